//! Scores of dances sampled from a model: their numbers on a worked example and on recorded dances,
//! and what holds of them whatever the dance.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

use glam::DVec3;
use keydance::evaluation::PrintedTables;
use keydance::evaluation::frechet::frechet_distance;
use keydance::evaluation::sampled_dance::beat_alignment::{BeatAlignment, DanceBeats, Performance};
use keydance::evaluation::sampled_dance::divergence::leaves;
use keydance::evaluation::sampled_dance::diversity::within_dance_diversity;
use keydance::evaluation::sampled_dance::frechet::{
    fmd, fmd_as_published, fpd, fpd_as_published, without,
};
use keydance::evaluation::sampled_dance::freezing::{freezes, mean_joint_speed};
use keydance::evaluation::sampled_dance::kinematic_beats::{KinematicBeat, kinematic_beats};
use keydance::evaluation::sampled_dance::prompting::{Prompting, Style};
use keydance::evaluation::sampled_dance::step::mean_step;
use keydance::evaluation::sampled_dance::tempogram::{Tempogram, beat_curve};
use keydance::evaluation::sampled_dance::{HEIGHT, METRICS, share};
use keydance::report::figures::valleperez2021::tempograms::{TempogramPanel, figure_3};
use ndarray::{Array2, ArrayView2, Axis, array, concatenate, s};
use proptest::prelude::*;
use serde_json::Value;

use crate::motorica_data::motorica_folder;

const FPS: f64 = 20.0;

type Distance = fn(&[ArrayView2<'_, f64>], &[ArrayView2<'_, f64>]) -> Option<f64>;

const DISTANCES: [(&str, Distance); 4] = [
    ("fpd", fpd),
    ("fmd", fmd),
    ("fpd_as_published", fpd_as_published),
    ("fmd_as_published", fmd_as_published),
];

fn example() -> Value {
    serde_json::from_str(include_str!("sampled_dance_example.json")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().unwrap().iter();
    numbers.map(|number| number.as_f64().unwrap()).collect()
}

fn dance(value: &Value) -> Array2<f64> {
    let rows: Vec<Vec<f64>> = value.as_array().unwrap().iter().map(numbers).collect();
    Array2::from_shape_vec((rows.len(), rows[0].len()), rows.concat()).unwrap()
}

fn views(dances: &[Array2<f64>]) -> Vec<ArrayView2<'_, f64>> {
    dances.iter().map(|dance| dance.view()).collect()
}

fn near(ours: f64, expected: f64, bound: f64) -> bool {
    (ours - expected).abs() <= bound
}

/// A dance that no two columns of are alike.
fn waves(frames: usize, columns: usize, speed: f64) -> Array2<f64> {
    Array2::from_shape_fn((frames, columns), |(t, column)| {
        (speed * (t * t) as f64 * (column as f64 + 1.3)).sin() + 0.1 * column as f64
    })
}

/// `fmd_as_published` of the example in arithmetic of 60 digits. The program that wrote it gives
/// 10.644454: it takes roots of eigenvalues that are rounding of others, 10^16 times as large.
const EXACT: f64 = 10.644_463_140_270_671;

#[test]
fn distances_of_the_example_are_those_of_an_independent_program() {
    let example = &example()["frechet"];
    let sets = ["reference", "generated"].map(|set| -> Vec<Array2<f64>> {
        example[set].as_array().unwrap().iter().map(dance).collect()
    });
    let [reference, generated] = [views(&sets[0]), views(&sets[1])];
    for (name, distance) in DISTANCES {
        let written = example[name].as_f64().unwrap();
        let expected = match name {
            "fmd_as_published" => EXACT,
            _ => written,
        };
        assert!(near(written, expected, 1e-5));
        for (a, b) in [(&reference, &generated), (&generated, &reference)] {
            let ours = distance(a, b).unwrap();
            assert!(near(ours, expected, 1e-7), "{name}: {ours} {expected}");
        }
    }
}

