//! One step: a batch is cut and standardised, its shards run forwards and backwards, Adam moves the weights.

use std::borrow::Cow;
use std::sync::{Mutex, PoisonError};

use ndarray::{Array2, Array3, Axis};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::{Serialize, Serializer};

use super::error::TrainingError;
use crate::autograd::{AutogradError, Gradients, Parameters, Tape, Workspace};
use crate::data::DanceClip;
use crate::evaluation::Evaluation;
use crate::models::streams::Streams;
use crate::models::transition::schedule::parts;
use crate::models::transition::single_frames::SingleFramePlan;
use crate::models::transition::{Batch, Feed, Network, PoseWindows, SingleFrame};
use crate::models::transition::{RootFrame, Standardisation, Window};
use crate::motion::Pose;
use crate::motion::features::FEATURES;
use crate::optim::Adam;

/// What one step did: a line of `log.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepReport {
    /// Steps done, this one included.
    pub step: u64,
    /// From 0.
    pub epoch: usize,
    /// Frames of a transition, N.
    pub length: usize,
    /// Windows in the batch.
    pub batch: usize,
    #[serde(serialize_with = "feed_name")]
    pub feed: Feed,
    /// Probability of the ground truth at this step.
    pub beta: f64,
    /// The loss that is minimised.
    pub total: f64,
    /// Its terms by name, not weighted.
    #[serde(serialize_with = "by_name")]
    pub losses: Vec<(&'static str, f64)>,
    pub learning_rate: f64,
    /// Norm of the gradient over all parameters, before any clipping.
    pub gradient_norm: f64,
    /// Frames predicted so far, this step's included.
    pub frame_steps: u64,
    /// Wall-clock time of the step.
    pub seconds: f64,
    pub frame_steps_per_second: f64,
    /// Scores on validation clips after the step, where it was scored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation: Option<Evaluation>,
}

fn feed_name<S: Serializer>(feed: &Feed, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(match feed {
        Feed::GroundTruth => "ground_truth",
        Feed::Predictions => "predictions",
    })
}

fn by_name<S: Serializer>(
    losses: &[(&'static str, f64)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(losses.iter().copied())
}

/// What is trained, and how its windows become network input.
pub(crate) struct TrainingWindows<'d> {
    pub clips: Vec<TrainingClip<'d>>,
    pub standardisation: Standardisation,
    pub root_frame: RootFrame,
}

/// One of them.
pub(crate) struct TrainingClip<'d> {
    /// `[frames, 154]`, not standardised.
    pub features: Cow<'d, Array2<f64>>,
    pub poses: Cow<'d, [Pose]>,
}

impl<'d> TrainingClip<'d> {
    pub fn of(clip: &'d DanceClip) -> Self {
        Self {
            features: Cow::Borrowed(&clip.features),
            poses: Cow::Borrowed(&clip.clip.poses),
        }
    }

    pub fn owning(clip: DanceClip) -> Self {
        Self {
            features: Cow::Owned(clip.features),
            poses: Cow::Owned(clip.clip.poses),
        }
    }
}

impl TrainingWindows<'_> {
    /// Standardised features of windows of `length` + 1 frames, `[length + 1, windows, 154]`.
    fn features(&self, windows: &[Window], length: usize) -> Array3<f32> {
        let mut features = Array3::zeros((length + 1, windows.len(), FEATURES));
        for (k, window) in windows.iter().enumerate() {
            let clip = &self.clips[window.clip].features;
            let cut = self.root_frame.window_features(clip, window.start, length);
            features.index_axis_mut(Axis(1), k).assign(
                &self
                    .standardisation
                    .standardise(cut.view())
                    .mapv(|x| x as f32),
            );
        }
        features
    }

    /// Single frames with the standardised features of their windows.
    fn single_frames(&self, plans: &[SingleFramePlan]) -> Vec<SingleFrame<f32>> {
        plans
            .iter()
            .map(|plan| SingleFrame {
                window: self.features(&[plan.window], plan.length),
                frame: plan.frame,
            })
            .collect()
    }

    /// Poses of the same windows; none where a clip has none of its own.
    fn poses(&self, windows: &[Window], length: usize) -> Option<PoseWindows<f32>> {
        let mut cut = PoseWindows::zeros(length + 1, windows.len());
        for (k, window) in windows.iter().enumerate() {
            let frames = window.start..=window.start + length;
            cut.write(k, 0..=length, self.clips[window.clip].poses.get(frames)?);
        }
        Some(cut)
    }
}

