//! Generated dances with their music, for timings.

use super::config::{Audio, FeaturesConfig};
use super::windows::Contexts;
use crate::autograd::Parameters;
use crate::data::choreography::{
    ChoreographyConfig, by_name, dataset_with_music, generate_with_music,
};
use crate::data::{DataConfig, Dataset, Split};
use crate::models::{Generator, ModelError, Statistics, Step, Streams, Task, TaskSetting};

/// Frames a second of the columns.
const FPS: f64 = 20.0;
/// Frames a second of the generated dances.
const GENERATED_FPS: f64 = 30.0;

/// A data set of generated dances.
pub struct MadeUp {
    dataset: Dataset,
    data: DataConfig,
}

/// Dances that have a batch of windows, all to train on.
///
/// # Errors
/// More frames than can be generated.
pub fn made_up(contexts: Contexts, batch: usize, seed: u64) -> Result<MadeUp, ModelError> {
    let window = contexts.past() + contexts.future();
    let frames = ((window + batch) as f64 * GENERATED_FPS / FPS).ceil() as usize + 2;
    let dances = generate_with_music(&ChoreographyConfig {
        clips: 2,
        frames_per_clip: frames,
        seed,
    });
    let dances = by_name(dances.map_err(|error| ModelError::data(&error))?);
    let data = DataConfig {
        fps: FPS,
        split: Split::List {
            train: dances.keys().cloned().collect(),
            validation: Vec::new(),
            test: Vec::new(),
        },
        music: true,
        ..DataConfig::default()
    };
    let dataset = dataset_with_music(&dances, &data);
    let dataset = dataset.map_err(|error| ModelError::data(&error))?;
    Ok(MadeUp { dataset, data })
}

impl MadeUp {
    /// What may be read of them.
    pub fn features(&self) -> FeaturesConfig {
        FeaturesConfig {
            audio: Audio::Transflower85,
            ..FeaturesConfig::default()
        }
    }

    pub fn setting(&self, streams: Streams) -> TaskSetting<'_> {
        TaskSetting {
            dataset: &self.dataset,
            data: self.data.clone(),
            streams,
            start: None,
        }
    }
}

/// A task without an end: its steps are its first ones again and again.
pub struct Endless<T>(pub T);

impl<T: Task<f32>> Task<f32> for Endless<T> {
    fn steps(&self) -> u64 {
        u64::MAX
    }

    fn frame_steps(&self) -> u64 {
        u64::MAX
    }

    fn step(&self, step: u64) -> Box<dyn Step<f32> + '_> {
        self.0.step(step)
    }

    fn statistics(&self) -> Statistics {
        self.0.statistics()
    }

    fn generator(&self, name: &str, parameters: Parameters<f32>) -> Box<dyn Generator> {
        self.0.generator(name, parameters)
    }
}
