//! The protocol of dances to music: its numbers on real clips against an independent reference,
//! what a model is asked for, and what holds of its scores whatever the motion.

use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex};

use glam::{DQuat, DVec3};
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::data::{DataConfig, DataPart, Dataset, Split};
use keydance::evaluation::music_dance::MusicDance;
use keydance::evaluation::{Evaluation, EvaluationOptions, Protocol as _, Scores, TableRow};
use keydance::evaluation::{PrintedTables, ProtocolScores, Tables};
use keydance::experiment::ExperimentConfig;
use keydance::models::baselines::rotations::RotationBaseline;
use keydance::models::generator::{Condition, Given, NeededPoses, Needs};
use keydance::models::{Generator, ModelError, Motion, Request};
use keydance::motion::rotation_6d::rotation_6d;
use keydance::motion::{Clip, Pose, Skeleton};
use keydance::music::{Analysis, FeatureSet, HOP, RATE, Sound};
use ndarray::{Array2, Array3};

use crate::music_dance_data::music_dance_folder;

const INTERPOLATION: RotationBaseline = RotationBaseline::KeyPoseInterpolation;
const HOLD: RotationBaseline = RotationBaseline::HeldSeed;

/// A model that is a function of one request.
struct Model<F> {
    needs: Needs,
    answer: F,
}

impl<F: Fn(&Request) -> Motion + Send + Sync> Generator for Model<F> {
    fn name(&self) -> &str {
        "model of the test"
    }

    fn needs(&self) -> Needs {
        self.needs
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        let requests = requests.iter();
        requests
            .map(|request| {
                request.check(self.name(), &self.needs)?;
                Ok((self.answer)(request))
            })
            .collect()
    }
}

fn model(answer: impl Fn(&Request) -> Motion + Send + Sync) -> impl Generator {
    let needs = Needs {
        poses: NeededPoses::Seed(60),
        conditions: &[Condition::Music],
        heeds: &[],
    };
    Model { needs, answer }
}

fn motion(skeleton: &Skeleton, poses: Vec<Pose>) -> Motion {
    let world = skeleton.world_positions(&poses);
    let shape = (poses.len(), skeleton.len(), 3);
    let positions = Array3::from_shape_fn(shape, |(t, joint, axis)| world[t][joint][axis]);
    Motion {
        poses: Some(poses),
        ..Motion::new(positions)
    }
}

/// The dance itself, found by its first pose.
fn recorded(data: &Dataset, request: &Request) -> Motion {
    let clips = data.test.iter();
    let mut found = clips.filter_map(|recording| {
        let poses = &recording.clip.poses;
        let first = poses
            .iter()
            .position(|pose| *pose == request.given[0].pose)?;
        poses.get(first..first + request.frames)
    });
    motion(&request.skeleton, found.next().unwrap().to_vec())
}

/// Clicks, two a second, in so many frames.
fn clicks(frames: usize) -> Arc<Analysis> {
    let click = |n: usize| if n % 11_025 < 200 { 0.5 } else { 0.0 };
    let samples: Vec<f32> = (0..frames * HOP).map(click).collect();
    let sound = Sound::new("clicks", &samples, RATE).unwrap();
    Arc::new(Analysis::of(&sound).unwrap())
}

/// Four generated clips of so many frames, two to train on, with music of as many frames; some
/// frames are called new.
fn made_up(frames: usize, change: impl Fn(&mut Clip)) -> Dataset {
    let config = ChoreographyConfig {
        clips: 4,
        frames_per_clip: frames,
        seed: 5,
    };
    let clips = generate(&config).unwrap().into_iter().map(|generated| {
        let mut clip = generated.clip;
        change(&mut clip);
        clip
    });
    let data = DataConfig {
        split: Split::Share(0.5),
        ..DataConfig::default()
    };
    let mut data = Dataset::from_clips(clips.collect(), &data).unwrap();
    let music = clicks(frames);
    for recording in data.train.iter_mut().chain(&mut data.test) {
        recording.music = Some(music.clone());
    }
    let novel = vec![100..105, 190..200];
    let novel = [(data.test[0].name().to_string(), novel)];
    data.named_frames.insert("novel".into(), novel.into());
    data
}

