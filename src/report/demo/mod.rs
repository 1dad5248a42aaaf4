//! What a demo leaves: tables, scores, curves, and one transition to look at.

mod comparison;
mod losses;
mod settings;
mod showcase;

use std::fmt;
use std::path::Path;

use super::ReportError;
use crate::data::{DataPart, Dataset};
use crate::evaluation::{
    EvaluatedData, Evaluation, EvaluationError, EvaluationRecord, Protocol, ProtocolScores, Tables,
};
use crate::experiment::ExperimentConfig;
use crate::models::baselines::interpolation::Interpolation;
use crate::models::transition::DanceClip;
use crate::models::{Generator, ModelError};
use crate::run::{RunFolder, check_output_folder, remove_file, replace_file, write_json};
use showcase::Showcase;

pub use comparison::Comparison;
pub use losses::Losses;
pub use settings::DemoSettings;

const TABLES: &str = "tables.md";
const LOSS_CURVE: &str = "loss_curve.svg";
/// Name of the file with the transition that is shown.
const TRANSITION: &str = "transition.bvh";
const FIGURE: &str = "motion.svg";
const VIEWER: &str = "viewer.html";
const INTERPOLATION: &str = "interpolation.json";
const UNTRAINED: &str = "untrained.json";
const CHOREOGRAPHY: &str = "choreography.toml";

/// A demo in its folder.
pub struct Demo {
    settings: DemoSettings,
    pub run: RunFolder,
    /// The generated clips.
    pub dataset: Dataset,
}

/// Refuses a folder that holds something else than an earlier demo.
fn check_folder(folder: &Path) -> Result<(), ReportError> {
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

impl Demo {
    /// Takes the place of an earlier demo: what that left beside its run is removed, as a demo that
    /// is interrupted must not leave results of two; and what is generated is written, by which the
    /// folder is known as a demo's.
    ///
    /// # Errors
    /// The folder holds something else, or a file cannot be removed or written.
    pub fn begin(folder: &Path, settings: DemoSettings) -> Result<Self, ReportError> {
        check_folder(folder)?;
        let run = RunFolder::replace(folder, &settings.experiment)?;
        let own = [
            TABLES,
            LOSS_CURVE,
            TRANSITION,
            FIGURE,
            VIEWER,
            INTERPOLATION,
            UNTRAINED,
        ];
        let scores = EvaluationRecord::files(DataPart::Test);
        own.iter()
            .chain(&scores)
            .try_for_each(|name| remove_file(&folder.join(name)))?;
        let choreography = toml::to_string(&settings.choreography)?;
        replace_file(&folder.join(CHOREOGRAPHY), choreography)?;
        Ok(Self {
            dataset: settings.dataset()?,
            settings,
            run,
        })
    }

    /// What is trained.
    pub fn config(&self) -> &ExperimentConfig {
        &self.settings.experiment
    }

    /// The trained model.
    ///
    /// # Errors
    /// It was not trained.
    pub fn model(&self) -> Result<Box<dyn Generator>, ReportError> {
        Ok(self.run.trained_model(self.config())?)
    }

    fn interpolation(&self) -> Interpolation {
        Interpolation {
            contact_threshold: self.config().data.contact_threshold,
        }
    }

    /// Writes the loss curve.
    ///
    /// # Errors
    /// There is no loss to draw, or the file cannot be written.
    pub fn write_losses(&self, losses: &Losses) -> Result<(), ReportError> {
        let path = self.run.path().join(LOSS_CURVE);
        Ok(replace_file(&path, losses.figure()?)?)
    }

    /// Sets the model beside interpolation and beside itself before its training, scored as
    /// `evaluate` does: writes tables and scores, and gives the tables as plain text, too.
    ///
    /// # Errors
    /// A model that cannot be scored, or a file that cannot be written.
    pub fn compare(
        &self,
        untrained: &dyn Generator,
        model: &dyn Generator,
        evaluate: impl Fn(&dyn Protocol, &dyn Generator) -> Result<Evaluation, EvaluationError>,
    ) -> Result<(Comparison, String), ReportError> {
        let (config, folder) = (self.config(), self.run.path());
        // The paper's numbers are of other data, so its own way of counting adds nothing here.
        let protocols = &config.protocols()[..1];
        let protocol = &*protocols[0];
        let scores = |model: &dyn Generator| -> Result<ProtocolScores, EvaluationError> {
            let scores = evaluate(protocol, model)?.scores;
            Ok(ProtocolScores::new([(protocol.name(), scores)]))
        };
        let comparison = Comparison {
            interpolation: scores(&self.interpolation())?,
            untrained: scores(untrained)?,
            model: scores(model)?,
        };
        let none = || ReportError::Refused("the training left no manifest".into());
        let manifest = self.run.manifest()?.ok_or_else(none)?;
        let rows = comparison.rows(config, &manifest);
        let printed = &config.printed()?;
        let tables = Tables { protocols, printed };
        let markdown = tables.markdown(&rows, &self.settings.subject(&self.dataset));
        replace_file(&folder.join(TABLES), markdown)?;
        write_json(&folder.join(INTERPOLATION), &comparison.interpolation)?;
        write_json(&folder.join(UNTRAINED), &comparison.untrained)?;
        let record = EvaluationRecord {
            scores: comparison.model.clone(),
            data: EvaluatedData::of(&self.dataset, DataPart::Test)?,
        };
        record.write(folder)?;
        Ok((comparison, tables.terminal(&rows)))
    }

    /// Writes one transition as motion, figure and page, and says which.
    ///
    /// # Errors
    /// No clip is long enough, a model fails, or a file cannot be written.
    pub fn show(&self, model: &dyn Generator) -> Result<String, ReportError> {
        let features = self.config().data.features();
        let clips = DanceClip::measure_all(&self.dataset.test, &features);
        let clips = clips.map_err(|error| ModelError::data(&error))?;
        let showcase = Showcase::new(&clips)?;
        let motion = showcase.write(&self.interpolation(), model, self.run.path())?;
        Ok(format!(
            "{TRANSITION}: {showcase}; its rotations meet the predicted positions to {:.1} cm in \
             the mean, {:.1} cm at most",
            motion.mean_error, motion.max_error
        ))
    }
}

impl fmt::Display for Demo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.settings.summary(&self.dataset))
    }
}
