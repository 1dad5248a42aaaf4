//! Models that fill the frames between two keyframes, behind one trait: [`TransitionModel`].
//!
//! Evaluation and synthesis know a model by this trait only, training by [`Network`].

pub mod gradient_check;
pub mod harvey2020;
pub mod interpolation;
pub mod linear_positions;
pub mod measure;
mod motion_rows;
pub mod network;
pub mod pan2021;
pub mod pose_windows;
mod posed_frames;
pub mod registry;
pub mod trained;
pub mod transition;
pub mod velocity_refinement;
pub mod weights;
pub mod zero_velocity;

pub use network::{Batch, Feed, LossTerms, Network, SingleFrame};
pub use pose_windows::PoseWindows;
pub use registry::ModelConfig;
pub use trained::TrainedModel;
pub use transition::{KeyframePose, ModelError, Transition, TransitionModel, TransitionRequest};
