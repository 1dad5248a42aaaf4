//! What several tests share.

pub mod training;
