//! The curriculum and its batches.

use std::collections::{HashMap, HashSet};

use keydance::models::Streams;
use keydance::models::transition::{Schedule, ScheduleConfig, ScheduledSamplingConfig, windows};
use proptest::prelude::*;

fn schedule(frames: &[usize], config: &ScheduleConfig, seed: u64) -> Schedule {
    Schedule::new(frames, config, Streams::new(seed))
}

#[test]
fn lengths_grow_as_the_paper_says() {
    let schedule = schedule(&[200], &ScheduleConfig::default(), 1);
    assert_eq!(schedule.epochs(), 66);
    let lengths = |epoch: usize| {
        let lengths = schedule.epoch(epoch).into_iter().map(|batch| batch.length);
        (lengths.clone().min().unwrap(), lengths.max().unwrap())
    };
    assert_eq!(lengths(0), (5, 5));
    assert_eq!(lengths(4), (5, 9));
    assert_eq!(lengths(5), (9, 10));
    assert_eq!(lengths(65), (57, 70));
}

#[test]
fn teacher_forcing_of_the_whole_schedule_is_the_papers_and_of_a_fraction_ends_where_that_ends() {
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

#[test]
fn so_many_frame_steps_are_trained_of_however_many_clips() {
    let config = ScheduleConfig {
        max_len: 50,
        max_len_step: 5,
        batch_size: 32,
        frame_steps: Some(100_000),
        ..ScheduleConfig::default()
    };
    for clips in [6, 24, 100] {
        let trained = schedule(&vec![900; clips], &config, 1);
        assert!(trained.whole_frame_steps() > 1_000_000);
        let off = trained.frame_steps().abs_diff(100_000);
        // A batch, and that long windows are not dealt as often as short ones to the frame.
        assert!(off < 5_000, "{clips} clips: {}", trained.frame_steps());
    }
    let all = schedule(&[60], &config, 1);
    assert_eq!(all.frame_steps(), all.whole_frame_steps());
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
    fn the_windows_of_a_length_are_dealt_to_as_few_batches_as_hold_them_as_evenly_as_can_be(
        frames in 6usize..300, batch_size in 1usize..20,
    ) {
        let config = ScheduleConfig { batch_size, ..ScheduleConfig::default() };
        let sizes: Vec<usize> = schedule(&[frames], &config, 5).epoch(0).iter().map(|b| b.windows.len()).collect();
        prop_assert_eq!(sizes.len(), (frames - 5).div_ceil(batch_size));
        prop_assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1);
    }
}
