//! The autograd engine, motions, data sets, and what a training goes on with.

// What several of these tests need.
#[path = "../common/lafan1_data.rs"]
mod lafan1_data;
#[path = "../common/martial_data.rs"]
mod martial_data;
#[path = "../common/real_data.rs"]
mod real_data;
#[path = "../common/rigs.rs"]
mod rigs;

mod dance_clip;

// The tests.
mod adam;
mod autograd;
mod bvh;
mod choreography;
mod columns;
mod contact;
mod contact_foot;
mod dataset;
mod facing;
mod features;
mod fit;
mod ik;
mod learning_rate;
mod mapping;
mod music;
mod prepared;
mod resample;
mod rig;
mod root_reconstruction;
mod rotation_fit;
mod rotation_window;
mod run_state;
mod split;
mod streams;
mod units;
mod velocity_factor;
mod windows;