#[test]
fn beat_alignment_of_the_example_is_that_of_an_independent_program() {
    let example = &example()["beat_alignment"];
    let of = |key: &str| example[key].as_f64().unwrap();
    let (height, music) = (
        numbers(&example["hip_height"]),
        numbers(&example["music_beats"]),
    );
    let dance = DanceBeats::of(&height, of("fps"));
    let offsets: Vec<f64> = dance.offsets(&music).collect();
    for (ours, key) in [(&dance.times, "kinematic_beats"), (&offsets, "offsets")] {
        let expected = numbers(&example[key]);
        assert_eq!(ours.len(), expected.len(), "{key}");
        for (ours, expected) in ours.iter().zip(expected) {
            assert!(near(*ours, expected, 1e-9), "{key}: {ours} {expected}");
        }
    }
    let alignment = BeatAlignment::matched(&[Performance {
        song: "the example",
        dance: &dance,
        music: &music,
    }]);
    for (ours, key) in [
        (alignment.mean, "mean"),
        (alignment.deviation, "sd"),
        (alignment.chance, "chance_mean"),
        (alignment.beats_per_second, "kinematic_beats_per_second"),
    ] {
        assert!(near(ours.unwrap(), of(key), 1e-9), "{key}: {ours:?}");
    }
    let ratio = of("mean") / of("chance_mean");
    assert!(near(alignment.over_chance().unwrap(), ratio, 1e-9));
    assert_eq!((alignment.dances, alignment.without_beat), (1, 0));
}

/// The Motorica dances at 20 fps: motion by dance, and the pieces of the split.
struct Motorica {
    dances: BTreeMap<String, Array2<f64>>,
    /// Dance, part, first frame, end.
    split: Vec<(String, String, usize, usize)>,
    beats: BTreeMap<String, Vec<f64>>,
}

impl Motorica {
    fn read(folder: &Path) -> Self {
        let lines = |file: &str| -> Vec<Vec<String>> {
            let text = fs::read_to_string(folder.join(file)).unwrap();
            let words = |line: &str| line.split(',').map(String::from).collect();
            text.lines().skip(1).map(words).collect()
        };
        let split = lines("split.csv").into_iter().map(|line| {
            let frame = |at: usize| line[at].parse().unwrap();
            (line[0].clone(), line[1].clone(), frame(2), frame(3))
        });
        let split: Vec<_> = split.collect();
        let mut beats: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for line in lines("beats.csv") {
            let of_dance = beats.entry(line[0].clone()).or_default();
            of_dance.push(line[2].parse().unwrap());
        }
        let motion = |dance: &String| -> Array2<f64> {
            let file = folder.join(format!("20fps/{dance}.motion.npy"));
            let motion: Array2<f32> = ndarray_npy::read_npy(file).unwrap();
            motion.mapv(f64::from)
        };
        let dances = split
            .iter()
            .map(|(dance, ..)| (dance.clone(), motion(dance)));
        Self {
            dances: dances.collect(),
            split,
            beats,
        }
    }

    fn pieces(&self, is_chosen: impl Fn(&str, &str) -> bool) -> Vec<ArrayView2<'_, f64>> {
        let chosen = self.split.iter().filter(|it| is_chosen(&it.0, &it.1));
        let piece = |(dance, _, first, end): &(String, String, usize, usize)| {
            self.dances[dance].slice(s![*first..*end, ..])
        };
        chosen.map(piece).collect()
    }
}

/// Distances by a QR decomposition of the movements themselves, in NumPy. `check.json` has 11.5299
/// and 5.4472, for the reason told at [`EXACT`].
const EXACT_OF_PARTS: [(&str, &str, f64); 2] = [
    ("validation", "fmd_as_published", 11.530_044_333),
    ("test", "fmd_as_published", 5.447_357_105),
];

