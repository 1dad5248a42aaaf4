//! A trained network as a generator: its state runs over the seed, then each frame is sampled.

use std::sync::Arc;

use ndarray::{Array2, Axis, concatenate, s};
use rand_chacha::ChaCha8Rng;

use super::config::{MoglowConfig, MoglowSettings};
use super::flow::{Moglow2020, SequenceBatch, States};
use super::task::{Sequence, sequence_batch};
use crate::autograd::Parameters;
use crate::models::dance_features::{DanceFeatures, GenerationConfig, GivenDance, SampledFrames};
use crate::models::flow::noise_like;
use crate::models::generator::{Condition, Motion, NeededPoses, Needs, Request, Sampling};
use crate::models::inference::Inference;
use crate::models::settings::LoadError;
use crate::models::weights::SavedWeights;
use crate::models::{Generator, ModelError, Statistics, Streams};
use crate::music::FeatureSet;

/// Frames that a likelihood is of, as many as Transflower's.
const PREDICTED: usize = 3;

/// What the numbers of a network are about.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    pub features: DanceFeatures,
    model: MoglowConfig,
    generation: GenerationConfig,
}

impl Reference {
    pub fn new(features: DanceFeatures, settings: &MoglowSettings) -> Self {
        Self {
            features,
            model: settings.model.clone(),
            generation: settings.generation.clone(),
        }
    }

    pub fn statistics(&self) -> Statistics {
        self.features.statistics(Statistics::default())
    }

    /// That of saved statistics.
    ///
    /// # Errors
    /// They are not there, or do not fit together.
    pub fn saved(saved: &SavedWeights, settings: &MoglowSettings) -> Result<Self, LoadError> {
        let features = DanceFeatures::saved(saved, &settings.features)?;
        Ok(Self::new(features, settings))
    }
}

/// A trained network, in f32.
pub struct TrainedMoglow {
    network: Arc<Moglow2020>,
    weights: Inference,
    reference: Reference,
}

/// A dance as far as it is made.
struct Dance<'r> {
    given: GivenDance<'r>,
    frames: SampledFrames,
    states: States<f32>,
    rng: ChaCha8Rng,
    wanted: usize,
}

impl TrainedMoglow {
    pub(super) fn new(
        name: &str,
        network: Arc<Moglow2020>,
        parameters: Parameters<f32>,
        reference: Reference,
    ) -> Self {
        Self {
            network,
            weights: Inference::new(name, parameters),
            reference,
        }
    }

    /// What runs through the state before frame `end` of a dance whose motion is `motion`.
    fn run_up(
        &self,
        motion: &Array2<f32>,
        audio: &GivenDance<'_>,
        end: usize,
    ) -> SequenceBatch<f32> {
        let model = &self.reference.model;
        let rows = model.motion_past - model.audio_past..end - 1 + model.audio_future;
        let audio = audio.music_at(rows);
        let sequence = Sequence {
            known: motion.clone(),
            motion: motion.clone(),
            audio: audio.view(),
        };
        sequence_batch(model, &[sequence], end - model.motion_past, 1)
    }

    fn begin<'r>(&self, request: &'r Request) -> Result<Dance<'r>, ModelError> {
        request.check(self.name(), &self.needs())?;
        let Reference {
            features,
            model,
            generation,
        } = &self.reference;
        let seed = model.motion_context;
        let given = features.given(request, seed)?;
        let needed = request.frames + model.audio_future - 1;
        given.check_music(self.name(), needed, generation.pad_audio)?;
        let states = match seed > model.motion_past {
            true => {
                let batch = self.run_up(&given.motion, &given, seed);
                let run = self
                    .weights
                    .run(|tape| self.network.log_densities(tape, &batch, 0))?;
                run.1
            }
            false => self.network.start_states(1),
        };
        Ok(Dance {
            frames: SampledFrames::after(given.motion.view()),
            given,
            states,
            rng: Streams::new(request.seed).stream("dance", &[]),
            wanted: request.frames,
        })
    }

    fn go_on(&self, request: usize, dance: &mut Dance<'_>) -> Result<(), ModelError> {
        let Reference {
            features,
            model,
            generation,
        } = &self.reference;
        let at = dance.frames.len();
        let known = dance.frames.last(model.motion_past);
        let heard = at - model.audio_past..at + model.audio_future;
        let audio = dance.given.music_at(heard);
        let numbers: Vec<f32> = known.iter().chain(audio.iter()).copied().collect();
        let condition = Array2::from_shape_vec((1, numbers.len()), numbers)
            .map_err(|error| ModelError::data(&error))?;
        let z = noise_like(
            &mut dance.rng,
            (1, features.widths().0),
            generation.temperature,
        );
        let states = &mut dance.states;
        let x = self
            .weights
            .run(|tape| self.network.sample(tape, &z, &condition, states))?;
        let frame = x.index_axis(Axis(0), 0);
        dance.frames.push(
            (self.name(), request),
            frame,
            generation.clamp,
            &features.columns,
        )
    }
}

impl Generator for TrainedMoglow {
    fn name(&self) -> &str {
        self.weights.model()
    }

    fn needs(&self) -> Needs {
        Needs {
            poses: NeededPoses::Seed(self.reference.model.motion_context),
            conditions: &[],
            heeds: &[Condition::Music],
        }
    }

    fn music_features(&self) -> FeatureSet {
        self.reference.features.music_features()
    }

    fn reads_given_music(&self) -> bool {
        self.reference.features.reads_given_music()
    }

    fn sampling(&self) -> Option<Sampling> {
        Some(Sampling {
            predicted: PREDICTED,
            look_ahead: self.reference.model.audio_future - 1,
        })
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        let dance = |(number, request)| {
            let mut dance = self.begin(request)?;
            while dance.frames.len() < dance.wanted {
                self.go_on(number, &mut dance)?;
            }
            let generated = dance.frames.generated(dance.wanted);
            self.reference
                .features
                .motion(&dance.given, generated.view())
        };
        requests.iter().enumerate().map(dance).collect()
    }

    /// Of the frames behind the seed, after the state has run over the seed. Past and music are
    /// those of what is known, in the condition of every frame; what the state ran over, too.
    fn log_likelihoods_knowing(
        &self,
        known: &[Request],
        requests: &[Request],
        truths: &[Motion],
    ) -> Result<Vec<f64>, ModelError> {
        let Reference {
            features,
            model,
            generation,
        } = &self.reference;
        let of = |(known, (request, truth)): (&Request, (&Request, &Motion))| {
            request.check(self.name(), &self.needs())?;
            let seed = model.motion_context;
            let end = seed + PREDICTED;
            let own = features.given(request, seed)?;
            let recorded = own.recorded(features, truth, end)?;
            let known = features.given(known, seed)?;
            known.check_music(
                self.name(),
                end - 1 + model.audio_future,
                generation.pad_audio,
            )?;
            let own = recorded.slice(s![seed.., ..]);
            let motion = concatenate(Axis(0), &[known.motion.view(), own]);
            let motion = motion.map_err(|error| ModelError::data(&error))?;
            let batch = self.run_up(&motion, &known, end);
            let run = self
                .weights
                .run(|tape| self.network.log_densities(tape, &batch, PREDICTED))?;
            run.0
                .first()
                .copied()
                .ok_or_else(|| self.lacks("likelihood"))
        };
        let pairs = known.iter().zip(requests.iter().zip(truths));
        pairs.map(of).collect()
    }
}
