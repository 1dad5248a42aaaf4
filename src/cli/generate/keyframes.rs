//! `--motion`, `--keyframes` and `--keyframe`: which frames of which files, and when.

use std::path::PathBuf;

use clap::Args;

use crate::cli::list::{with_file, within};
use crate::synthesis::keyframes::{KeyframeChoice, LONGEST, TimedFrame};

#[derive(Debug, Args)]
pub struct KeyframeArgs {
    /// BVH file of the dancer; gives the root trajectory and the velocity factors between its
    /// keyframes, too
    #[arg(long, value_name = "FILE.bvh", requires = "keyframes")]
    motion: Option<PathBuf>,
    /// Frames of --motion that are keyframes, ascending, such as 120,180,260; the first becomes
    /// frame 0 of the result, the others keep their distances
    #[arg(long, value_name = "FRAMES", value_delimiter = ',', requires = "motion",
        allow_hyphen_values = true, value_parser = within(0..=usize::MAX))]
    keyframes: Vec<usize>,
    /// A frame of any file as a keyframe, and its time in the result, a frame such as
    /// jump.bvh:75@60 or seconds such as jump.bvh:75@12.5s; may be repeated
    #[arg(long, value_name = "FILE.bvh:FRAME@TIME", value_parser = with_file::<TimedFrame>())]
    keyframe: Vec<TimedFrame>,
    /// Mapping file for clips on a skeleton other than the dance skeleton [default: the run's, or
    /// the joints are recognised]
    #[arg(long, value_name = "FILE")]
    mapping: Option<PathBuf>,
    /// Count --keyframes and --length in frames of --motion at its own rate, each frame exactly as
    /// the file has it, and write the result at that rate; with --length the frames are poses made
    /// by hand, with no motion between them
    #[arg(long, requires = "motion", conflicts_with = "keyframe")]
    own_frames: bool,
    /// Frames from each keyframe of --motion to the next: one number for all, or one for each, such
    /// as 100,250
    #[arg(long, value_name = "FRAMES", value_delimiter = ',', requires = "motion", conflicts_with = "keyframe",
        allow_hyphen_values = true, value_parser = within(1..=LONGEST))]
    pub length: Vec<u32>,
}

impl KeyframeArgs {
    /// For results of so many frames a second.
    pub fn choice(&self, fps: f64) -> KeyframeChoice {
        let motion = self.motion.clone();
        KeyframeChoice {
            motion: motion.map(|file| (file, self.keyframes.clone())),
            further: self.keyframe.iter().map(|it| it.at(fps)).collect(),
            mapping: self.mapping.clone(),
            own_frames: self.own_frames,
        }
    }
}