#[test]
fn recorded_dances_lie_where_the_data_says_that_they_do() {
    let Some(folder) = motorica_folder() else {
        return;
    };
    let data = Motorica::read(&folder);
    let check = fs::read_to_string(folder.join("check.json")).unwrap();
    let check: Value = serde_json::from_str(&check).unwrap();
    let train = data.pieces(|_, part| part == "train");
    let test = |dance: &str, part: &str| part == "test" && dance != "lo_rocksteady";
    let mean = concatenate(Axis(0), &train)
        .unwrap()
        .mean_axis(Axis(0))
        .unwrap();
    let held = mean.broadcast((60, mean.len())).unwrap();
    let sets = [
        ("validation", data.pieces(|_, part| part == "validation")),
        ("test", data.pieces(|_, part| part == "test")),
        ("test_pieces_of_trained_dances", data.pieces(test)),
        (
            "lo_rocksteady",
            data.pieces(|dance, _| dance == "lo_rocksteady"),
        ),
        ("frozen_mean_pose", vec![held]),
    ];
    for (name, pieces) in &sets {
        let forms = [
            ("frechet_of_parts", ""),
            ("frechet_of_parts_as_published", "_as_published"),
        ];
        for (form, ending) in forms {
            for measure in ["fpd", "fmd"] {
                let Some(written) = check[form][name][measure].as_f64() else {
                    continue;
                };
                let key = format!("{measure}{ending}");
                let exact = EXACT_OF_PARTS
                    .iter()
                    .find(|it| (it.0, it.1) == (*name, &key));
                let expected = exact.map_or(written, |it| it.2);
                assert!(near(written, expected, 2e-4));
                let (_, distance) = DISTANCES.into_iter().find(|it| it.0 == key).unwrap();
                let ours = distance(&train, pieces).unwrap();
                assert!(
                    near(ours, expected, 6e-5),
                    "{name} {key}: {ours} {expected}"
                );
            }
        }
    }

    let edge = 200;
    let cut = |motion: &Array2<f64>| motion.slice(s![edge..-edge, HEIGHT]).to_vec();
    let danced = data.dances.iter().map(|(name, motion)| {
        let seconds = edge as f64 / FPS;
        let music: Vec<f64> = data.beats[name].iter().map(|at| at - seconds).collect();
        let dance = DanceBeats::of(&cut(motion), FPS);
        // Music ends before the edge, too.
        let music = music
            .into_iter()
            .filter(|at| (0.0..dance.duration).contains(at));
        (
            name.split("_d0").next().unwrap(),
            dance.clone(),
            music.collect::<Vec<f64>>(),
        )
    });
    let danced: Vec<(&str, DanceBeats, Vec<f64>)> = danced.collect();
    let performances: Vec<Performance<'_>> = danced
        .iter()
        .map(|(song, dance, music)| Performance { song, dance, music })
        .collect();
    let (matched, mismatched) = (
        BeatAlignment::matched(&performances),
        BeatAlignment::mismatched(&performances),
    );
    let expected = &check["beat_alignment_true"];
    for (ours, key) in [
        (matched.mean, "matched_mean"),
        (matched.deviation, "matched_sd"),
        (mismatched.mean, "mismatched_mean"),
        (mismatched.deviation, "mismatched_sd"),
    ] {
        let expected = expected[key].as_f64().unwrap();
        assert!(
            near(ours.unwrap(), expected, 5e-4),
            "{key}: {ours:?} {expected}"
        );
    }
    assert!(near(matched.beats_per_second.unwrap(), 1.4, 0.05));
    // Recorded dances are no nearer to their music than chance, by this measure.
    assert!(near(matched.over_chance().unwrap(), 1.0, 0.02));
    assert_eq!((mismatched.dances, mismatched.without_beat), (18, 0));

    let shorter: Vec<Array2<f64>> = train.iter().map(|it| without(*it, HEIGHT)).collect();
    let held = [without(held, HEIGHT)];
    let whole = fpd(&train, &sets[4].1).unwrap();
    let rest = fpd(&views(&shorter), &views(&held)).unwrap();
    let height = whole - rest;
    // The mean pose has the mean height, and no deviation.
    let deviation = check["training_part_20fps"]["motion_sd"][HEIGHT]
        .as_f64()
        .unwrap();
    assert!(
        near(height / deviation.powi(2), 1.0, 1e-3),
        "{height} {deviation}"
    );
}

