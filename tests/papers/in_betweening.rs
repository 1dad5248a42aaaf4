//! The protocol of Li et al.: its numbers on real clips against an independent reference, what a
//! model is given, and what holds of its scores whatever the motion.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Mutex;

use glam::{DQuat, DVec3};
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::data::{DataConfig, DataPart, Dataset, Recording, Split};
use keydance::evaluation::in_betweening::{Deviations, InBetweening, Npss, l2p, l2q};
use keydance::evaluation::{EvaluationOptions, Protocol as _, Scores};
use keydance::models::generator::{Condition, NeededPoses, Needs};
use keydance::models::{Generator, ModelError, Motion, Request};
use keydance::motion::root_reconstruction::reconstruct_root;
use keydance::motion::rotation_window::{Interpolation, between};
use keydance::motion::{Clip, Feet, Pose, Skeleton};
use ndarray::Array3;
use proptest::prelude::*;

use crate::lafan1_data::lafan1_folder;
use crate::real_data::dance_folder;

/// The six numbers of the paper's three metrics.
const SIX: [&str; 6] = [
    "l2q_local",
    "l2q_global",
    "l2p_relative",
    "l2p_global",
    "npss_local",
    "npss_global",
];

const ENDS: Needs = Needs {
    poses: NeededPoses::Ends,
    conditions: &[],
    heeds: &[],
};

/// A model that is a function of one request.
struct Model<F> {
    needs: Needs,
    answer: F,
}

impl<F: Fn(&Request) -> Result<Motion, ModelError> + Send + Sync> Generator for Model<F> {
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
                (self.answer)(request)
            })
            .collect()
    }
}

