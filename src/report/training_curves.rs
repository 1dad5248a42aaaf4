//! Curves over the course of a training: its losses, and its scores on validation clips.

use super::FigureError;
use super::chart::{Axis, Chart, Line, Scale};
use super::score_figure::metric_axis;
use crate::evaluation::Metric;

/// The total loss or one of its terms.
#[derive(Debug, Clone, PartialEq)]
pub struct LossSeries {
    /// Its name in the legend, such as `L_rec`.
    pub name: String,
    /// `(frame-steps, loss)`: predicted frames that the training had gone through, and the mean
    /// loss since the point before.
    pub points: Vec<(f64, f64)>,
}

/// At most this many points of a line are drawn; more are averaged in equal runs.
const POINTS: usize = 300;

/// Draws losses over frame-steps, the first series as the total; the loss axis is logarithmic, and
/// a loss of 0 has no place on it.
///
/// `title` stands above, such as "whole_model, 1.2 M frame-steps".
///
/// # Errors
///
/// [`FigureError`]: no positive loss at all, or one that is NaN or infinite.
pub fn loss_curve(title: &str, series: &[LossSeries]) -> Result<String, FigureError> {
    let lines = series.iter().enumerate().map(|(index, series)| Line {
        name: series.name.clone(),
        emphasised: index == 0,
        ..Line::plain(thinned(&series.points), index)
    });
    Chart {
        title: title.to_string(),
        caption: String::new(),
        x: Axis::linear("training (frame-steps)"),
        y: Axis {
            label: "loss (standardised units, log scale)".into(),
            scale: Scale::Logarithmic,
        },
        lines: lines.collect(),
    }
    .svg()
}

/// Means of equal runs of points, at most [`POINTS`] of them.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    points
        .chunks(points.len().div_ceil(POINTS).max(1))
        .map(|run| {
            let mean = |of: fn(&(f64, f64)) -> f64| {
                let sum: f64 = run.iter().map(of).sum();
                sum / run.len() as f64
            };
            (mean(|point| point.0), mean(|point| point.1))
        })
        .collect()
}

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
