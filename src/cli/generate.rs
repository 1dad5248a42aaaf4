//! `keydance generate`: reads a run's folder and keyframes from BVH files, writes the dance between
//! them as BVH.

mod keyframes;
mod rotations;
mod song;
mod trajectory;
mod velocity;

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;

use super::file_units::FileUnits;
use super::notice::warn;
use crate::counted::counted;
use crate::models::generator::{Condition, NeededPoses};
use crate::models::transition::DataRanges;
use crate::motion::bvh;
use crate::report::viewer::generated_page;
use crate::run::{Subject, beside_clips, check_outputs, replace_file, write_json};
use crate::synthesis::keyframes::Keyframes;
use crate::synthesis::{ControlWarning, Summary, SynthesisOptions, control_warnings, synthesise};
use keyframes::KeyframeArgs;
use rotations::ContactArgs;
use song::SongArgs;
use trajectory::TrajectoryArgs;
use velocity::VelocityArgs;

/// Generate the dance between keyframes and write it as BVH
///
/// Frames are counted from 0 at the run's rate (30 a second unless its config says otherwise): a
/// file at another rate is resampled first, so frame 120 of the file's own 120 a second is frame 30
/// here. The result passes through every keyframe. Keyframes of several dancers are put onto the
/// first one's bones.
///
/// Which controls change the motion depends on the model, as each reads its own: interpolation, for
/// one, the keyframes alone. A control that the model does not read gets a warning; one that it
/// needs and does not get is an error.
#[derive(Debug, Args)]
pub struct GenerateArgs {
    /// Folder of a run, or the config of a model that needs no training
    #[arg(value_name = "RUN_DIR_OR_CONFIG")]
    run: PathBuf,
    #[command(flatten)]
    keyframes: KeyframeArgs,
    #[command(flatten)]
    units: FileUnits,
    /// Where to write the motion
    #[arg(long, value_name = "FILE.bvh")]
    out: PathBuf,
    #[command(flatten)]
    trajectory: TrajectoryArgs,
    #[command(flatten)]
    velocity: VelocityArgs,
    #[command(flatten)]
    contacts: ContactArgs,
    #[command(flatten)]
    song: SongArgs,
    /// Pin the feet where the model predicts contact
    #[arg(long)]
    foot_cleanup: bool,
    /// Show the motion beside interpolation and, where keyframes come from --motion at their own
    /// distances, the recorded motion; of a dance to --music the dance alone, in step with the
    /// song: one HTML page that needs no network
    #[arg(long, value_name = "OUT.html")]
    viewer: Option<PathBuf>,
    /// Write what is printed here, too, as JSON with its units
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Override a key of the config; of a run's model only one that acts after the network, such
    /// as model.velocity_refinement=false or rtr.meet_target=linear; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Replace files that are there already
    #[arg(long)]
    force: bool,
}

/// # Errors
/// The run, a file or a control cannot be used, or they do not fit each other; nothing is written
/// then. A file cannot be written.
pub fn run(args: GenerateArgs) -> anyhow::Result<()> {
    let subject = Subject::open(&args.run, &args.set)?;
    subject.check_features()?;
    let needs = subject.model.needs();
    if let NeededPoses::Past(frames) | NeededPoses::Keyframes { past: frames @ 1.. } = needs.poses {
        let (what, poses) = (&subject.what, counted(frames, "pose"));
        anyhow::bail!("{what} dances on from {poses}; generate makes motions between keyframes");
    }
    let choice = args.keyframes.choice(subject.config.data.fps);
    let (mut inputs, own) = (choice.files(), subject.files());
    inputs.extend(&own);
    let TrajectoryArgs { trajectory, .. } = &args.trajectory;
    inputs.extend(trajectory.iter().chain(&args.velocity.velocity_csv));
    inputs.extend(args.song.files());
    inputs.extend(args.velocity.velocity_from.iter().map(|from| &from.file));
    let outputs = args.viewer.iter().chain(&args.json).chain([&args.out]);
    check_outputs(outputs, inputs.iter().copied(), args.force)?;
    subject.check_no_clip(&args.out)?;
    warn(beside_clips(&args.out, &inputs));
    if let Some(music) = &args.song.music {
        return song::run(&args, &subject, music);
    }
    if let NeededPoses::Seed(frames) = needs.poses {
        let frames = counted(frames, "frame");
        anyhow::bail!(
            "{} goes on from a seed of {frames} to music; give --music SONG and --seed-motion \
             FILE.bvh",
            subject.what
        );
    }
    if let NeededPoses::Keyframes { .. } = needs.poses {
        return rotations::run(&args, &subject);
    }
    let data = args.units.over(&subject.config.data);
    let keyframes = Keyframes::read(&choice, &data)?;
    warn(keyframes.notices());
    let request = keyframes.request(&args.keyframes.length)?;
    let (request, mut warnings) = args.trajectory.apply(request, &keyframes)?;
    let request = args.velocity.apply(request, &keyframes)?;
    let run = subject.run.as_ref();
    let ranges = run.map(|run| DataRanges::of_run(run, &subject.config));
    let ranges = ranges.transpose()?.flatten();
    let contacts = args.contacts.contacts.as_ref();
    let contacts = contacts.map(|_| Condition::Contacts);
    let asked = [args.trajectory.asked(), args.velocity.asked(), contacts];
    let unread = asked.into_iter().flatten().filter(|&it| !needs.reads(it));
    warnings.extend(unread.map(ControlWarning::Unread));
    warnings.extend(control_warnings(&request, ranges.as_ref()));
    warn(&warnings);
    let options = SynthesisOptions {
        foot_cleanup: args.foot_cleanup,
    };
    let name = args.out.file_name().unwrap_or_default().to_string_lossy();
    let sequence = synthesise(subject.model.as_ref(), &request, &options, &name)?;
    let document = keyframes.document(&sequence.clip);
    let document = document.context("the motion cannot be written")?;
    let page = || generated_page(&subject, &keyframes, &request, &sequence, &options);
    let page = args.viewer.as_ref().map(|_| page()).transpose()?;
    bvh::write(&args.out, &document)?;
    if let Some((path, page)) = args.viewer.as_ref().zip(page) {
        replace_file(path, page)?;
    }
    let summary = Summary::new(&subject.what, &request, &sequence, &options, &warnings);
    if let Some(path) = &args.json {
        write_json(path, &summary)?;
    }
    writeln!(std::io::stdout(), "{summary}{}", args.out.display())?;
    Ok(())
}
