//! The training: all windows of the training pieces, shuffled anew in every epoch (spec, sections 1
//! and 6).

use std::sync::Arc;

use ndarray::{Array2, ArrayView2, s};
use serde_json::{Map, Value, json};

use super::config::{LinearInit, TargetKind, ValleperezSettings};
use super::generator::{Reference, TrainedValleperez};
use super::network::{Valleperez2021, WindowBatch};
use super::target::{LOOK_BACK, Target};
use crate::autograd::{AutogradError, Parameters, Tape, Var};
use crate::counted::counted;
use crate::models::dance_features::{DanceData, Epochs, Piece, with_noise};
use crate::models::flow::NormKind;
use crate::models::settings::{InitialRng, TaskSetting};
use crate::models::transition::parts;
use crate::models::{Generator, LossTerms, Meeting, ModelError, Statistics, Step, Streams, Task};
use crate::nn::Initialiser;

/// The training of a network on dances with their music.
pub struct ValleperezTask {
    settings: ValleperezSettings,
    network: Arc<Valleperez2021>,
    reference: Reference,
    pieces: Vec<Piece>,
    epochs: Epochs,
    streams: Streams,
    warnings: Vec<String>,
}

impl ValleperezTask {
    /// # Errors
    /// Clips of other joints or rates, without music, or too short for a window; fewer windows than
    /// a batch has; sizes that do not fit together.
    pub fn new(
        settings: &ValleperezSettings,
        setting: &TaskSetting<'_>,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Self, ModelError> {
        let mirror = settings.augmentation.mirror;
        let known = setting.start.map(|start| Reference::saved(start, settings));
        let known = known
            .transpose()
            .map_err(|error| ModelError::data(&error))?;
        let mut data = match &known {
            Some(known) => DanceData::in_numbers(known.features.clone(), setting.dataset, mirror)?,
            None => DanceData::of(setting.dataset, &settings.features, mirror)?,
        };
        data.keep(&settings.schedule.clips)?;
        let DanceData {
            features,
            train,
            warnings,
            ..
        } = data;
        // What the targets are told by is what training sees of them.
        let noise = settings.augmentation.target_noise;
        let seen = train.iter().enumerate().map(|(index, piece)| {
            let mut rng = setting.streams.stream("target_fit", &[index as u64]);
            with_noise(piece.motion.view(), noise, &mut rng)
        });
        let seen: Vec<Array2<f32>> = seen.collect();
        let views: Vec<ArrayView2<'_, f32>> = seen.iter().map(|it| it.view()).collect();
        let target = match known {
            Some(known) => known.target,
            None => Target::fitted(settings.model.target, &views),
        };
        let first = first_matrix(settings, &target, &views);
        let frames: Vec<usize> = train.iter().map(Piece::frames).collect();
        let contexts = settings.model.contexts();
        let batch = settings.schedule.batch_size;
        let epochs = Epochs::new(&frames, contexts, batch, setting.streams)?;
        let (motion, audio) = features.widths();
        let task = Self {
            network: settings.build(init, motion, audio, first.as_ref())?.into(),
            reference: Reference::new(features, target, settings),
            settings: settings.clone(),
            pieces: train,
            epochs,
            streams: setting.streams,
            warnings,
        };
        task.start(init.parameters_mut())?;
        Ok(task)
    }

    /// Starts the norms from the whole first batch.
    fn start(&self, parameters: &mut Parameters<f32>) -> Result<(), ModelError> {
        let batch = self.batch(0, 0..self.settings.schedule.batch_size);
        let started = self.network.start(parameters, &batch);
        started.map_err(|error| ModelError::data(&error))
    }

    /// Windows of a step.
    fn batch(&self, step: u64, range: std::ops::Range<usize>) -> WindowBatch<f32> {
        let contexts = self.settings.model.contexts();
        let noise = self.settings.augmentation.target_noise;
        let windows = self.epochs.batch(step);
        let windows = windows.iter().enumerate();
        let windows = windows.skip(range.start).take(range.len());
        let windows = windows.map(|(index, at)| {
            let piece = &self.pieces[at.piece];
            let (from, to) = (at.frame - contexts.motion, at.frame + contexts.predicted);
            let mut rng = self.streams.stream("target_noise", &[step, index as u64]);
            let motion = with_noise(piece.motion.slice(s![from..to, ..]), noise, &mut rng);
            (
                motion,
                piece.audio.slice(s![contexts.audio_rows(at.frame), ..]),
            )
        });
        let windows: Vec<_> = windows.collect();
        let windows = windows
            .iter()
            .map(|(motion, audio)| (motion.view(), *audio));
        let total = self.settings.schedule.batch_size;
        window_batch(&self.reference.target, windows, contexts.predicted, total)
    }
}

/// Windows beside each other: of each its motion `[motion_context + N, D]` and its music.
pub(super) fn window_batch<'w>(
    target: &Target,
    windows: impl Iterator<Item = (ArrayView2<'w, f32>, ArrayView2<'w, f32>)>,
    predicted: usize,
    total_windows: usize,
) -> WindowBatch<f32> {
    let (mut motion, mut audio, mut targets) = (Vec::new(), Vec::new(), Vec::new());
    let (mut widths, mut rows, mut count) = ((0, 0), (0, 0), 0);
    for (own, heard) in windows {
        let known = own.nrows() - predicted;
        motion.extend(own.slice(s![..known, ..]).iter().copied());
        audio.extend(heard.iter().copied());
        let frames = own.slice(s![known - LOOK_BACK.., ..]).mapv(f64::from);
        targets.extend(target.forward(frames.view()).iter().map(|&y| y as f32));
        widths = (own.ncols(), heard.ncols());
        rows = (known, heard.nrows());
        count += 1;
    }
    let matrix = |rows: usize, columns: usize, values: Vec<f32>| {
        Array2::from_shape_fn((rows, columns), |(i, j)| values[i * columns + j])
    };
    WindowBatch {
        motion: matrix(count * rows.0, widths.0, motion),
        audio: matrix(count * rows.1, widths.1, audio),
        target: matrix(count * predicted, widths.0, targets),
        windows: count,
        total_windows,
    }
}

