//! The command line: one file a subcommand.

mod bench;
mod bvh;
mod choreography;
mod demo;
mod evaluate;
mod export_batch;
mod features;
mod figures;
mod file_units;
mod generate;
mod gradcheck;
mod list;
mod manual;
mod music;
mod notice;
mod pack;
mod plot;
mod prepare;
mod progress;
mod regenerate;
mod reproduce;
mod rig;
mod runs;
mod stop;
mod study;
mod tables;
mod threads;
mod train;
mod view;
mod watched;

use std::io;
use std::process::ExitCode;
use std::sync::LazyLock;
use std::time::Duration;

use clap::{Parser, Subcommand};

use self::notice::notice;
use crate::autograd::kernels::Isa;
use crate::ranks::{self, RanksError};
use crate::run::manifest::Build;
use crate::training::TrainingError;

/// Exit code of a training that ended because a loss or gradient was not finite.
const DIVERGED: u8 = 3;
/// How long a rank that says nothing waits for the first to speak.
const MUTE: Duration = Duration::from_secs(1);
/// Exit code where what read the output no longer does: that of a program which SIGPIPE ends.
const OUTPUT_CLOSED: u8 = 141;

/// Synthesise dance between keyframes: train models, score them, generate with them
#[derive(Debug, Parser)]
#[command(version = VERSION.as_str(), about, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// Of the program and, where it was built in a git checkout, the commit.
static VERSION: LazyLock<String> = LazyLock::new(|| Build::this().to_string());

/// The main commands first, benchmarks last.
#[derive(Debug, Subcommand)]
enum Command {
    #[command(after_help = include_str!("help/demo.txt"))]
    Demo(demo::DemoArgs),
    /// Train a model
    #[command(after_help = include_str!("help/train.txt"))]
    Train(train::TrainArgs),
    /// Score a trained model, or one that needs no training, by its paper's protocols
    #[command(after_help = include_str!("help/evaluate.txt"))]
    Evaluate(evaluate::EvaluateArgs),
    #[command(after_help = include_str!("help/generate.txt"))]
    Generate(Box<generate::GenerateArgs>),
    #[command(after_help = include_str!("help/reproduce.txt"))]
    Reproduce(reproduce::ReproduceArgs),
    /// Set scores beside the paper's in its tables
    #[command(after_help = include_str!("help/tables.txt"))]
    Tables(tables::TablesArgs),
    #[command(after_help = include_str!("help/figures.txt"))]
    Figures(figures::FiguresArgs),
    /// Have people rate dances without knowing whose they are, and analyse the ratings
    #[command(after_help = include_str!("help/study.txt"))]
    Study(study::StudyArgs),
    #[command(after_help = include_str!("help/regenerate.txt"))]
    Regenerate(regenerate::RegenerateArgs),
    #[command(after_help = include_str!("help/runs.txt"))]
    Runs(runs::RunsArgs),
    #[command(after_help = include_str!("help/view.txt"))]
    View(view::ViewArgs),
    #[command(after_help = include_str!("help/plot.txt"))]
    Plot(plot::PlotArgs),
    #[command(after_help = include_str!("help/pack.txt"))]
    Pack(pack::PackArgs),
    #[command(after_help = include_str!("help/rig.txt"))]
    Rig(rig::RigArgs),
    /// Look into BVH files
    #[command(after_help = include_str!("help/bvh.txt"))]
    Bvh(bvh::BvhArgs),
    /// Write the features of every frame of a BVH file as one array
    #[command(after_help = include_str!("help/features.txt"))]
    Features(features::FeaturesArgs),
    #[command(after_help = include_str!("help/music.txt"))]
    Music(music::MusicArgs),
    #[command(after_help = include_str!("help/prepare.txt"))]
    Prepare(prepare::PrepareArgs),
    /// Write generated dance clips as BVH files
    #[command(after_help = include_str!("help/choreography.txt"))]
    Choreography(choreography::ChoreographyArgs),
    /// Compare the gradient of a model's whole loss with central differences
    #[command(after_help = include_str!("help/gradcheck.txt"))]
    Gradcheck(gradcheck::GradcheckArgs),
    /// Write a batch with a trained model's outputs, losses and gradients
    #[command(after_help = include_str!("help/export_batch.txt"))]
    ExportBatch(export_batch::ExportBatchArgs),
    #[command(after_help = include_str!("help/completions.txt"))]
    Completions(manual::CompletionsArgs),
    #[command(after_help = include_str!("help/man.txt"))]
    Man(manual::ManArgs),
    /// Time a training step
    #[command(after_help = include_str!("help/bench_step.txt"))]
    BenchStep(bench::StepArgs),
    /// Time an LSTM and two Transformer encoder layers, forward and backward
    #[command(after_help = include_str!("help/bench_layers.txt"))]
    BenchLayers(bench::LayersArgs),
    /// Time the generation of frames
    #[command(after_help = include_str!("help/bench_generate.txt"))]
    BenchGenerate(bench::GenerateArgs),
}

