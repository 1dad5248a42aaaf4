//! Rotations between keyframes, on any skeleton: what Li et al. and Duan et al. share.
//!
//! - [`Body`]: the joints that a network was built for;
//! - [`GivenWindow`], [`WindowTruth`]: a window as it is given, and as it was recorded; [`Batch`]:
//!   several as arrays;
//! - [`RotationNetwork`]: losses and predictions on a tape; [`TrainedRotations`]: one with its
//!   weights;
//! - [`RotationTask`]: one length a batch, windows of all clips in every epoch;
//! - [`RotationSettings`]: their part of a config.

mod batch;
mod body;
mod clips;
mod exported_batch;
mod gradient_check;
mod made_up;
mod network;
mod schedule;
mod settings;
mod statistics;
mod task;
mod trained;
mod window;

pub use batch::{Batch, Truth};
pub use body::Body;
pub use clips::TrainingClip;
pub use gradient_check::generated_batch;
pub use network::{Prediction, RootSource, RotationNetwork};
pub use schedule::{LengthConfig, Schedule, ScheduleConfig};
pub use settings::RotationSettings;
pub use statistics::WindowStatistics;
pub use task::RotationTask;
pub use trained::TrainedRotations;
pub use window::{GivenWindow, PastFrame, WindowTruth};
