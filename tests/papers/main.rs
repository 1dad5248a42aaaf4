//! The models of the papers: what they compute, how they train and what they score.

// What several of these tests need.
#[path = "../common/generated_data.rs"]
mod generated_data;
#[path = "../common/lafan1_data.rs"]
mod lafan1_data;
#[path = "../common/motorica_data.rs"]
mod motorica_data;
#[path = "../common/music_dance_data.rs"]
mod music_dance_data;
#[path = "../common/real_data.rs"]
mod real_data;
#[path = "../common/small_run.rs"]
mod small_run;
#[path = "../common/thread_ranks.rs"]
mod thread_ranks;

mod network;
mod small_training;

// The tests.
mod baselines;
mod config_layers;
mod controls;
mod dance_features;
mod effect;
mod golden;
mod golden_run;
mod harvey2020;
mod in_betweening;
mod interpolation;
mod li2023;
mod linear_gaussian;
mod mapped_model;
mod metrics;
mod music_dance;
mod pan2021;
mod preferred;
mod prepared_training;
mod prior;
mod pu2022;
mod published;
mod ranges;
mod ranks;
mod retrieval;
mod root_frame;
mod rotations;
mod sampled_dance;
mod sampled_training;
mod schedule;
mod step_batches;
mod synthesis;
mod tables;
mod training;
mod valleperez2021;
mod velocity_refinement;
mod windows;
mod wording;
