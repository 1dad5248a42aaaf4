//! Curves over the course of a training: its losses, and its scores on validation clips.

use super::FigureError;
use super::chart::{Axis, Chart, Line, Scale};
use super::score_figure::metric_axis;
use crate::evaluation::Metric;

/// One line over the course of a training.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend, such as `L_rec`.
    pub name: String,
    /// `(frame-steps, value)`, ascending: predicted frames that the training had gone through, and
    /// the mean since the point before.
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
pub fn loss_curve(title: &str, series: &[Series]) -> Result<String, FigureError> {
    let lines = series.iter().enumerate().map(|(index, series)| Line {
        name: series.name.clone(),
        emphasised: index == 0,
        ..Line::plain(thinned(&series.points), index)
    });
    over_frame_steps(title, loss_axis(), lines.collect())
}

/// Draws the total losses of several trainings in the same way.
///
/// # Errors
///
/// As [`loss_curve`].
pub fn total_losses_curve(title: &str, series: &[Series]) -> Result<String, FigureError> {
    over_frame_steps(title, loss_axis(), one_each(series))
}

fn loss_axis() -> Axis {
    Axis {
        label: "loss (standardised units, log scale)".into(),
        scale: Scale::Logarithmic,
    }
}

/// A line for each training, thinned.
fn one_each(series: &[Series]) -> Vec<Line> {
    let lines = series.iter().enumerate().map(|(colour, series)| Line {
        name: series.name.clone(),
        emphasised: true,
        ..Line::plain(thinned(&series.points), colour)
    });
    lines.collect()
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

/// Draws a metric on validation clips over frame-steps, a line for each column of its table or for
/// each of several trainings.
///
/// # Errors
///
/// [`FigureError`]: no points, or a NaN or infinity.
pub fn validation_curve(
    title: &str,
    metric: &Metric,
    series: Vec<Series>,
) -> Result<String, FigureError> {
    let lines = series.into_iter().enumerate();
    let lines = lines.map(|(colour, series)| Line {
        name: series.name,
        dots: series.points.len() <= 30,
        emphasised: true,
        ..Line::plain(series.points, colour)
    });
    over_frame_steps(title, Axis::linear(&metric_axis(metric)), lines.collect())
}

/// Draws learning rates over frame-steps, a line for each training.
///
/// # Errors
///
/// [`FigureError`]: no points, or a NaN or infinity.
pub fn learning_rate_curve(title: &str, series: &[Series]) -> Result<String, FigureError> {
    over_frame_steps(title, Axis::linear("learning rate"), one_each(series))
}

fn over_frame_steps(title: &str, y: Axis, lines: Vec<Line>) -> Result<String, FigureError> {
    Chart {
        title: title.to_string(),
        caption: String::new(),
        x: Axis::linear("training (frame-steps)"),
        y,
        lines,
    }
    .svg()
}
