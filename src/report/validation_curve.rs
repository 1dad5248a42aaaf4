//! A metric over the course of a training: whether more of it would still help.

use super::FigureError;
use super::chart::{Axis, Chart, Line};
use super::score_figure::metric_axis;
use crate::evaluation::Metric;

/// Draws a metric on validation clips over frame-steps: for each column of its table, such as a
/// length N in frames, a line through `(frame-steps, score)`, ascending in frame-steps.
///
/// # Errors
///
/// [`FigureError`]: no points, or a NaN or infinity.
pub fn validation_curve(
    title: &str,
    metric: &Metric,
    columns: Vec<(&str, Vec<(f64, f64)>)>,
) -> Result<String, FigureError> {
    let lines = columns.into_iter().enumerate();
    let lines = lines.map(|(colour, (column, points))| Line {
        name: format!("N = {column}"),
        dots: points.len() <= 30,
        emphasised: true,
        ..Line::plain(points, colour)
    });
    Chart {
        title: title.to_string(),
        caption: String::new(),
        x: Axis::linear("training (frame-steps)"),
        y: Axis::linear(&metric_axis(metric)),
        lines: lines.collect(),
    }
    .svg()
}
