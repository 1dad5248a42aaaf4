//! Figure 13: cyclic motion as recorded and by several models, all on the recorded root.

use ndarray::s;

use super::check;
use super::root::row_with_paths;
use super::stage::{Generated, ShownWindow, Stage, positions};
use super::wording::mean;
use crate::evaluation::equations::foot_skate;
use crate::models::ModelError;
use crate::models::generator::Condition;
use crate::models::transition::DanceClip;
use crate::motion::features::{FACING, ROOT_POSITION};
use crate::report::figures::{DrawnFigures, Figure, FigureRequest, Numbers};
use crate::report::{MotionFigure, MotionRow, PathView, ReportError, Shown};
use crate::run::Subject;

/// Frames from one drawn dancer to the next.
const EVERY: usize = 5;
/// Frames from keyframe to keyframe, where none are asked for.
const LENGTH: usize = 50;

/// Draws figure 13.
///
/// # Errors
/// Models that were made for other features of the data cannot be compared; the shown clip is not
/// there; a model fails; a page is wanted.
pub fn draw(asked: &FigureRequest<'_>) -> Result<DrawnFigures, ReportError> {
    check(asked)?;
    if asked.page {
        let reason = "figure 13 has no page for --viewer; generate --viewer makes one";
        return Err(ReportError::Refused(reason.into()));
    }
    let features = asked.subject.config.data.features();
    let clips = DanceClip::measure_all(&asked.dataset.test, &features)
        .map_err(|error| ModelError::data(&error))?;
    let stage = Stage::new(
        &clips,
        &FigureRequest {
            length: Some(asked.length.unwrap_or(LENGTH)),
            ..*asked
        },
    )?;
    let models = asked.compared.iter().chain([asked.subject]);
    Ok(DrawnFigures {
        figures: vec![figure_13(&stage, models)?],
        left_out: Vec::new(),
        page: None,
    })
}

fn figure_13<'s>(
    stage: &Stage,
    models: impl Iterator<Item = &'s Subject>,
) -> Result<Figure, ReportError> {
    let mut numbers = Numbers::default();
    let shown = stage.shown();
    let truth = positions(shown.recorded.view());
    let mut rows = vec![MotionRow::between_keyframes("Ground truth", truth, false)];
    let mut said = Vec::new();
    let mut replaced = Vec::new();
    for subject in models {
        let name = &subject.config.name;
        let mut generated = stage.generate(subject.model.as_ref(), Ok)?;
        if !subject.model.needs().reads(Condition::RootTrajectory) {
            replaced.push(name.as_str());
            let windows = stage.windows().iter().zip(&mut generated);
            windows.for_each(|(window, generated)| take_recorded_root(generated, window));
        }
        let scores = stage.scores(name, &generated)?;
        let lrp = mean(scores.iter().map(|scores| scores.body_position));
        numbers.add(name, "LRP", lrp, "cm");
        let mut words = format!("{name} {lrp:.1} cm");
        if let Some(skate) = foot_skate(&scores) {
            numbers.add(name, "foot_skate", skate, "cm/frame");
            words += &format!(" and {skate:.2} cm/frame");
        }
        said.push(words);
        rows.push(row_with_paths(name, &generated[0], PathView::Above));
    }
    stage.count(&mut numbers);
    let replaced = match replaced[..] {
        [] => String::new(),
        _ => format!(
            " Place and facing of the root are the recorded ones for {}, which is not given them.",
            replaced.join(", ")
        ),
    };
    let caption = format!(
        "Figure 13. Cyclic motion as recorded and as generated, every {EVERY} frames; LRP and foot \
         skate {}: {}.{replaced}",
        stage.measured_on(),
        said.join(", ")
    );
    let title = format!("Figure 13: {}", shown.describe());
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Every(EVERY));
    Figure::of_dancers("figure_13", drawing, numbers)
}

/// Puts what a model generated onto the recorded root, as the paper does with a model that does not
/// control it.
fn take_recorded_root(generated: &mut Generated, window: &ShownWindow) {
    for columns in [ROOT_POSITION, FACING] {
        let recorded = window.recorded.slice(s![.., columns.clone()]);
        generated
            .frames
            .slice_mut(s![.., columns])
            .assign(&recorded);
    }
}
