//! The demo of Pan et al.: a small whole model that is to be ahead of interpolation and of the linear
//! estimate which it begins with.

mod comparison;
mod showcase;

pub use comparison::Comparison;

use std::path::Path;

use super::{Demo, DemoOptions, Other, OtherScores, Verdict};
use crate::data::choreography::{ChoreographyConfig, generate};
use crate::data::{DataError, Dataset};
use crate::evaluation::ProtocolScores;
use crate::experiment::ExperimentConfig;
use crate::models::Generator;
use crate::models::baselines::interpolation::Interpolation;
use crate::models::transition::{DanceClip, TransitionSettings};
use crate::report::{NO_TRAINING, ReportError};
use showcase::Showcase;

const EXPERIMENT: &str = include_str!("../../../../experiments/demo.toml");
/// Name of the file with the transition that is shown.
const TRANSITION: &str = "transition.bvh";
const FIGURE: &str = "motion.svg";
const VIEWER: &str = "viewer.html";
const INTERPOLATION: &str = "interpolation.json";
const UNTRAINED: &str = "untrained.json";

/// Clips and training.
struct Pan2021Demo {
    choreography: ChoreographyConfig,
    experiment: ExperimentConfig,
}

/// The demo; reduced to about a seventh of the training.
///
/// # Errors
/// The fraction is not a share.
pub fn open(options: &DemoOptions) -> Result<Box<dyn Demo>, ReportError> {
    let mut experiment = ExperimentConfig::parse(EXPERIMENT, "experiments/demo.toml")?;
    // 24 clips of half a minute: four of each style.
    let (clips, frames_per_clip) = if options.reduced {
        (12, 450)
    } else {
        (24, 900)
    };
    let fraction = options.fraction.or(options.reduced.then_some(0.1));
    if let Some(settings) = TransitionSettings::of_mut(&mut experiment) {
        let schedule = &mut settings.schedule;
        schedule.fraction = fraction.unwrap_or(schedule.fraction);
    }
    experiment.validate().map_err(ReportError::Fraction)?;
    Ok(Box::new(Pan2021Demo {
        choreography: ChoreographyConfig {
            clips,
            frames_per_clip,
            seed: 1,
        },
        experiment,
    }))
}

impl Pan2021Demo {
    fn interpolation(&self) -> Interpolation {
        Interpolation {
            contact_threshold: self.experiment.data.contact_threshold,
        }
    }
}

impl Demo for Pan2021Demo {
    fn choreography(&self) -> &ChoreographyConfig {
        &self.choreography
    }

    fn experiment(&self) -> &ExperimentConfig {
        &self.experiment
    }

    fn model_title(&self) -> &'static str {
        "small whole model"
    }

    fn dataset(&self) -> Result<Dataset, ReportError> {
        let clips = generate(&self.choreography)?;
        let clips = clips.into_iter().map(|generated| generated.clip).collect();
        Ok(Dataset::from_clips(clips, &self.experiment.data)?)
    }

    fn others(&self, untrained: Box<dyn Generator>) -> Vec<Other> {
        vec![
            Other {
                title: "interpolation",
                file: INTERPOLATION,
                note: NO_TRAINING,
                model: Box::new(self.interpolation()),
            },
            Other {
                title: "linear estimate",
                file: UNTRAINED,
                note: "the small whole model before its training",
                model: untrained,
            },
        ]
    }

    fn files(&self) -> &'static [&'static str] {
        &[INTERPOLATION, UNTRAINED, TRANSITION, FIGURE, VIEWER]
    }

    fn show(
        &self,
        model: &dyn Generator,
        dataset: &Dataset,
        folder: &Path,
    ) -> Result<String, ReportError> {
        let clips = DanceClip::measure_all(&dataset.test, &self.experiment.data.features());
        let clips = clips.map_err(DataError::from)?;
        let showcase = Showcase::new(&clips)?;
        let motion = showcase.write(&self.interpolation(), model, folder)?;
        Ok(format!(
            "{TRANSITION}: {showcase}; its rotations meet the predicted positions to {:.1} cm in the \
             mean, {:.1} cm at most",
            motion.mean_error, motion.max_error
        ))
    }

    fn verdict(&self, model: &ProtocolScores, others: &OtherScores) -> Verdict {
        let comparison = Comparison {
            interpolation: others.of(INTERPOLATION),
            untrained: others.of(UNTRAINED),
            model: model.clone(),
        };
        Verdict {
            reached: comparison.is_ahead(),
            numbers: comparison.to_string(),
            missed: "the trained model is not ahead of interpolation and of its own beginning at \
                     long transitions",
        }
    }
}
