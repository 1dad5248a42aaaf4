//! The demo of Pu and Shan: a small model that is to keep to its key poses and to the beat.

mod goal;
mod showcase;

pub use goal::Goal;

use std::path::Path;

use super::{Demo, DemoOptions, Other, OtherScores, Verdict};
use crate::data::Dataset;
use crate::data::choreography::{
    ChoreographyConfig, by_name, clips_with_music, dataset_with_music, generate_with_music,
};
use crate::evaluation::ProtocolScores;
use crate::experiment::ExperimentConfig;
use crate::models::Generator;
use crate::models::baselines::rotations::RotationBaseline;
use crate::models::pu2022::Pu2022Settings;
use crate::models::settings::ValueError;
use crate::report::{NO_TRAINING, ReportError};

const EXPERIMENT: &str = include_str!("../../../../experiments/demo_pu2022.toml");
const HOLD: &str = "hold.json";
const INTERPOLATION: &str = "interpolation.json";
/// What is shown: the model's dance, its song, the dance that it begins as, the page.
const DANCE: &str = "dance.bvh";
const SONG: &str = "song.wav";
const RECORDED: &str = "recorded.bvh";
const VIEWER: &str = "viewer.html";

/// Dances and training.
struct Pu2022Demo {
    choreography: ChoreographyConfig,
    experiment: ExperimentConfig,
}

/// The demo.
///
/// # Errors
/// The fraction is not a share.
pub fn open(options: &DemoOptions) -> Result<Box<dyn Demo>, ReportError> {
    let mut experiment = ExperimentConfig::parse(EXPERIMENT, "experiments/demo_pu2022.toml")?;
    let (clips, frames_per_clip) = if options.reduced {
        (12, 450)
    } else {
        (200, 900)
    };
    let fraction = options.fraction.or(options.reduced.then_some(0.1));
    let fraction = fraction.unwrap_or(1.0);
    let is_share = fraction > 0.0 && fraction <= 1.0;
    let expected = "above 0 and at most 1";
    ValueError::unless(is_share, "schedule.steps", fraction, expected)
        .map_err(ReportError::Fraction)?;
    if let Some(settings) = experiment.model.downcast_mut::<Pu2022Settings>() {
        let steps = &mut settings.schedule.steps;
        *steps = (*steps as f64 * fraction).ceil() as u64;
    }
    Ok(Box::new(Pu2022Demo {
        choreography: ChoreographyConfig {
            clips,
            frames_per_clip,
            seed: 1,
        },
        experiment,
    }))
}

impl Demo for Pu2022Demo {
    fn choreography(&self) -> &ChoreographyConfig {
        &self.choreography
    }

    fn experiment(&self) -> &ExperimentConfig {
        &self.experiment
    }

    fn model_title(&self) -> &'static str {
        "small model"
    }

    fn dataset(&self) -> Result<Dataset, ReportError> {
        let dances = by_name(generate_with_music(&self.choreography)?);
        Ok(dataset_with_music(&dances, &self.experiment.data)?)
    }

    fn others(&self, _untrained: Box<dyn Generator>) -> Vec<Other> {
        let other = |title, file, model: RotationBaseline| Other {
            title,
            file,
            note: NO_TRAINING,
            model: Box::new(model),
        };
        vec![
            other("hold", HOLD, RotationBaseline::HeldSeed),
            other(
                "interpolation",
                INTERPOLATION,
                RotationBaseline::KeyPoseInterpolation,
            ),
        ]
    }

    fn metrics(&self) -> &'static [&'static str] {
        &[
            "consistency",
            "key_pose_error",
            "position_error",
            "jerk",
            "jerk_real",
            "beat_hit_rate",
            "beat_hit_rate_shifted",
            "beat_hit_rate_real",
            "beat_hit_rate_chance",
        ]
    }

    fn files(&self) -> &'static [&'static str] {
        &[HOLD, INTERPOLATION, DANCE, SONG, RECORDED, VIEWER]
    }

    fn show(
        &self,
        model: &dyn Generator,
        dataset: &Dataset,
        folder: &Path,
    ) -> Result<String, ReportError> {
        let first = dataset.test.first();
        let mut dances = clips_with_music(&self.choreography)?;
        let recorded = first.and_then(|first| dances.find(|it| it.dance.clip.name == first.name()));
        let none = || ReportError::Refused("there is no test clip to show".into());
        showcase::write(&recorded.ok_or_else(none)?, model, &self.experiment, folder)
    }

    fn verdict(&self, model: &ProtocolScores, others: &OtherScores) -> Verdict {
        let goal = Goal::of(model, &others.of(HOLD));
        Verdict {
            reached: goal.is_reached(),
            numbers: goal.to_string(),
            missed: "the trained model does not keep to its key poses twice as well as a held pose, \
                     or its beats hit those of the music no more often than by chance",
        }
    }
}
