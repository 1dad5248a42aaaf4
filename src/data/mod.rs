//! Data sets: what models are trained on and tested with.

pub mod choreography;