#[test]
fn movements_stay_inside_a_dance_and_those_as_published_do_not() {
    let [one, two] = [waves(8, 2, 0.37), waves(7, 2, 0.11)];
    let reference = waves(40, 2, 0.73);
    let starts = |dance: &Array2<f64>, every: usize| -> Array2<f64> {
        let starts: Vec<usize> = (0..dance.nrows() - 2).step_by(every).collect();
        Array2::from_shape_fn((starts.len(), 6), |(row, at)| {
            dance[[starts[row] + at / 2, at % 2]]
        })
    };
    let inside = concatenate![Axis(0), starts(&one, 1), starts(&two, 1)];
    assert_eq!(inside.nrows(), 11);
    let expected = frechet_distance(starts(&reference, 1).view(), inside.view()).unwrap();
    let dances = [one.view(), two.view()];
    let ours = fmd(&[reference.view()], &dances).unwrap();
    assert!(near(ours, expected, 1e-9), "{ours} {expected}");

    let laid = concatenate![Axis(0), one, two];
    let ours = fmd_as_published(&[reference.view()], &dances).unwrap();
    let expected = fmd_as_published(&[reference.view()], &[laid.view()]).unwrap();
    assert_eq!(ours, expected);
    // The 15 frames are five movements, the third over the seam: each a vector of its own.
    let cut = starts(&laid, 3);
    let cut_reference = starts(&reference, 3);
    let expected = fpd_as_published(&[cut_reference.view()], &[cut.view()]).unwrap();
    assert!(near(ours, expected, 1e-9), "{ours} {expected}");
}

#[test]
fn what_has_no_distance_has_none() {
    let some = waves(12, 3, 0.3);
    let (none, other) = (Array2::zeros((0, 3)), waves(12, 2, 0.3));
    let mut broken = some.clone();
    broken[[4, 1]] = f64::NAN;
    for (name, distance) in DISTANCES {
        for bad in [&none, &other, &broken] {
            assert_eq!(distance(&[some.view()], &[bad.view()]), None, "{name}");
        }
        assert_eq!(distance(&[some.view()], &[]), None, "{name}");
        assert_eq!(
            distance(&[some.view()], &[some.view(), other.view()]),
            None,
            "{name}"
        );
        assert!(distance(&[some.view()], &[some.view()]).is_some(), "{name}");
    }
    // One frame has no covariance, but a second moment.
    let one = some.slice(s![..1, ..]);
    assert_eq!(fpd(&[some.view()], &[one]), None);
    assert!(fpd_as_published(&[some.view()], &[one]).is_some());
}

fn some_dance() -> impl Strategy<Value = Array2<f64>> {
    (12usize..40, 1usize..5).prop_flat_map(|(frames, columns)| {
        prop::collection::vec(-5.0..5.0f64, frames * columns)
            .prop_map(move |numbers| Array2::from_shape_vec((frames, columns), numbers).unwrap())
    })
}

proptest! {
    #[test]
    fn a_dance_is_no_way_from_itself(dance in some_dance()) {
        for (name, distance) in DISTANCES {
            let own = distance(&[dance.view()], &[dance.view()]).unwrap();
            prop_assert!(own < 1e-9, "{name}: {own}");
        }
    }

    #[test]
    fn the_order_of_frames_is_nothing_to_poses_and_something_to_movements(
        dance in some_dance(),
        seed in any::<u64>(),
    ) {
        let mut order: Vec<usize> = (0..dance.nrows()).collect();
        let mut state = seed;
        for at in (1..order.len()).rev() {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            order.swap(at, (state >> 33) as usize % (at + 1));
        }
        let shuffled = dance.select(Axis(0), &order);
        let reference = waves(50, dance.ncols(), 0.3);
        for distance in [fpd, fpd_as_published] {
            let before = distance(&[reference.view()], &[dance.view()]).unwrap();
            let after = distance(&[reference.view()], &[shuffled.view()]).unwrap();
            prop_assert!(near(before, after, 1e-9 * before.max(1.0)));
        }
        let moved = fmd(&[dance.view()], &[shuffled.view()]).unwrap();
        prop_assert!(moved > 1e-3 || order.is_sorted());
    }

    #[test]
    fn dances_count_by_their_frames_in_whatever_order(
        one in some_dance(),
        frames in 12usize..30,
    ) {
        let two = waves(frames, one.ncols(), 0.19);
        let reference = waves(50, one.ncols(), 0.3);
        for distance in [fpd, fmd, fpd_as_published] {
            let before = distance(&[reference.view()], &[one.view(), two.view()]).unwrap();
            let after = distance(&[reference.view()], &[two.view(), one.view()]).unwrap();
            prop_assert!(near(before, after, 1e-9 * before.max(1.0)));
        }
    }

    #[test]
    fn chance_is_the_mean_offset_of_all_moments(
        mut times in prop::collection::vec(0.0..30.0f64, 1..20),
        rest in 0.0..5.0f64,
    ) {
        times.sort_by(f64::total_cmp);
        let duration = times[times.len() - 1] + rest + 0.01;
        let dance = DanceBeats { times, duration };
        let moments = 40_000;
        let moment = |at: usize| (at as f64 + 0.5) * duration / f64::from(moments);
        let moments: Vec<f64> = (0..moments as usize).map(moment).collect();
        let offsets: Vec<f64> = dance.offsets(&moments).collect();
        prop_assert_eq!(offsets.len(), moments.len());
        let mean = offsets.iter().sum::<f64>() / offsets.len() as f64;
        prop_assert!(near(dance.chance().unwrap(), mean, 1e-5));
    }

    #[test]
    fn a_tempogram_does_not_see_how_high_or_how_large_a_curve_is(
        curve in prop::collection::vec(0.0..3.0f64, 200..260),
        up in -50.0..50.0f64,
        times in 0.01..100.0f64,
    ) {
        let plain = Tempogram::of(&curve, FPS).unwrap();
        let other: Vec<f64> = curve.iter().map(|x| times * (x + up)).collect();
        let other = Tempogram::of(&other, FPS).unwrap();
        for (a, b) in plain.strength.iter().zip(&other.strength) {
            prop_assert!(near(*a, *b, 1e-7), "{a} {b}");
        }
    }
}

