//! The autograd engine, motions, data sets, and what a training goes on with.

// What several of these tests need.
#[path = "../common/martial_data.rs"]
mod martial_data;
#[path = "../common/real_data.rs"]
mod real_data;

mod dance_clip;

// The tests.
mod autograd;
mod bvh;
mod choreography;
mod dataset;
mod features;
mod fit;
mod mapping;
mod run_state;
mod streams;