/// W of the first block where it does not start as a random rotation.
fn first_matrix(
    settings: &ValleperezSettings,
    target: &Target,
    pieces: &[ArrayView2<'_, f32>],
) -> Option<Array2<f64>> {
    match settings.model.linear_init {
        LinearInit::Orthogonal => None,
        LinearInit::Whitening => Some(target.whitening(pieces)),
    }
}

impl Task<f32> for ValleperezTask {
    fn steps(&self) -> u64 {
        self.settings.schedule.steps
    }

    fn frame_steps(&self) -> u64 {
        let frames = self.settings.schedule.batch_size * self.settings.model.predicted_frames;
        self.settings.schedule.steps * frames as u64
    }

    fn step(&self, step: u64) -> Box<dyn Step<f32> + '_> {
        Box::new(ValleperezStep { task: self, step })
    }

    fn place(&self, step: u64) -> [u64; 2] {
        self.epochs.place(step)
    }

    fn statistics(&self) -> Statistics {
        self.reference.statistics()
    }

    fn generator(&self, name: &str, parameters: Parameters<f32>) -> Box<dyn Generator> {
        let (network, reference) = (self.network.clone(), self.reference.clone());
        Box::new(TrainedValleperez::new(name, network, parameters, reference))
    }

    fn summary(&self) -> Option<String> {
        let epoch = self.epochs.batches() as u64;
        let epochs = self.settings.schedule.steps as f64 / epoch as f64;
        Some(format!("{epochs:.1} epochs of {epoch} steps"))
    }

    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    fn facts(&self) -> Map<String, Value> {
        let features = &self.reference.features;
        let mut facts = Map::from_iter([
            ("training_windows".into(), json!(self.epochs.windows())),
            ("motion_columns".into(), json!(features.widths().0)),
            ("audio_columns".into(), json!(features.widths().1)),
            // What bits of standardised numbers lack to those in cm and rad.
            ("bits_of_deviations".into(), json!(features.motion.bits())),
        ]);
        if self.settings.model.target != TargetKind::Pose {
            let bits = self.reference.target.log_deviations() / std::f64::consts::LN_2;
            facts.insert("bits_of_target_deviations".into(), json!(bits));
        }
        facts
    }
}

/// A step of the training.
struct ValleperezStep<'t> {
    task: &'t ValleperezTask,
    step: u64,
}

impl ValleperezStep<'_> {
    /// Windows of a shard.
    fn batch_of(&self, shard: usize) -> WindowBatch<f32> {
        let total = self.task.settings.schedule.batch_size;
        let range = parts(total, self.shards()).nth(shard).unwrap_or(0..0);
        self.task.batch(self.step, range)
    }

    /// Losses of windows with the density of the frames themselves: the targets are these over
    /// their deviations.
    fn of_frames(
        &self,
        tape: &mut Tape<'_, f32>,
        batch: &WindowBatch<f32>,
        mut losses: LossTerms,
    ) -> Result<LossTerms, AutogradError> {
        if self.task.settings.model.target != TargetKind::Pose {
            let bits = self.task.reference.target.log_deviations() / std::f64::consts::LN_2;
            let share = batch.windows as f64 / batch.total_windows as f64;
            let bits = tape.constant_with(&[1], |out| out.fill((bits * share) as f32));
            losses.total = tape.add(losses.total, bits)?;
            losses.terms.push(("target", bits));
        }
        Ok(losses)
    }
}

impl Step<f32> for ValleperezStep<'_> {
    fn shards(&self) -> usize {
        self.task.settings.schedule.shards()
    }

    fn frames(&self) -> u64 {
        let settings = &self.task.settings;
        (settings.schedule.batch_size * settings.model.predicted_frames) as u64
    }

    fn losses(&self, tape: &mut Tape<'_, f32>, shard: usize) -> Result<LossTerms, AutogradError> {
        let batch = self.batch_of(shard);
        let losses = self.task.network.losses(tape, &batch, true)?;
        self.of_frames(tape, &batch, losses)
    }

    /// Batch norm's statistics are those of the whole batch: its shards encode, the flow is one.
    fn meeting(&self) -> Option<&dyn Meeting<f32>> {
        let whole = self.task.network.is_flow() && self.task.settings.model.norm == NormKind::Batch;
        whole.then_some(self)
    }

    fn describe(&self) -> String {
        counted(self.task.settings.schedule.batch_size, "window")
    }
}

impl Meeting<f32> for ValleperezStep<'_> {
    fn bring(&self, tape: &mut Tape<'_, f32>, shard: usize) -> Result<Var, AutogradError> {
        self.task.network.latent(tape, &self.batch_of(shard))
    }

    fn losses(&self, tape: &mut Tape<'_, f32>, together: Var) -> Result<LossTerms, AutogradError> {
        let windows = 0..self.task.settings.schedule.batch_size;
        let batch = self.task.batch(self.step, windows);
        let network = &self.task.network;
        let losses = network.losses_by(tape, &batch, together, true)?;
        self.of_frames(tape, &batch, losses)
    }
}
