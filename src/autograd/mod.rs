//! Reverse-mode automatic differentiation on a tape of ndarray arrays, generic over f32 and f64.
//!
//! - [`Parameters`] hold the weights, [`Gradients`] what a backward pass adds up for them;
//! - a [`Tape`] records operations (one file each in [`ops`]) on [`Var`]s and runs them backwards;
//! - a [`Workspace`] keeps the buffers of one step for the next;
//! - [`check`] compares gradients with central differences;
//! - [`kernels`] are the matrix products and vector maths underneath.

pub mod check;
mod error;
// Public for tests and benchmarks alone: it panics where shapes do not fit.
#[doc(hidden)]
pub mod kernels;
pub mod ops;
mod parameters;
mod reduce;
mod staging;
mod tape;
mod workspace;

pub use error::AutogradError;
pub use kernels::Real;
pub use parameters::{BlockId, BufferId, Gradients, ParameterId, Parameters};
pub use tape::{Backward, Operation, Target};
pub use tape::{Tape, Var};
pub use workspace::Workspace;
