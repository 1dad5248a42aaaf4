//! The training: all windows of the training pieces, shuffled anew in every epoch (spec, sections 1
//! and 6).

use std::ops::Range;
use std::sync::Arc;

use ndarray::{Array2, ArrayView2, s};
use serde_json::{Map, Value, json};

use super::config::{LinearInit, TargetKind, ValleperezSettings};
use super::generator::{Reference, TrainedValleperez};
use super::network::{Valleperez2021, WindowBatch};
use super::target::{LOOK_BACK, Target};
use crate::autograd::{AutogradError, Parameters, Tape, Var};
use crate::counted::counted;
use crate::models::dance_features::TrainingWindows;
use crate::models::flow::NormKind;
use crate::models::settings::{InitialRng, TaskSetting};
use crate::models::{Generator, LossTerms, Meeting, ModelError, Statistics, Step, Task};
use crate::nn::Initialiser;

/// The training of a network on dances with their music.
pub struct ValleperezTask {
    settings: ValleperezSettings,
    network: Arc<Valleperez2021>,
    reference: Reference,
    windows: TrainingWindows,
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
        let known = setting.start.map(|start| Reference::saved(start, settings));
        let known = known
            .transpose()
            .map_err(|error| ModelError::data(&error))?;
        let (windows, features) = TrainingWindows::new(
            setting,
            known.as_ref().map(|known| known.features.clone()),
            &settings.features,
            &settings.augmentation,
            &settings.schedule,
            settings.model.contexts(),
        )?;
        // What the targets are told by is what training sees of them.
        let seen = windows.seen("target_fit");
        let views: Vec<ArrayView2<'_, f32>> = seen.iter().map(|it| it.view()).collect();
        let target = match known {
            Some(known) => known.target,
            None => Target::fitted(settings.model.target, &views),
        };
        let first = first_matrix(settings, &target, &views);
        let (motion, audio) = features.widths();
        let task = Self {
            network: settings.build(init, motion, audio, first.as_ref())?.into(),
            reference: Reference::new(features, target, settings),
            settings: settings.clone(),
            windows,
        };
        task.start(init.parameters_mut())?;
        Ok(task)
    }

    /// Starts the norms from the whole first batch.
    fn start(&self, parameters: &mut Parameters<f32>) -> Result<(), ModelError> {
        let batch = self.batch(0, 0..self.windows.batch());
        let started = self.network.start(parameters, &batch);
        started.map_err(|error| ModelError::data(&error))
    }

    /// Windows of a step.
    fn batch(&self, step: u64, range: Range<usize>) -> WindowBatch<f32> {
        let windows = self.windows.of(step, range);
        let views = windows.iter().map(|it| (it.motion.view(), it.audio));
        let predicted = self.settings.model.predicted_frames;
        window_batch(
            &self.reference.target,
            views,
            predicted,
            self.windows.batch(),
        )
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
        self.windows.steps()
    }

    fn frame_steps(&self) -> u64 {
        self.steps() * self.windows.frames()
    }

    fn step(&self, step: u64) -> Box<dyn Step<f32> + '_> {
        Box::new(ValleperezStep { task: self, step })
    }

    fn place(&self, step: u64) -> [u64; 2] {
        self.windows.place(step)
    }

    fn statistics(&self) -> Statistics {
        self.reference.statistics()
    }

    fn generator(&self, name: &str, parameters: Parameters<f32>) -> Box<dyn Generator> {
        let (network, reference) = (self.network.clone(), self.reference.clone());
        Box::new(TrainedValleperez::new(name, network, parameters, reference))
    }

    fn summary(&self) -> Option<String> {
        Some(self.windows.summary())
    }

    fn warnings(&self) -> Vec<String> {
        self.windows.warnings().to_vec()
    }

    fn facts(&self) -> Map<String, Value> {
        let mut facts = self.windows.facts(&self.reference.features);
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
        let windows = self.task.windows.shard(shard);
        self.task.batch(self.step, windows)
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
        self.task.windows.shards()
    }

    fn frames(&self) -> u64 {
        self.task.windows.frames()
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
        counted(self.task.windows.batch(), "window")
    }
}

impl Meeting<f32> for ValleperezStep<'_> {
    fn bring(&self, tape: &mut Tape<'_, f32>, shard: usize) -> Result<Var, AutogradError> {
        self.task.network.latent(tape, &self.batch_of(shard))
    }

    fn losses(&self, tape: &mut Tape<'_, f32>, together: Var) -> Result<LossTerms, AutogradError> {
        let windows = 0..self.task.windows.batch();
        let batch = self.task.batch(self.step, windows);
        let network = &self.task.network;
        let losses = network.losses_by(tape, &batch, together, true)?;
        self.of_frames(tape, &batch, losses)
    }
}
