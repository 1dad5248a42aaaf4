//! The curriculum: which windows are trained in which batch of which epoch.

use rand::seq::SliceRandom;

use super::{ScheduleConfig, ScheduledSamplingConfig};
use super::{Window, windows};
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
    /// With a `fraction` below 1 whole batches are dealt: the windows due of a length that fill
    /// none go to the next length, so that a small share has steps of `batch_size` windows as any
    /// other, and the total is right to one batch.
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
                length => windows(clip_frames, length).windows.len(),
            })
            .collect();
        let growth = config.max_len.saturating_sub(config.min_len);
        let epochs = growth.div_ceil(config.max_len_step.max(1)) + 1;
        let (mut all, mut taken, mut steps) = (0usize, 0usize, 0u64);
        for epoch in 0..epochs {
            let longest = (config.min_len + config.max_len_step * epoch).min(config.max_len);
            let shortest =
                config.min_len + config.min_len_step * (epoch / config.min_len_every.max(1));
            let mut shares = Vec::new();
            for (length, &n) in available
                .iter()
                .enumerate()
                .take(longest + 1)
                .skip(shortest.min(longest))
            {
                if n == 0 && !schedule.skipped_lengths.contains(&length) {
                    schedule.skipped_lengths.push(length);
                }
                all += n;
                let due = (all as f64 * config.fraction).floor() as usize - taken;
                let count = if config.fraction < 1.0 {
                    (due - due % schedule.batch_size).min(n)
                } else {
                    due
                };
                taken += count;
                schedule.frame_steps += (count * length) as u64;
                schedule.whole_frame_steps += (n * length) as u64;
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
pub(super) fn parts(len: usize, count: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let (small, larger) = (len / count.max(1), len % count.max(1));
    (0..count).map(move |k| {
        let start = k * small + k.min(larger);
        start..start + small + usize::from(k < larger)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::{HashMap, HashSet};

    fn schedule(frames: &[usize], config: &ScheduleConfig, seed: u64) -> Schedule {
        Schedule::new(frames, config, Streams::new(seed))
    }

    #[test]
    fn lengths_grow_as_the_paper_says() {
        let schedule = schedule(&[200], &ScheduleConfig::default(), 1);
        assert_eq!(schedule.epochs(), 66);
        let lengths = |epoch: usize| {
            let shares = &schedule.epochs[epoch];
            (shares[0].length, shares[shares.len() - 1].length)
        };
        assert_eq!(lengths(0), (5, 5));
        assert_eq!(lengths(4), (5, 9));
        assert_eq!(lengths(5), (9, 10));
        assert_eq!(lengths(65), (57, 70));
    }

    #[test]
    fn teacher_forcing_of_the_whole_schedule_is_the_papers_and_of_a_fraction_ends_where_that_ends()
    {
        let frames = [900, 1400, 333];
        let whole = schedule(&frames, &ScheduleConfig::default(), 1);
        let sampling = ScheduledSamplingConfig::default();
        for step in [0, 1, 77, 4000] {
            let expected = 0.99995f64.powf(step as f64);
            assert_eq!(whole.teacher_forcing(&sampling, step), expected);
        }
        let config = ScheduleConfig {
            fraction: 0.01,
            ..ScheduleConfig::default()
        };
        let part = schedule(&frames, &config, 1);
        let ends = |s: &Schedule| s.teacher_forcing(&sampling, s.steps());
        assert!((ends(&part) - ends(&whole)).abs() < 1e-12);
    }

    #[test]
    fn lengths_that_no_clip_is_long_enough_for_are_skipped_and_named() {
        let config = ScheduleConfig {
            max_len: 9,
            ..ScheduleConfig::default()
        };
        let schedule = schedule(&[8, 3], &config, 1);
        assert_eq!(schedule.skipped_lengths(), [8, 9]);
        assert_eq!(schedule.epoch(4).len(), 3);
    }

    fn any_config() -> impl Strategy<Value = ScheduleConfig> {
        (
            1usize..8,
            0usize..12,
            1usize..4,
            0usize..4,
            1usize..4,
            1usize..40,
        )
            .prop_map(
                |(min_len, more, max_len_step, min_len_step, min_len_every, batch_size)| {
                    ScheduleConfig {
                        min_len,
                        max_len: min_len + more,
                        max_len_step,
                        min_len_step,
                        min_len_every,
                        batch_size,
                        ..ScheduleConfig::default()
                    }
                },
            )
    }

    proptest! {
        #[test]
        fn every_window_of_an_epoch_is_trained_exactly_once(
            config in any_config(), frames in prop::collection::vec(1usize..120, 1..5), seed: u64,
        ) {
            let schedule = schedule(&frames, &config, seed);
            let (mut steps, mut frame_steps) = (0, 0);
            for epoch in 0..schedule.epochs() {
                let batches = schedule.epoch(epoch);
                let mut seen = HashSet::new();
                for batch in &batches {
                    prop_assert!((1..=config.batch_size).contains(&batch.windows.len()));
                    for window in &batch.windows {
                        prop_assert!(seen.insert((batch.length, window.clip, window.start)));
                    }
                    frame_steps += batch.length * batch.windows.len();
                }
                let longest = (config.min_len + config.max_len_step * epoch).min(config.max_len);
                let shortest = (config.min_len + config.min_len_step * (epoch / config.min_len_every)).min(longest);
                let expected: HashSet<_> = (shortest..=longest)
                    .flat_map(|n| windows(&frames, n).windows.into_iter().map(move |w| (n, w.clip, w.start)))
                    .collect();
                prop_assert_eq!(seen, expected);
                if !batches.is_empty() {
                    prop_assert_eq!(schedule.place(steps), (epoch, 0));
                }
                steps += batches.len() as u64;
            }
            prop_assert_eq!(schedule.steps(), steps);
            prop_assert_eq!(schedule.frame_steps(), frame_steps as u64);
            prop_assert_eq!(schedule.place(steps), (schedule.epochs(), 0));
        }

        #[test]
        fn a_fraction_takes_that_share_of_the_windows_in_whole_batches_without_repeats(
            config in any_config(), frames in prop::collection::vec(20usize..300, 1..5), fraction in 0.001..1.0f64,
        ) {
            let part = ScheduleConfig { fraction, ..config.clone() };
            let trained = |config: &ScheduleConfig| {
                let schedule = schedule(&frames, config, 5);
                let batches: Vec<_> = (0..schedule.epochs()).map(|e| schedule.epoch(e)).collect();
                for epoch in &batches {
                    let mut of_length: HashMap<usize, Vec<usize>> = HashMap::new();
                    for batch in epoch {
                        of_length.entry(batch.length).or_default().push(batch.windows.len());
                    }
                    for (length, sizes) in of_length {
                        let all = windows(&frames, length).windows.len();
                        let full = sizes.iter().all(|&size| size == config.batch_size);
                        assert!(full || sizes.iter().sum::<usize>() == all, "{sizes:?} of {all}");
                    }
                }
                assert_eq!(batches.iter().map(Vec::len).sum::<usize>() as u64, schedule.steps());
                for epoch in &batches {
                    let windows: Vec<_> = epoch.iter().flat_map(|b| b.windows.iter().map(|w| (b.length, w.clip, w.start))).collect();
                    assert_eq!(windows.iter().collect::<HashSet<_>>().len(), windows.len());
                }
                batches.iter().flatten().map(|b| b.windows.len()).sum::<usize>()
            };
            let all = |config: &ScheduleConfig| schedule(&frames, config, 5).whole_frame_steps();
            prop_assert_eq!(all(&part), schedule(&frames, &config, 5).frame_steps());
            let (whole, part) = (trained(&config), trained(&part));
            let due = (whole as f64 * fraction).floor() as usize;
            prop_assert!(part <= due && due - part < config.batch_size, "{} of {}", part, due);
        }

        #[test]
        fn parts_cover_everything_in_order(len in 0usize..300, count in 1usize..20) {
            let ranges: Vec<_> = parts(len, count).collect();
            prop_assert_eq!(ranges.len(), count);
            prop_assert_eq!(ranges.iter().cloned().flatten().collect::<Vec<_>>(), (0..len).collect::<Vec<_>>());
            let sizes: Vec<usize> = ranges.iter().map(ExactSizeIterator::len).collect();
            prop_assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1);
        }
    }
}
