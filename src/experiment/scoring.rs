//! The scoring of one model: by which protocols, on what, and where its scores are kept.

use std::path::{Path, PathBuf};

use super::ReproduceError;
use crate::counted::counted;
use crate::data::{DataPart, Dataset};
use crate::evaluation::protocol::choose;
use crate::evaluation::{
    EvaluatedData, EvaluationError, EvaluationOptions, EvaluationRecord, Protocol, ProtocolScores,
    Scores, TableRow, Tables,
};
use crate::run::Subject;

/// What a model is scored by and on.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ScoringChoice {
    pub part: DataPart,
    pub options: EvaluationOptions,
    /// Names of protocols; none: all of the model's paper.
    pub protocols: Vec<String>,
    /// For a config: a folder for its scores.
    pub out: Option<PathBuf>,
    /// Whether the data is the run's.
    pub own_data: bool,
    /// Replace scores on other clips.
    pub force: bool,
}

/// A model that is about to be scored.
pub struct Scoring<'s> {
    subject: &'s Subject,
    data: EvaluatedData,
    protocols: Vec<Box<dyn Protocol>>,
    most_windows: Option<usize>,
    /// The folder for the scores; none where there is none, or where it keeps others.
    folder: Option<PathBuf>,
    /// Whether these are scores that the folder is for: a run's folder is for those of its own
    /// model by all protocols, on all windows of their own lengths.
    is_kept: bool,
}

impl<'s> Scoring<'s> {
    /// # Errors
    /// The data has no such clips; a protocol that the model's paper does not have; a folder for
    /// the scores that holds others.
    pub fn new(
        subject: &'s Subject,
        dataset: &Dataset,
        choice: &ScoringChoice,
    ) -> Result<Self, ReproduceError> {
        let ScoringChoice {
            part,
            options,
            protocols: names,
            out,
            own_data,
            force,
        } = choice;
        let data = EvaluatedData::of(dataset, *part, subject.weights.clone())?;
        let mut protocols = subject.config.protocols_with(options);
        if !names.is_empty() {
            protocols.extend(subject.config.protocols_by_name(options));
        }
        let folder = subject.scores_folder(out.as_deref(), &data, *force)?;
        let folder = folder.filter(|_| subject.run.is_none() || *own_data || *force);
        let whole = *options == EvaluationOptions::default() && names.is_empty();
        let is_kept = match &subject.run {
            Some(run) => whole && *run.config()?.model == *subject.config.model,
            None => true,
        };
        Ok(Self {
            folder: folder.map(Path::to_path_buf),
            protocols: choose(protocols, names, !options.lengths.is_empty())?,
            most_windows: options.most_windows,
            subject,
            data,
            is_kept,
        })
    }

    /// What is scored on what.
    pub fn title(&self) -> String {
        let EvaluatedData {
            clips,
            part,
            frames,
            ..
        } = &self.data;
        let clips = counted(*clips, &format!("{part} clip"));
        format!("{} on {clips}, {frames} frames", self.subject.what)
    }

    /// That a run's folder keeps the scores that it has.
    pub fn warning(&self) -> Option<&'static str> {
        let keeps = self.subject.run.is_some() && self.folder.is_none();
        keeps.then_some(
            "the run keeps its scores, and none on other data than its own; --force replaces them",
        )
    }

    /// The scores that `evaluate` gives by each protocol.
    ///
    /// # Errors
    /// Those of `evaluate`.
    pub fn record(
        &self,
        mut evaluate: impl FnMut(&dyn Protocol) -> Result<Scores, EvaluationError>,
    ) -> Result<EvaluationRecord, EvaluationError> {
        let scores = self.protocols.iter();
        let scores = scores.map(|protocol| Ok((protocol.name(), evaluate(&**protocol)?)));
        let scores = ProtocolScores::new(scores.collect::<Result<Vec<_>, EvaluationError>>()?);
        let bound = self.most_windows;
        Ok(EvaluationRecord {
            data: EvaluatedData {
                most_windows: bound.filter(|&most| scores.most_windows() >= most),
                ..self.data.clone()
            },
            scores,
        })
    }

    /// The scores as plain text, beside the paper's.
    ///
    /// # Errors
    /// A model from outside whose paper's numbers cannot be read.
    pub fn terminal(&self, record: &EvaluationRecord) -> Result<String, ReproduceError> {
        let config = &self.subject.config;
        let row = TableRow {
            name: config.name.clone(),
            seed: None,
            scores: Some(record.scores.clone()),
            schedule_note: String::new(),
        };
        let (protocols, printed) = (&self.protocols, &config.printed()?);
        let mut text = Tables { protocols, printed }.terminal(&[row]);
        if let Some(most) = self.most_windows {
            text += &format!(
                "\nat most {} of each length: not comparable with scores on all\n",
                counted(most, "window")
            );
        }
        Ok(text)
    }

    /// Writes scores into the folder for them, where they are what it is for.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn keep(&self, record: &EvaluationRecord) -> Result<(), ReproduceError> {
        match self.folder.as_ref().filter(|_| self.is_kept) {
            Some(folder) => Ok(self.subject.write_scores(folder, record)?),
            None => Ok(()),
        }
    }
}