/// A model that is given both keyframes and makes rotations.
fn rotations(answer: impl Fn(&Request) -> Vec<Pose> + Send + Sync) -> impl Generator {
    Model {
        needs: ENDS,
        answer: move |request: &Request| Ok(motion(&request.skeleton, answer(request))),
    }
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

/// Each joint's slerp between the keyframes, the root on a straight line.
fn interpolated(request: &Request) -> Vec<Pose> {
    let [start, end] = [0, request.frames as i64 - 1].map(|frame| {
        let given = request.given.iter().find(|given| given.frame == frame);
        &given.unwrap().pose
    });
    let pose = |frame: usize| {
        let share = frame as f64 / (request.frames - 1) as f64;
        let along = Interpolation::Slerp;
        let mut pose = start.clone();
        pose.rotations = between(&start.rotations, &end.rotations, share, along);
        pose.translations[0] = start.translations[0].lerp(end.translations[0], share);
        pose
    };
    (0..request.frames).map(pose).collect()
}

/// The pose of k1, held.
fn held(request: &Request) -> Vec<Pose> {
    vec![request.given[0].pose.clone(); request.frames]
}

/// Six generated clips of so many frames: four train, two test.
fn made_up(frames: usize) -> Dataset {
    from_clips(clips(frames))
}

fn clips(frames: usize) -> Vec<Clip> {
    let config = ChoreographyConfig {
        clips: 6,
        frames_per_clip: frames,
        seed: 3,
    };
    let generated = generate(&config).unwrap().into_iter();
    generated.map(|generated| generated.clip).collect()
}

fn from_clips(clips: Vec<Clip>) -> Dataset {
    Dataset::from_clips(clips, &share()).unwrap()
}

fn share() -> DataConfig {
    DataConfig {
        split: Split::Share(0.8),
        ..DataConfig::default()
    }
}

fn lengths(lengths: &[usize]) -> EvaluationOptions {
    EvaluationOptions {
        lengths: lengths.to_vec(),
        ..EvaluationOptions::default()
    }
}

fn dance(of: &[usize]) -> InBetweening {
    InBetweening::dance(&share(), &lengths(of))
}

fn lafan1(of: &[usize]) -> InBetweening {
    InBetweening::lafan1(&share(), &lengths(of))
}

fn scores(protocol: &InBetweening, model: &dyn Generator, data: &Dataset) -> Scores {
    protocol
        .evaluate(model, data, DataPart::Test)
        .unwrap()
        .scores
}

fn message(protocol: &InBetweening, model: &dyn Generator, data: &Dataset) -> String {
    let error = protocol.evaluate(model, data, DataPart::Test).unwrap_err();
    format!("{:#}", anyhow::Error::from(error))
}

fn value(scores: &Scores, metric: &str, length: usize) -> f64 {
    scores.row(metric).unwrap().at(length).unwrap()
}

fn assert_near(a: &Scores, b: &Scores, metrics: &[&str], tolerance: f64) {
    for metric in metrics {
        let (a, b) = (a.row(metric).unwrap(), b.row(metric).unwrap());
        for column in a.columns() {
            let (a, b) = (a.at(column).unwrap(), b.at(column).unwrap());
            let apart = (a - b).abs();
            assert!(
                apart <= tolerance * a.abs().max(1.0),
                "{metric} {column}: {a}, {b}"
            );
        }
    }
    assert_eq!(a.windows(), b.windows());
}

/// What a numpy program of its own gives (BVH reader, kinematics, FFT) on the dance clips and on
/// the 14 files of LaFAN1: data set, model, length, and the numbers in the order of the metrics.
const REFERENCE: &str = include_str!("in_betweening_reference.txt");

fn assert_reference(protocol: &InBetweening, data: &Dataset, data_set: &str) {
    let of = |model: &dyn Generator| scores(protocol, model, data);
    let interpolation = of(&rotations(interpolated));
    let zero_velocity = of(&rotations(held));
    let mut compared = 0;
    for line in REFERENCE.lines().filter(|line| line.starts_with(data_set)) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let found = match words[1] {
            "interpolation" => &interpolation,
            _ => &zero_velocity,
        };
        let length = words[2].parse().unwrap();
        assert_eq!(words.len(), 3 + protocol.metrics().len());
        for (metric, expected) in protocol.metrics().iter().zip(&words[3..]) {
            let (found, expected) = (value(found, metric.key, length), expected.parse().unwrap());
            let apart: f64 = found - expected;
            assert!(
                apart.abs() <= 1e-9 * f64::abs(expected).max(1e-2),
                "{line}\n{}: {found}, reference {expected}",
                metric.key
            );
            compared += 1;
        }
    }
    assert_eq!(
        compared,
        2 * protocol.lengths().len() * protocol.metrics().len()
    );
}

fn frames(clips: &[Recording]) -> Vec<usize> {
    clips.iter().map(Recording::frames).collect()
}

/// Numbers of training windows and of those that are scored.
fn counts(protocol: &InBetweening, data: &Dataset) -> (usize, usize) {
    let training = protocol.training_windows().windows(&frames(&data.train));
    let scored = protocol.scored_windows().windows(&frames(&data.test));
    (training.len(), scored.len())
}

#[test]
fn the_dance_clips_give_the_windows_and_numbers_of_the_reference() {
    let Some(folder) = dance_folder() else {
        return;
    };
    let config = DataConfig::default();
    let data = Dataset::load(&folder, &config).unwrap();
    let protocol = InBetweening::dance(&config, &EvaluationOptions::default());
    assert_eq!(counts(&protocol, &data), (8_906, 1_986));
    assert_reference(&protocol, &data, "dance");
}

#[test]
fn lafan1_gives_the_windows_and_numbers_of_the_reference() {
    let Some(folder) = lafan1_folder() else {
        return;
    };
    let config = DataConfig {
        split: Split::Lafan1,
        ..DataConfig::default()
    };
    let data = Dataset::load(&folder, &config).unwrap();
    let protocol = InBetweening::lafan1(&config, &EvaluationOptions::default());
    match data.train.len() + data.test.len() {
        14 => {
            assert_eq!(counts(&protocol, &data), (2_353, 178));
            assert_reference(&protocol, &data, "lafan1");
        }
        77 => {
            assert_eq!(counts(&protocol, &data), (20_212, 2_232));
            assert_published(&protocol, &data);
        }
        files => eprintln!("not compared: {files} files of LaFAN1 have no known numbers"),
    }
}

