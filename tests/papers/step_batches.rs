//! What a training step shows a network: mirror images, other tempi, single frames.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use keydance::autograd::{AutogradError, BlockId, Tape};
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::data::{DataConfig, Dataset, Split};
use keydance::experiment::ExperimentConfig;
use keydance::models::transition::{Batch, Forcing, Network, Standardisation};
use keydance::models::{LossTerms, Shards};
use keydance::motion::features::{FRAME, ROOT_POSITION, ROOT_VELOCITY};
use ndarray::{Array1, Array2, Array3, ArrayView2, Axis, s};

use crate::small_training::{settings, trainer_of_network};

/// A network with one weight that keeps what it was shown.
struct Witness {
    weight: BlockId,
    single_frames: usize,
    shown: Arc<Mutex<Vec<Batch<f32>>>>,
}

impl Network<f32> for Witness {
    fn single_frames(&self) -> usize {
        self.single_frames
    }

    fn losses(
        &self,
        tape: &mut Tape<'_, f32>,
        batch: &Batch<f32>,
        _forcing: Forcing,
    ) -> Result<LossTerms, AutogradError> {
        self.shown.lock().unwrap().push(batch.clone());
        let weight = tape.block(self.weight);
        let total = tape.sum(weight);
        Ok(LossTerms {
            total,
            critics: None,
            terms: vec![("weight", total)],
            buffers: Vec::new(),
            watched: Vec::new(),
        })
    }

    fn predict(
        &self,
        _tape: &mut Tape<'_, f32>,
        batch: &Batch<f32>,
    ) -> Result<Array3<f32>, AutogradError> {
        Ok(batch.features.slice(s![1.., .., ..FRAME]).to_owned())
    }
}

/// Two training clips and a test clip of generated dances, the root of frame t moved along X by
/// `by(t)`.
fn moved(by: impl Fn(usize) -> f64) -> Dataset {
    let clips = generate(&ChoreographyConfig {
        clips: 3,
        frames_per_clip: 90,
        seed: 3,
    });
    let clips = clips.unwrap().into_iter().map(|generated| {
        let mut clip = generated.clip;
        for (frame, pose) in clip.poses.iter_mut().enumerate() {
            pose.translations[0].x += by(frame);
        }
        clip
    });
    let config = DataConfig {
        split: Split::Share(0.7),
        ..DataConfig::default()
    };
    Dataset::from_clips(clips.collect(), &config).unwrap()
}

/// Far out on one side of the floor: in all windows p^r has an x above 1000, in their mirror images
/// below -1000.
fn one_sided() -> Dataset {
    moved(|_| 3000.0)
}

/// What 12 steps of 8 windows show, and the mean of p^r's x in the statistics.
fn shown(
    data: &Dataset,
    mirror: bool,
    shards: usize,
    single_frames: usize,
) -> (Vec<Batch<f32>>, f64) {
    let (batches, statistics) = shown_with(data, single_frames, |config| {
        settings(config).schedule.shards = Shards::Fixed(shards);
        settings(config).augmentation.mirror = mirror;
    });
    (batches, statistics.mean[ROOT_POSITION.start])
}

/// What 12 steps of 8 windows show with these changes of the config, and the statistics.
fn shown_with(
    data: &Dataset,
    single_frames: usize,
    change: impl FnOnce(&mut ExperimentConfig),
) -> (Vec<Batch<f32>>, Standardisation) {
    let mut config = ExperimentConfig::default();
    let own = settings(&mut config);
    own.schedule.min_len = 6;
    own.schedule.max_len = 6;
    own.schedule.batch_size = 8;
    own.schedule.shards = Shards::Fixed(1);
    change(&mut config);
    let shown = Arc::new(Mutex::new(Vec::new()));
    let witnessed = shown.clone();
    let mut trainer = trainer_of_network(config, data, 1, |init| {
        Box::new(Witness {
            weight: init.uniform("weight".into(), &[1], 1.0).1,
            single_frames,
            shown: witnessed,
        })
    });
    let trainer = trainer.as_mut().unwrap_or_else(|error| panic!("{error}"));
    let stop_at_12 = &mut |report: &keydance::training::StepReport| match report.step {
        12 => ControlFlow::Break(()),
        _ => ControlFlow::Continue(()),
    };
    trainer.run(None, stop_at_12).unwrap();
    let statistics = trainer.task().statistics();
    let of = |name: &str| -> Vec<f64> {
        let found = statistics.iter().find(|(known, _)| *known == name);
        found.unwrap().1.iter().copied().collect()
    };
    let statistics = Standardisation {
        mean: of("feature_mean"),
        std: of("feature_std"),
        position_scale: of("position_scale")[0],
        velocity_scale: of("velocity_scale")[0],
    };
    let batches = shown.lock().unwrap().clone();
    (batches, statistics)
}

/// The first frames of all windows, in order.
fn windows(batches: &[Batch<f32>]) -> Vec<Array1<f32>> {
    let mut rows: Vec<Array1<f32>> = batches
        .iter()
        .flat_map(|batch| {
            batch
                .features
                .index_axis(Axis(0), 0)
                .rows()
                .into_iter()
                .map(|row| row.to_owned())
                .collect::<Vec<_>>()
        })
        .collect();
    rows.sort_by(|a, b| a.iter().partial_cmp(b.iter()).unwrap());
    rows
}

