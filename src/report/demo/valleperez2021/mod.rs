//! The demo of Transflower: a small flow that is to dance on, each time anew, without freezing or
//! trembling.

mod goal;
mod showcase;

pub use goal::Goal;

use std::collections::BTreeMap;
use std::path::Path;

use super::{Demo, DemoOptions, Other, OtherScores, Verdict};
use crate::data::Dataset;
use crate::data::choreography::{
    ChoreographyConfig, DanceWithMusic, by_name, dataset_with_music, generate_with_music,
};
use crate::evaluation::ProtocolScores;
use crate::experiment::ExperimentConfig;
use crate::models::Generator;
use crate::models::settings::ValueError;
use crate::models::valleperez2021::ValleperezSettings;
use crate::report::ReportError;

const EXPERIMENT: &str = include_str!("../../../../experiments/demo_valleperez2021.toml");
/// What is shown: dances to one song from one seed, the song, the dance that the seed is from, the
/// page.
const DANCES: [&str; 3] = ["dance_1.bvh", "dance_2.bvh", "dance_3.bvh"];
const SONG: &str = "song.wav";
const RECORDED: &str = "recorded.bvh";
const VIEWER: &str = "viewer.html";

/// Dances and training.
struct ValleperezDemo {
    choreography: ChoreographyConfig,
    experiment: ExperimentConfig,
}

/// The demo.
///
/// # Errors
/// The fraction is not a share.
pub fn open(options: &DemoOptions) -> Result<Box<dyn Demo>, ReportError> {
    let mut experiment =
        ExperimentConfig::parse(EXPERIMENT, "experiments/demo_valleperez2021.toml")?;
    let (clips, frames_per_clip) = if options.reduced {
        (12, 450)
    } else {
        (24, 900)
    };
    let fraction = options.fraction.or(options.reduced.then_some(0.1));
    let fraction = fraction.unwrap_or(1.0);
    let is_share = fraction > 0.0 && fraction <= 1.0;
    let expected = "above 0 and at most 1";
    ValueError::unless(is_share, "schedule.steps", fraction, expected)
        .map_err(ReportError::Fraction)?;
    if let Some(settings) = experiment.model.downcast_mut::<ValleperezSettings>() {
        let steps = &mut settings.schedule.steps;
        *steps = (*steps as f64 * fraction).ceil() as u64;
    }
    Ok(Box::new(ValleperezDemo {
        choreography: ChoreographyConfig {
            clips,
            frames_per_clip,
            seed: 1,
        },
        experiment,
    }))
}

impl ValleperezDemo {
    fn dances(&self) -> Result<BTreeMap<String, DanceWithMusic>, ReportError> {
        Ok(by_name(generate_with_music(&self.choreography)?))
    }
}

impl Demo for ValleperezDemo {
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
        Ok(dataset_with_music(&self.dances()?, &self.experiment.data)?)
    }

    fn others(&self, _untrained: Box<dyn Generator>) -> Vec<Other> {
        Vec::new()
    }

    fn protocol(&self) -> Option<&'static str> {
        Some("sampled_dance")
    }

    fn metrics(&self) -> &'static [&'static str] {
        &[
            "fpd",
            "fpd_real",
            "fpd_mean_pose",
            "fmd",
            "fmd_real",
            "freezing",
            "divergence",
            "diversity",
            "diversity_real",
            "step",
            "step_real",
            "kinematic_beats",
            "kinematic_beats_real",
        ]
    }

    fn files(&self) -> &'static [&'static str] {
        &[DANCES[0], DANCES[1], DANCES[2], SONG, RECORDED, VIEWER]
    }

    fn show(
        &self,
        model: &dyn Generator,
        dataset: &Dataset,
        folder: &Path,
    ) -> Result<String, ReportError> {
        let mut dances = self.dances()?;
        let first = dataset.test.first();
        let recorded = first.and_then(|first| dances.remove(first.name()));
        let none = || ReportError::Refused("there is no test clip to show".into());
        showcase::write(&recorded.ok_or_else(none)?, model, &self.experiment, folder)
    }

    fn verdict(&self, model: &ProtocolScores, _others: &OtherScores) -> Verdict {
        let goal = Goal::of(model);
        Verdict {
            reached: goal.is_reached(),
            numbers: goal.to_string(),
            missed: "dances freeze, leave all that was danced, tremble, or repeat themselves",
        }
    }
}
