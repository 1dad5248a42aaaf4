//! Where the root goes: `--trajectory`, `--trajectory-through`, `--turn`, `--scale`, `--raise`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::models::generator::Condition;
use crate::synthesis::controls::{Points, Speed, read_trajectory};
use crate::synthesis::keyframes::Keyframes;
use crate::synthesis::{ControlWarning, SequenceRequest, moved_warnings};

#[derive(Debug, Args)]
pub struct TrajectoryArgs {
    /// Root trajectory from a CSV file with the columns frame,x,y,z (cm), a row for every frame of
    /// the result; keyframes are moved onto it [default: --motion's, else a smooth curve through
    /// the keyframes]
    #[arg(long, value_name = "FILE.csv")]
    pub trajectory: Option<PathBuf>,
    /// Root trajectory along a smooth curve through points (cm) "x,z; x,z; ..." or "x,y,z; ...",
    /// from the first frame to the last; without y the root keeps the heights that it would have
    /// had. Keyframes are moved onto it
    #[arg(
        long,
        value_name = "POINTS",
        allow_hyphen_values = true,
        conflicts_with = "trajectory"
    )]
    trajectory_through: Option<Points>,
    /// How the curve through points is timed
    #[arg(long, value_enum, requires = "trajectory_through", default_value_t)]
    timing: Timing,
    /// Turn trajectory and keyframes about the vertical through the first keyframe, degrees
    /// (counterclockwise from above)
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    turn: Option<f64>,
    /// Make the trajectory's way this many times as large, from the first keyframe on; heights
    /// stay, keyframes go along
    #[arg(long, value_name = "S")]
    scale: Option<f64>,
    /// Raise the trajectory between the keyframes by up to this, cm; below 0: lower it. Keyframes
    /// keep their heights
    #[arg(long, value_name = "CM", allow_hyphen_values = true)]
    raise: Option<f64>,
}

/// How fast the root goes along a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum Timing {
    /// At one speed
    #[default]
    Constant,
    /// In proportion to the speed of the trajectory that the curve replaces: that of --motion
    Clip,
}

impl TrajectoryArgs {
    /// What these controls ask for between the keyframes, if any is given.
    pub fn asked(&self) -> Option<Condition> {
        let given =
            self.trajectory.is_some() || self.trajectory_through.is_some() || self.raise.is_some();
        given.then_some(Condition::RootTrajectory)
    }

    /// The request under these controls, and warnings of keyframes that were moved.
    ///
    /// # Errors
    /// A file or number that cannot be used.
    pub fn apply(
        &self,
        mut request: SequenceRequest,
        keyframes: &Keyframes,
    ) -> anyhow::Result<(SequenceRequest, Vec<ControlWarning>)> {
        let flags = ["turn", "scale", "raise"];
        for (flag, value) in flags.into_iter().zip([self.turn, self.scale, self.raise]) {
            if let Some(value) = value.filter(|value| value.is_nan() || value.abs() > 1e5) {
                anyhow::bail!("--{flag} {value}: expected a number between -100000 and 100000");
            }
        }
        let trajectory = if let Some(path) = &self.trajectory {
            read_trajectory(path, request.frames())?
        } else if let Some(points) = &self.trajectory_through {
            if self.timing == Timing::Clip && keyframes.motion().is_none() {
                anyhow::bail!(
                    "--timing clip takes the speed of --motion; give --motion, or --timing constant"
                );
            }
            let speed = match self.timing {
                Timing::Constant => Speed::Constant,
                Timing::Clip => request.own_speed(),
            };
            request.trajectory_through(points, &speed)
        } else {
            request.root_trajectory.clone()
        };
        let (placed, moved) = request.on_trajectory(trajectory)?;
        let warnings = moved_warnings(&placed, &moved);
        request = placed;
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
