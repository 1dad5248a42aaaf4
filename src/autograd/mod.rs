//! Reverse-mode differentiation of array programs.
pub mod kernels;
