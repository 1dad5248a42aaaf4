//! The program from outside: its commands, and the files, figures and pages that it reads and
//! writes.

// What several of these tests need.
#[path = "../common/damage.rs"]
mod damage;
#[path = "../common/generated_data.rs"]
mod generated_data;
#[path = "../common/martial_data.rs"]
mod martial_data;
#[path = "../common/real_data.rs"]
mod real_data;
#[path = "../common/rigs.rs"]
mod rigs;
#[path = "../common/small_run.rs"]
mod small_run;

mod browser;
mod folders;
mod trained_run;
mod viewer_page;

// The tests.
mod bad_input;
mod commands;
mod demo;
mod documents;
mod elsewhere;
mod evaluate;
mod examples;
mod figures;
mod generate;
mod help;
mod launched;
mod music;
mod odd_files;
mod outputs;
mod passed_on;
mod prepare;
mod report;
mod reproduce;
mod rig;
mod rotations;
mod sampled;
mod song;
mod song_figures;
mod stopped;
mod study;
mod viewer;
