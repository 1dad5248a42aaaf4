//! Transitions between two keyframes: what Pan et al. 2021, Harvey et al. 2020 and the baselines share.

pub(crate) mod augmentation;
pub mod exported_batch;
pub mod gradient_check;
pub mod gradient_report;
pub mod measure;
pub(crate) mod motion_rows;
pub(crate) mod network;
pub mod pose_windows;
pub(crate) mod posed_frames;
mod ranges;
mod request;
pub mod root_frame;
pub(crate) mod schedule;
pub(crate) mod single_frames;
mod standardisation;
mod trained;
pub mod velocity_refinement;
pub mod window;
mod windows;

pub use network::{Batch, CRITICS, Feed, LossTerms, Network, SingleFrame};
pub use pose_windows::PoseWindows;
pub use ranges::DataRanges;
pub use request::{KeyframePose, ModelError, Transition, TransitionModel, TransitionRequest};
pub use root_frame::RootFrame;
pub use schedule::{BatchPlan, Schedule};
pub use standardisation::Standardisation;
pub use trained::TrainedModel;
pub use window::window_features;
pub use windows::{Window, Windows, windows};