fn evaluate(model: &dyn Generator, data: &Dataset) -> Evaluation {
    let protocol = MusicDance::new(&EvaluationOptions::default());
    protocol.evaluate(model, data, DataPart::Test).unwrap()
}

fn at(scores: &Scores, metric: &str, column: &str) -> f64 {
    let row = scores.row(metric).unwrap_or_else(|| panic!("no {metric}"));
    row.at(column)
        .unwrap_or_else(|| panic!("no {metric} {column}"))
}

fn all_numbers(scores: &Scores) -> Vec<(String, f64)> {
    let rows = scores.rows().flat_map(|(metric, row)| {
        let columns = row.columns();
        columns.map(move |column| (format!("{metric} {column}"), row.at(column).unwrap()))
    });
    rows.collect()
}

#[test]
fn scores_on_the_real_clips_are_those_of_an_independent_program() {
    let Some(folder) = music_dance_folder() else {
        return;
    };
    let config = DataConfig {
        split: Split::MusicDance,
        music: true,
        ..DataConfig::default()
    };
    let data = Dataset::load(&folder, &config).unwrap();
    let scored = [("interpolation", INTERPOLATION), ("hold", HOLD)];
    let scored = scored.map(|(name, model)| (name, evaluate(&model, &data)));
    for (name, Evaluation { scores, warnings }) in &scored {
        assert!(warnings.is_empty(), "{warnings:?}");
        for (column, count) in [("1", 7), ("5", 7), ("all", 144), ("novel", 92)] {
            assert_eq!(scores.windows_of(column), Some(count));
        }
        // Nothing moves, so these have no ratio.
        for metric in ["smoothness", "smoothness_median", "step_variation"] {
            assert_eq!(scores.row(metric).is_none(), *name == "hold");
        }
    }
    let reference = include_str!("music_dance_reference.txt");
    assert!(reference.lines().count() > 60);
    for line in reference.lines() {
        let mut words = line.split(' ');
        let mut word = || words.next().unwrap();
        let (subject, metric, column) = (word(), word(), word());
        let expected: f64 = word().parse().unwrap();
        // The reference takes the mean over all shifts, ours over 200 of them.
        let bound = match metric.ends_with("_chance") {
            true => 0.03,
            false => 1e-7,
        };
        for (name, Evaluation { scores, .. }) in &scored {
            if subject == "both" || subject == *name {
                let ours = at(scores, metric, column);
                let error = (ours - expected).abs();
                assert!(
                    error <= bound * expected.abs() + 1e-9,
                    "{line}, {name}: {ours}"
                );
            }
        }
    }
}

