//! LRP over the course of a training: whether more of it would still help.

use super::FigureError;
use super::chart::{Axis, Chart, Line};

/// LRP at one transition length.
#[derive(Debug, Clone, PartialEq)]
pub struct ValidationSeries {
    /// N, frames.
    pub length: usize,
    /// `(frame-steps, LRP in cm)`, ascending in frame-steps.
    pub points: Vec<(f64, f64)>,
}

/// Draws LRP (cm, eq. 12) on validation clips over frame-steps, a line for each transition length.
///
/// # Errors
///
/// [`FigureError`]: no points, or a NaN or infinity.
pub fn validation_curve(title: &str, lengths: &[ValidationSeries]) -> Result<String, FigureError> {
    let lines = lengths.iter().enumerate().map(|(index, series)| Line {
        name: format!("N = {}", series.length),
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
        y: Axis::linear("LRP (cm), lower is better"),
        lines: lines.collect(),
    }
    .svg()
}
