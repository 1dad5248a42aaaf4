//! The controls of a sequence as they are asked for: files, points and numbers, put onto a request
//! in the order in which they combine.

use std::path::PathBuf;

use thiserror::Error;

use super::{Gains, Points, Speed, TableError, read_trajectory, read_velocity_factors};
use crate::models::generator::Condition;
use crate::synthesis::keyframes::{FileFrom, KeyframeError, Keyframes};
use crate::synthesis::{ControlWarning, SequenceRequest, SynthesisError, moved_warnings};

/// Numbers beyond this are mistakes.
const LARGEST: f64 = 1e5;

/// Why controls cannot be put onto a request.
#[derive(Debug, Error)]
pub enum ControlError {
    #[error("--{flag} {value}: expected a number between -{LARGEST} and {LARGEST}")]
    Number { flag: &'static str, value: f64 },
    #[error("--timing clip takes the speed of --motion; give --motion, or --timing constant")]
    NoMotion,
    #[error(transparent)]
    Table(#[from] TableError),
    #[error(transparent)]
    Keyframe(#[from] KeyframeError),
    #[error(transparent)]
    Synthesis(#[from] SynthesisError),
}

/// How fast the root goes along a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Timing {
    /// At one speed.
    #[default]
    Constant,
    /// In proportion to the speed of the trajectory that the curve replaces: that of --motion.
    Clip,
}

/// Where the root is to go.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TrajectoryControls {
    /// CSV of the trajectory, see [`read_trajectory`].
    pub table: Option<PathBuf>,
    /// In its place: a curve through points, and how it is timed.
    pub through: Option<Points>,
    pub timing: Timing,
    /// Degrees, see [`SequenceRequest::turned`].
    pub turn: Option<f64>,
    /// See [`SequenceRequest::scaled`].
    pub scale: Option<f64>,
    /// cm, see [`SequenceRequest::raised`].
    pub raise: Option<f64>,
}

impl TrajectoryControls {
    /// What they ask for between the keyframes, if anything.
    pub fn asked(&self) -> Option<Condition> {
        let given = self.table.is_some() || self.through.is_some() || self.raise.is_some();
        given.then_some(Condition::RootTrajectory)
    }

    /// Whether they move the keyframes themselves.
    pub fn moves_keyframes(&self) -> bool {
        let turns = self.turn.is_some_and(|turn| turn != 0.0);
        turns || self.scale.is_some_and(|scale| scale != 1.0)
    }

    /// The request under them, and warnings of keyframes that were moved.
    ///
    /// # Errors
    /// A file or number that cannot be used.
    pub fn apply(
        &self,
        request: SequenceRequest,
        keyframes: &Keyframes,
    ) -> Result<(SequenceRequest, Vec<ControlWarning>), ControlError> {
        let flags = ["turn", "scale", "raise"];
        for (flag, value) in flags.into_iter().zip([self.turn, self.scale, self.raise]) {
            if let Some(value) = value.filter(|value| value.is_nan() || value.abs() > LARGEST) {
                return Err(ControlError::Number { flag, value });
            }
        }
        let trajectory = if let Some(path) = &self.table {
            read_trajectory(path, request.frames())?
        } else if let Some(points) = &self.through {
            let speed = match self.timing {
                Timing::Constant => Speed::Constant,
                Timing::Clip if keyframes.motion().is_none() => return Err(ControlError::NoMotion),
                Timing::Clip => request.own_speed(),
            };
            request.trajectory_through(points, &speed)
        } else {
            request.root_trajectory.clone()
        };
        let (mut request, moved) = request.on_trajectory(trajectory)?;
        let warnings = moved_warnings(&request, &moved);
        if let Some(degrees) = self.turn {
            request = request.turned(degrees.to_radians());
        }
        if let Some(scale) = self.scale {
            request = request.scaled(scale)?;
        }
        if let Some(height) = self.raise {
            request = request.raised(height);
        }
        Ok((request, warnings))
    }
}

/// How fast the parts of the body are to move.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VelocityControls {
    /// What the factors are multiplied by.
    pub gains: Option<Gains>,
    /// Another clip whose factors are taken, from a frame on.
    pub from: Option<FileFrom>,
    /// CSV of the factors, see [`read_velocity_factors`].
    pub table: Option<PathBuf>,
}

impl VelocityControls {
    /// What they ask for, if anything.
    pub fn asked(&self) -> Option<Condition> {
        let given = self.gains.is_some() || self.from.is_some() || self.table.is_some();
        given.then_some(Condition::VelocityFactors)
    }

    /// The request under them, and what is odd about the file that the factors are from.
    ///
    /// # Errors
    /// A file that cannot be used or is too short.
    pub fn apply(
        &self,
        mut request: SequenceRequest,
        keyframes: &Keyframes,
    ) -> Result<(SequenceRequest, Vec<String>), ControlError> {
        let (frames, mut notices) = (request.frames(), Vec::new());
        if let Some(path) = &self.table {
            let factors = read_velocity_factors(path, frames)?;
            request = request.with_velocity_factors(factors)?;
        }
        if let Some(FileFrom { file, frame, .. }) = &self.from {
            let (factors, own) = keyframes.velocity_factors(file, *frame, frames)?;
            notices = own;
            request = request.with_velocity_factors(factors)?;
        }
        if let Some(Gains(gains)) = self.gains {
            request = request.velocity_times(gains)?;
        }
        Ok((request, notices))
    }
}
