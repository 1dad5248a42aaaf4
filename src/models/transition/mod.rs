//! Transitions between two keyframes: what Pan et al. 2021, Harvey et al. 2020 and the baselines
//! share.
//!
//! - the data: [`DanceClip`]s, their windows, statistics and frames of reference, mirror images and
//!   tempi;
//! - [`Network`]: losses and predictions on a tape; [`TrainedModel`]: one with its weights;
//! - [`TransitionModel`]: what fills a [`TransitionRequest`], as any
//!   [`Generator`](crate::models::Generator) may be asked;
//! - [`TransitionTask`]: the curriculum, with scheduled sampling and single frames;
//! - [`TransitionSettings`], [`ModelConfig`], [`Kind`]: their part of a config.

mod augmentation;
mod dance_clip;
pub mod effect;
mod exported_batch;
mod generator;
pub mod gradient_check;
mod kind;
mod made_up;
pub mod measure;
pub(super) mod motion_rows;
mod network;
pub mod pose_windows;
pub(super) mod posed_frames;
mod ranges;
mod request;
pub mod root_frame;
mod schedule;
mod settings;
mod single_frames;
mod standardisation;
mod task;
mod trained;
mod training_clips;
mod training_windows;
pub mod velocity_refinement;
pub mod window;
mod windows;

pub use crate::data::Window;
pub use dance_clip::DanceClip;
pub use kind::{Kind, ModelConfig, NoSettings};
pub(crate) use made_up::MADE_UP_FRAMES;
pub use network::{Batch, Forcing, Network, SingleFrame};
pub use pose_windows::PoseWindows;
pub use ranges::DataRanges;
pub use request::{KeyframePose, Transition, TransitionModel, TransitionRequest, check_frames};
pub use root_frame::RootFrame;
pub(crate) use schedule::parts;
pub use schedule::{BatchPlan, Schedule};
pub use settings::{ScheduleConfig, ScheduledSamplingConfig, TransitionSettings};
pub use standardisation::Standardisation;
pub use task::TransitionTask;
pub use trained::TrainedModel;
pub use window::window_features;
pub use windows::{Windows, windows};
