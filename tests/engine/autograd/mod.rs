//! The engine through its public interface.

mod errors;
mod extremes;
mod fused;
mod kernels;
mod misuse;
mod tape;
mod weights;
