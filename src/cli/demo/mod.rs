//! `keydance demo`: reads nothing, writes a folder of results: a run on generated clips from their making to tables and figures.

mod comparison;
mod settings;
mod showcase;
mod training;

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context as _;
use clap::Args;

use super::notice::notice;
use super::threads::Threads;
use super::watched::evaluate_watched;
use crate::data::choreography::{ChoreographyConfig, generate};
use crate::data::{DanceClip, DataPart, Dataset};
use crate::evaluation::{EvaluatedData, EvaluationRecord};
use crate::evaluation::{Evaluation, Protocol, TableRow, markdown_tables, terminal_tables};
use crate::models::baselines::interpolation::Interpolation;
use crate::models::transition::TransitionModel;
use crate::report::{schedule_note, thousands};
use crate::run::{RunFolder, replace_file, write_json};
use comparison::Comparison;
use settings::Settings;
use showcase::{Showcase, ShowcaseFiles};

/// Exit code of a demo whose model is behind interpolation or behind itself before its training.
const BEHIND: u8 = 4;

const TABLES: &str = "tables.md";
const LOSS_CURVE: &str = "loss_curve.svg";
const TRANSITION: &str = "transition.bvh";
const FIGURE: &str = "motion.svg";
const VIEWER: &str = "viewer.html";
const INTERPOLATION: &str = "interpolation.json";
const UNTRAINED: &str = "untrained.json";
const CHOREOGRAPHY: &str = "choreography.toml";

/// Generates dance clips, trains a small model on them, evaluates it beside what needs no training, writes tables and figures.
///
/// Needs no data, takes two to three minutes on two cores and gives the same numbers each time. Ends with exit code 4 if the
/// model is not ahead in LRP at 100 and 150 frames, of interpolation and of the linear estimate that it was before its training.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Folder for the results; those of an earlier demo there are replaced
    #[arg(long, value_name = "DIR", default_value = "results/demo")]
    out: PathBuf,
    /// Fewer and shorter clips and about a seventh of the training: about 20 seconds, the same files and the same demand on the model
    #[arg(long)]
    reduced: bool,
    /// Share of the demo's schedule that is trained, above 0 and at most 1, instead of the one in experiments/demo.toml
    #[arg(long, value_name = "F")]
    fraction: Option<f64>,
    #[command(flatten)]
    threads: Threads,
}

