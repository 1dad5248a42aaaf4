//! Demos: what a paper's model does, without data. Dances are generated, a small model is trained on
//! them and scored beside what needs no training, and something of it is left to look at. One
//! folder a paper.

mod losses;
#[cfg(feature = "papers")]
pub mod pan2021;
#[cfg(feature = "papers")]
pub mod pu2022;
#[cfg(feature = "papers")]
pub mod valleperez2021;

pub use losses::Losses;

use std::path::Path;

use super::{ReportError, schedule_note, thousands};
use crate::counted::counted;
use crate::data::choreography::ChoreographyConfig;
use crate::data::{DataPart, Dataset, Recording};
use crate::evaluation::{
    EvaluatedData, Evaluation, EvaluationError, EvaluationRecord, PrintedTables, Protocol,
    ProtocolScores, TableRow, Tables,
};
use crate::experiment::ExperimentConfig;
use crate::models::{Generator, registry};
use crate::run::{RunFolder, check_output_folder, remove_file, replace_file, write_json};

const TABLES: &str = "tables.md";
const LOSS_CURVE: &str = "loss_curve.svg";
const CHOREOGRAPHY: &str = "choreography.toml";

/// Makes a paper's demo ready: a line of [`crate::models::Paper`].
pub type OpenDemo = fn(&DemoOptions) -> Result<Box<dyn Demo>, ReportError>;

/// How large a demo is to be.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DemoOptions {
    /// Less of everything, for tests.
    pub reduced: bool,
    /// Share of the schedule that is trained, above 0 and at most 1, in place of the demo's own.
    pub fraction: Option<f64>,
}

/// A paper's demo.
pub trait Demo {
    /// What is generated.
    fn choreography(&self) -> &ChoreographyConfig;

    /// What is trained.
    fn experiment(&self) -> &ExperimentConfig;

    /// What the trained model is called in the tables.
    fn model_title(&self) -> &'static str;

    /// The generated clips, split as the experiment says.
    ///
    /// # Errors
    /// They cannot be generated or measured.
    fn dataset(&self) -> Result<Dataset, ReportError>;

    /// What is scored beside the model; `untrained` is the model before its training.
    fn others(&self, untrained: Box<dyn Generator>) -> Vec<Other>;

    /// The protocol that scores it; none: the first of the model's.
    fn protocol(&self) -> Option<&'static str> {
        None
    }

    /// The metrics of its tables; none: those of the paper's, with its numbers.
    fn metrics(&self) -> &'static [&'static str] {
        &[]
    }

    /// Names of the files of this demo alone: scores of the others, and what [`Demo::show`] writes.
    fn files(&self) -> &'static [&'static str];

    /// Writes files to look at into a folder; what they show, in a line.
    ///
    /// # Errors
    /// The model fails, or a file cannot be written.
    fn show(
        &self,
        model: &dyn Generator,
        dataset: &Dataset,
        folder: &Path,
    ) -> Result<String, ReportError>;

    /// Whether the model with these scores reached the demo's goal.
    fn verdict(&self, model: &ProtocolScores, others: &OtherScores) -> Verdict;
}

/// What is scored beside a demo's model.
pub struct Other {
    /// What it is called in the tables.
    pub title: &'static str,
    /// Name of the file of its scores.
    pub file: &'static str,
    /// How it was trained.
    pub note: &'static str,
    pub model: Box<dyn Generator>,
}

/// Scores of the others by their files.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OtherScores(pub Vec<(&'static str, ProtocolScores)>);

impl OtherScores {
    /// No scores of a file that is not there.
    pub fn of(&self, file: &str) -> ProtocolScores {
        let found = self.0.iter().find(|(known, _)| *known == file);
        found.map_or_else(ProtocolScores::default, |(_, scores)| scores.clone())
    }
}

/// Whether a demo's goal is reached.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verdict {
    pub reached: bool,
    /// The goal with the numbers that decide it.
    pub numbers: String,
    /// What it means where the goal is not reached.
    pub missed: &'static str,
}

/// What opens the demo of a paper; without a name, of the first that has one.
///
/// # Errors
/// No such paper has a demo.
pub fn opener(paper: Option<&str>) -> Result<OpenDemo, ReportError> {
    let papers = registry::papers().into_iter();
    let demos = papers.filter_map(|paper| Some((paper.name, paper.demo?)));
    let demos: Vec<(&str, OpenDemo)> = demos.collect();
    let mut wanted = demos.iter();
    let found = wanted.find(|(name, _)| paper.is_none_or(|paper| paper == *name));
    found.map(|(_, open)| *open).ok_or_else(|| {
        let known: Vec<&str> = demos.iter().map(|(name, _)| *name).collect();
        let (paper, known) = (paper.unwrap_or_default(), known.join(", "));
        ReportError::Refused(format!(
            "--paper {paper}: no such paper has a demo; these have one: {known}"
        ))
    })
}

