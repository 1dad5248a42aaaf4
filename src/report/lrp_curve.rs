//! LRP over the transition length, for several models.

use super::FigureError;
use super::chart::{Axis, Chart, Line};

/// LRP of one model at each transition length.
#[derive(Debug, Clone, PartialEq)]
pub struct LrpSeries {
    /// The model's name.
    pub name: String,
    /// `(N in frames, LRP in cm)`, ascending in N: ours.
    pub ours: Vec<(f64, f64)>,
    /// Likewise what the paper prints of this model, drawn dashed in the same colour; empty where it prints nothing.
    pub paper: Vec<(f64, f64)>,
}

/// Draws LRP (cm, eq. 12) over the transition length N (frames).
///
/// # Errors
///
/// [`FigureError`]: no points, or a NaN or infinity.
pub fn lrp_curve(title: &str, models: &[LrpSeries]) -> Result<String, FigureError> {
    let mut lines = Vec::new();
    for (colour, model) in models.iter().enumerate() {
        for (points, dashed) in [(&model.ours, false), (&model.paper, true)] {
            if points.is_empty() {
                continue;
            }
            let paper = if dashed { ", paper" } else { "" };
            lines.push(Line {
                name: format!("{}{paper}", model.name),
                points: points.clone(),
                emphasised: !dashed,
                dashed,
                dots: true,
                colour,
            });
        }
    }
    Chart {
        title: title.to_string(),
        caption: String::new(),
        x: Axis::linear("transition length N (frames at 30 fps)"),
        y: Axis::linear("LRP (cm), lower is better"),
        lines,
    }
    .svg()
}
