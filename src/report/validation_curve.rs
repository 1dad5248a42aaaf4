//! A metric over the course of a training: whether more of it would still help.

use super::FigureError;
use super::chart::{Axis, Chart, Line};
use super::score_figure::metric_axis;
use crate::evaluation::Metric;

/// Scores in one column of a metric's table.
#[derive(Debug, Clone, PartialEq)]
pub struct ValidationSeries {
    /// Such as a transition length N, frames.
    pub column: String,
    /// `(frame-steps, score)`, ascending in frame-steps.
    pub points: Vec<(f64, f64)>,
}

/// Draws a metric on validation clips over frame-steps, a line for each column.
///
/// # Errors
///
/// [`FigureError`]: no points, or a NaN or infinity.
pub fn validation_curve(
    title: &str,
    metric: &Metric,
    columns: &[ValidationSeries],
) -> Result<String, FigureError> {
    let lines = columns.iter().enumerate().map(|(index, series)| Line {
        name: format!("N = {}", series.column),
        points: series.points.clone(),
        emphasised: true,
        dashed: false,
        dots: series.points.len() <= 30,
        colour: index,
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
