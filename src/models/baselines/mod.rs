//! Models that need no training.

pub mod interpolation;
pub mod linear_positions;
pub mod zero_velocity;
