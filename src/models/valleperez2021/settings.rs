//! What the commands ask of a config of this model.

use ndarray::{Array2, ArrayView2, s};
use rand::{Rng, RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::config::{Head, TargetKind, ValleperezSettings};
use super::generator::{Reference, TrainedValleperez};
use super::network::{Valleperez2021, WindowBatch};
use super::task::{ValleperezTask, window_batch};
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

impl ValleperezSettings {
    pub(super) fn build<T: Real, R: Rng>(
        &self,
        init: &mut Initialiser<'_, T, R>,
        motion: usize,
        audio: usize,
        first: Option<&Array2<f64>>,
    ) -> Result<Valleperez2021, ModelError> {
        let network = Valleperez2021::new(init, &self.model, motion, audio, first);
        let network = network.map_err(|error| ModelError::data(&error))?;
        match init.exceeded() {
            None => Ok(network),
            Some(most) => Err(ModelError::TooLarge { most }),
        }
    }

    /// Predicts this many frames together, as `--frames` asks.
    fn set_frames(&mut self, frames: usize) -> Result<(), ModelError> {
        self.model.predicted_frames = frames;
        self.check_values().map_err(|error| ModelError::Data {
            reason: format!("--frames {frames}: {error}"),
        })
    }

    /// The same structure in small sizes, for checks in f64.
    fn small(&self) -> Self {
        let mut small = self.clone();
        let model = &mut small.model;
        (model.width, model.heads, model.feed_forward) = (8, 2, 12);
        model.motion_layers = model.motion_layers.min(1);
        model.audio_layers = model.audio_layers.min(1);
        model.cross_layers = model.cross_layers.min(2);
        (model.motion_context, model.audio_past, model.audio_future) = (5, 4, 3);
        model.blocks = model.blocks.min(2);
        (model.flow_width, model.flow_heads, model.flow_feed_forward) = (6, 2, 8);
        model.coupling_layers = model.coupling_layers.min(1);
        model.predicted_frames = model.predicted_frames.min(3);
        small
    }

    fn check_case(&self, options: &GradientCheckOptions) -> Result<CheckReport, ModelError> {
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        let mut parameters = Parameters::<f64>::new();
        let mut init = Initialiser::new(&mut parameters, &mut rng);
        let (motion, audio) = CHECKED;
        let network = self.build(&mut init, motion, audio, None)?;
        let windows = options.windows.max(1);
        let mut draw = |rows: usize, columns: usize| {
            Array2::from_shape_simple_fn((windows * rows, columns), || rng.random_range(-1.5..1.5))
        };
        let model = &self.model;
        let batch = WindowBatch {
            motion: draw(model.motion_context, motion),
            audio: draw(model.audio_frames(), audio),
            target: draw(model.predicted_frames, motion),
            windows,
            total_windows: windows,
        };
        let started = network.start(&mut parameters, &batch);
        started.map_err(|error| ModelError::data(&error))?;
        for (_, mut value) in parameters.values_mut() {
            value.mapv_inplace(|x| x + rng.random_range(-NOISE..NOISE));
        }
        // By stored statistics: those of a batch are constants for the gradient, by definition.
        let report = check_losses(&mut parameters, None, options.per_parameter, |tape| {
            network.losses(tape, &batch, false)
        });
        report.map_err(|error| ModelError::data(&error))
    }

    fn load(&self, saved: &SavedWeights) -> Result<Loaded, LoadError> {
        let reference = Reference::saved(saved, self)?;
        let (motion, audio) = reference.features.widths();
        let (network, parameters) = saved.network(&reference.statistics(), |init| {
            self.build(init, motion, audio, None)
        })?;
        Ok(Loaded {
            network,
            parameters,
            reference,
        })
    }

    /// Windows spread evenly over the training recordings.
    fn exported_windows(
        &self,
        reference: &Reference,
        setting: &TaskSetting<'_>,
        options: &ExportOptions,
    ) -> Result<WindowBatch<f32>, ModelError> {
        let contexts = self.model.contexts();
        let recordings = &setting.dataset.train;
        let frames: Vec<usize> = recordings.iter().map(|it| it.frames()).collect();
        let cut = contexts.cut(1).windows(&frames);
        let predicted = contexts.predicted;
        let all = spread(
            &cut,
            options.windows,
            predicted,
            contexts.past() + contexts.future(),
        )?;
        let pieces = recordings.iter().map(|it| reference.features.piece(it));
        let pieces: Vec<Piece> = pieces.collect::<Result<_, _>>()?;
        let views = all.iter().map(|window| {
            let (piece, i) = (&pieces[window.clip], window.start + contexts.past());
            let motion = piece
                .motion
                .slice(s![i - contexts.motion..i + predicted, ..]);
            (motion, piece.audio.slice(s![contexts.audio_rows(i), ..]))
        });
        let views: Vec<(ArrayView2<'_, f32>, ArrayView2<'_, f32>)> = views.collect();
        Ok(window_batch(
            &reference.target,
            views.into_iter(),
            predicted,
            all.len(),
        ))
    }
}

struct Loaded {
    network: Valleperez2021,
    parameters: Parameters<f32>,
    reference: Reference,
}

impl ModelSettings for ValleperezSettings {
    fn kind(&self) -> &str {
        "valleperez2021"
    }

    fn check(&self, _data: &DataConfig) -> Result<(), ValueError> {
        self.check_values()
    }

    fn budget_note(&self) -> String {
        let schedule = &self.schedule;
        format!(
            "{} steps of {} windows",
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
        Ok(Box::new(ValleperezTask::new(self, setting, init)?))
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
        let made_up = made_up(settings.model.contexts(), batch, streams.seed())?;
        settings.features = made_up.features();
        let task = ValleperezTask::new(&settings, &made_up.setting(streams), init)?;
        Ok(Box::new(Endless(task)))
    }

    fn trained(&self, name: &str, saved: &SavedWeights) -> Result<Box<dyn Generator>, LoadError> {
        let Loaded {
            network,
            parameters,
            reference,
        } = self.load(saved)?;
        let network = network.into();
        Ok(Box::new(TrainedValleperez::new(
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
        let title = match settings.model.head {
            Head::Flow => format!("N = {}, flow", settings.model.predicted_frames),
            Head::Deterministic => format!("N = {}", settings.model.predicted_frames),
        };
        Ok(vec![(title, settings.check_case(options)?)])
    }

    fn export_batch(
        &self,
        saved: &SavedWeights,
        setting: &TaskSetting<'_>,
        options: &ExportOptions,
    ) -> Result<ExportedBatch, LoadError> {
        options.check_not_fed()?;
        options.check_frames(self.model.predicted_frames, "model.predicted_frames")?;
        let loaded = self.load(saved)?;
        let batch = self.exported_windows(&loaded.reference, setting, options)?;
        let mut exported = ExportedBatch::default();
        let results = if options.double {
            let (motion, audio) = loaded.reference.features.widths();
            let (network, parameters) = saved
                .network::<f64, _>(&loaded.reference.statistics(), |init| {
                    self.build(init, motion, audio, None)
                })?;
            let batch = WindowBatch {
                motion: batch.motion.mapv(f64::from),
                audio: batch.audio.mapv(f64::from),
                target: batch.target.mapv(f64::from),
                windows: batch.windows,
                total_windows: batch.total_windows,
            };
            add_results(&mut exported, &network, &parameters, &batch)
        } else {
            add_results(&mut exported, &loaded.network, &loaded.parameters, &batch)
        };
        results.map_err(|error| ModelError::data(&error))?;
        if self.model.target != TargetKind::Pose {
            let log_deviations = loaded.reference.target.log_deviations();
            exported.add("target.log_deviations", &[1], &[log_deviations]);
        }
        Ok(exported)
    }
}

/// W windows: `motion [W motion_context, D]`, `audio [W (past + future), A]`, `target [W N, D]`,
/// `latent [W N, width]`, `windows [1]`, of a flow `noise [W N, D]` and `back [W N, D]` (the inverse
/// of the noise); `log_density [W]` of the targets; `loss.*`, `gradient.*`. By stored statistics.
fn add_results<T: Real>(
    exported: &mut ExportedBatch,
    network: &Valleperez2021,
    parameters: &Parameters<T>,
    batch: &WindowBatch<T>,
) -> Result<(), AutogradError> {
    for (name, array) in [
        ("motion", &batch.motion),
        ("audio", &batch.audio),
        ("target", &batch.target),
    ] {
        let values: Vec<T> = array.iter().copied().collect();
        exported.add(name, array.shape(), &values);
    }
    exported.add("windows", &[1], &[batch.windows as f32]);
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(parameters, &mut workspace);
    let h = network.latent(&mut tape, batch)?;
    exported.add("latent", tape.shape(h), tape.values(h));
    if network.is_flow() {
        let z = network.noise(&mut tape, batch, h, false)?.z;
        exported.add("noise", tape.shape(z), tape.values(z));
        let noise: Vec<f64> = tape.values(z).iter().map(|&x| Real::to_f64(x)).collect();
        let columns = batch.target.ncols();
        let noise = Array2::from_shape_fn(batch.target.dim(), |(i, j)| noise[i * columns + j]);
        let back = network.sample(&mut tape, &noise, h)?;
        let values: Vec<f64> = back.iter().copied().collect();
        exported.add("back", back.shape(), &values);
    }
    let densities = network.log_densities(&mut tape, batch, h)?;
    exported.add("log_density", &[densities.len()], &densities);
    drop(tape);
    exported.add_losses(parameters, &mut workspace, |tape| {
        network.losses(tape, batch, false)
    })
}
