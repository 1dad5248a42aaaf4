//! Optimisers, and the learning rate over a training.

mod adam;
mod learning_rate;

pub use adam::{Adam, AdamConfig, AdamError, SettingError};
pub use learning_rate::{RateSchedule, RateShape};