#[test]
fn a_model_is_given_seed_key_poses_and_the_music_of_its_frames() {
    let frames = 425;
    let mut data = made_up(frames, |_| {});
    // The music of the first clip is a frame shorter.
    data.test[0].music = Some(clicks(frames - 1));
    let asked = Mutex::new(Vec::new());
    evaluate(
        &model(|request| {
            asked.lock().unwrap().push(request.clone());
            recorded(&data, request)
        }),
        &data,
    );
    let asked = asked.into_inner().unwrap();
    // Windows from 0, 90 and 180 of each clip, and each whole.
    assert_eq!(asked.len(), 8);
    for request in &asked {
        let clips = data.test.iter();
        let (recording, start) = clips
            .filter_map(|recording| {
                let mut poses = recording.clip.poses.iter();
                let start = poses.position(|pose| *pose == request.given[0].pose)?;
                Some((recording, start))
            })
            .next()
            .unwrap();
        let keys: &[i64] = match request.frames {
            240 => &[104, 149, 194, 239],
            _ => &[104, 149, 194, 239, 284, 329, 374, 419],
        };
        let expected: Vec<i64> = (0..60).chain(keys.iter().copied()).collect();
        let given: Vec<i64> = request.given.iter().map(|given| given.frame).collect();
        assert_eq!(given, expected);
        for Given { frame, pose, .. } in &request.given {
            assert_eq!(*pose, recording.clip.poses[start + *frame as usize]);
        }
        let features = recording
            .music
            .as_ref()
            .unwrap()
            .features(FeatureSet::Paper15);
        let heard = request.music.as_ref().unwrap();
        assert_eq!(heard.dim(), (request.frames, 15));
        for (frame, row) in heard.rows().into_iter().enumerate() {
            let expected = features.row((start + frame).min(features.nrows() - 1));
            assert!(row.iter().zip(expected).all(|(a, b)| *a == f64::from(*b)));
        }
        assert_eq!(request.root, None);
    }
    let mut seeds: Vec<u64> = asked.iter().map(|request| request.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    // The whole clip begins where its first window does.
    assert_eq!(seeds.len(), 6);
}

#[test]
fn the_recorded_dance_itself_has_no_error_and_the_real_dances_scores() {
    let data = made_up(425, |_| {});
    let scores = evaluate(&model(|request| recorded(&data, request)), &data).scores;
    for metric in ["consistency", "key_pose_error", "position_error"] {
        for column in ["all", "novel"] {
            let error = at(&scores, metric, column);
            assert!(error < 1e-12, "{metric} {column}: {error}");
        }
    }
    for metric in ["fid_kinetic", "fid_geometric"] {
        assert!(at(&scores, metric, "all") < 1e-5, "{metric}");
    }
    for (metric, real) in [
        ("smoothness", "smoothness_real"),
        ("smoothness_median", "smoothness_real_median"),
        ("step_variation", "step_variation_real"),
        ("jerk", "jerk_real"),
        ("beat_hit_rate", "beat_hit_rate_real"),
        ("beat_alignment", "beat_alignment_real"),
        ("beat_alignment_of_dance", "beat_alignment_of_dance_real"),
        ("diversity_kinetic", "diversity_kinetic_real"),
        ("diversity_geometric", "diversity_geometric_real"),
    ] {
        for column in scores.row(real).unwrap().columns() {
            let [ours, real] = [metric, real].map(|metric| at(&scores, metric, column));
            assert!(
                (ours - real).abs() <= 1e-9 * real,
                "{metric}: {ours} {real}"
            );
        }
    }
    // Frames 60 to 239 have both ranges, 150 to 329 the second, 240 to 419 none.
    assert_eq!(scores.windows_of("novel"), Some(2));
}

#[test]
fn consistency_takes_the_numbers_as_they_were_given_and_all_else_the_poses() {
    let data = made_up(300, |_| {});
    let with_raw = |change: f64| {
        let answer = |request: &Request| {
            let answer = recorded(&data, request);
            let poses = &answer.poses.as_ref().unwrap()[60..];
            let mut raw = Array2::zeros((poses.len(), 6 * 24 + 3));
            for (mut row, pose) in raw.rows_mut().into_iter().zip(poses) {
                let numbers = pose.rotations.iter().flat_map(|&q| rotation_6d(q));
                row.iter_mut().zip(numbers).for_each(|(into, x)| *into = x);
                row[17] += change;
                // The root is no part of the error.
                row[145] = 1e6;
            }
            Motion {
                raw: Some(raw),
                ..answer
            }
        };
        evaluate(&model(answer), &data).scores
    };
    let scores = with_raw(0.5);
    assert!((at(&scores, "consistency", "all") - 0.25).abs() < 1e-12);
    assert!(at(&scores, "key_pose_error", "all") < 1e-12);
    assert!(at(&with_raw(0.0), "consistency", "all") < 1e-24);
}

#[test]
fn turning_and_moving_the_world_changes_no_score() {
    let turned = |clip: &mut Clip| {
        let (turn, by) = (DQuat::from_rotation_y(2.1), DVec3::new(250.0, 0.0, -40.0));
        for pose in &mut clip.poses {
            pose.translations[0] = turn * pose.translations[0] + by;
            pose.rotations[0] = turn * pose.rotations[0];
        }
    };
    for model in [INTERPOLATION, HOLD] {
        let [here, there] = [made_up(425, |_| {}), made_up(425, turned)]
            .map(|data| all_numbers(&evaluate(&model, &data).scores));
        assert_eq!(here.len(), there.len());
        for ((name, here), (_, there)) in here.iter().zip(&there) {
            let error = (here - there).abs();
            assert!(error <= 1e-6 * here.abs() + 1e-9, "{name}: {here} {there}");
        }
    }
}

#[test]
fn the_scores_are_the_same_to_the_bit_on_any_number_of_threads() {
    let data = made_up(425, |_| {});
    let scores = [1, 3].map(|threads| {
        let pool = rayon_pool(threads);
        pool.install(|| evaluate(&INTERPOLATION, &data))
    });
    assert_eq!(scores[0], scores[1]);
}

fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build().unwrap()
}