#[test]
fn the_body_falls_fastest_between_the_top_and_the_bottom_of_a_wave() {
    // 1.25 Hz: tops every 0.8 s, the fall is fastest 0.2 s after each.
    let height = |t: usize| 80.0 + 3.0 * (TAU * 1.25 * t as f64 / FPS).cos();
    let height: Vec<f64> = (0..81).map(height).collect();
    let beats = kinematic_beats(&height, FPS);
    assert_eq!(beats.len(), 5);
    for (n, beat) in beats.iter().enumerate() {
        // Velocities lie between frames, so a minimum is told to half a frame.
        assert!(near(beat.time, 0.2 + 0.8 * n as f64, 0.026), "{beat:?}");
        // Smoothing takes exp(-(0.1 tau 1.25)^2 / 2) of 3 tau 1.25 cm/s.
        assert!(near(beat.velocity, -17.3, 0.5), "{beat:?}");
    }
    let climb: Vec<f64> = height
        .iter()
        .zip(0..)
        .map(|(y, t)| y + 2.0 * f64::from(t))
        .collect();
    assert_eq!(kinematic_beats(&climb, FPS), []);
    assert_eq!(kinematic_beats(&[80.0; 60], FPS), []);
    for frames in 0..4 {
        assert_eq!(kinematic_beats(&height[..frames], FPS), []);
    }
}

#[test]
fn a_dance_without_a_beat_is_counted_and_not_scored() {
    let still = DanceBeats::of(&[80.0; 100], FPS);
    let moving = DanceBeats {
        times: vec![1.0, 3.0],
        duration: 5.0,
    };
    assert_eq!(still.duration, 5.0);
    assert_eq!(still.chance(), None);
    let music = [0.5, 2.0, 4.9, 5.0, 7.0, -1.0, f64::NAN];
    let performance = |dance| Performance {
        song: "one",
        dance,
        music: &music,
    };
    let both = BeatAlignment::matched(&[performance(&still), performance(&moving)]);
    assert_eq!((both.dances, both.without_beat), (2, 1));
    // What lies outside the dance is no beat of its music: offsets 0.5, 1 and 1.9.
    assert!(near(both.mean.unwrap(), 3.4 / 3.0, 1e-12));
    assert!(near(both.chance.unwrap(), (1.0 + 0.5 + 2.0) / 5.0, 1e-12));
    assert!(near(both.beats_per_second.unwrap(), 0.2, 1e-12));
    let none = BeatAlignment::matched(&[performance(&still)]);
    assert_eq!(
        (none.mean, none.deviation, none.over_chance()),
        (None, None, None)
    );
    // Both dance to one song, so there is no other.
    let none = BeatAlignment::mismatched(&[performance(&still), performance(&moving)]);
    assert_eq!((none.mean, none.dances), (None, 0));
}

