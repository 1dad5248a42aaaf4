//! `keydance choreography`: writes generated dance clips as BVH files, for whoever has no motion
//! capture.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;

use super::list::within;
use crate::data::choreography::{
    CLIPS, ChoreographyConfig, FRAMES, GeneratedClip, clips, generate_with_music,
};
use crate::motion::bvh::{self, Axis, Bvh, channel_layout};
use crate::music::RATE;
use crate::run::check_output_folder;

#[derive(Debug, Args)]
pub struct ChoreographyArgs {
    /// Folder for the clips, made where there is none
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of clips; styles take turns
    #[arg(long, default_value_t = ChoreographyConfig::default().clips, value_parser = within(CLIPS))]
    clips: usize,
    /// Frames of each clip, at 30 a second
    #[arg(long, default_value_t = ChoreographyConfig::default().frames_per_clip,
        value_parser = within(FRAMES))]
    frames: usize,
    /// Number that the dances follow from
    #[arg(long, default_value_t = ChoreographyConfig::default().seed)]
    seed: u64,
    /// Write music on the dances' beats, too: a wav file of each clip's name
    #[arg(long)]
    music: bool,
    /// Write into a folder that holds files, and replace those of the same names
    #[arg(long)]
    force: bool,
}

/// # Errors
/// No clips or frames or too many are asked for, or a file cannot be written.
pub fn run(args: ChoreographyArgs) -> anyhow::Result<()> {
    let config = ChoreographyConfig {
        clips: args.clips,
        frames_per_clip: args.frames,
        seed: args.seed,
    };
    let dances: Box<dyn Iterator<Item = (GeneratedClip, Option<Vec<f32>>)>> = match args.music {
        true => {
            let dances = generate_with_music(&config)?.into_iter();
            Box::new(dances.map(|it| (it.dance, Some(it.samples))))
        }
        false => Box::new(clips(&config)?.map(|clip| (clip, None))),
    };
    check_output_folder(&args.out, args.force)?;
    std::fs::create_dir_all(&args.out)
        .with_context(|| format!("{} cannot be created", args.out.display()))?;
    let mut out = std::io::stdout();
    for (generated, samples) in dances {
        let channels = channel_layout(&generated.clip, [Axis::Z, Axis::X, Axis::Y]);
        let path = args.out.join(&generated.clip.name);
        bvh::write(&path, &Bvh::from_clip(&generated.clip, channels)?)?;
        if let Some(samples) = samples {
            write_wav(&path.with_extension("wav"), &samples)?;
        }
        writeln!(out, "{}", path.display())?;
    }
    Ok(())
}

/// One channel of 16 bits at 22,050 Hz.
fn write_wav(path: &Path, samples: &[f32]) -> anyhow::Result<()> {
    let spec = hound::WavSpec {
        channels: 1,
        sample_rate: RATE,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let unwritable = || format!("{} cannot be written", path.display());
    let mut writer = hound::WavWriter::create(path, spec).with_context(unwritable)?;
    for &sample in samples {
        let sample = (sample.clamp(-1.0, 1.0) * f32::from(i16::MAX)).round() as i16;
        writer.write_sample(sample).with_context(unwritable)?;
    }
    writer.finalize().with_context(unwritable)
}