/// What the public benchmark prints of all 77 files, as far as it prints digits.
fn assert_published(protocol: &InBetweening, data: &Dataset) {
    let interpolation = [
        ("l2q_global", [0.22, 0.62, 0.98, 1.25], 0.005),
        ("l2p_global", [0.373, 1.249, 2.316, 3.447], 0.0005),
        ("npss_global", [0.0023, 0.0391, 0.2013, 0.4493], 0.00005),
    ];
    let zero_velocity = [
        ("l2q_global", [0.56, 1.10, 1.51, 1.81], 0.005),
        ("l2p_global", [1.523, 3.695, 6.601, 9.329], 0.0005),
        ("npss_global", [0.0053, 0.0522, 0.2318, 0.4918], 0.00005),
    ];
    let of = |model: &dyn Generator| scores(protocol, model, data);
    for (found, published) in [
        (of(&rotations(interpolated)), interpolation),
        (of(&rotations(held)), zero_velocity),
    ] {
        for (metric, values, half_a_digit) in published {
            for (length, expected) in [5, 15, 30, 45].into_iter().zip(values) {
                let found = value(&found, metric, length);
                let apart = (found - expected).abs();
                assert!(
                    apart <= half_a_digit * 1.001,
                    "{metric} at {length}: {found}"
                );
            }
        }
    }
}

#[test]
fn the_recording_itself_scores_zero_and_differs_from_the_reconstructed_root() {
    let data = made_up(150);
    let recorded: Vec<Clip> = data.test.iter().map(|it| it.clip.clone()).collect();
    let truth = rotations(move |request| {
        let found = recorded.iter().find_map(|clip| {
            let mut windows = clip.poses.windows(request.frames);
            let ends = [&request.given[0].pose, &request.given[1].pose];
            let fits = |window: &&[Pose]| [&window[0], &window[window.len() - 1]] == ends;
            windows.find(fits).map(<[Pose]>::to_vec)
        });
        found.unwrap()
    });
    for (protocol, length) in [(dance(&[20]), 20), (lafan1(&[20]), 20)] {
        let scores = scores(&protocol, &truth, &data);
        for metric in SIX.iter().chain(&["root_error", "root_error_at_k2"]) {
            let found = value(&scores, metric, length);
            assert!(found < 1e-9, "{metric}: {found}");
        }
        assert!(value(&scores, "root_error_rtr", length) > 0.01);
        // A foot that stands moves less than the threshold allows.
        assert!(value(&scores, "foot_skate", length) < 0.2_f64.sqrt());
    }
}

/// Lets the root's own +Y look forward, as it does in LaFAN1, and leaves the motion as it is.
fn lay_root(clip: &mut Clip) {
    let turn = DQuat::from_rotation_x(FRAC_PI_2);
    let parents = clip.skeleton.joints.iter().map(|joint| joint.parent);
    let below: Vec<bool> = parents.map(|parent| parent == Some(0)).collect();
    for pose in &mut clip.poses {
        pose.rotations[0] *= turn;
        for joint in (0..below.len()).filter(|&joint| below[joint]) {
            pose.translations[joint] = turn.inverse() * pose.translations[joint];
            pose.rotations[joint] = turn.inverse() * pose.rotations[joint];
        }
    }
}

