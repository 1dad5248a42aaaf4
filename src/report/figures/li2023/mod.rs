//! Figures 3 to 10 of Li et al., drawn with trained models.

mod contacts;
mod methods;
mod stage;

use super::{DrawnFigures, FigureRequest};
use crate::models::Generator;
use crate::models::baselines::rotations::RotationBaseline;
use crate::report::ReportError;
use crate::run::Subject;
use stage::Stage;

/// Frames of figures 3 to 5 and 7 to 10 from keyframe to keyframe, where none are asked for.
const LENGTH: usize = 30;
/// Those of figure 6.
const SHORT: usize = 10;

/// Draws those figures whose models are there: figures 3 and 4 compare rows of table 2 by the names
/// of their configs.
///
/// # Errors
/// Models on other data cannot be compared; what is to be shown is not there; a model fails.
pub fn draw(asked: &FigureRequest<'_>) -> Result<DrawnFigures, ReportError> {
    if asked.page {
        return Err(ReportError::Refused(
            "--viewer shows Pan et al.'s transitions; write BVH with `keydance generate` for these \
             models"
                .into(),
        ));
    }
    asked.without_rows()?;
    let data = &asked.subject.config.data;
    for other in asked.compared {
        let theirs = &other.config.data;
        if (data.fps, data.contact_threshold, &data.mapping)
            != (theirs.fps, theirs.contact_threshold, &theirs.mapping)
        {
            return Err(ReportError::Refused(format!(
                "{} was made for data at another rate, or with another mapping or contact \
                 threshold than {}: they cannot be compared",
                other.what, asked.subject.what
            )));
        }
    }
    let frames = asked.length.unwrap_or(LENGTH) + 1;
    let short = SHORT + 1;
    let stage = Stage::new(asked, frames.max(short))?;
    let cast = Cast {
        subject: asked.subject,
        compared: asked.compared,
    };
    let model = asked.subject.model.as_ref();
    let mut figures = Vec::new();
    figures.extend(methods::figure_3(&stage, &cast, frames)?);
    figures.extend(methods::figure_4(&stage, &cast, frames)?);
    figures.push(methods::figure_5(&stage, &cast, frames)?);
    figures.push(methods::figure_6(&stage, &cast, short)?);
    figures.push(contacts::figure_7(&stage, model, frames)?);
    figures.push(contacts::figure_8(&stage, model, frames)?);
    figures.push(contacts::figure_9(&stage, asked.dataset, model, frames)?);
    figures.push(contacts::figure_10(&stage, asked.dataset, model, frames)?);
    Ok(DrawnFigures {
        figures,
        left_out: Vec::new(),
        page: None,
    })
}

/// The models of the figures.
struct Cast<'a> {
    /// The one that figures 7 to 10 are about.
    subject: &'a Subject,
    /// Those beside it.
    compared: &'a [Subject],
}

/// Rows that figures 3 and 4 alone compare.
const ABLATIONS: [&str; 4] = ["slerp", "mix_embedding", "contact_loss", "position_loss"];

impl Cast<'_> {
    /// Interpolation, those beside the subject that are no ablations, and the subject.
    fn methods(&self) -> Vec<(&str, &dyn Generator)> {
        let interpolation: &dyn Generator = &RotationBaseline::Slerp;
        let mut methods = vec![("Interpolation", interpolation)];
        let others = self.compared.iter().filter(|it| {
            let (name, kind) = (it.config.name.as_str(), it.config.model.kind());
            !ABLATIONS.contains(&name) && kind != "slerp"
        });
        for subject in others.chain([self.subject]) {
            methods.push((subject.config.name.as_str(), subject.model.as_ref()));
        }
        methods
    }

    /// The models whose configs have these names, with their labels; none where one is missing.
    fn called<'l, const N: usize>(
        &self,
        rows: [(&str, &'l str); N],
    ) -> Option<Vec<(&'l str, &dyn Generator)>> {
        let all = || self.compared.iter().chain([self.subject]);
        let found = rows.into_iter().map(|(name, label)| {
            let subject = all().find(|subject| subject.config.name == name)?;
            Some((label, subject.model.as_ref()))
        });
        found.collect()
    }
}