impl Cli {
    /// Runs the subcommand. Returns the exit code.
    ///
    /// # Errors
    /// Whatever the subcommand could not do.
    pub fn run(self) -> anyhow::Result<ExitCode> {
        Isa::asked_for()?;
        if let Some((_, count)) = ranks::launched().filter(|&(_, count)| count > 1)
            && !matches!(self.command, Command::Train(_) | Command::BenchStep(_))
        {
            anyhow::bail!(
                "{count} ranks of an MPI launcher: train and bench-step alone share their work \
                 among ranks; reproduce deals out rows by --task"
            );
        }
        match self.command {
            Command::Train(args) => return train::run(args),
            Command::Evaluate(args) => return evaluate::run(args),
            Command::Generate(args) => generate::run(*args)?,
            Command::Regenerate(args) => regenerate::run(args)?,
            Command::Reproduce(args) => return reproduce::run(args),
            Command::Figures(args) => figures::run(args)?,
            Command::Study(args) => study::run(args)?,
            Command::Tables(args) => tables::run(args)?,
            Command::Runs(args) => runs::run(args)?,
            Command::Demo(args) => return demo::run(args),
            Command::Choreography(args) => choreography::run(args)?,
            Command::Prepare(args) => return prepare::run(args),
            Command::View(args) => view::run(args)?,
            Command::Plot(args) => plot::run(args)?,
            Command::Pack(args) => pack::run(args)?,
            Command::Rig(args) => rig::run(args)?,
            Command::Bvh(args) => bvh::run(args)?,
            Command::Features(args) => features::run(args)?,
            Command::Music(args) => music::run(args)?,
            Command::Gradcheck(args) => gradcheck::run(args)?,
            Command::ExportBatch(args) => export_batch::run(args)?,
            Command::Completions(args) => manual::completions(&args)?,
            Command::Man(args) => manual::man(&args)?,
            Command::BenchStep(args) => bench::step(args)?,
            Command::BenchLayers(args) => bench::layers(args)?,
            Command::BenchGenerate(args) => bench::generate(args)?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// The command line; ends the process where that is none, or asks for help.
pub fn parse() -> Cli {
    Cli::try_parse().unwrap_or_else(|error| {
        if notice::is_mute() {
            let_the_first_speak();
            std::process::exit(error.exit_code());
        }
        error.exit()
    })
}

/// A launcher kills the other ranks once one has ended with an error.
fn let_the_first_speak() {
    if notice::is_mute() {
        std::thread::sleep(MUTE);
    }
}

/// Says what went wrong; the exit code of it.
pub fn report(error: &anyhow::Error) -> ExitCode {
    if let Some(error @ RanksError::NotBuilt { .. }) = error.downcast_ref() {
        // None of the ranks can speak for this one.
        notice::of_any_rank(format_args!("error: {error}"));
        return ExitCode::FAILURE;
    }
    // What reads the output, such as `head`, has seen enough of it.
    let mut causes = error.chain().filter_map(|cause| cause.downcast_ref());
    if causes.any(|cause: &io::Error| cause.kind() == io::ErrorKind::BrokenPipe) {
        return ExitCode::from(OUTPUT_CLOSED);
    }
    notice(format_args!("error: {error:#}"));
    let_the_first_speak();
    match error.downcast_ref::<TrainingError>() {
        Some(error) if error.is_divergence() => ExitCode::from(DIVERGED),
        _ => ExitCode::FAILURE,
    }
}
