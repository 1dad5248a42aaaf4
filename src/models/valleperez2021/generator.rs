//! A trained network as a generator: frame after frame, each sampled (spec, section 7).

use std::sync::Arc;

use ndarray::{Array1, Array2, ArrayView2, Axis, s};
use rand_chacha::ChaCha8Rng;

use super::config::ValleperezSettings;
use super::network::{Valleperez2021, WindowBatch};
use super::target::{LOOK_BACK, Target};
use super::task::window_batch;
use crate::autograd::{Parameters, Var};
use crate::models::dance_features::{
    Contexts, DanceFeatures, GenerationConfig, GivenDance, SampledFrames,
};
use crate::models::flow::noise_like;
use crate::models::generator::{Condition, Motion, NeededPoses, Needs, Request, Sampling};
use crate::models::inference::Inference;
use crate::models::settings::LoadError;
use crate::models::weights::SavedWeights;
use crate::models::{Generator, ModelError, Statistics, Streams};
use crate::music::FeatureSet;

/// Dances that go on together. Bounds memory.
const CHUNK: usize = 16;

const TARGET_MATRIX: &str = "target.matrix";
const TARGET_DEVIATION: &str = "target.deviation";

/// What the numbers of a network are about.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    pub features: DanceFeatures,
    pub target: Target,
    contexts: Contexts,
    generation: GenerationConfig,
}

impl Reference {
    pub fn new(features: DanceFeatures, target: Target, settings: &ValleperezSettings) -> Self {
        Self {
            features,
            target,
            contexts: settings.model.contexts(),
            generation: settings.generation.clone(),
        }
    }

    pub fn statistics(&self) -> Statistics {
        let statistics = self.features.statistics(Statistics::default());
        statistics
            .with(TARGET_MATRIX, self.target.matrix().clone().into_dyn())
            .with(TARGET_DEVIATION, self.target.deviation().clone().into_dyn())
    }

    /// That of saved statistics.
    ///
    /// # Errors
    /// They are not there, or do not fit together.
    pub fn saved(saved: &SavedWeights, settings: &ValleperezSettings) -> Result<Self, LoadError> {
        let features = DanceFeatures::saved(saved, &settings.features)?;
        let d = features.widths().0;
        let rows = LOOK_BACK * d + 1;
        let matrix = saved.statistic(TARGET_MATRIX, &[rows, d])?;
        let matrix = Array2::from_shape_fn((rows, d), |(i, j)| matrix[[i, j]]);
        let deviation = saved.statistic(TARGET_DEVIATION, &[d])?;
        let deviation: Array1<f64> = deviation.iter().copied().collect();
        let target = Target::from_parts(matrix, deviation).map_err(|reason| ModelError::Data {
            reason: format!("{}: {TARGET_DEVIATION}: {reason}", saved.path.display()),
        })?;
        Ok(Self::new(features, target, settings))
    }
}

/// A trained network, in f32.
pub struct TrainedValleperez {
    network: Arc<Valleperez2021>,
    weights: Inference,
    reference: Reference,
}

/// A dance as far as it is made.
struct Dance<'r> {
    given: GivenDance<'r>,
    frames: SampledFrames,
    rng: ChaCha8Rng,
    wanted: usize,
}

impl TrainedValleperez {
    pub(super) fn new(
        name: &str,
        network: Arc<Valleperez2021>,
        parameters: Parameters<f32>,
        reference: Reference,
    ) -> Self {
        Self {
            network,
            weights: Inference::new(name, parameters),
            reference,
        }
    }