/// What a step trains.
#[derive(Debug, Clone)]
pub(crate) struct StepPlan {
    /// N of the windows.
    pub length: usize,
    pub windows: Vec<Window>,
    pub single_frames: Vec<SingleFramePlan>,
}

/// A part of it, computed by itself.
#[derive(Clone, Copy)]
struct Shard<'s> {
    /// From 0.
    index: usize,
    windows: &'s [Window],
    single_frames: &'s [SingleFramePlan],
}

impl StepPlan {
    /// The plan in `count` parts or, where it has fewer windows, one of each.
    fn shards(&self, count: usize) -> Vec<Shard<'_>> {
        let count = count.min(self.windows.len());
        parts(self.windows.len(), count)
            .zip(parts(self.single_frames.len(), count))
            .enumerate()
            .map(|(index, (windows, single_frames))| Shard {
                index,
                windows: &self.windows[windows],
                single_frames: &self.single_frames[single_frames],
            })
            .collect()
    }
}

/// What a step is given.
pub(crate) struct StepInput<'s> {
    pub network: &'s dyn Network<f32>,
    pub windows: &'s TrainingWindows<'s>,
    pub streams: Streams,
    /// Steps done before.
    pub step: u64,
    pub plan: &'s StepPlan,
    pub feed: Feed,
    pub learning_rate: f64,
}

/// Losses of a batch or of a shard of it.
#[derive(Debug, Default)]
pub(crate) struct Losses {
    pub total: f64,
    pub terms: Vec<(&'static str, f64)>,
}

/// Threads and buffers that one step leaves for the next.
pub(crate) struct Stepper {
    pool: ThreadPool,
    workspaces: Mutex<Vec<Workspace<f32>>>,
    /// One for each shard, zero between steps.
    gradients: Vec<Gradients<f32>>,
}

impl Stepper {
    pub fn new(
        parameters: &Parameters<f32>,
        shards: usize,
        threads: usize,
    ) -> Result<Self, TrainingError> {
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|cause| TrainingError::Threads { threads, cause })?;
        Ok(Self {
            pool,
            workspaces: Mutex::new(Vec::new()),
            gradients: vec![Gradients::zeros(parameters); shards],
        })
    }

    /// Runs something else on the threads of the steps.
    pub fn install<R: Send>(&self, run: impl FnOnce() -> R + Send) -> R {
        self.pool.install(run)
    }

    /// Computes the batch and moves the weights. Returns the losses before the move, and the norm of the gradient.
    ///
    /// # Errors
    /// The network refuses the batch; or a loss or gradient is not finite, and then weights and moments are as before; or the
    /// weights are not after it.
    pub fn step(
        &mut self,
        input: &StepInput<'_>,
        parameters: &mut Parameters<f32>,
        adam: &mut Adam<f32>,
    ) -> Result<(Losses, f64), TrainingError> {
        let result = self.try_step(input, parameters, adam);
        if result.is_err() {
            self.gradients.iter_mut().for_each(Gradients::set_zero);
        }
        result
    }