#[test]
fn mismatched_dances_have_the_music_of_every_other_song() {
    let dance = DanceBeats {
        times: vec![1.0, 2.0, 3.0],
        duration: 4.0,
    };
    let (on, off) = ([1.0, 2.0, 3.0], [1.5, 2.5]);
    let of = |song, music| Performance {
        song,
        dance: &dance,
        music,
    };
    let performances = [of("on", &on), of("on", &on), of("off", &off)];
    let matched = BeatAlignment::matched(&performances);
    assert!(near(matched.mean.unwrap(), 2.0 * 0.5 / 8.0, 1e-12));
    // Twice the two beats of "off", and for its dance twice the three of "on".
    let mismatched = BeatAlignment::mismatched(&performances);
    assert!(near(mismatched.mean.unwrap(), 4.0 * 0.5 / 10.0, 1e-12));
    assert_eq!(mismatched.dances, 4);
}

#[test]
fn chance_weighs_dances_as_the_offsets_do() {
    // A still, long dance to a slow song and a lively one to a fast song, both by chance.
    let lively = DanceBeats {
        times: (0..100).map(|n| 0.1 + 0.2 * f64::from(n)).collect(),
        duration: 20.0,
    };
    let slow = DanceBeats {
        times: vec![5.0, 15.0],
        duration: 20.0,
    };
    let evenly = |count: u32| -> Vec<f64> {
        let of = f64::from(count);
        (0..count)
            .map(|n| 20.0 * (f64::from(n) + 0.5) / of)
            .collect()
    };
    let (many, few) = (evenly(3000), evenly(1000));
    let alignment = BeatAlignment::matched(&[
        Performance {
            song: "fast",
            dance: &lively,
            music: &many,
        },
        Performance {
            song: "slow",
            dance: &slow,
            music: &few,
        },
    ]);
    assert!(near(alignment.over_chance().unwrap(), 1.0, 1e-3));
}

/// Beats of so many a minute over 30 s.
fn steady(tempo: f64) -> Tempogram {
    let beat = |n: u32| KinematicBeat {
        time: f64::from(n) * 60.0 / tempo,
        velocity: -10.0,
    };
    let beats: Vec<KinematicBeat> = (0..200).map(beat).collect();
    Tempogram::of(&beat_curve(&beats, 600, FPS), FPS).unwrap()
}

#[test]
fn a_steady_beat_shows_at_its_tempo_and_at_its_half_all_the_time() {
    let tempogram = steady(120.0);
    assert_eq!(tempogram.strength.dim(), (61, 43));
    assert_eq!(tempogram.times[..3], [0.0, 0.5, 1.0]);
    assert_eq!((tempogram.tempi[0], tempogram.tempi[42]), (30.0, 240.0));
    let at = |tempo: f64| tempogram.tempi.iter().position(|it| *it == tempo).unwrap();
    for time in tempogram.strength.rows() {
        for tempo in [120.0, 60.0, 40.0, 30.0] {
            assert!(time[at(tempo)] > 0.9, "{tempo}: {}", time[at(tempo)]);
        }
        for tempo in [240.0, 160.0, 80.0] {
            assert!(time[at(tempo)] < 0.1, "{tempo}: {}", time[at(tempo)]);
        }
    }
    // At another tempo other rows are strong, and on either side it falls off.
    let means = steady(100.0).mean_strength();
    assert!(means[at(100.0)] > 0.9 && means[at(120.0)] < 0.3);
    assert!(means[at(90.0)] < means[at(95.0)] && means[at(95.0)] < means[at(100.0)]);
}

#[test]
fn a_curve_without_a_beat_has_no_tempo() {
    let flat = Tempogram::of(&[0.3; 400], FPS).unwrap();
    assert!(flat.strength.iter().all(|strength| *strength == 0.0));
    assert_eq!(Tempogram::of(&[0.3; 159], FPS), None);
    assert_eq!(Tempogram::of(&[0.3; 400], 7.0), None);
    assert_eq!(Tempogram::of(&[0.3; 400], f64::NAN), None);
    assert_eq!(beat_curve(&[], 3, FPS), [0.0; 3]);
}

