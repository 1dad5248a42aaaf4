//! A step of a training: its shards run forwards and backwards on tapes of their own, Adam moves
//! the weights by the sum of their gradients.
//!
//! Shards are computed on threads, and dealt to [`ranks`](crate::ranks) where there are several:
//! the bits depend on neither.

mod error;
mod losses;
pub mod measure;
mod meeting;
mod stepper;

pub use error::StepError;
pub use stepper::pool;
pub(crate) use stepper::{StepInput, Stepper};
