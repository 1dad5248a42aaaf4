//! What the commands ask of a config of this model.

use ndarray::{Array2, s};
use rand::{Rng, RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::config::MoglowSettings;
use super::flow::{Moglow2020, SequenceBatch};
use super::generator::{Reference, TrainedMoglow};
use super::task::{MoglowTask, Sequence, sequence_batch};
use crate::autograd::check::CheckReport;
use crate::autograd::{AutogradError, Parameters, Real, Tape, Workspace};
use crate::data::DataConfig;
use crate::models::dance_features::{Endless, GenerationConfig, Piece, made_up};
use crate::models::exported_batch::{ExportOptions, ExportedBatch, spread};
use crate::models::gradient_report::check_losses;
use crate::models::settings::{
    GradientCheckOptions, InitialRng, LoadError, ModelSettings, TaskSetting, ValueError,
};
use crate::models::weights::SavedWeights;
use crate::models::{Generator, ModelError, Streams, Task};
use crate::nn::Initialiser;

/// Uniform noise on every weight, so that none stands at a special value such as 0.
const NOISE: f64 = 0.1;
/// Numbers of motion and music a frame of a gradient check.
const CHECKED: (usize, usize) = (5, 3);

impl MoglowSettings {
    pub(super) fn build<T: Real, R: Rng>(
        &self,
        init: &mut Initialiser<'_, T, R>,
        motion: usize,
        audio: usize,
    ) -> Result<Moglow2020, ModelError> {
        let condition = self.model.condition(motion, audio);
        let network = Moglow2020::new(init, &self.model, motion, condition);
        match init.exceeded() {
            None => Ok(network),
            Some(most) => Err(ModelError::TooLarge { most }),
        }
    }

    /// Trains sequences of this many frames, as `--frames` asks.
    fn set_frames(&mut self, frames: usize) -> Result<(), ModelError> {
        self.model.sequence = frames;
        self.check_values().map_err(|error| ModelError::Data {
            reason: format!("--frames {frames}: {error}"),
        })
    }

    /// The same structure in small sizes, for checks in f64.
    fn small(&self) -> Self {
        let mut small = self.clone();
        let model = &mut small.model;
        model.blocks = model.blocks.min(2);
        model.hidden = 6;
        model.lstm_layers = model.lstm_layers.min(2);
        (model.motion_past, model.audio_past, model.audio_future) = (3, 2, 2);
        model.sequence = model.sequence.min(4);
        small
    }

    fn check_case(&self, options: &GradientCheckOptions) -> Result<CheckReport, ModelError> {
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        let mut parameters = Parameters::<f64>::new();
        let mut init = Initialiser::new(&mut parameters, &mut rng);
        let (motion, audio) = CHECKED;
        let network = self.build(&mut init, motion, audio)?;
        let sequences = options.windows.max(1);
        let rows = sequences * self.model.sequence;
        let mut draw = |columns: usize| {
            Array2::from_shape_simple_fn((rows, columns), || rng.random_range(-1.5..1.5))
        };
        let batch = SequenceBatch {
            condition: draw(self.model.condition(motion, audio)),
            target: draw(motion),
            sequences,
            total_sequences: sequences,
        };
        for (_, mut value) in parameters.values_mut() {
            value.mapv_inplace(|x| x + rng.random_range(-NOISE..NOISE));
        }
        let report = check_losses(&mut parameters, None, options.per_parameter, |tape| {
            network.losses(tape, &batch)
        });
        report.map_err(|error| ModelError::data(&error))
    }

    fn load(&self, saved: &SavedWeights) -> Result<Loaded, LoadError> {
        let reference = Reference::saved(saved, self)?;
        let (motion, audio) = reference.features.widths();
        let (network, parameters) = saved.network(&reference.statistics(), |init| {
            self.build(init, motion, audio)
        })?;
        Ok(Loaded {
            network,
            parameters,
            reference,
        })
    }

    /// Sequences spread evenly over the training recordings.
    fn exported_sequences(
        &self,
        reference: &Reference,
        setting: &TaskSetting<'_>,
        options: &ExportOptions,
    ) -> Result<SequenceBatch<f32>, ModelError> {
        let contexts = self.model.sequence_contexts();
        let recordings = &setting.dataset.train;
        let frames: Vec<usize> = recordings.iter().map(|it| it.frames()).collect();
        let cut = contexts.cut(1).windows(&frames);
        let needed = contexts.past() + contexts.future();
        let all = spread(&cut, options.windows, contexts.predicted, needed)?;
        let pieces = recordings.iter().map(|it| reference.features.piece(it));
        let pieces: Vec<Piece> = pieces.collect::<Result<_, _>>()?;
        let sequences = all.iter().map(|window| {
            let (piece, i) = (&pieces[window.clip], window.start + contexts.past());
            let rows = i - contexts.motion..i + contexts.predicted;
            let motion = piece.motion.slice(s![rows, ..]).to_owned();
            Sequence {
                known: motion.clone(),
                motion,
                audio: piece.audio.slice(s![contexts.audio_rows(i), ..]),
            }
        });
        let sequences: Vec<Sequence<'_>> = sequences.collect();
        let frames = self.model.sequence;
        Ok(sequence_batch(
            &self.model,
            &sequences,
            frames,
            sequences.len(),
        ))
    }
}

struct Loaded {
    network: Moglow2020,
    parameters: Parameters<f32>,
    reference: Reference,
}

impl ModelSettings for MoglowSettings {
    fn kind(&self) -> &str {
        "moglow2020"
    }

    fn check(&self, _data: &DataConfig) -> Result<(), ValueError> {
        self.check_values()
    }

    fn budget_note(&self) -> String {
        let schedule = &self.schedule;
        let frames = self.model.sequence;
        format!(
            "{} steps of {} sequences of {frames} frames",
            schedule.steps, schedule.batch_size
        )
    }

    fn keys_after_the_network(&self) -> &'static [&'static str] {
        GenerationConfig::KEYS
    }

    fn task<'d>(
        &self,
        setting: &TaskSetting<'d>,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Box<dyn Task<f32> + 'd>, ModelError> {
        Ok(Box::new(MoglowTask::new(self, setting, init)?))
    }

    fn made_up_task(
        &self,
        frames: Option<usize>,
        batch: usize,
        streams: Streams,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Box<dyn Task<f32>>, ModelError> {
        let mut settings = self.clone();
        settings.schedule.batch_size = batch;
        frames.map_or(Ok(()), |frames| settings.set_frames(frames))?;
        let made_up = made_up(settings.model.sequence_contexts(), batch, streams.seed())?;
        settings.features = made_up.features();
        let task = MoglowTask::new(&settings, &made_up.setting(streams), init)?;
        Ok(Box::new(Endless(task)))
    }

    fn trained(&self, name: &str, saved: &SavedWeights) -> Result<Box<dyn Generator>, LoadError> {
        let Loaded {
            network,
            parameters,
            reference,
        } = self.load(saved)?;
        let network = network.into();
        Ok(Box::new(TrainedMoglow::new(
            name, network, parameters, reference,
        )))
    }

    fn check_gradients(
        &self,
        options: &GradientCheckOptions,
    ) -> Result<Vec<(String, CheckReport)>, ModelError> {
        let mut settings = match options.full_size {
            true => self.clone(),
            false => self.small(),
        };
        if let Some(frames) = options.frames {
            settings.set_frames(frames)?;
        }
        let title = format!("sequences of {} frames", settings.model.sequence);
        Ok(vec![(title, settings.check_case(options)?)])
    }

    fn export_batch(
        &self,
        saved: &SavedWeights,
        setting: &TaskSetting<'_>,
        options: &ExportOptions,
    ) -> Result<ExportedBatch, LoadError> {
        options.check_not_fed()?;
        options.check_frames(self.model.sequence, "model.sequence")?;
        let loaded = self.load(saved)?;
        let batch = self.exported_sequences(&loaded.reference, setting, options)?;
        let mut exported = ExportedBatch::default();
        let results = if options.double {
            let (motion, audio) = loaded.reference.features.widths();
            let (network, parameters) = saved
                .network::<f64, _>(&loaded.reference.statistics(), |init| {
                    self.build(init, motion, audio)
                })?;
            let batch = SequenceBatch {
                condition: batch.condition.mapv(f64::from),
                target: batch.target.mapv(f64::from),
                sequences: batch.sequences,
                total_sequences: batch.total_sequences,
            };
            add_results(&mut exported, &network, &parameters, &batch)
        } else {
            add_results(&mut exported, &loaded.network, &loaded.parameters, &batch)
        };
        results.map_err(|error| ModelError::data(&error))?;
        Ok(exported)
    }
}

/// S sequences of F frames, row `frame S + sequence`: `condition [F S, condition]`,
/// `target [F S, D]`, `sequences [1]`, `noise [F S, D]`, `log_density [S]`; `loss.*`, `gradient.*`.
fn add_results<T: Real>(
    exported: &mut ExportedBatch,
    network: &Moglow2020,
    parameters: &Parameters<T>,
    batch: &SequenceBatch<T>,
) -> Result<(), AutogradError> {
    for (name, array) in [("condition", &batch.condition), ("target", &batch.target)] {
        let values: Vec<T> = array.iter().copied().collect();
        exported.add(name, array.shape(), &values);
    }
    exported.add("sequences", &[1], &[batch.sequences as f32]);
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(parameters, &mut workspace);
    let z = network.noise(&mut tape, batch)?;
    let values: Vec<f64> = z.iter().copied().collect();
    exported.add("noise", z.shape(), &values);
    let (densities, _) = network.log_densities(&mut tape, batch, usize::MAX)?;
    exported.add("log_density", &[densities.len()], &densities);
    drop(tape);
    exported.add_losses(parameters, &mut workspace, |tape| {
        network.losses(tape, batch)
    })
}
