//! The losses of a training, kept for a figure.

use crate::report::{FigureError, LossSeries, loss_curve, thousands};
use crate::training::StepReport;

/// Losses over a training: the total, then its terms.
#[derive(Debug, Default)]
pub struct Losses {
    series: Vec<LossSeries>,
    frame_steps: u64,
}

impl Losses {
    /// Keeps a step.
    pub fn add(&mut self, report: &StepReport) {
        let values = [("total", report.total)];
        let values = values.into_iter().chain(report.losses.iter().copied());
        for (index, (name, loss)) in values.enumerate() {
            if index == self.series.len() {
                self.series.push(LossSeries {
                    name: name.into(),
                    points: Vec::new(),
                });
            }
            self.series[index]
                .points
                .push((report.frame_steps as f64, loss));
        }
        self.frame_steps = report.frame_steps;
    }

    /// The loss curve, SVG.
    ///
    /// # Errors
    /// There is no loss to draw.
    pub fn figure(&self) -> Result<String, FigureError> {
        let title = format!(
            "Losses of the demo, {} frame-steps",
            thousands(self.frame_steps)
        );
        loss_curve(&title, &self.series)
    }
}
