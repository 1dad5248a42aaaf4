//! How fast the parts of the body move: `--velocity`, `--velocity-from`, `--velocity-csv`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::notice::warn;
use crate::models::generator::Condition;
use crate::synthesis::SequenceRequest;
use crate::synthesis::controls::{Gains, read_velocity_factors};
use crate::synthesis::keyframes::{FileFrom, Keyframes};

#[derive(Debug, Args)]
pub struct VelocityArgs {
    /// Velocity factors times a constant: 0.5 for all parts, or parts with one each, such as
    /// right_arm=1.5,left_leg=1.5; parts: trunk, left_leg, right_leg, right_arm, left_arm
    #[arg(long, value_name = "FACTORS", allow_hyphen_values = true)]
    velocity: Option<Gains>,
    /// Velocity factors of another clip, from its frame FRAME (0 where left out) on [default:
    /// --motion's, else evenly from keyframe to keyframe]
    #[arg(long, value_name = "FILE.bvh[:FRAME]")]
    pub velocity_from: Option<FileFrom>,
    /// Velocity factors from a CSV file with the columns
    /// frame,trunk,left_leg,right_leg,right_arm,left_arm (cm/frame), a row for every frame of the
    /// result
    #[arg(long, value_name = "FILE.csv", conflicts_with = "velocity_from")]
    pub velocity_csv: Option<PathBuf>,
}

impl VelocityArgs {
    /// What these controls ask for, if any is given.
    pub fn asked(&self) -> Option<Condition> {
        let given =
            self.velocity.is_some() || self.velocity_from.is_some() || self.velocity_csv.is_some();
        given.then_some(Condition::VelocityFactors)
    }

    /// The request under these controls.
    ///
    /// # Errors
    /// A file that cannot be used or is too short.
    pub fn apply(
        &self,
        mut request: SequenceRequest,
        keyframes: &Keyframes,
    ) -> anyhow::Result<SequenceRequest> {
        let frames = request.frames();
        if let Some(path) = &self.velocity_csv {
            let factors = read_velocity_factors(path, frames)?;
            request = request.with_velocity_factors(factors)?;
        }
        if let Some(source) = &self.velocity_from {
            let (file, first) = (&source.file, source.frame);
            let (factors, notices) = keyframes.velocity_factors(file, first, frames)?;
            warn(&notices);
            request = request.with_velocity_factors(factors)?;
        }
        match self.velocity {
            Some(Gains(gains)) => Ok(request.velocity_times(gains)?),
            None => Ok(request),
        }
    }
}