#[test]
fn a_turn_of_the_clip_and_a_shift_change_no_score() {
    let model = rotations(interpolated);
    let turned = |angle: f64, shift: DVec3| {
        let turn = DQuat::from_rotation_y(angle);
        let mut turned = clips(130);
        for clip in &mut turned {
            lay_root(clip);
            for pose in &mut clip.poses {
                pose.rotations[0] = turn * pose.rotations[0];
                pose.translations[0] = turn * pose.translations[0] + shift;
            }
        }
        from_clips(turned)
    };
    // All but those that go by the label: of two ankles at one height, rounding makes one the
    // lower.
    let metrics = [&SIX[..], &["root_error", "root_error_at_k2", "foot_skate"]].concat();
    for protocol in [dance(&[10, 50]), lafan1(&[5, 54])] {
        let plain = scores(&protocol, &model, &turned(0.0, DVec3::ZERO));
        for (angle, shift) in [(1.0, DVec3::ZERO), (PI, DVec3::new(300.0, 0.0, -70.0))] {
            let turned = scores(&protocol, &model, &turned(angle, shift));
            assert_near(&plain, &turned, &metrics, 1e-7);
        }
    }
}

#[test]
fn the_signs_and_lengths_of_an_answers_quaternions_and_its_keyframes_do_not_matter() {
    let data = made_up(100);
    let protocol = dance(&[12]);
    let plain = scores(&protocol, &rotations(interpolated), &data);
    let changed = rotations(|request| {
        let mut poses = interpolated(request);
        for (t, pose) in poses.iter_mut().enumerate() {
            for (joint, q) in pose.rotations.iter_mut().enumerate() {
                let sign = if (3 * t + joint * joint) % 5 < 2 {
                    -1.0
                } else {
                    1.0
                };
                *q *= sign;
            }
        }
        poses
    });
    assert_near(&plain, &scores(&protocol, &changed, &data), &SIX, 1e-12);
    // What is said of k1 and k2 does not count, but for the root at k2.
    let careless = rotations(|request| {
        let mut poses = interpolated(request);
        for frame in [0, request.frames - 1] {
            poses[frame].rotations.fill(DQuat::from_rotation_x(1.0));
        }
        poses[0].translations[0] += 50.0;
        poses[request.frames - 1].translations[0].x += 4.0;
        poses
    });
    let careless = scores(&protocol, &careless, &data);
    for metric in protocol.metrics().iter().map(|metric| metric.key) {
        let (found, plain) = (value(&careless, metric, 12), value(&plain, metric, 12));
        match metric {
            "root_error_at_k2" => assert!((found - 4.0).abs() < 1e-9, "{found}"),
            "root_error_rtr_at_k2" => assert_ne!(found, plain),
            _ => assert_eq!(found, plain, "{metric}"),
        }
    }
}

