//! Figures 4 (b) to 12 of Pan et al. 2021, drawn with trained models.

mod comparison;
mod lengths;
mod root;
mod stage;
mod velocity;
pub mod wording;

pub use stage::{Stage, Window};

use std::path::Path;

use super::Figure;
use crate::data::Dataset;
use crate::models::baselines::interpolation::Interpolation;
use crate::models::transition::Kind;
use crate::models::{Generator, ModelKind as _};
use crate::report::{MotionKind, ReportError, Viewer, ViewerMotion};
use crate::run::Subject;
use crate::synthesis::{SynthesisOptions, synthesise};
use comparison::Entry;

/// The models of the figures.
pub struct Cast {
    subject: Subject,
    compared: Vec<Subject>,
    interpolation: Interpolation,
}

impl Cast {
    /// The model that the figures are about, and those to set beside it in figures 11 and 12.
    ///
    /// # Errors
    /// The models were made for other features of the data, so they cannot be compared.
    pub fn new(subject: Subject, compared: Vec<Subject>) -> Result<Self, ReportError> {
        for other in &compared {
            let (ours, theirs) = (&subject.config.data, &other.config.data);
            if (ours.fps, ours.features(), &ours.mapping)
                != (theirs.fps, theirs.features(), &theirs.mapping)
            {
                return Err(ReportError::Refused(format!(
                    "{} was made for data at another rate, or with another mapping, contact \
                     threshold or facing_sigma than {}: they cannot be compared",
                    other.what, subject.what
                )));
            }
        }
        let interpolation = Interpolation {
            contact_threshold: subject.config.data.contact_threshold,
        };
        Ok(Self {
            subject,
            compared,
            interpolation,
        })
    }

    /// The model that the figures are about.
    pub fn subject(&self) -> &Subject {
        &self.subject
    }

    /// Refuses data that a model was not trained on, see [`Subject::check_data`].
    ///
    /// # Errors
    /// As [`Subject::check_data`].
    pub fn check_data(&self, dataset: &Dataset, folder: &Path) -> Result<(), ReportError> {
        for subject in std::iter::once(&self.subject).chain(&self.compared) {
            subject.check_data(dataset, folder)?;
        }
        Ok(())
    }

    /// All figures, in their order.
    ///
    /// # Errors
    /// A model fails, a control does not fit, or there is nothing to draw.
    pub fn figures(&self, stage: &Stage) -> Result<Vec<Figure>, ReportError> {
        let model = self.subject.model.as_ref();
        let name = &self.subject.config.name;
        let plain = stage.generate(model, Ok)?;
        let mut figures = vec![
            velocity::figure_4b(stage, model)?,
            root::figure_5(stage, name, &plain)?,
            root::figure_6(stage, model, &plain)?,
            root::figure_7(stage, model, &plain)?,
            velocity::figure_8(stage, model, &plain)?,
            velocity::figure_9(stage, model, &plain)?,
            lengths::figure_10(stage, model)?,
        ];
        let mut entries = Vec::new();
        for (name, trained, model) in self.others() {
            entries.push(Entry {
                name: name.into(),
                drawn_with_root: trained,
                generated: stage.generate(model, Ok)?,
            });
        }
        entries.push(Entry {
            name: name.clone(),
            drawn_with_root: true,
            generated: plain,
        });
        figures.push(comparison::figure_11(stage, &entries)?);
        figures.push(comparison::figure_12(stage, &entries)?);
        Ok(figures)
    }

    /// The viewer's page of the shown transition, as `keydance generate` would make it.
    ///
    /// # Errors
    /// A model fails, or the page cannot be made.
    pub fn page(&self, stage: &Stage) -> Result<String, ReportError> {
        let window = stage.shown();
        let options = SynthesisOptions::default();
        let name = self.subject.config.name.as_str();
        let recorded = window.recorded.view();
        let mut motions = vec![ViewerMotion::from_features(
            "Ground truth",
            MotionKind::Recorded,
            recorded,
        )];
        let others = self.others().into_iter();
        let others = others.map(|(name, _, model)| (name, MotionKind::Other, model));
        let subject = (name, MotionKind::Model, self.subject.model.as_ref());
        for (name, kind, model) in others.chain([subject]) {
            let sequence = synthesise(model, &window.request, &options, name)?;
            let frames = sequence.features.view();
            motions.push(ViewerMotion::from_features(name, kind, frames));
        }
        Ok(Viewer::of_request(&window.describe(), &window.request, motions).html()?)
    }

    /// Name, whether it was trained, and model: interpolation unless it is among those given, then
    /// those to set beside.
    fn others(&self) -> Vec<(&str, bool, &dyn Generator)> {
        let mut given = self.compared.iter().chain([&self.subject]);
        let mut models: Vec<(&str, bool, &dyn Generator)> = Vec::new();
        if !given.any(|subject| subject.config.model.kind() == Kind::Interpolation.name()) {
            models.push(("Interpolation", false, &self.interpolation));
        }
        models.extend(self.compared.iter().map(|subject| {
            let config = &subject.config;
            let trained = config.model.untrained(&config.data).is_none();
            (config.name.as_str(), trained, subject.model.as_ref())
        }));
        models
    }
}
