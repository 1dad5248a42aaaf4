//! What the demo generates and trains.

use crate::counted::counted;
use crate::data::choreography::{ChoreographyConfig, generate};
use crate::data::{Dataset, Recording};
use crate::experiment::ExperimentConfig;
use crate::models::transition::TransitionSettings;
use crate::report::{ReportError, thousands};

const EXPERIMENT: &str = include_str!("../../../experiments/demo.toml");

/// Clips and training of a demo.
#[derive(Debug, Clone, PartialEq)]
pub struct DemoSettings {
    pub choreography: ChoreographyConfig,
    pub experiment: ExperimentConfig,
}

impl DemoSettings {
    /// The demo's settings; `reduced` to about a seventh of the training, and `fraction` in place
    /// of the schedule's own.
    ///
    /// # Errors
    /// The fraction is not a share.
    pub fn new(reduced: bool, fraction: Option<f64>) -> Result<Self, ReportError> {
        let mut experiment = ExperimentConfig::parse(EXPERIMENT, "experiments/demo.toml")?;
        // 24 clips of half a minute: four of each style.
        let (clips, frames_per_clip) = if reduced { (12, 450) } else { (24, 900) };
        let fraction = fraction.or(reduced.then_some(0.1));
        if let Some(settings) = TransitionSettings::of_mut(&mut experiment) {
            let schedule = &mut settings.schedule;
            schedule.fraction = fraction.unwrap_or(schedule.fraction);
        }
        experiment.validate().map_err(ReportError::Fraction)?;
        Ok(Self {
            choreography: ChoreographyConfig {
                clips,
                frames_per_clip,
                seed: 1,
            },
            experiment,
        })
    }

    /// The data in words.
    pub fn summary(&self, dataset: &Dataset) -> String {
        let of = |clips: &[Recording]| {
            let frames: usize = clips.iter().map(Recording::frames).sum();
            (clips.len(), thousands(frames as u64))
        };
        let ((train, frames), (test, test_frames)) = (of(&dataset.train), of(&dataset.test));
        format!(
            "{} to train on ({frames} frames), {test} to test on ({test_frames} frames), generated \
             from seed {}",
            counted(train, "clip"),
            self.choreography.seed
        )
    }

    /// What the scores are on, for a caption.
    pub(super) fn subject(&self, dataset: &Dataset) -> String {
        let choreography = &self.choreography;
        format!(
            "{} of {} of {} (seed {})",
            dataset.test.len(),
            counted(choreography.clips, "generated clip"),
            counted(choreography.frames_per_clip, "frame"),
            choreography.seed
        )
    }

    /// The generated clips, split as the experiment says.
    ///
    /// # Errors
    /// The clips cannot be generated or measured.
    pub fn dataset(&self) -> Result<Dataset, ReportError> {
        let clips = generate(&self.choreography)?;
        let clips = clips.into_iter().map(|generated| generated.clip).collect();
        Ok(Dataset::from_clips(clips, &self.experiment.data)?)
    }
}