#[test]
fn a_model_sees_what_it_needs_and_nothing_else_of_the_recording() {
    let data = made_up(80);
    let asked = |protocol: &InBetweening, needs: Needs| {
        let seen = Mutex::new(Vec::new());
        let model = Model {
            needs,
            answer: |request: &Request| {
                seen.lock().unwrap().push(request.clone());
                Ok(motion(&request.skeleton, interpolated(request)))
            },
        };
        protocol.evaluate(&model, &data, DataPart::Test).unwrap();
        let mut seen = seen.into_inner().unwrap();
        // Threads answer in any order.
        seen.retain(|it| data.test[0].clip.poses[0..12].contains(&it.given[0].pose));
        seen.sort_by_key(|it| {
            let mut poses = data.test[0].clip.poses.iter();
            poses.position(|pose| *pose == it.given[0].pose)
        });
        seen.remove(0)
    };
    let frames =
        |request: &Request| -> Vec<i64> { request.given.iter().map(|given| given.frame).collect() };
    let poses = &data.test[0].clip.poses;

    let bare = asked(&lafan1(&[5]), ENDS);
    assert_eq!((bare.frames, frames(&bare)), (7, vec![0, 6]));
    assert_eq!(
        (&bare.given[0].pose, &bare.given[1].pose),
        (&poses[9], &poses[15])
    );
    assert!(bare.given.iter().all(|given| given.features.is_none()));
    let nothing = [
        Condition::RootTrajectory,
        Condition::VelocityFactors,
        Condition::Contacts,
        Condition::Music,
    ];
    assert!(nothing.iter().all(|&condition| !bare.has(condition)));

    let past = asked(
        &lafan1(&[5]),
        Needs {
            poses: NeededPoses::Past(9),
            ..ENDS
        },
    );
    let expected: Vec<i64> = (-9..=0).chain([6]).collect();
    assert_eq!(frames(&past), expected);
    let given = past.given.iter().map(|given| &given.pose);
    assert!(given.eq(poses[..10].iter().chain([&poses[15]])));

    let short = asked(&dance(&[10]), ENDS);
    assert_eq!((short.frames, frames(&short)), (10, vec![0, 9]));
    assert_eq!(short.given[1].pose, poses[9]);

    let told = asked(
        &dance(&[10]),
        Needs {
            heeds: &[Condition::Contacts],
            ..ENDS
        },
    );
    let contacts = told.contacts.as_ref().unwrap();
    assert_eq!(contacts.dim(), (10, 2));
    let feet = Feet::of(&told.skeleton).unwrap();
    for (pose, label) in poses.iter().zip(contacts.rows()) {
        let world = pose.world_positions(&told.skeleton);
        let [right, left] = feet.ankles.map(|joint| world[joint].y);
        let expected = if right < left { [1.0, 0.0] } else { [0.0, 1.0] };
        assert_eq!(label.to_vec(), expected);
    }
    assert!(!told.has(Condition::RootTrajectory));

    let root = asked(
        &dance(&[10]),
        Needs {
            conditions: &[Condition::RootTrajectory],
            heeds: &[Condition::VelocityFactors],
            ..ENDS
        },
    );
    let (trajectory, factors) = (root.root.unwrap(), root.velocity_factors.unwrap());
    assert_eq!((trajectory.dim(), factors.dim()), ((10, 3), (10, 5)));
    for (pose, row) in poses.iter().zip(trajectory.rows()) {
        let place = DVec3::new(row[0], row[1], row[2]);
        assert!(place.distance(pose.translations[0]) < 1e-9);
    }
    assert!(root.given.iter().all(|given| given.features.is_some()));
    assert!(root.contacts.is_none());
}

#[test]
fn the_past_is_there_on_lafan1_alone() {
    let model = Model {
        needs: Needs {
            poses: NeededPoses::Past(9),
            ..ENDS
        },
        answer: |request: &Request| Ok(motion(&request.skeleton, interpolated(request))),
    };
    let text = message(&dance(&[10]), &model, &made_up(80));
    assert!(text.contains("needs the 9 poses before frame 0"), "{text}");
}

#[test]
fn a_root_from_the_given_contacts_leaves_the_contact_foot_where_it_is() {
    let data = made_up(150);
    let needs = Needs {
        conditions: &[Condition::Contacts],
        ..ENDS
    };
    let model = Model {
        needs,
        answer: |request: &Request| {
            let mut poses = interpolated(request);
            let feet = Feet::of(&request.skeleton).unwrap().ankles;
            let start = poses[0].translations[0];
            let relative: Vec<[DVec3; 2]> = poses
                .iter()
                .map(|pose| {
                    let world = pose.world_positions(&request.skeleton);
                    feet.map(|joint| world[joint] - world[0])
                })
                .collect();
            let weights = request.contacts.as_ref().unwrap().rows().into_iter();
            let weights: Vec<[f64; 2]> = weights.map(|row| [row[0], row[1]]).collect();
            let roots = reconstruct_root(&relative, &weights, start);
            for (pose, root) in poses.iter_mut().zip(roots) {
                pose.translations[0] = root;
            }
            Ok(motion(&request.skeleton, poses))
        },
    };
    for protocol in [dance(&[10, 50]), lafan1(&[15])] {
        let (rebuilt, plain) = (
            scores(&protocol, &model, &data),
            scores(&protocol, &rotations(interpolated), &data),
        );
        for &length in protocol.lengths() {
            let speed = value(&rebuilt, "contact_foot_speed", length);
            assert!(speed < 1e-9, "{speed}");
            assert!(value(&plain, "contact_foot_speed", length) > 0.01);
            assert!(value(&rebuilt, "root_error_at_k2", length) > 0.01);
            // The body is the same; the root is in none of these.
            for metric in ["l2q_local", "l2q_global", "l2p_relative", "npss_local"] {
                let (a, b) = (
                    value(&rebuilt, metric, length),
                    value(&plain, metric, length),
                );
                assert!((a - b).abs() < 1e-9, "{metric}: {a}, {b}");
            }
        }
    }
}