#[test]
fn figure_3_has_a_panel_for_each_tempogram() {
    let panel = |name: &str, tempo: f64| TempogramPanel {
        name: name.into(),
        tempogram: steady(tempo),
    };
    let names = ["Music", "Fine-tuned", "Transflower", "MoGlow", "a < b"];
    let panels: Vec<TempogramPanel> = names.map(|name| panel(name, 110.0)).to_vec();
    let figure = figure_3(&panels, "A dance.").unwrap();
    let document = roxmltree::Document::parse(&figure.svg).unwrap();
    let drawn = |class: &str| {
        let nodes = document.descendants();
        nodes
            .filter(|it| it.attribute("class") == Some(class))
            .count()
    };
    assert_eq!(drawn("tempogram"), 5);
    let texts: Vec<&str> = document.descendants().filter_map(|it| it.text()).collect();
    assert!(names.iter().all(|name| texts.contains(name)));
    assert!(texts.contains(&"120") && texts.contains(&"beats a minute"));
    assert!(figure.caption.starts_with("Figure 3. A dance."));

    let mut broken = panels.clone();
    broken[2].tempogram.strength[[1, 1]] = f64::NAN;
    let refused = |panels: &[TempogramPanel]| {
        let refused = figure_3(panels, "").err().unwrap();
        refused.to_string()
    };
    assert!(refused(&broken).contains("Transflower"));
    assert!(refused(&[]).contains("no tempogram"));
}

#[test]
fn a_dance_freezes_that_stands_for_five_seconds() {
    let walk = |frames: usize, still: usize| -> Vec<Vec<DVec3>> {
        let place = |t: usize| t.min(150) + (t.max(150 + still) - (150 + still));
        let joints = |t: usize| vec![DVec3::X * place(t) as f64, DVec3::ONE];
        (0..frames).map(joints).collect()
    };
    let speed = mean_joint_speed(&walk(400, 0), FPS);
    assert_eq!(speed.len(), 399);
    // One of two joints goes 20 cm/s.
    assert!(speed.iter().all(|speed| near(*speed, 10.0, 1e-9)));
    assert!(!freezes(&speed, 10.0, FPS));
    // A tenth of the usual speed is reached when 10 of the 100 frames move.
    for (still, frozen) in [(100, true), (91, true), (90, false), (40, false)] {
        let speed = mean_joint_speed(&walk(400, still), FPS);
        assert_eq!(freezes(&speed, 10.0, FPS), frozen, "{still}");
    }
    assert!(!freezes(&[0.0; 99], 10.0, FPS));
    assert!(mean_joint_speed(&walk(1, 0), FPS).is_empty());
    assert_eq!(share(&[true, false, false, true]), Some(50.0));
    assert_eq!(share(&[]), None);
}

#[test]
fn a_dance_leaves_at_its_first_number_beyond_ten_deviations() {
    let mut dance = Array2::zeros((6, 3));
    dance[[1, 0]] = 10.0;
    assert_eq!(leaves(dance.view()), None);
    dance[[5, 0]] = f64::NAN;
    assert_eq!(leaves(dance.view()), Some((5, 0)));
    dance[[3, 2]] = -10.1;
    assert_eq!(leaves(dance.view()), Some((3, 2)));
}

#[test]
fn a_repeated_piece_has_no_diversity_and_two_poses_have() {
    let piece = waves(60, 4, 0.3);
    let repeated = concatenate![Axis(0), piece, piece, piece];
    assert!(within_dance_diversity(repeated.view(), FPS).unwrap() < 1e-12);
    // A deviation apart in every mean, alike in the deviations; the rest is no whole piece.
    let other = &piece + 1.0;
    let two = concatenate![Axis(0), piece, other, waves(59, 4, 9.0)];
    let diversity = within_dance_diversity(two.view(), FPS).unwrap();
    assert!(near(diversity, 0.5f64.sqrt(), 1e-12), "{diversity}");
    // Twice as wide about the same means: by the deviations alone.
    let mean = piece.mean_axis(Axis(0)).unwrap();
    let wide = &piece * 2.0 - &mean;
    let two = concatenate![Axis(0), piece, wide];
    let deviation = piece.std_axis(Axis(0), 0.0);
    let expected = (deviation.dot(&deviation) / 8.0).sqrt();
    let diversity = within_dance_diversity(two.view(), FPS).unwrap();
    assert!(near(diversity, expected, 1e-12), "{diversity} {expected}");
    assert_eq!(within_dance_diversity(piece.view(), FPS), None);
    assert_eq!(
        within_dance_diversity(Array2::zeros((200, 0)).view(), FPS),
        None
    );
}