    fn try_step(
        &mut self,
        input: &StepInput<'_>,
        parameters: &mut Parameters<f32>,
        adam: &mut Adam<f32>,
    ) -> Result<(Losses, f64), TrainingError> {
        let shards = input.plan.shards(self.gradients.len());
        let (workspaces, gradients) = (&self.workspaces, &mut self.gradients);
        let (before, pool) = (&*parameters, &self.pool);
        let losses: Vec<Result<Losses, AutogradError>> = pool.install(|| {
            gradients
                .par_iter_mut()
                .zip(&shards)
                .map(|(gradients, shard)| {
                    let free = workspaces
                        .lock()
                        .unwrap_or_else(PoisonError::into_inner)
                        .pop();
                    let mut workspace = free.unwrap_or_default();
                    let losses = run_shard(input, before, &mut workspace, *shard, gradients, false);
                    workspaces
                        .lock()
                        .unwrap_or_else(PoisonError::into_inner)
                        .push(workspace);
                    losses
                })
                .collect()
        });
        let mut sum = Losses::default();
        for losses in losses {
            let losses = losses.map_err(|cause| failure(input, cause))?;
            sum.total += losses.total;
            if sum.terms.is_empty() {
                sum.terms = losses.terms;
            } else {
                for ((_, sum), (_, term)) in sum.terms.iter_mut().zip(losses.terms) {
                    *sum += term;
                }
            }
        }
        let norm = self
            .pool
            .install(|| adam.step(parameters, &mut self.gradients, input.learning_rate));
        match norm {
            Ok(norm) => match first_not_finite(parameters) {
                None => Ok((sum, norm)),
                Some((name, shape)) => Err(non_finite(
                    input,
                    format!("it left {name} {shape:?} with a NaN or an infinity"),
                )),
            },
            Err(error) => {
                let cause = self
                    .trace(input, parameters, &shards)
                    .map_or_else(|| error.to_string(), |cause| cause.to_string());
                Err(non_finite(input, cause))
            }
        }
    }

    /// Runs the shards once more, slowly, to find the first operation whose gradient is not finite.
    fn trace(
        &mut self,
        input: &StepInput<'_>,
        parameters: &Parameters<f32>,
        shards: &[Shard<'_>],
    ) -> Option<AutogradError> {
        let mut workspace = Workspace::new();
        // One sum for all shards: each may be finite where their sum is not.
        let gradients = self.gradients.first_mut()?;
        gradients.set_zero();
        shards
            .iter()
            .map(|shard| run_shard(input, parameters, &mut workspace, *shard, gradients, true))
            .find_map(Result::err)
    }
}

/// The first parameter with a NaN or an infinity, and its shape.
fn first_not_finite(parameters: &Parameters<f32>) -> Option<(&str, &[usize])> {
    // To the end in any case, so that it vectorises.
    let finite = |values: &[f32]| values.iter().fold(true, |all, x| all & x.is_finite());
    parameters
        .iter()
        .find(|(_, value)| !value.as_slice().is_some_and(finite))
        .map(|(name, value)| (name, value.shape()))
}

/// Losses of a shard; its gradients are added to `gradients`.
fn run_shard(
    input: &StepInput<'_>,
    parameters: &Parameters<f32>,
    workspace: &mut Workspace<f32>,
    shard: Shard<'_>,
    gradients: &mut Gradients<f32>,
    trace: bool,
) -> Result<Losses, AutogradError> {
    let batch = Batch {
        features: input.windows.features(shard.windows, input.plan.length),
        poses: match input.network.reads_poses() {
            true => input.windows.poses(shard.windows, input.plan.length),
            false => None,
        },
        total_windows: input.plan.windows.len(),
        single_frames: input.windows.single_frames(shard.single_frames),
        total_single_frames: input.plan.single_frames.len(),
    };
    let mut tape = Tape::recording(parameters, workspace)
        .with_dropout(input.streams.dropout(input.step, shard.index));
    if trace {
        tape = tape.with_trace();
    }
    let losses = input.network.losses(&mut tape, &batch, input.feed)?;
    let number = |var| tape.values(var).iter().map(|&x| f64::from(x)).sum::<f64>();
    let values = Losses {
        total: number(losses.total),
        terms: losses
            .terms
            .iter()
            .map(|&(name, var)| (name, number(var)))
            .collect(),
    };
    if !values.total.is_finite() || values.terms.iter().any(|(_, x)| !x.is_finite()) {
        tape.check_finite()?;
    }
    tape.backward(losses.total, gradients)?;
    Ok(values)
}

fn failure(input: &StepInput<'_>, cause: AutogradError) -> TrainingError {
    match cause {
        AutogradError::NonFinite { .. } => non_finite(input, cause.to_string()),
        cause => TrainingError::Step {
            step: input.step + 1,
            windows: input.plan.windows.len(),
            length: input.plan.length,
            cause: Box::new(cause),
        },
    }
}

fn non_finite(input: &StepInput<'_>, cause: String) -> TrainingError {
    TrainingError::NonFinite {
        step: input.step + 1,
        windows: input.plan.windows.len(),
        length: input.plan.length,
        cause,
    }
}