/// # Errors
/// The folder holds something else, or a file cannot be written.
pub fn run(args: DemoArgs) -> anyhow::Result<ExitCode> {
    let begun = Instant::now();
    let settings = Settings::new(args.reduced, args.fraction)?;
    let config = &settings.experiment;
    let mut out = std::io::stdout();
    let run = RunFolder::replace(&args.out, config)?;
    remove_results(run.path())?;

    let dataset = generated_data(&settings)?;
    let of = |clips: &[DanceClip]| clips.iter().map(DanceClip::frames).sum::<usize>() as u64;
    writeln!(
        out,
        "{} clips to train on ({} frames), {} to test on ({} frames), generated from seed {}",
        dataset.train.len(),
        thousands(of(&dataset.train)),
        dataset.test.len(),
        thousands(of(&dataset.test)),
        settings.choreography.seed
    )?;
    let trained = training::train(config, &dataset, args.threads.count(), &run)?;
    write_text(&run, LOSS_CURVE, &trained.losses.figure()?)?;

    let model = run.trained_model(config)?;
    let interpolation = Interpolation {
        contact_threshold: config.data.contact_threshold,
    };
    let pool = args.threads.pool()?;
    let evaluate = |model: &dyn TransitionModel| -> anyhow::Result<Evaluation> {
        let protocol = Protocol::default();
        let outcome = pool.install(|| evaluate_watched(&protocol, model, &dataset.test))?;
        Ok(outcome.evaluation)
    };
    let comparison = Comparison {
        interpolation: evaluate(&interpolation)?,
        untrained: evaluate(&trained.untrained)?,
        model: evaluate(&model)?,
    };
    let manifest = run.manifest()?.context("the training left no manifest")?;
    let row = |name: &str, seed, evaluation: &Evaluation, schedule_note: String| TableRow {
        name: name.into(),
        seed,
        evaluation: Some(evaluation.clone()),
        schedule_note,
    };
    let rows = [
        row(
            "interpolation, generated clips",
            None,
            &comparison.interpolation,
            "needs no training".into(),
        ),
        row(
            "linear estimate, generated clips",
            None,
            &comparison.untrained,
            "the small whole model before its training".into(),
        ),
        row(
            "small whole model, generated clips",
            Some(manifest.seed),
            &comparison.model,
            schedule_note(config, &manifest),
        ),
    ];
    write!(out, "\n{}\n", terminal_tables(&rows))?;
    write_text(
        &run,
        TABLES,
        &markdown_tables(&rows, &subject(&settings.choreography, &dataset)),
    )?;
    write_json(&run.path().join(INTERPOLATION), &comparison.interpolation)?;
    write_json(&run.path().join(UNTRAINED), &comparison.untrained)?;
    EvaluationRecord {
        evaluation: comparison.model.clone(),
        data: EvaluatedData::of(&dataset, DataPart::Test)?,
    }
    .write(run.path())?;
    write_text(
        &run,
        CHOREOGRAPHY,
        &toml::to_string(&settings.choreography)?,
    )?;

    let showcase = Showcase::new(&dataset.test)?;
    let files = ShowcaseFiles {
        figure: run.path().join(FIGURE),
        viewer: run.path().join(VIEWER),
        bvh: run.path().join(TRANSITION),
    };
    let motion = showcase.write(&interpolation, &model, &files)?;
    writeln!(
        out,
        "{TRANSITION}: {showcase}; its rotations meet the predicted positions to {:.1} cm in the mean, {:.1} cm at most",
        motion.mean_error, motion.max_error
    )?;
    writeln!(
        out,
        "{} in {:.0} s",
        run.path().display(),
        begun.elapsed().as_secs_f64()
    )?;
    writeln!(out, "{comparison}")?;
    if comparison.is_ahead() {
        Ok(ExitCode::SUCCESS)
    } else {
        notice(
            "error: the trained model is not ahead of interpolation and of its own beginning at long transitions",
        );
        Ok(ExitCode::from(BEHIND))
    }
}

fn generated_data(settings: &Settings) -> anyhow::Result<Dataset> {
    let clips = generate(&settings.choreography)?;
    let clips = clips.into_iter().map(|generated| generated.clip).collect();
    Ok(Dataset::from_clips(clips, &settings.experiment.data)?)
}

/// What the scores were measured on, for the tables' caption.
fn subject(choreography: &ChoreographyConfig, dataset: &Dataset) -> String {
    format!(
        "{} of {} generated clips of {} frames (seed {}), the paper's on its own data: not comparable",
        dataset.test.len(),
        choreography.clips,
        choreography.frames_per_clip,
        choreography.seed
    )
}

fn write_text(run: &RunFolder, name: &str, text: &str) -> anyhow::Result<()> {
    Ok(replace_file(&run.path().join(name), text.as_bytes())?)
}

/// Removes what an earlier demo left beside its run: a demo that is interrupted must not leave results of two.
fn remove_results(folder: &Path) -> anyhow::Result<()> {
    let own = [
        TABLES,
        LOSS_CURVE,
        TRANSITION,
        FIGURE,
        VIEWER,
        INTERPOLATION,
        UNTRAINED,
        CHOREOGRAPHY,
    ];
    let names = own
        .into_iter()
        .chain(EvaluationRecord::files(DataPart::Test));
    for path in names.map(|name| folder.join(name)) {
        if path.exists() {
            fs::remove_file(&path)
                .with_context(|| format!("{} cannot be removed", path.display()))?;
        }
    }
    Ok(())
}