#[test]
fn a_model_of_positions_is_scored_by_the_rotations_that_are_fitted_to_them() {
    let data = made_up(80);
    let protocol = dance(&[10]);
    let positions = Model {
        needs: ENDS,
        answer: |request: &Request| {
            let full = motion(&request.skeleton, interpolated(request));
            Ok(Motion::new(full.positions))
        },
    };
    let (fitted, own) = (
        scores(&protocol, &positions, &data),
        scores(&protocol, &rotations(interpolated), &data),
    );
    for metric in ["root_error", "root_error_at_k2", "root_error_rtr"] {
        let (a, b) = (value(&fitted, metric, 10), value(&own, metric, 10));
        assert!((a - b).abs() < 1e-9, "{metric}: {a}, {b}");
    }
    // Positions are met, what they do not tell is near.
    for (metric, share) in [("l2p_global", 0.02), ("l2q_global", 0.5)] {
        let (a, b) = (value(&fitted, metric, 10), value(&own, metric, 10));
        assert!((a - b).abs() < share * b, "{metric}: {a}, {b}");
    }
}

#[test]
fn lengths_that_a_window_does_not_hold_are_refused() {
    let (data, model) = (made_up(80), rotations(interpolated));
    for length in [0, 2, 51] {
        let text = message(&dance(&[10, length]), &model, &data);
        let number = format!("N = {length}:");
        let expected = [&number, "counts both keyframes", "3 to 50"];
        assert!(expected.iter().all(|it| text.contains(it)), "{text}");
    }
    for length in [0, 55] {
        let text = message(&lafan1(&[length]), &model, &data);
        assert!(
            text.contains(&format!("N = {length}:")) && text.contains("1 to 54"),
            "{text}"
        );
    }
    // The shortest and the longest work.
    assert_eq!(scores(&dance(&[3, 50]), &model, &data).windows().len(), 2);
    assert_eq!(scores(&lafan1(&[1, 54]), &model, &data).windows().len(), 2);
}

#[test]
fn clips_that_do_not_do_are_refused_or_left_out_by_name() {
    let model = rotations(interpolated);
    let shortened = |frames: usize| {
        let mut clips = clips(80);
        clips
            .iter_mut()
            .for_each(|clip| clip.poses.truncate(frames));
        from_clips(clips)
    };
    let text = message(&lafan1(&[5]), &model, &shortened(65));
    assert!(text.contains("66 frames"), "{text}");
    let text = message(&dance(&[10]), &model, &shortened(49));
    assert!(
        text.contains("50 frames") && text.contains("has 49"),
        "{text}"
    );

    let mut data = made_up(80);
    data.test[0].clip.poses.truncate(40);
    let evaluation = dance(&[10])
        .evaluate(&model, &data, DataPart::Test)
        .unwrap();
    let [warning] = &evaluation.warnings[..] else {
        panic!("{:?}", evaluation.warnings)
    };
    let name = data.test[0].name();
    assert!(
        warning.contains(name) && warning.contains("40 frames"),
        "{warning}"
    );

    let mut data = made_up(80);
    for clip in &mut data.train {
        clip.clip.poses.truncate(40);
    }
    let text = message(&dance(&[10]), &model, &data);
    assert!(
        text.contains("no training clip has the 50 frames"),
        "{text}"
    );

    let mut data = made_up(80);
    data.train[1].clip.skeleton.joints[5].name = "Tail".into();
    let text = message(&dance(&[10]), &model, &data);
    let names = [data.train[1].name(), data.test[0].name(), "mapping"];
    assert!(names.iter().all(|name| text.contains(name)), "{text}");

    let mut data = made_up(80);
    let all = data.train.iter_mut().chain(&mut data.test);
    all.for_each(|it| it.clip.skeleton.joints[4].name = "Tail".into());
    let text = message(&dance(&[10]), &model, &data);
    assert!(text.contains("LeftToe or LeftToeBase"), "{text}");
}

