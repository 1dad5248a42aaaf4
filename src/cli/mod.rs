//! The command line: one file a subcommand.

mod bvh;
mod features;
mod gradcheck;

use clap::{Parser, Subcommand};

/// Dance synthesis from keyframes.
#[derive(Debug, Parser)]
#[command(version, about, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Look into BVH files
    Bvh(bvh::BvhArgs),
    /// Write the features of every frame of a BVH file as one array
    Features(features::FeaturesArgs),
    /// Compare the gradient of a model's whole loss with central differences
    Gradcheck(gradcheck::GradcheckArgs),
}

impl Cli {
    /// Runs the subcommand.
    ///
    /// # Errors
    /// Whatever the subcommand could not do.
    pub fn run(self) -> anyhow::Result<()> {
        match self.command {
            Command::Bvh(args) => bvh::run(args),
            Command::Features(args) => features::run(args),
            Command::Gradcheck(args) => gradcheck::run(args),
        }
    }
}
