//! The curriculum: which windows are trained in which batch of which epoch.

use rand::seq::SliceRandom;

use super::Window;
use super::windows::{self, windows};
use super::{ScheduleConfig, ScheduledSamplingConfig};
use crate::models::streams::Streams;

/// Batch size that [`Schedule::teacher_forcing`] counts steps in, the paper's.
const REFERENCE_BATCH: usize = 128;

/// One batch of an epoch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BatchPlan {
    /// Frames of a transition, N; a window has N + 1.
    pub length: usize,
    /// At most `batch_size` windows of training clips.
    pub windows: Vec<Window>,
}

/// The windows of one length in one epoch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Share {
    length: usize,
    /// How many of the length's windows are trained.
    count: usize,
}

/// The whole schedule of a training, counted; an epoch's batches are drawn when it is their turn.
#[derive(Debug, Clone)]
pub struct Schedule {
    clip_frames: Vec<usize>,
    batch_size: usize,
    streams: Streams,
    epochs: Vec<Vec<Share>>,
    /// Steps before each epoch, and in all: one number more than epochs.
    first_steps: Vec<u64>,
    frame_steps: u64,
    whole_frame_steps: u64,
    skipped_lengths: Vec<usize>,
    reference_steps: u64,
}

impl Schedule {
    /// Counts the schedule for training clips of these numbers of frames.
    ///
    /// With a `fraction` below 1, or `frame_steps` in its place, whole batches are dealt: the
    /// windows due of a length that fill none go to the next length, so that a small share has
    /// steps of `batch_size` windows as any other, and the total is right to one batch.
    pub fn new(clip_frames: &[usize], config: &ScheduleConfig, streams: Streams) -> Self {
        let mut schedule = Self {
            clip_frames: clip_frames.to_vec(),
            batch_size: config.batch_size.max(1),
            streams,
            epochs: Vec::new(),
            first_steps: vec![0],
            frame_steps: 0,
            whole_frame_steps: 0,
            skipped_lengths: Vec::new(),
            reference_steps: 0,
        };
        let available: Vec<usize> = (0..=config.max_len)
            .map(|length| match length {
                0 => 0,
                length => windows::cut(length).count(clip_frames),
            })
            .collect();
        let growth = config.max_len.saturating_sub(config.min_len);
        let epochs = growth.div_ceil(config.max_len_step.max(1)) + 1;
        let lengths = |epoch: usize| {
            let longest = (config.min_len + config.max_len_step * epoch).min(config.max_len);
            let shortest =
                config.min_len + config.min_len_step * (epoch / config.min_len_every.max(1));
            shortest.min(longest)..=longest
        };
        let frames = |length: usize| (available[length] * length) as u64;
        schedule.whole_frame_steps = (0..epochs).flat_map(lengths).map(frames).sum();
        let whole = schedule.whole_frame_steps.max(1) as f64;
        let fraction = match config.frame_steps {
            Some(frame_steps) => (frame_steps as f64 / whole).min(1.0),
            None => config.fraction,
        };
        let (mut all, mut taken, mut steps) = (0usize, 0usize, 0u64);
        for epoch in 0..epochs {
            let mut shares = Vec::new();
            for length in lengths(epoch) {
                let n = available[length];
                if n == 0 && !schedule.skipped_lengths.contains(&length) {
                    schedule.skipped_lengths.push(length);
                }
                all += n;
                let due = (all as f64 * fraction).floor() as usize - taken;
                let count = if fraction < 1.0 {
                    (due - due % schedule.batch_size).min(n)
                } else {
                    due
                };
                taken += count;
                schedule.frame_steps += (count * length) as u64;
                schedule.reference_steps += n.div_ceil(REFERENCE_BATCH) as u64;
                steps += count.div_ceil(schedule.batch_size) as u64;
                if count > 0 {
                    shares.push(Share { length, count });
                }
            }
            schedule.epochs.push(shares);
            schedule.first_steps.push(steps);
        }
        schedule
    }

    /// Frames of the training clips.
    pub(super) fn clip_frames(&self) -> &[usize] {
        &self.clip_frames
    }

    pub fn epochs(&self) -> usize {
        self.epochs.len()
    }

    /// Optimiser steps of the whole schedule.
    pub fn steps(&self) -> u64 {
        self.first_steps.last().copied().unwrap_or(0)
    }

    /// Frames that the training predicts: N for each window.
    pub fn frame_steps(&self) -> u64 {
        self.frame_steps
    }

    /// Frames that it would predict with every window, whatever its fraction.
    pub fn whole_frame_steps(&self) -> u64 {
        self.whole_frame_steps
    }

    /// Lengths that no training clip is long enough for.
    pub fn skipped_lengths(&self) -> &[usize] {
        &self.skipped_lengths
    }

    /// Epoch and position in it of the step that `steps_done` steps come before; the number of
    /// epochs and 0 at the end.
    pub fn place(&self, steps_done: u64) -> (usize, usize) {
        let epoch = self.first_steps[1..].partition_point(|&end| end <= steps_done);
        let first = self.first_steps[epoch.min(self.epochs.len())];
        (epoch, steps_done.saturating_sub(first) as usize)
    }

    /// The batches of an epoch, in the order in which they are trained; none beyond the last epoch.
    ///
    /// A length's windows are dealt to as few batches as hold them, as evenly as possible: a rest
    /// of one window would be a step as large as any, in a direction that one window gives.
    pub fn epoch(&self, epoch: usize) -> Vec<BatchPlan> {
        let mut rng = self.streams.stream("shuffling", &[epoch as u64]);
        let mut batches = Vec::new();
        for &Share { length, count } in self.epochs.get(epoch).into_iter().flatten() {
            let mut all = windows(&self.clip_frames, length).windows;
            let (chosen, _) = all.partial_shuffle(&mut rng, count);
            batches.extend(
                parts(count, count.div_ceil(self.batch_size)).map(|range| BatchPlan {
                    length,
                    windows: chosen[range].to_vec(),
                }),
            );
        }
        batches.shuffle(&mut rng);
        batches
    }

    /// beta, the probability that the ground truth is fed at a step (counted from 0):
    /// `decay^(step r)`, where r is the number of steps of the whole schedule, with all windows in
    /// batches of 128, over the number of steps of this one.
    ///
    /// So a fraction of the schedule is that fraction of all of it: beta falls as far in its fewer
    /// steps. With fraction 1 and batches of 128 it is the paper's `decay^step`.
    pub fn teacher_forcing(&self, config: &ScheduledSamplingConfig, step: u64) -> f64 {
        let stretch = self.reference_steps as f64 / self.steps().max(1) as f64;
        config.decay.powf(step as f64 * stretch)
    }
}

/// `0..len` in `count` ranges whose lengths differ by one at most, the longer ones first.
pub(crate) fn parts(len: usize, count: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let (small, larger) = (len / count.max(1), len % count.max(1));
    (0..count).map(move |k| {
        let start = k * small + k.min(larger);
        start..start + small + usize::from(k < larger)
    })
}