#[test]
fn interpolation_meets_every_pose_that_it_is_given_and_holds_the_last() {
    let data = made_up(300, |_| {});
    let clip = &data.test[0].clip;
    let mut request = Request::new(clip.skeleton.clone(), clip.frame_time, 120);
    let given = |frame: usize| Given {
        frame: frame as i64,
        pose: clip.poses[frame].clone(),
        features: None,
    };
    request.given = (0..60).chain([80, 101]).map(given).collect();
    let poses = |model: RotationBaseline, request: &Request| {
        let motions = model.generate(std::slice::from_ref(request)).unwrap();
        motions.into_iter().next().unwrap().poses.unwrap()
    };
    let same = |a: &Pose, b: &Pose| {
        let rotations = a.rotations.iter().zip(&b.rotations);
        rotations
            .clone()
            .all(|(a, b)| a.dot(*b).abs() > 1.0 - 1e-12)
            && a.translations[0].distance(b.translations[0]) < 1e-9
    };
    let made = poses(INTERPOLATION, &request);
    assert_eq!(made.len(), 120);
    for Given { frame, pose, .. } in &request.given {
        assert!(same(&made[*frame as usize], pose), "{frame}");
    }
    assert!(same(
        &made[70],
        &clip.poses[59].towards(&clip.poses[80], 11.0 / 21.0)
    ));
    assert!(made[101..].iter().all(|pose| *pose == clip.poses[101]));
    let held = poses(HOLD, &request);
    assert!(held[..60].iter().zip(&clip.poses).all(|(a, b)| same(a, b)));
    assert!(held[60..].iter().all(|pose| *pose == clip.poses[59]));
    // A seed alone, and none.
    request.given.truncate(1);
    for model in [INTERPOLATION, HOLD] {
        assert!(
            poses(model, &request)
                .iter()
                .all(|pose| *pose == clip.poses[0])
        );
    }
    request.given.clear();
    assert!(HOLD.generate(&[request]).is_err());
}

#[test]
fn what_cannot_be_scored_is_refused_with_a_remedy_or_named() {
    let refused = |data: &Dataset| {
        let protocol = MusicDance::new(&EvaluationOptions::default());
        let refused = protocol.evaluate(&HOLD, data, DataPart::Test);
        refused.unwrap_err().to_string()
    };
    let mut data = made_up(300, |_| {});
    data.test[1].music = None;
    assert!(refused(&data).contains("data.music = true"));
    let mut data = made_up(300, |_| {});
    data.train[0].clip.frame_time = 1.0 / 25.0;
    assert!(refused(&data).contains("data.fps = 30"));
    assert!(refused(&made_up(239, |_| {})).contains("240 frames"));
    let mut data = made_up(300, |_| {});
    data.train[0].clip.skeleton.joints[12].name = "Chest".into();
    assert!(refused(&data).contains("other joints"));
    let mut data = made_up(300, |_| {});
    data.test[1].clip.poses.truncate(200);
    let Evaluation { scores, warnings } = evaluate(&HOLD, &data);
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains(data.test[1].name()) && warnings[0].contains("200 frames"));
    assert_eq!(
        (scores.windows_of("all"), scores.windows_of("1")),
        (Some(1), Some(1))
    );
    // One window has no covariance and no pairs.
    assert_eq!(scores.row("fid_kinetic"), None);
}

