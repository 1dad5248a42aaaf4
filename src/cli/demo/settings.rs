//! What the demo generates and trains.

use anyhow::Context as _;

use crate::data::choreography::ChoreographyConfig;
use crate::experiment::ExperimentConfig;

const EXPERIMENT: &str = include_str!("../../../experiments/demo.toml");

/// Clips and training of a demo.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    pub choreography: ChoreographyConfig,
    pub experiment: ExperimentConfig,
}

impl Settings {
    /// The demo's settings; `reduced` to about a seventh of the training, and `fraction` in place of the schedule's own.
    ///
    /// # Errors
    /// The fraction is not a share.
    pub fn new(reduced: bool, fraction: Option<f64>) -> anyhow::Result<Self> {
        let mut experiment = ExperimentConfig::parse(EXPERIMENT, "experiments/demo.toml")?;
        // 24 clips of half a minute: four of each style.
        let mut choreography = ChoreographyConfig {
            clips: 24,
            frames_per_clip: 900,
            seed: 1,
        };
        if reduced {
            (choreography.clips, choreography.frames_per_clip) = (12, 450);
            experiment.schedule.fraction = 0.1;
        }
        if let Some(fraction) = fraction {
            experiment.schedule.fraction = fraction;
            experiment
                .validate()
                .context("--fraction is not a share of the schedule")?;
        }
        Ok(Self {
            choreography,
            experiment,
        })
    }
}
