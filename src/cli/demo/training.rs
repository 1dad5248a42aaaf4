//! The demo's training, with its losses kept for the figure.

use std::io::Write as _;
use std::ops::ControlFlow;

use crate::cli::progress::Progress;
use crate::data::Dataset;
use crate::experiment::ExperimentConfig;
use crate::models::transition::TrainedModel;
use crate::report::thousands;
use crate::report::{FigureError, LossSeries, loss_curve};
use crate::run::RunFolder;
use crate::training::{StepReport, Trainer};

/// What a training was and what it began with.
pub struct Trained {
    pub losses: Losses,
    /// The model with its initial weights.
    pub untrained: TrainedModel,
}

/// Losses over a training: the total, then its terms.
pub struct Losses {
    series: Vec<LossSeries>,
    frame_steps: u64,
}

/// Trains to the end of the schedule and shows the progress on stderr.
pub fn train(
    config: &ExperimentConfig,
    dataset: &Dataset,
    threads: usize,
    run: &RunFolder,
) -> anyhow::Result<Trained> {
    let mut trainer = Trainer::new(config.clone(), dataset, threads)?;
    writeln!(
        std::io::stdout(),
        "a whole model with {} weights; {} steps, {} frame-steps on {threads} threads",
        thousands(trainer.parameters().weights() as u64),
        trainer.schedule().steps(),
        thousands(trainer.schedule().frame_steps())
    )?;
    let untrained = trainer.model();
    let mut progress = Progress::new(trainer.schedule(), 0);
    let mut losses = Losses {
        series: Vec::new(),
        frame_steps: 0,
    };
    let outcome = trainer.run(Some(run), &mut |report| {
        progress.step(report);
        losses.add(report);
        ControlFlow::Continue(())
    });
    drop(progress);
    outcome?;
    Ok(Trained { losses, untrained })
}

impl Losses {
    fn add(&mut self, report: &StepReport) {
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