/// The share of numbers below 0.
fn left_side(numbers: impl IntoIterator<Item = f32>) -> f64 {
    let numbers: Vec<f32> = numbers.into_iter().collect();
    numbers.iter().filter(|&&x| x < 0.0).count() as f64 / numbers.len() as f64
}

#[test]
fn half_of_the_windows_are_seen_in_the_mirror_and_the_statistics_are_those_of_both_sides() {
    let data = one_sided();
    let (plain, mean) = shown(&data, false, 1, 40);
    assert!(mean > 2000.0);
    let (batches, mean) = shown(&data, true, 1, 40);
    assert!(mean.abs() < 1e-6, "{mean}");
    assert_eq!(batches.len(), 12);
    let x = ROOT_POSITION.start;
    let share = left_side(windows(&batches).iter().map(|row| row[x]));
    assert!((0.35..0.65).contains(&share), "{share}");
    let single = batches.iter().flat_map(|batch| &batch.single_frames);
    let share = left_side(single.map(|frame| frame.window[[0, 0, x]]));
    assert!((0.42..0.58).contains(&share), "{share}");
    // The images are those of the very windows that the schedule has.
    let (images, others) = (windows(&batches), windows(&plain));
    let heights = |rows: &[Array1<f32>]| {
        let mut heights: Vec<f32> = rows.iter().map(|row| row[x + 1]).collect();
        heights.sort_by(f32::total_cmp);
        heights
    };
    for (image, other) in heights(&images).iter().zip(heights(&others)) {
        assert!((image - other).abs() < 1e-4, "{image} {other}");
    }
}

/// Shares of windows whose roots go at about 20, 40 and 80 cm a frame; all do.
fn shares_of_speeds<'w>(
    windows: impl Iterator<Item = ArrayView2<'w, f32>>,
    statistics: &Standardisation,
) -> [f64; 3] {
    let x = ROOT_VELOCITY.start;
    let mut counts = [0usize; 3];
    for window in windows {
        let mean = f64::from(window.column(x).slice(s![1..]).mean().unwrap());
        let speed = mean * statistics.std[x] + statistics.mean[x];
        let found = [20.0, 40.0, 80.0]
            .iter()
            .position(|&at| (speed / at - 1.0).abs() < 0.3);
        counts[found.unwrap_or_else(|| panic!("{speed} cm a frame"))] += 1;
    }
    let all: usize = counts.iter().sum();
    counts.map(|count| count as f64 / all as f64)
}

#[test]
fn windows_are_seen_at_every_tempo_and_the_statistics_are_those_of_the_recorded_one() {
    let data = moved(|frame| 40.0 * frame as f64);
    let (plain, recorded) = shown_with(&data, 40, |_| {});
    let (batches, statistics) = shown_with(&data, 40, |config| {
        settings(config).augmentation.tempi = vec![0.5, 2.0];
    });
    assert_eq!(statistics.mean, recorded.mean);
    assert_eq!(statistics.std, recorded.std);
    let windows = |batches: &[Batch<f32>]| -> Vec<Array2<f32>> {
        let of_batch = |batch: &Batch<f32>| -> Vec<Array2<f32>> {
            batch
                .features
                .axis_iter(Axis(1))
                .map(|window| window.to_owned())
                .collect()
        };
        batches.iter().flat_map(of_batch).collect()
    };
    let shares = |windows: &[Array2<f32>]| {
        shares_of_speeds(windows.iter().map(|window| window.view()), &statistics)
    };
    assert_eq!(shares(&windows(&plain)), [0.0, 1.0, 0.0]);
    for share in shares(&windows(&batches)) {
        assert!((0.2..0.47).contains(&share), "{share}");
    }
    // Of 89 frames of transition at most: where a clip is too short at twice the tempo, it is seen
    // as it was recorded.
    let single = batches.iter().flat_map(|batch| &batch.single_frames);
    let (long, short): (Vec<_>, Vec<_>) = single
        .map(|frame| frame.window.index_axis(Axis(1), 0))
        .partition(|window| window.nrows() > 45);
    let [slow, as_recorded, fast] = shares_of_speeds(short.into_iter(), &statistics);
    for share in [slow, as_recorded, fast] {
        assert!((0.24..0.43).contains(&share), "{share}");
    }
    let [slow, as_recorded, fast] = shares_of_speeds(long.into_iter(), &statistics);
    assert!((0.2..0.47).contains(&slow), "{slow}");
    assert!((0.53..0.8).contains(&as_recorded), "{as_recorded}");
    assert_eq!(fast, 0.0);
}

#[test]
fn shards_share_the_windows_and_single_frames_of_a_step_whatever_their_number() {
    let data = one_sided();
    let (one, _) = shown(&data, true, 1, 7);
    let (three, _) = shown(&data, true, 3, 7);
    assert_eq!((one.len(), three.len()), (12, 36));
    assert_eq!(windows(&one), windows(&three));
    for (step, shards) in one.iter().zip(three.chunks(3)) {
        assert_eq!(step.single_frames.len(), 7);
        let dealt: Vec<_> = shards
            .iter()
            .flat_map(|shard| shard.single_frames.clone())
            .collect();
        assert_eq!(step.single_frames, dealt);
        assert!(shards.iter().all(|shard| shard.total_single_frames == 7));
    }
    let (none, _) = shown(&data, true, 1, 0);
    assert_eq!(windows(&none), windows(&one));
}
