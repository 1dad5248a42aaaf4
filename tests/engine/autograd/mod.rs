//! The engine through its public interface.

mod errors;
mod extremes;
mod fused;
mod tape;
mod weights;
