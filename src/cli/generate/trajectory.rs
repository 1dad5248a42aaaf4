//! Where the root goes: `--trajectory`, `--trajectory-through`, `--turn`, `--scale`, `--raise`.

use std::path::PathBuf;

use clap::Args;

use crate::synthesis::controls::{Points, Timing, TrajectoryControls};

#[derive(Debug, Args)]
pub struct TrajectoryArgs {
    /// Root trajectory from a CSV file with the columns frame,x,y,z (cm), a row for every frame of
    /// the result; keyframes are moved onto it [default: --motion's, else a smooth curve through
    /// the keyframes]
    #[arg(long, value_name = "FILE.csv")]
    trajectory: Option<PathBuf>,
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

impl TrajectoryArgs {
    pub fn controls(&self) -> TrajectoryControls {
        TrajectoryControls {
            table: self.trajectory.clone(),
            through: self.trajectory_through.clone(),
            timing: self.timing,
            turn: self.turn,
            scale: self.scale,
            raise: self.raise,
        }
    }
}
