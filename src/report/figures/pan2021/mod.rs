//! Figures 4 (b) to 13 of Pan et al. 2021, drawn with trained models.

mod comparison;
pub mod cyclic;
mod lengths;
mod root;
mod stage;
mod velocity;
pub mod wording;

use super::{DrawnFigures, Figure, FigureRequest};
use crate::models::baselines::interpolation::Interpolation;
use crate::models::transition::{DanceClip, Kind};
use crate::models::{Generator, ModelError, ModelKind as _};
use crate::report::{MotionKind, ReportError, Viewer, ViewerMotion};
use crate::run::Subject;
use crate::synthesis::{SynthesisOptions, synthesise};
use comparison::Entry;
use stage::Stage;

/// Draws all but figure 13, which is of other data.
///
/// # Errors
/// Models that were made for other features of the data cannot be compared; the shown clip is not
/// there; a model fails.
pub fn draw(asked: &FigureRequest<'_>) -> Result<DrawnFigures, ReportError> {
    check(asked)?;
    let data = &asked.subject.config.data;
    let clips = DanceClip::measure_all(&asked.dataset.test, &data.features())
        .map_err(|error| ModelError::data(&error))?;
    let stage = Stage::new(&clips, asked)?;
    let cast = Cast {
        subject: asked.subject,
        compared: asked.compared,
        interpolation: Interpolation {
            contact_threshold: data.contact_threshold,
        },
    };
    Ok(DrawnFigures {
        figures: cast.figures(&stage)?,
        left_out: Vec::new(),
        page: asked.page.then(|| cast.page(&stage)).transpose()?,
    })
}

/// Refuses rows, and models to set beside that were made for other features of the data.
fn check(asked: &FigureRequest<'_>) -> Result<(), ReportError> {
    asked.without_rows()?;
    let data = &asked.subject.config.data;
    for other in asked.compared {
        let theirs = &other.config.data;
        if (data.fps, data.features(), &data.mapping)
            != (theirs.fps, theirs.features(), &theirs.mapping)
        {
            return Err(ReportError::Refused(format!(
                "{} was made for data at another rate, or with another mapping, contact threshold \
                 or facing_sigma than {}: they cannot be compared",
                other.what, asked.subject.what
            )));
        }
    }
    Ok(())
}

/// The models of the figures.
struct Cast<'a> {
    /// The one that the figures are about.
    subject: &'a Subject,
    /// Those beside it in figures 11 and 12.
    compared: &'a [Subject],
    interpolation: Interpolation,
}

impl Cast<'_> {
    /// All figures, in their order.
    ///
    /// # Errors
    /// A model fails, a control does not fit, or there is nothing to draw.
    fn figures(&self, stage: &Stage) -> Result<Vec<Figure>, ReportError> {
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
    fn page(&self, stage: &Stage) -> Result<String, ReportError> {
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
        let mut given = self.compared.iter().chain([self.subject]);
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