#[test]
fn a_bad_answer_is_an_error_that_says_which() {
    let data = made_up(300, |_| {});
    let refused = |change: &(dyn Fn(&mut Motion) + Sync)| {
        let model = model(|request| {
            let mut answer = recorded(&data, request);
            change(&mut answer);
            answer
        });
        let protocol = MusicDance::new(&EvaluationOptions::default());
        let error = protocol
            .evaluate(&model, &data, DataPart::Test)
            .unwrap_err();
        let cause = std::error::Error::source(&error).map(ToString::to_string);
        format!("{error}: {}", cause.unwrap_or_default())
    };
    let short = refused(&|motion| motion.raw = Some(Array2::zeros((3, 147))));
    assert!(short.contains("raw output has shape [3, 147]"), "{short}");
    let endless = refused(&|motion| motion.raw = Some(Array2::from_elem((300, 147), f64::NAN)));
    assert!(endless.contains("raw output has a NaN"), "{endless}");
    let none = refused(&|motion| {
        let poses = motion.poses.as_mut().unwrap();
        poses[100].rotations[3] = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    });
    assert!(
        none.contains("predicted rotations") && none.contains("frames 0 to 239"),
        "{none}"
    );
}

#[test]
fn a_model_of_positions_alone_is_scored_by_the_rotations_that_fit_them() {
    let data = made_up(300, |_| {});
    let scores = evaluate(
        &model(|request| Motion {
            poses: None,
            ..recorded(&data, request)
        }),
        &data,
    );
    assert!(at(&scores.scores, "key_pose_error", "all") < 0.5);
}

/// The dance of a request with its root walking along X, slowest at these frames.
fn slow_at(request: &Request, beats: &[usize]) -> Motion {
    let from = &request.given[59].pose;
    let mut poses: Vec<Pose> = request.given[..60]
        .iter()
        .map(|it| it.pose.clone())
        .collect();
    let mut place = from.translations[0];
    for frame in 60..request.frames {
        let away = beats.iter().map(|beat| beat.abs_diff(frame)).min();
        place.x += away.unwrap_or(0).min(8) as f64;
        let mut pose = from.clone();
        pose.translations[0] = place;
        poses.push(pose);
    }
    motion(&request.skeleton, poses)
}

#[test]
fn beats_that_a_dance_keeps_to_are_hit_more_often_than_shifted_ones_and_others_are_not() {
    let mut data = made_up(900, |_| {});
    // At distances of which no shift repeats many.
    let beats: Vec<usize> = (0..36)
        .map(|beat| 20 * beat + beat * beat / 6 + 65)
        .collect();
    let music = data.test[0].music.as_ref().unwrap();
    let music = Arc::new(Analysis {
        beats: beats.clone(),
        ..Analysis::clone(music)
    });
    for recording in &mut data.test {
        recording.music = Some(music.clone());
    }
    // Windows are of no concern to the beats.
    let rates = |late: usize| {
        let late: Vec<usize> = beats.iter().map(|beat| beat + late).collect();
        let scores = evaluate(&model(|request| slow_at(request, &late)), &data).scores;
        [2, 3].map(|delta| {
            let of = |metric| at(&scores, metric, &delta.to_string());
            [of("beat_hit_rate"), of("beat_hit_rate_shifted")]
        })
    };
    for [hits, shifted] in rates(0) {
        assert!(hits > 90.0 && shifted < 70.0, "{hits} {shifted}");
    }
    for [hits, shifted] in rates(9) {
        assert!(hits < shifted, "{hits} {shifted}");
    }
    // Of the recorded dance the bound lies above the mean over the same shifts.
    let scores = evaluate(&model(|request| recorded(&data, request)), &data).scores;
    for delta in ["1", "2", "3", "4", "5"] {
        let of = |metric| at(&scores, metric, delta);
        assert!(of("beat_hit_rate_shifted") > of("beat_hit_rate_chance"));
    }
}

#[test]
fn a_config_says_which_extrema_are_beats() {
    let data = made_up(425, |_| {});
    let rate = |extrema: &str| {
        let hold = include_str!("../../experiments/pu2022/hold.toml");
        let config =
            ExperimentConfig::parse(&format!("{hold}motion_beats = \"{extrema}\"\n"), "a config");
        let protocols = config.unwrap().protocols();
        let scores = protocols[0].evaluate(&HOLD, &data, DataPart::Test).unwrap();
        at(&scores.scores, "beat_hit_rate_real", "5")
    };
    let [minima, maxima, both] = ["minima", "maxima", "both"].map(rate);
    assert!((minima + maxima - both).abs() < 1e-9);
    assert!(minima > 0.0 && maxima > 0.0);
}