#[test]
fn a_step_is_a_mean_over_columns_frames_and_dances() {
    let one = array![[0.0, 1.0], [1.0, 1.0], [-1.0, 2.0]];
    let (two, short) = (array![[0.0, 0.0], [8.0, 0.0]], array![[5.0, 5.0]]);
    let step = mean_step(&[one.view(), short.view(), two.view()]).unwrap();
    assert!(near(step, (1.0 + 2.0 + 1.0 + 8.0) / 6.0, 1e-12));
    assert_eq!(mean_step(&[short.view()]), None);
    // Trembling goes further.
    let smooth = waves(100, 3, 0.001);
    let trembling = &smooth + &Array2::from_shape_fn((100, 3), |(t, _)| 0.3 * (t % 2) as f64);
    assert!(mean_step(&[trembling.view()]) > mean_step(&[smooth.view()]));
}

#[test]
fn seeds_set_the_style_where_dances_lie_nearest_to_it() {
    let style = |speed: f64| waves(60, 3, speed) + 5.0 * speed;
    let (one, two, three) = (style(0.1), style(0.5), style(0.9));
    let made = [&one + 0.1, &two + 0.1, &three - 9.0];
    let styles: Vec<Style<'_>> = [&one, &two, &three]
        .into_iter()
        .zip(&made)
        .map(|(truth, made)| Style {
            name: "a style".into(),
            truth: vec![truth.view()],
            made: vec![made.view()],
        })
        .collect();
    for (name, distance) in DISTANCES {
        let table = Prompting::of(&styles, distance).unwrap();
        let of = |row: &Array2<f64>, column: &Array2<f64>| {
            distance(&[row.view()], &[column.view()]).unwrap()
        };
        assert_eq!(table.distances.dim(), (3, 3));
        assert_eq!(table.distances[[0, 1]], of(&one, &made[1]), "{name}");
        assert_eq!(table.distances[[1, 0]], of(&two, &made[0]), "{name}");
        // The third's dances lie below all, so nearest to the first's.
        assert_eq!(table.own(), 2, "{name}");
    }
    // Where all styles are one no seed sets it.
    let alike = [styles[0].clone(), styles[0].clone()];
    assert_eq!(Prompting::of(&alike, fpd).unwrap().own(), 0);
    assert_eq!(Prompting::of(&styles, |_, _| None), None);
}

#[test]
fn every_printed_table_is_of_a_metric_and_holds_what_the_paper_says() {
    let file = "experiments/valleperez2021/paper.toml";
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap();
    let printed = PrintedTables::parse(&text, file).unwrap();
    let mut tabled: Vec<&str> = printed.tables.iter().map(|it| it.metric.as_str()).collect();
    let mut keys: Vec<&str> = METRICS.iter().map(|metric| metric.key).collect();
    tabled.sort_unstable();
    keys.sort_unstable();
    assert_eq!(tabled, keys);
    assert!(keys.windows(2).all(|pair| pair[0] != pair[1]));
    assert!(!printed.rows.is_empty());
    for row in &printed.rows {
        assert!(
            row.values
                .keys()
                .all(|metric| keys.contains(&metric.as_str()))
        );
    }

    // "The smallest FMD is found on the diagonal in three of five cases."
    let transflower = printed.row("transflower").unwrap();
    let values = transflower.values["prompted_fmd"].clone();
    let styles = ["FS", "CA", "HH", "BR", "GN"].map(String::from).to_vec();
    let table = Prompting {
        distances: Array2::from_shape_vec((5, 5), values).unwrap(),
        styles,
    };
    assert_eq!(transflower.values["prompted_own"], [table.own() as f64]);
    let columns = printed.columns_of("prompted_fmd");
    for ((row, column), distance) in table.distances.indexed_iter() {
        let name = format!("{} from {}", table.styles[row], table.styles[column]);
        assert_eq!(
            transflower.value("prompted_fmd", columns, &name),
            Some(*distance)
        );
    }
    // "Transflower captures the distribution best."
    for metric in ["fpd_as_published", "fmd_as_published"] {
        let all = printed.rows.iter().map(|row| row.values[metric][0]);
        let order: Vec<f64> = all.collect();
        assert!(order.windows(2).all(|pair| pair[0] > pair[1]), "{metric}");
    }
}
