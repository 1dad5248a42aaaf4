//! The losses of a training, kept for a figure.

use crate::report::{FigureError, Series, loss_curve, thousands};
use crate::training::StepReport;

/// Losses over a training: the total, then its terms.
#[derive(Debug, Default)]
pub struct Losses {
    series: Vec<Series>,
    frame_steps: u64,
}

impl Losses {
    /// Keeps a step.
    pub fn add(&mut self, report: &StepReport) {
        let total = std::iter::once(("total", report.total));
        for (index, (name, loss)) in total.chain(report.losses.iter().copied()).enumerate() {
            if index == self.series.len() {
                let (name, points) = (name.into(), Vec::new());
                self.series.push(Series { name, points });
            }
            let points = &mut self.series[index].points;
            points.push((report.frame_steps as f64, loss));
        }
        self.frame_steps = report.frame_steps;
    }

    /// The loss curve, SVG.
    ///
    /// # Errors
    /// There is no loss to draw.
    pub fn figure(&self) -> Result<String, FigureError> {
        let frame_steps = thousands(self.frame_steps);
        let title = format!("Losses of the demo, {frame_steps} frame-steps");
        loss_curve(&title, &self.series)
    }
}
