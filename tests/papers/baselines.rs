//! The untrained baselines beside interpolation: linear positions and zero velocity.

use std::f64::consts::TAU;
use std::fs;

use assert_cmd::Command;
use keydance::data::DataConfig;
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::evaluation::equations::window_scores;
use keydance::evaluation::transitions::window_request;
use keydance::models::baselines::linear_positions::LinearPositions;
use keydance::models::baselines::zero_velocity::ZeroVelocity;
use keydance::models::transition::DanceClip;
use keydance::models::transition::window_features;
use keydance::models::transition::{Transition, TransitionModel, TransitionRequest};
use keydance::motion::features::{
    BODY_POSITIONS, BODY_VELOCITIES, CONTACTS, FACING, FRAME, ROOT_POSITION, ROOT_VELOCITY,
};
use keydance::motion::placement::world_positions;
use ndarray::{Array2, s};
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use tempfile::TempDir;

use crate::generated_data::write_clips;

const THRESHOLD: f64 = 0.2;
const LENGTHS: [usize; 4] = [1, 2, 7, 40];

fn models() -> [Box<dyn TransitionModel>; 2] {
    let contact_threshold = THRESHOLD;
    [
        Box::new(LinearPositions { contact_threshold }),
        Box::new(ZeroVelocity { contact_threshold }),
    ]
}

/// Windows of generated dance as requests, with the recorded windows.
fn requests(length: usize) -> Vec<(TransitionRequest, Array2<f64>)> {
    let config = ChoreographyConfig {
        clips: 3,
        frames_per_clip: 120,
        seed: 7,
    };
    let clips = generate(&config).unwrap().into_iter().map(|clip| {
        let clip = DanceClip::new(clip.clip, None, &DataConfig::default()).unwrap();
        let window = window_features(&clip.features, 30, length);
        let request = window_request(&clip.clip, 30, window.view()).unwrap();
        (TransitionRequest::of(&request).unwrap(), window)
    });
    clips.collect()
}

fn transition(model: &dyn TransitionModel, request: &TransitionRequest) -> Array2<f64> {
    let transitions: Vec<Transition> = model.transitions(std::slice::from_ref(request)).unwrap();
    transitions.into_iter().next().unwrap().frames
}

#[test]
fn both_follow_the_root_trajectory_and_their_velocities_are_differences() {
    for length in LENGTHS {
        for (request, _) in requests(length) {
            for model in models() {
                let frames = transition(&*model, &request);
                assert_eq!(frames.dim(), (length, FRAME));
                assert_eq!(
                    frames.slice(s![.., ROOT_POSITION]),
                    request.root_trajectory.slice(s![1.., ..])
                );
                let start = request.start.features.slice(s![..FRAME]).to_owned();
                let mut before = start;
                for frame in frames.rows() {
                    let body = BODY_VELOCITIES.zip(BODY_POSITIONS);
                    for (v, p) in body.chain(ROOT_VELOCITY.zip(ROOT_POSITION)) {
                        assert_eq!(frame[v], frame[p] - before[p]);
                    }
                    let (now, then) = (world_positions(frame), world_positions(before.view()));
                    for (label, joint) in CONTACTS.zip([3, 4, 7, 8]) {
                        let planted = now[joint].distance_squared(then[joint]) < THRESHOLD;
                        assert_eq!(frame[label], f64::from(u8::from(planted)));
                    }
                    before = frame.to_owned();
                }
            }
        }
    }
}

#[test]
fn linear_positions_end_at_the_target_exactly_and_every_step_is_the_same() {
    let [linear, _] = models();
    for length in LENGTHS {
        for (request, _) in requests(length) {
            let frames = transition(&*linear, &request);
            let (start, target) = (&request.start.features, &request.target.features);
            let last = frames.row(length - 1);
            assert_eq!(
                last.slice(s![BODY_POSITIONS]),
                target.slice(s![BODY_POSITIONS])
            );
            let turns = (last[FACING.start] - target[FACING.start]) / TAU;
            assert!((turns - turns.round()).abs() < 1e-12);
            for (t, frame) in frames.rows().into_iter().enumerate() {
                let share = (t + 1) as f64 / length as f64;
                for k in BODY_POSITIONS {
                    let expected = start[k] + share * (target[k] - start[k]);
                    assert!((frame[k] - expected).abs() < 1e-9);
                    let step = (target[k] - start[k]) / length as f64;
                    assert!((frame[k + BODY_VELOCITIES.start] - step).abs() < 1e-9);
                }
            }
            // The shorter way round: at most half a turn.
            let turned = last[FACING.start] - start[FACING.start];
            assert!(turned.abs() <= TAU / 2.0 + 1e-9, "{turned}");
        }
    }
}

#[test]
fn zero_velocity_holds_the_first_pose_and_does_not_look_at_the_target() {
    let [_, still] = models();
    for length in LENGTHS {
        for (mut request, recorded) in requests(length) {
            let frames = transition(&*still, &request);
            for frame in frames.rows() {
                assert_eq!(
                    frame.slice(s![BODY_POSITIONS]),
                    request.start.features.slice(s![BODY_POSITIONS])
                );
                assert_eq!(frame[FACING.start], request.start.features[FACING.start]);
                assert!(frame.slice(s![BODY_VELOCITIES]).iter().all(|&v| v == 0.0));
            }
            let distance: f64 = (1..=length)
                .map(|t| {
                    let moved = &recorded.slice(s![t, BODY_POSITIONS])
                        - &recorded.slice(s![0, BODY_POSITIONS]);
                    moved.mapv(|x| x * x).sum().sqrt()
                })
                .sum();
            let scores = window_scores(recorded.view(), frames.view());
            let scores = scores.unwrap();
            assert!((scores.body_position - distance / length as f64).abs() < 1e-9);
            assert_eq!(scores.root, 0.0);
            request.target.features.fill(1.0);
            assert_eq!(transition(&*still, &request), frames);
        }
    }
}

#[test]
fn requests_that_do_not_fit_are_errors() {
    let (mut request, _) = requests(7).remove(0);
    request.root_trajectory[[2, 1]] = f64::NAN;
    for model in models() {
        assert!(model.transitions(std::slice::from_ref(&request)).is_err());
    }
}

#[test]
fn their_configs_are_evaluated_through_the_binary_and_are_not_trained() {
    let folder = TempDir::new().unwrap();
    write_clips(folder.path(), 180, 3);
    let keydance = |command: &str, config: &str| {
        let mut keydance = Command::cargo_bin("keydance").unwrap();
        keydance
            .args([
                command,
                config,
                "--set",
                "data.split={ share = 0.8 }",
                "--data",
            ])
            .arg(folder.path());
        keydance
    };
    let mut lrp = Vec::new();
    for name in ["zero_velocity", "linear_positions"] {
        let config = format!("experiments/pan2021/{name}.toml");
        let out = folder.path().join(name);
        keydance("evaluate", &config)
            .arg("--out")
            .arg(&out)
            .assert()
            .success()
            .stdout(contains(name));
        let scores = fs::read_to_string(out.join("evaluation.json")).unwrap();
        let scores: serde_json::Value = serde_json::from_str(&scores).unwrap();
        assert_eq!(scores["equations"]["art"]["avg"], 1.0);
        lrp.push(scores["equations"]["lrp"]["10"].as_f64().unwrap());
        keydance("train", &config)
            .arg("--out")
            .arg(folder.path().join("run"))
            .assert()
            .failure()
            .stderr(contains(name).and(contains("needs no training")));
    }
    assert!(lrp[1] < 0.8 * lrp[0], "{lrp:?}");
}
