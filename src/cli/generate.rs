//! `keydance generate`: reads a run's folder and keyframes from BVH files, writes the dance between
//! them as BVH.

mod built_in;
mod keyframes;
mod song;
mod trajectory;
mod velocity;

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use super::file_units::FileUnits;
use super::notice::warn;
use crate::data::Dataset;
use crate::motion::bvh;
use crate::report::viewer::dance_page;
use crate::run::{Subject, beside_clips, check_outputs, replace_file, write_json};
use crate::synthesis::{ContactSequence, Dance, DanceRequest, SynthesisOptions};
use keyframes::KeyframeArgs;
use song::SongArgs;
use trajectory::TrajectoryArgs;
use velocity::VelocityArgs;

/// Generate the dance between keyframes and write it as BVH
///
/// Frames are counted from 0 at the run's rate (30 a second unless its config says otherwise): a
/// file at another rate is resampled first, so frame 120 of the file's own 120 a second is frame 30
/// here; --own-frames counts as the file does. The result passes through every keyframe; a dance to
/// --music comes near its key poses, how near is printed. Keyframes of several dancers are put onto
/// the first one's bones.
///
/// Keyframes on a rig other than the dance skeleton are recognised by the names of its joints
/// (keydance rig prints how), and the result is on that rig, in its file's unit, axis and rate.
///
/// Which controls change the motion depends on the model, as each reads its own: interpolation, for
/// one, the keyframes alone. A control that the model does not read gets a warning; one that it
/// needs and does not get is an error.
#[derive(Debug, Args)]
pub struct GenerateArgs {
    /// Folder of a run, or the config of a model that needs no training [default: a model that
    /// comes with the program, between keyframes or to --music]
    #[arg(value_name = "RUN_DIR_OR_CONFIG")]
    run: Option<PathBuf>,
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
    /// Which foot stands when, every frame once, such as left:0-9,right:10-24,both:25-30; where
    /// both stand one is drawn by --seed [default: the lower foot of --motion]
    #[arg(long, value_name = "FOOT:FIRST-LAST,..")]
    contacts: Option<ContactSequence>,
    /// What is drawn follows from this
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    song: SongArgs,
    /// Folder of clips, for a model that looks motion up in those that train, as its config says
    /// which: key_pose_retrieval
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Pin the feet where they stand on the floor, and lift them where they are below it: the floor
    /// is as low as the feet come from the first keyframe of --motion to the last, or as they
    /// usually are in the files of the keyframes
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
    #[arg(long, value_name = "KEY=VALUE", requires = "run")]
    set: Vec<String>,
    /// Replace files that are there already
    #[arg(long)]
    force: bool,
}

impl GenerateArgs {
    /// Where the dances go: --out, numbered where there are several.
    fn files(&self) -> Vec<PathBuf> {
        let [stem, ending] = [self.out.file_stem(), self.out.extension()]
            .map(|part| part.unwrap_or_default().to_string_lossy());
        match self.song.count {
            1 => vec![self.out.clone()],
            count => {
                let dot = if ending.is_empty() { "" } else { "." };
                let name = |number| format!("{stem}_{number}{dot}{ending}");
                (1..=count)
                    .map(|number| self.out.with_file_name(name(number)))
                    .collect()
            }
        }
    }

    /// What they ask of a model for data of so many frames a second.
    fn request(&self, fps: f64) -> DanceRequest {
        let name = self.out.file_name().unwrap_or_default();
        DanceRequest {
            name: name.to_string_lossy().into(),
            keyframes: self.keyframes.choice(fps),
            lengths: self.keyframes.length.clone(),
            trajectory: self.trajectory.controls(),
            velocity: self.velocity.controls(),
            contacts: self.contacts.clone(),
            seed: self.seed,
            song: self.song.request(fps),
            options: SynthesisOptions {
                foot_cleanup: self.foot_cleanup,
            },
        }
    }
}

/// # Errors
/// The run, a file or a control cannot be used, or they do not fit each other; nothing is written
/// then. A file cannot be written.
pub fn run(args: GenerateArgs) -> anyhow::Result<()> {
    let mut subject = match &args.run {
        Some(run) => Subject::open(run, &args.set)?,
        None if args.song.is_asked() => Subject::built_in(&built_in::MUSIC)?,
        None => Subject::built_in(&built_in::DANCE)?,
    };
    subject.check_features()?;
    Dance::check_model(&subject)?;
    let data = args.units.over(&subject.config.data);
    let request = args.request(data.fps);
    let (mut inputs, own) = (request.files(), subject.files());
    inputs.extend(&own);
    inputs.extend(&args.data);
    let files = args.files();
    let outputs = args.viewer.iter().chain(&args.json).chain(&files);
    check_outputs(outputs, inputs.iter().copied(), args.force)?;
    for file in &files {
        subject.check_no_clip(file)?;
    }
    warn(beside_clips(&args.out, &inputs));
    if let Some(folder) = &args.data {
        let dataset = Dataset::load(folder, &subject.config.data)?;
        warn(&dataset.warnings);
        subject.model.look_up_in(&dataset.train)?;
    }
    let mut dances = Vec::new();
    for number in 0..args.song.count {
        let mut request = request.clone();
        request.seed = request.seed.wrapping_add(number);
        let mut tell = |notice| warn((number == 0).then_some(notice));
        dances.push(Dance::make(&subject, &request, &data, &mut tell)?);
    }
    let mut further = dances.iter().skip(1);
    let alike = further.any(|dance| dance.document.motion() == dances[0].document.motion());
    warn(alike.then_some("the model draws nothing: dances of --count are the same"));
    let page = args.viewer.as_ref();
    let page = page.map(|path| dance_page(&subject, &dances, &data, args.song.sound(path)));
    let page = page.transpose()?;
    for (file, dance) in files.iter().zip(&dances) {
        bvh::write(file, &dance.document)?;
    }
    if let Some((path, page)) = args.viewer.as_ref().zip(page) {
        replace_file(path, page)?;
    }
    if let Some(path) = &args.json {
        match &dances[..] {
            [one] => write_json(path, &one.summary)?,
            all => write_json(path, &all.iter().map(|it| &it.summary).collect::<Vec<_>>())?,
        }
    }
    for (file, dance) in files.iter().zip(&dances) {
        writeln!(std::io::stdout(), "{}{}", dance.summary, file.display())?;
    }
    Ok(())
}
