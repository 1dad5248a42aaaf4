//! Figures 11 and 12: several models on the same transition.

use super::root::{root_distance, row_with_paths};
use super::stage::{Generated, Stage, positions};
use super::wording::mean;
use crate::evaluation::equations::WindowScores;
use crate::motion::placement::world_positions;
use crate::report::figures::{Figure, Numbers};
use crate::report::{MotionFigure, MotionRow, PathView, Placing, ReportError, Shown};

/// Frames from one drawn dancer to the next.
const EVERY: usize = 10;

/// What a model makes of the windows under the clips' own controls.
pub struct Entry {
    pub name: String,
    /// Whether it stands in figure 11: a model without training, whose root is the target itself,
    /// does not unless it is what the figures are about.
    pub drawn_with_root: bool,
    pub generated: Vec<Generated>,
}

/// Figure 11: motions and root trajectories of the models.
pub fn figure_11(stage: &Stage, entries: &[Entry]) -> Result<Figure, ReportError> {
    let mut numbers = Numbers::default();
    let mut rows = Vec::new();
    let mut said = Vec::new();
    for Entry {
        name, generated, ..
    } in entries.iter().filter(|entry| entry.drawn_with_root)
    {
        rows.push(row_with_paths(name, &generated[0], PathView::Above));
        let distance = mean(generated.iter().map(root_distance));
        numbers.add(name, "root_distance_mean", distance, "cm");
        let shown = root_distance(&generated[0]);
        numbers.add(name, "root_distance_of_shown", shown, "cm");
        said.push(format!("{name} {distance:.1} cm"));
    }
    stage.count(&mut numbers);
    let alone = match rows.len() {
        0 | 1 => " No other trained run was given to compare with (--compare).",
        _ => "",
    };
    let caption = format!(
        "Figure 11. Motion and root trajectory of models on one transition, every {EVERY} frames; \
         mean distance of the root from its target {}: {}.{alone}",
        stage.measured_on(),
        said.join(", ")
    );
    let title = format!("Figure 11: {}", stage.shown().describe());
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Every(EVERY));
    Figure::of_dancers("figure_11", drawing, numbers)
}

/// Figure 12: the recorded motion and every model's.
pub fn figure_12(stage: &Stage, entries: &[Entry]) -> Result<Figure, ReportError> {
    let mut numbers = Numbers::default();
    let recorded = positions(stage.shown().recorded.view());
    let recorded = MotionRow::between_keyframes("Ground truth", recorded, false);
    let mut rows = vec![recorded];
    let mut said = Vec::new();
    for Entry {
        name, generated, ..
    } in entries
    {
        rows.push(generated[0].row(name));
        let scores = stage.scores(name, generated)?;
        let of = |score: fn(&WindowScores) -> f64| mean(scores.iter().map(score));
        let lrp = of(|scores| scores.body_position);
        numbers.add(name, "LRP", lrp, "cm");
        let factors = of(|scores| scores.velocity_factor);
        numbers.add(name, "velocity_factor_error", factors, "cm/frame");
        numbers.add(name, "root_distance", of(|scores| scores.root), "cm");
        let missed = mean(generated.iter().map(keyframe_miss));
        numbers.add(name, "keyframe_miss", missed, "cm");
        said.push(format!("{name} {lrp:.1} and {missed:.1} cm"));
    }
    stage.count(&mut numbers);
    let caption = format!(
        "Figure 12. One transition as recorded and as generated, every {EVERY} frames; LRP, and \
         mean joint distance from the keyframe at its frame, {}: {}.",
        stage.measured_on(),
        said.join(", ")
    );
    let drawing = MotionFigure {
        title: format!("Figure 12: {}", stage.shown().describe()),
        caption,
        rows,
        shown: Shown::Every(EVERY),
        placing: Placing::OnFirstPath,
        music: None,
    };
    Figure::of_dancers("figure_12", drawing, numbers)
}

/// Mean distance of the last predicted frame's joints from the keyframe's, cm.
fn keyframe_miss(generated: &Generated) -> f64 {
    let given = &generated.request.keyframes;
    let wanted = world_positions(given[given.len() - 1].keyframe.features.view());
    let frames = &generated.frames;
    let last = world_positions(frames.row(frames.nrows() - 1));
    mean(last.iter().zip(wanted).map(|(a, b)| a.distance(b)))
}