#[test]
fn answers_that_are_none_are_refused() {
    type Change = fn(&mut Motion);
    let data = made_up(80);
    let refused = |change: Change| {
        let model = Model {
            needs: ENDS,
            answer: |request: &Request| {
                let mut motion = motion(&request.skeleton, interpolated(request));
                change(&mut motion);
                Ok(motion)
            },
        };
        message(&dance(&[10]), &model, &data)
    };
    fn poses(motion: &mut Motion) -> &mut Vec<Pose> {
        motion.poses.as_mut().unwrap()
    }
    let changes: [(Change, &str); 4] = [
        (
            |it| poses(it)[3].rotations[2] = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0),
            "predicted rotations",
        ),
        (|it| it.positions[[9, 0, 1]] = f64::NAN, "predicted frames"),
        (|it| poses(it)[3].rotations.truncate(23), "a predicted pose"),
        (|it| poses(it).truncate(9), "predicted poses"),
    ];
    for (change, expected) in changes {
        let text = refused(change);
        assert!(
            text.contains(expected) && text.contains("model of the test"),
            "{text}"
        );
    }
}

#[test]
fn a_number_of_windows_is_spread_over_all_and_threads_change_no_bit() {
    let (data, model) = (made_up(400), rotations(interpolated));
    let protocol = |most_windows| {
        let options = EvaluationOptions {
            lengths: vec![10, 30],
            most_windows,
        };
        InBetweening::dance(&share(), &options)
    };
    let all = scores(&protocol(None), &model, &data);
    assert_eq!(all.windows_of("10"), Some(2 * 36));
    let few = scores(&protocol(Some(5)), &model, &data);
    assert_eq!(few.windows_of("30"), Some(5));
    assert_ne!(few.row("l2q_local"), all.row("l2q_local"));
    assert_eq!(scores(&protocol(Some(72)), &model, &data), all);
    assert_eq!(protocol(Some(5)).frames(&[400, 400]), 5 * 40);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let again = pool
            .build()
            .unwrap()
            .install(|| scores(&protocol(None), &model, &data));
        assert_eq!(again, all, "{threads} threads");
    }
}

#[test]
fn sigma_is_the_same_whatever_is_set_aside_for_validation() {
    let with = |validation_share: f64| {
        let config = DataConfig {
            validation_share,
            ..share()
        };
        Dataset::from_clips(clips(120), &config).unwrap()
    };
    let (all, aside) = (with(0.0), with(0.5));
    assert!(!aside.validation.is_empty());
    let of = |data: &Dataset| dance(&[10]).deviations(data).unwrap().0;
    for (a, b) in of(&all).iter().zip(of(&aside)) {
        assert!(a.distance(b) < 1e-9, "{a} {b}");
    }
}

/// One joint whose quaternion is (0, 0, 0, 1), then something.
fn two_frames(second: DQuat) -> [Vec<DQuat>; 2] {
    [vec![DQuat::IDENTITY], vec![second]]
}