#[test]
fn the_papers_tables_stand_by_themselves_with_their_own_rows_and_columns() {
    let paper = keydance::evaluation::music_dance::PU2022;
    let printed = PrintedTables::parse(paper.printed, "pu2022/paper.toml").unwrap();
    let value = |row: &str, metric: &str, column: &str| {
        let columns = printed.columns_of(metric);
        printed.row(row).unwrap().value(metric, columns, column)
    };
    assert_eq!(value("small", "consistency", "all"), Some(0.0839));
    assert_eq!(value("small", "beat_hit_rate", "3"), Some(25.9));
    assert_eq!(
        value("larger_lambda0_sigma02", "smoothness", "all"),
        Some(220.45)
    );
    let data = made_up(425, |_| {});
    let row = |name: &str, model: &dyn Generator| TableRow {
        name: name.into(),
        seed: None,
        scores: Some(ProtocolScores::new([(
            "music_dance",
            evaluate(model, &data).scores,
        )])),
        schedule_note: "not trained".into(),
    };
    let rows = [row("hold", &HOLD), row("small", &INTERPOLATION)];
    let protocols = (paper.protocols)(&DataConfig::default(), &EvaluationOptions::default());
    let tables = Tables {
        protocols: &protocols,
        printed: &printed,
    };
    let text = tables.markdown(&rows, "two clips");
    let table = |title: &str| {
        let mut found = text.split("## ").filter(|table| table.starts_with(title));
        let first = found.next().unwrap_or_else(|| panic!("no {title}: {text}"));
        first.to_string()
    };
    let first = table("Table 1: consistency error");
    assert!(first.contains("| Model |  | all | novel |"), "{first}");
    assert!(
        first.contains("| Light, lambda 5, sigma 0.05 | paper | 0.0839 | - |"),
        "{first}"
    );
    assert!(
        !first.contains("hold") && !first.contains("Large"),
        "{first}"
    );
    assert!(first.contains("on other data"), "{first}");
    assert!(table("Table 3").contains("Large, lambda 5, sigma 0.05"));
    let beats = table("Table 5: beat hit rate\n");
    assert!(
        beats.contains("| delta = 1 | delta = 2 |") && beats.contains("| hold |"),
        "{beats}"
    );
    assert!(!beats.contains("novel"), "{beats}");
    let text = tables.terminal(&rows);
    assert!(
        text.contains("beat hit rate (%)") && text.contains("windows, hold"),
        "{text}"
    );
}

#[test]
fn every_row_that_is_trained_has_a_config_and_all_are_on_the_same_data() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/pu2022");
    let mut configs = Vec::new();
    for file in fs::read_dir(&folder).unwrap() {
        let file = file.unwrap().path();
        if !file.ends_with("paper.toml") {
            configs.push(ExperimentConfig::load(&file, &[]).unwrap());
        }
    }
    let names: Vec<&str> = configs.iter().map(|config| &*config.name).collect();
    let text = fs::read_to_string(folder.join("paper.toml")).unwrap();
    let printed = PrintedTables::parse(&text, "paper.toml").unwrap();
    // Two sizes, four lambdas, three sigmas.
    assert_eq!(printed.rows.len(), 24);
    let rows = printed.rows.iter().map(|row| &row.name);
    let in_tables = printed
        .tables
        .iter()
        .filter_map(|table| table.rows.as_ref());
    // Of the larger size one row is trained, that of the best consistency.
    let printed_alone = |name: &&String| name.starts_with("larger_");
    let rows = rows.chain(in_tables.flatten());
    for name in rows.filter(|name| !printed_alone(name)) {
        assert!(names.contains(&&**name), "{name}");
    }
    let protocol = MusicDance::new(&EvaluationOptions::default());
    for table in &printed.tables {
        let mut metrics = protocol.metrics().iter();
        assert!(
            metrics.any(|metric| metric.key == table.metric),
            "{table:?}"
        );
    }
    for config in &configs {
        assert_eq!(config.data, configs[0].data, "{}", config.name);
        assert!(config.data.music && config.data.split == Split::MusicDance);
    }
}