/// Refuses a folder that holds something else than an earlier demo.
///
/// # Errors
/// It does.
pub fn check_folder(folder: &Path) -> Result<(), ReportError> {
    let problem =
        if folder.join(CHOREOGRAPHY).exists() || check_output_folder(folder, false).is_ok() {
            return Ok(());
        } else if folder.join(RunFolder::CONFIG).exists() {
            "holds a run already, which is no demo"
        } else {
            "holds other files than a demo's"
        };
    let folder = folder.display();
    Err(ReportError::Refused(format!(
        "{folder} {problem}; give another --out"
    )))
}

/// Removes what an earlier demo left beside its run, as a demo that is interrupted must not leave
/// results of two; and writes what is generated, by which the folder is known as a demo's.
///
/// # Errors
/// A file cannot be removed or written.
pub fn begin_results(folder: &Path, demo: &dyn Demo) -> Result<(), ReportError> {
    let scores = EvaluationRecord::files(DataPart::Test);
    let own = [TABLES, LOSS_CURVE].into_iter().chain(scores);
    own.chain(demo.files().iter().copied())
        .try_for_each(|name| remove_file(&folder.join(name)))?;
    let choreography = toml::to_string(demo.choreography())?;
    Ok(replace_file(&folder.join(CHOREOGRAPHY), choreography)?)
}

/// Writes the loss curve.
///
/// # Errors
/// There is no loss to draw, or the file cannot be written.
pub fn write_losses(folder: &Path, losses: &Losses) -> Result<(), ReportError> {
    Ok(replace_file(&folder.join(LOSS_CURVE), losses.figure()?)?)
}

/// Scores the trained model of a run and what stands beside it, and writes tables and scores; the
/// tables for the terminal, and whether the demo's goal is reached. `untrained`: the model before
/// its training; `evaluate` scores a model on the test clips.
///
/// # Errors
/// A model that cannot be scored, or a file that cannot be written.
pub fn compare(
    demo: &dyn Demo,
    dataset: &Dataset,
    run: &RunFolder,
    (untrained, model): (Box<dyn Generator>, &dyn Generator),
    evaluate: impl Fn(&dyn Protocol, &dyn Generator) -> Result<Evaluation, EvaluationError>,
) -> Result<(String, Verdict), ReportError> {
    let (config, folder) = (demo.experiment(), run.path());
    // One alone: a paper's numbers are of other data, so how it counted adds nothing.
    let mut protocols = config.protocols();
    protocols.retain(|it| demo.protocol().is_none_or(|wanted| wanted == it.name()));
    protocols.truncate(1);
    let protocol = protocols.first().ok_or_else(|| {
        let kind = config.model.kind();
        ReportError::Refused(format!(
            "model.kind = {kind} has no protocol to score it by"
        ))
    })?;
    let (protocol, protocols) = (&**protocol, &protocols[..]);
    let evaluate = |model: &dyn Generator| -> Result<ProtocolScores, EvaluationError> {
        let scores = evaluate(protocol, model)?.scores;
        Ok(ProtocolScores::new([(protocol.name(), scores)]))
    };
    let row = |title: &str, seed, scores: &ProtocolScores, note: String| TableRow {
        name: format!("{title}, generated clips"),
        seed,
        scores: Some(scores.clone()),
        schedule_note: note,
    };
    let (mut rows, mut others) = (Vec::new(), OtherScores::default());
    for other in demo.others(untrained) {
        let scores = evaluate(&*other.model)?;
        write_json(&folder.join(other.file), &scores)?;
        rows.push(row(other.title, None, &scores, other.note.into()));
        others.0.push((other.file, scores));
    }
    let scores = evaluate(model)?;
    let none = || ReportError::Refused("the training left no manifest".into());
    let manifest = run.manifest()?.ok_or_else(none)?;
    let note = schedule_note(config, &manifest);
    rows.push(row(demo.model_title(), Some(manifest.seed), &scores, note));
    let printed = &match demo.metrics() {
        [] => config.printed()?,
        metrics => PrintedTables::of_metrics(metrics),
    };
    let tables = Tables { protocols, printed };
    let choreography = demo.choreography();
    let subject = format!(
        "{} of {} of {} (seed {})",
        dataset.test.len(),
        counted(choreography.clips, "generated clip"),
        counted(choreography.frames_per_clip, "frame"),
        choreography.seed
    );
    replace_file(&folder.join(TABLES), tables.markdown(&rows, &subject))?;
    let verdict = demo.verdict(&scores, &others);
    let data = EvaluatedData::of(dataset, DataPart::Test, None)?;
    EvaluationRecord { scores, data }.write(folder)?;
    Ok((tables.terminal(&rows), verdict))
}

/// The data in words.
pub fn summary(demo: &dyn Demo, dataset: &Dataset) -> String {
    let of = |clips: &[Recording]| {
        let frames: usize = clips.iter().map(Recording::frames).sum();
        (clips.len(), thousands(frames as u64))
    };
    let ((train, frames), (test, test_frames)) = (of(&dataset.train), of(&dataset.test));
    format!(
        "{} to train on ({frames} frames), {test} to test on ({test_frames} frames), generated \
         from seed {}",
        counted(train, "clip"),
        demo.choreography().seed
    )
}
