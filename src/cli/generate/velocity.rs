//! How fast the parts of the body move: `--velocity`, `--velocity-from`, `--velocity-csv`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::list::with_file;
use crate::synthesis::controls::{Gains, VelocityControls};
use crate::synthesis::keyframes::FileFrom;

#[derive(Debug, Args)]
pub struct VelocityArgs {
    /// Velocity factors times a constant: 0.5 for all parts, or parts with one each, such as
    /// right_arm=1.5,left_leg=1.5; parts: trunk, left_leg, right_leg, right_arm, left_arm
    #[arg(long, value_name = "FACTORS", allow_hyphen_values = true)]
    velocity: Option<Gains>,
    /// Velocity factors of another clip, from its frame FRAME (0 where left out) on [default:
    /// --motion's, else evenly from keyframe to keyframe]
    #[arg(long, value_name = "FILE.bvh[:FRAME]", value_parser = with_file::<FileFrom>())]
    velocity_from: Option<FileFrom>,
    /// Velocity factors from a CSV file with the columns
    /// frame,trunk,left_leg,right_leg,right_arm,left_arm (cm/frame), a row for every frame of the
    /// result
    #[arg(long, value_name = "FILE.csv", conflicts_with = "velocity_from")]
    velocity_csv: Option<PathBuf>,
}

impl VelocityArgs {
    pub fn controls(&self) -> VelocityControls {
        VelocityControls {
            gains: self.velocity,
            from: self.velocity_from.clone(),
            table: self.velocity_csv.clone(),
        }
    }
}