#[test]
fn npss_is_what_its_definition_gives_by_hand() {
    // Truth: w = 1, 1, of power 4, 0. Predicted: w = 1, 0, of power 1, 1, so that the curves are 1,
    // 1 and 1/2, 1; x has no power in the truth.
    let truth = two_frames(DQuat::IDENTITY);
    let still = Npss::of(&truth, &two_frames(DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0)));
    assert!((still.score() - 0.5).abs() < 1e-15);
    // The other way round: w of power 1, 1 and x of power 1, 1, both against curves of which x has
    // none: a is 1/2 and 1/2 + 1.
    let moving = Npss::of(&two_frames(DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0)), &truth);
    assert!((moving.score() - (0.5 * 2.0 + 1.5 * 2.0) / 4.0).abs() < 1e-15);
    // Weights of both windows together: 4 and 4, and no mean where they differ.
    let mut both = still;
    both.add(moving);
    assert!((both.score() - 0.75).abs() < 1e-15);
    both.add(Npss::of(&truth, &truth));
    assert!((both.score() - (2.0 + 4.0) / 12.0).abs() < 1e-15);
    assert_eq!(Npss::default().score(), 0.0);
}

#[test]
fn distances_are_norms_over_all_joints() {
    let truth = [DQuat::IDENTITY; 2];
    let predicted = [
        DQuat::from_xyzw(0.0, 0.0, 0.0, -1.0),
        DQuat::from_rotation_x(PI),
    ];
    assert!((l2q(&truth, &predicted) - 2.0_f64.sqrt()).abs() < 1e-12);
    let deviations = Deviations(vec![DVec3::ONE, DVec3::new(2.0, 1.0, 0.5)]);
    let truth = [DVec3::ZERO; 2];
    let predicted = [DVec3::X * 3.0, DVec3::new(2.0, 0.0, 1.0)];
    assert!((l2p(&truth, &predicted, &deviations) - 14.0_f64.sqrt()).abs() < 1e-12);
}

fn rotation() -> impl Strategy<Value = DQuat> {
    prop::array::uniform4(-1.0..1.0f64)
        .prop_filter("a direction", |q| {
            q.iter().map(|x| x * x).sum::<f64>() > 0.01
        })
        .prop_map(|q| DQuat::from_array(q).normalize())
}

/// Truth, prediction, and whether a prediction's sign is changed, `[frames][joints]`.
fn windows() -> impl Strategy<Value = Vec<Vec<(DQuat, DQuat, bool)>>> {
    let joint = (rotation(), rotation(), any::<bool>());
    prop::collection::vec(prop::collection::vec(joint, 3), 1..9)
}

proptest! {
    #[test]
    fn l2q_and_npss_do_not_see_signs_l2q_no_turn_and_the_truth_is_at_zero(
        window in windows(),
        angle in -PI..PI,
    ) {
        let all = |of: fn(&(DQuat, DQuat, bool)) -> DQuat| -> Vec<Vec<DQuat>> {
            window.iter().map(|frame| frame.iter().map(of).collect()).collect()
        };
        let (truth, predicted) = (all(|it| it.0), all(|it| it.1));
        let flipped = all(|it| if it.2 { -it.1 } else { it.1 });
        let turn = DQuat::from_rotation_y(angle);
        // In the world all joints turn, of local rotations the root's alone.
        let turned = |frame: &[DQuat], joints: usize| -> Vec<DQuat> {
            let joints_of = frame.iter().enumerate();
            joints_of.map(|(at, &q)| if at < joints { turn * q } else { q }).collect()
        };
        for t in 0..window.len() {
            let plain = l2q(&truth[t], &predicted[t]);
            prop_assert_eq!(plain, l2q(&truth[t], &flipped[t]));
            for joints in [1, 3] {
                let found = l2q(&turned(&truth[t], joints), &turned(&predicted[t], joints));
                prop_assert!((found - plain).abs() < 1e-12);
            }
            prop_assert_eq!(l2q(&truth[t], &truth[t]), 0.0);
        }
        let plain = Npss::of(&truth, &predicted).score();
        prop_assert!(plain >= 0.0);
        prop_assert!((Npss::of(&truth, &flipped).score() - plain).abs() < 1e-12);
        prop_assert_eq!(Npss::of(&truth, &truth).score(), 0.0);
    }
}