    fn begin<'r>(&self, request: &'r Request) -> Result<Dance<'r>, ModelError> {
        request.check(self.name(), &self.needs())?;
        let Reference {
            features,
            contexts,
            generation,
            ..
        } = &self.reference;
        let given = features.given(request, contexts.past())?;
        let needed = request.frames + contexts.future() - 1;
        given.check_music(self.name(), needed, generation.pad_audio)?;
        Ok(Dance {
            frames: SampledFrames::after(given.motion.view()),
            given,
            rng: Streams::new(request.seed).stream("dance", &[]),
            wanted: request.frames,
        })
    }

    /// The next frame of every dance.
    fn go_on(&self, dances: &mut [(usize, &mut Dance<'_>)]) -> Result<(), ModelError> {
        let Reference {
            target,
            contexts,
            generation,
            ..
        } = &self.reference;
        let predicted = contexts.predicted;
        let d = self.reference.features.widths().0;
        let windows: Vec<_> = dances
            .iter()
            .map(|(_, dance)| {
                let at = dance.frames.len();
                let known = dance.frames.last(contexts.motion);
                // Behind what is known: numbers that the network does not see.
                let mut motion = Array2::zeros((contexts.motion + predicted, d));
                motion.slice_mut(s![..contexts.motion, ..]).assign(&known);
                (motion, dance.given.music_at(contexts.audio_rows(at)))
            })
            .collect();
        let views = windows
            .iter()
            .map(|(motion, audio)| (motion.view(), audio.view()));
        let batch = window_batch(target, views, predicted, dances.len());
        let noise: Vec<Array2<f64>> = dances
            .iter_mut()
            .map(|(_, dance)| noise_like(&mut dance.rng, (predicted, d), generation.temperature))
            .collect();
        let views: Vec<ArrayView2<'_, f64>> = noise.iter().map(|it| it.view()).collect();
        let z = ndarray::concatenate(Axis(0), &views).map_err(|error| ModelError::data(&error))?;
        let sampled = self.weights.run(|tape| {
            let h = self.network.latent(tape, &batch)?;
            self.network.sample(tape, &z, h)
        })?;
        for (k, (request, dance)) in dances.iter_mut().enumerate() {
            let y = sampled.slice(s![k * predicted..k * predicted + 1, ..]);
            let before = dance.frames.last(LOOK_BACK).mapv(f64::from);
            let x = target.inverse(before.view(), y);
            let columns = &self.reference.features.columns;
            dance
                .frames
                .push((self.name(), *request), x.row(0), generation.clamp, columns)?;
        }
        Ok(())
    }

    /// Windows of what requests say is known; nothing is to be predicted of them.
    fn known(&self, requests: &[Request]) -> Result<WindowBatch<f32>, ModelError> {
        let contexts = &self.reference.contexts;
        let windows = requests.iter().map(|request| {
            let given = self.given(request)?;
            let at = contexts.past();
            let mut motion = Array2::zeros((contexts.motion + contexts.predicted, self.channels()));
            let seed = given.motion.slice(s![at - contexts.motion..at, ..]);
            motion.slice_mut(s![..contexts.motion, ..]).assign(&seed);
            Ok((motion, given.music_at(contexts.audio_rows(at))))
        });
        Ok(self.batch(&windows.collect::<Result<Vec<_>, ModelError>>()?))
    }

    /// Windows of requests with what was recorded in the place of what is asked for.
    fn recorded(
        &self,
        requests: &[Request],
        truths: &[Motion],
    ) -> Result<WindowBatch<f32>, ModelError> {
        let contexts = &self.reference.contexts;
        let windows = requests.iter().zip(truths).map(|(request, truth)| {
            let given = self.given(request)?;
            let at = contexts.past();
            let recorded =
                given.recorded(&self.reference.features, truth, at + contexts.predicted)?;
            let motion = recorded.slice(s![at - contexts.motion.., ..]).to_owned();
            Ok((motion, given.music_at(contexts.audio_rows(at))))
        });
        Ok(self.batch(&windows.collect::<Result<Vec<_>, ModelError>>()?))
    }

    /// A request about one window in the numbers of the network.
    fn given<'r>(&self, request: &'r Request) -> Result<GivenDance<'r>, ModelError> {
        let Reference {
            features,
            contexts,
            generation,
            ..
        } = &self.reference;
        request.check(self.name(), &self.needs())?;
        let given = features.given(request, contexts.past())?;
        let heard = contexts.past() + contexts.audio_future;
        given.check_music(self.name(), heard, generation.pad_audio)?;
        Ok(given)
    }

    /// D.
    fn channels(&self) -> usize {
        self.reference.features.widths().0
    }

    fn batch(&self, windows: &[(Array2<f32>, Array2<f32>)]) -> WindowBatch<f32> {
        let views = windows
            .iter()
            .map(|(motion, audio)| (motion.view(), audio.view()));
        let predicted = self.reference.contexts.predicted;
        window_batch(&self.reference.target, views, predicted, windows.len())
    }

    /// log p of targets with what the network makes of `known`.
    fn densities(
        &self,
        known: &WindowBatch<f32>,
        batch: &WindowBatch<f32>,
    ) -> Result<Vec<f64>, ModelError> {
        let densities = self.weights.run(|tape| {
            let h: Var = self.network.latent(tape, known)?;
            self.network.log_densities(tape, batch, h)
        })?;
        let fixed =
            self.reference.contexts.predicted as f64 * self.reference.target.log_deviations();
        Ok(densities.iter().map(|it| it - fixed).collect())
    }
}

impl Generator for TrainedValleperez {
    fn name(&self) -> &str {
        self.weights.model()
    }

    fn needs(&self) -> Needs {
        Needs {
            poses: NeededPoses::Seed(self.reference.contexts.past()),
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
        let contexts = &self.reference.contexts;
        Some(Sampling {
            predicted: contexts.predicted,
            look_ahead: contexts.audio_future - 1,
        })
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        let dances = requests.iter().map(|request| self.begin(request));
        let mut dances = dances.collect::<Result<Vec<_>, _>>()?;
        let mut all: Vec<(usize, &mut Dance<'_>)> = dances.iter_mut().enumerate().collect();
        for chunk in all.chunks_mut(CHUNK) {
            loop {
                let open = chunk.iter_mut();
                let open = open.filter(|(_, it)| it.frames.len() < it.wanted);
                let mut open: Vec<(usize, &mut Dance<'_>)> = open
                    .map(|(request, dance)| (*request, &mut **dance))
                    .collect();
                if open.is_empty() {
                    break;
                }
                self.go_on(&mut open)?;
            }
        }
        let features = &self.reference.features;
        let motions = dances.iter().map(|dance| {
            let generated = dance.frames.generated(dance.wanted);
            features.motion(&dance.given, generated.view())
        });
        motions.collect()
    }

    fn log_likelihoods_knowing(
        &self,
        known: &[Request],
        requests: &[Request],
        truths: &[Motion],
    ) -> Result<Vec<f64>, ModelError> {
        let mut densities = Vec::new();
        for start in (0..requests.len()).step_by(CHUNK) {
            let end = (start + CHUNK).min(requests.len());
            let batch = self.recorded(&requests[start..end], &truths[start..end])?;
            let known = self.known(&known[start..end])?;
            densities.extend(self.densities(&known, &batch)?);
        }
        Ok(densities)
    }
}
