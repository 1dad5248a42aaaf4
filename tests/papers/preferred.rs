//! The options beside the paper, those of `experiments/preferred/`: residual outputs, the control
//! path, the keyframe's frame of reference.

use std::collections::BTreeMap;

use keydance::autograd::{Tape, Workspace};
use keydance::data::DataConfig;
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::evaluation::transitions::window_request;
use keydance::models::pan2021::Pan2021Config;
use keydance::models::transition::DanceClip;
use keydance::models::transition::{
    Batch, Forcing, Network, SingleFrame, TrainedModel, Transition, TransitionModel,
    TransitionRequest,
};
use keydance::models::transition::{RootFrame, Standardisation, window_features};
use keydance::motion::features::{FACING, ROOT_POSITION, ROOT_VELOCITY};
use ndarray::{Array2, ArrayD, ArrayView1, Axis, s};

use crate::network::{Built, build, generated_windows, predict, residual, with_control_path};

/// Weights of p^b and v^b of k1 and p^b of k2 in the linear estimate of frame t with the least
/// expected square error, where numbers d frames apart correlate by r(d) of `docs/pan2021.md`.
fn estimate(t: usize, n: usize) -> [f64; 3] {
    kriging(t, n).0
}

fn r(d: usize) -> f64 {
    0.2 + 0.8 * (1.0 + d as f64 / 8.0) * (-(d as f64) / 8.0).exp()
}

/// The weights, and the standard deviation of the estimate's error.
fn kriging(t: usize, n: usize) -> ([f64; 3], f64) {
    let step = |d: usize| r(d) - r(d + 1);
    let given = [
        [1.0 + 1e-6, step(0), r(n)],
        [step(0), (2.0 + 1e-6) * step(0), step(n)],
        [r(n), step(n), 1.0 + 1e-6],
    ];
    let likely = glam::DVec3::new(r(t), step(t), r(n - t));
    let weights = glam::DMat3::from_cols_array_2d(&given).inverse() * likely;
    let open = (1.0 - likely.dot(weights)).max(0.0).sqrt();
    (weights.to_array(), open)
}

#[test]
fn an_untrained_residual_network_is_the_best_linear_estimate_on_the_given_trajectory() {
    let (features, statistics) = generated_windows(8, 2, 13);
    let std = &statistics.std;
    // From a velocity of p^b or p^r, standardised, to deviations of the position a frame, and back.
    let speed =
        |column: usize, v: f64| (v * std[77 + column] + statistics.mean[77 + column]) / std[column];
    let velocity =
        |column: usize, s: f64| (s * std[column] - statistics.mean[77 + column]) / std[77 + column];
    for decoders in [1, 2] {
        let config = Pan2021Config {
            decoders,
            ..residual().small()
        };
        let predicted = predict(&build(&config, &statistics), &features);
        for ((t, window, column), found) in predicted.indexed_iter() {
            let given = |row: usize, column: usize| features[[row, window, column]];
            let place = |t: usize, column: usize| match column {
                0..69 => {
                    let [first, moving, last] = estimate(t, 8);
                    let speed = speed(column, given(0, 77 + column));
                    first * given(0, column) + moving * speed + last * given(8, column)
                }
                _ => given(t, column),
            };
            let expected = match column {
                0..72 => place(t + 1, column),
                72 => given(0, 72) + (t + 1) as f64 / 8.0 * (given(8, 72) - given(0, 72)),
                73..77 => 0.0,
                _ => {
                    let column = column - 77;
                    velocity(column, place(t + 1, column) - place(t, column))
                }
            };
            assert!(
                (found - expected).abs() < 1e-9,
                "{t} {column}: {found}, {expected}"
            );
        }
        // At k2 nothing is open: whatever the weights, p^b is the keyframe's and p^r the
        // trajectory's.
        let built: Built<f64> = build(&config, &statistics).disturbed();
        let predicted = predict(&built, &features);
        for window in 0..2 {
            for column in 0..72 {
                let missed = predicted[[7, window, column]] - features[[8, window, column]];
                assert!(missed.abs() < 1e-2, "{column}: {missed}");
            }
        }
    }
}

/// The same request `shift` further on, cm.
fn moved(request: &TransitionRequest, shift: [f64; 3]) -> TransitionRequest {
    let mut moved = request.clone();
    for keyframe in [&mut moved.start, &mut moved.target] {
        keyframe.pose.translations[0] += glam::DVec3::from_array(shift);
        for (column, shift) in ROOT_POSITION.zip(shift) {
            keyframe.features[column] += shift;
        }
    }
    for (mut column, shift) in moved.root_trajectory.columns_mut().into_iter().zip(shift) {
        column += shift;
    }
    moved
}

/// The same request on a floor turned by `angle` about Y, rad.
fn turned(request: &TransitionRequest, angle: f64) -> TransitionRequest {
    let turn = glam::DQuat::from_rotation_y(angle);
    let around = |x: f64, y: f64, z: f64| (turn * glam::DVec3::new(x, y, z)).to_array();
    let mut turned = request.clone();
    for keyframe in [&mut turned.start, &mut turned.target] {
        keyframe.pose.translations[0] = turn * keyframe.pose.translations[0];
        let features = &mut keyframe.features;
        for columns in [ROOT_POSITION, ROOT_VELOCITY] {
            let at = columns.start;
            let vector = around(features[at], features[at + 1], features[at + 2]);
            features
                .slice_mut(s![columns])
                .assign(&ArrayView1::from(&vector));
        }
        features[FACING.start] += angle;
    }
    for mut place in turned.root_trajectory.rows_mut() {
        let vector = around(place[0], place[1], place[2]);
        place.assign(&ArrayView1::from(&vector));
    }
    turned
}

/// Two generated clips.
fn clips() -> Vec<DanceClip> {
    let generated = generate(&ChoreographyConfig {
        clips: 2,
        frames_per_clip: 120,
        seed: 4,
    });
    generated
        .unwrap()
        .into_iter()
        .map(|clip| DanceClip::new(clip.clip, None, &DataConfig::default()).unwrap())
        .collect()
}

/// A network as the model of transitions that synthesis and evaluation know.
fn trained(
    config: Pan2021Config,
    built: Built<f32>,
    standardisation: &Standardisation,
) -> TrainedModel {
    TrainedModel::new(
        "small".into(),
        Box::new(built.network) as Box<dyn Network<f32>>,
        built.parameters,
        standardisation.clone(),
        config.root_frame,
    )
}

#[test]
fn in_the_keyframes_frame_a_dance_elsewhere_on_the_floor_or_in_another_direction_is_the_same_dance()
{
    let clips = clips();
    let (clip, start, length) = (&clips[0], 30, 20);
    let window = window_features(&clip.features, start, length);
    let request =
        TransitionRequest::of(&window_request(&clip.clip, start, window.view()).unwrap()).unwrap();
    let shift = [250.0, 0.0, -130.0];
    let raised = [0.0, 40.0, 0.0];
    let angle = 2.0;
    for (root_frame, same_elsewhere, same_turned) in [
        (RootFrame::World, false, false),
        (RootFrame::Keyframe, true, false),
        (RootFrame::KeyframeFacing, true, true),
    ] {
        let views: Vec<_> = clips.iter().map(|clip| clip.features.view()).collect();
        let standardisation = root_frame.standardisation(views, length);
        let config = Pan2021Config {
            root_frame,
            ..with_control_path().small()
        };
        let built: Built<f32> = build(&config, &standardisation).disturbed();
        let model = trained(config, built, &standardisation);
        let requests = [
            request.clone(),
            moved(&request, shift),
            moved(&request, raised),
            turned(&request, angle),
        ];
        let [here, there, above, around] =
            model.transitions(&requests).unwrap().try_into().unwrap();
        // Near the trajectory that was asked for, in the world.
        let near = |transition: &Transition, request: &TransitionRequest| {
            let missed = &transition.frames.slice(s![.., ROOT_POSITION])
                - &request.root_trajectory.slice(s![1.., ..]);
            missed.iter().all(|x| x.abs() < 150.0)
        };
        assert!(near(&here, &request), "{root_frame:?}");
        assert!(near(&around, &requests[3]), "{root_frame:?}");
        let difference = |other: &Array2<f64>, shift: [f64; 3]| {
            let mut difference = other - &here.frames;
            for (column, shift) in ROOT_POSITION.zip(shift) {
                difference.column_mut(column).mapv_inplace(|x| x - shift);
            }
            difference.iter().fold(0f64, |most, x| most.max(x.abs()))
        };
        let same = difference(&there.frames, shift) < 1e-2;
        assert_eq!(same, same_elsewhere, "{root_frame:?}");
        // Heights are above the floor in each.
        assert!(difference(&above.frames, raised) > 0.1);
        let mut back = around.frames;
        let turn = glam::DQuat::from_rotation_y(-angle);
        for mut frame in back.rows_mut() {
            for at in [ROOT_POSITION.start, ROOT_VELOCITY.start] {
                let vector = glam::DVec3::new(frame[at], frame[at + 1], frame[at + 2]);
                let vector = (turn * vector).to_array();
                frame
                    .slice_mut(s![at..at + 3])
                    .assign(&ArrayView1::from(&vector));
            }
            frame[FACING.start] -= angle;
        }
        let same = difference(&back, [0.0; 3]) < 1e-2;
        assert_eq!(same, same_turned, "{root_frame:?}");
    }
}

/// Where what the control path sees of a frame stands: velocities of the trajectory, heights and
/// factors, turn, estimate, keyframes.
const HEIGHTS: usize = 24;
const TURN: usize = HEIGHTS + 13 * 6;
const ESTIMATE: usize = TURN + 1;
const SEEN: usize = ESTIMATE + 3 * 69;

#[test]
fn the_control_path_adds_what_it_sees_as_documented() {
    let (n, windows) = (30, 2);
    let (features, statistics) = generated_windows(n, windows, 13);
    let std = &statistics.std;
    let config = with_control_path().small();
    let plain = predict(&build(&config, &statistics), &features);
    let at = |t: usize, d: isize| t.saturating_add_signed(d).min(n);
    let floor = ((std[146].powi(2) + std[148].powi(2)) / 2.0).sqrt();
    // From here to frame t + d in deviations of v^r, turned to where the dancer faces.
    let way = |w: usize, t: usize, d: isize, axis: usize| {
        let [x, z] = [69, 71].map(|column| {
            let far = features[[at(t, d), w, column]] - features[[t, w, column]];
            far * std[column] / d.unsigned_abs() as f64 / floor
        });
        let facing = |row: usize| features[[row, w, 72]] * std[72] + statistics.mean[72];
        let share = t as f64 / n as f64;
        let (sin, cos) = ((1.0 - share) * facing(0) + share * facing(n)).sin_cos();
        [cos * x - sin * z, sin * x + cos * z][axis]
    };
    let speed = |w: usize, column: usize| {
        let v = features[[0, w, 77 + column]] * std[77 + column] + statistics.mean[77 + column];
        v / std[column]
    };
    type Seen<'a> = Box<dyn Fn(usize, usize) -> f64 + 'a>;
    let cases: [(usize, Seen); 9] = [
        (0, Box::new(|w, t| way(w, t, -20, 0))),
        (11, Box::new(|w, t| way(w, t, -1, 1))),
        (22, Box::new(|w, t| way(w, t, 20, 0))),
        (HEIGHTS, Box::new(|w, t| features[[at(t, -20), w, 70]])),
        (HEIGHTS + 6 * 6 + 3, Box::new(|w, t| features[[t, w, 151]])),
        (
            TURN,
            Box::new(|w, _| {
                30.0 * std[72] * (features[[n, w, 72]] - features[[0, w, 72]]) / n as f64
            }),
        ),
        (
            ESTIMATE + 5,
            Box::new(|w, t| {
                let [first, moving, last] = estimate(t, n);
                first * features[[0, w, 5]] + moving * speed(w, 5) + last * features[[n, w, 5]]
            }),
        ),
        (
            ESTIMATE + 69 + 7,
            Box::new(|w, t| r(t) * features[[0, w, 7]]),
        ),
        (SEEN - 1, Box::new(|w, t| r(n - t) * features[[n, w, 68]])),
    ];
    for (column, seen) in cases {
        for opened in [false, true] {
            // The path alone, as a linear map of one number to one joint's x.
            let mut built: Built<f64> = build(&config, &statistics);
            for (name, mut value) in built.parameters.values_mut() {
                match name {
                    "control_path.0.weight" => {
                        assert_eq!(value.shape(), [8, 2 * SEEN]);
                        value.fill(0.0);
                        value[[0, column + usize::from(opened) * SEEN]] = 1.0;
                    }
                    "control_path.2.weight" => {
                        assert_eq!(value.shape(), [8, 8]);
                        value.fill(0.0);
                        value[[1, 0]] = 1.0;
                    }
                    "control_path.0.bias" | "control_path.2.bias" => value.fill(0.0),
                    "control_path.1.weight" | "control_path.3.weight" => value.fill(1.0),
                    "control_path.4.weight" => value[[3, 1]] = 1.0,
                    _ => {}
                }
            }
            let added = &predict(&built, &features) - &plain;
            let expected = |w: usize, t: usize| {
                let open = kriging(t, n).1;
                let factor = if opened { open * open } else { open };
                if t == 0 { 0.0 } else { factor * seen(w, t) }
            };
            for ((row, w, number), &added) in added.indexed_iter() {
                let t = row + 1;
                let expected = match number {
                    3 => expected(w, t),
                    80 => (expected(w, t) - expected(w, t - 1)) * std[3] / std[80],
                    _ => 0.0,
                };
                assert!(
                    (added - expected).abs() < 1e-9,
                    "{column} {opened}: frame {t}, {number}: {added}, {expected}"
                );
            }
        }
    }
}

#[test]
fn the_loss_of_single_frames_is_the_distance_from_the_true_p_b_that_the_control_path_leaves() {
    let config = with_control_path().small();
    let mut single_frames = Vec::new();
    let mut expected = 0.0;
    let (features, statistics) = generated_windows(9, 2, 13);
    let mut built: Built<f64> = build(&config, &statistics).disturbed();
    for (name, mut value) in built.parameters.values_mut() {
        // The path alone: whatever the decoders would add is 0.
        if name.starts_with("state_decoder.4") || name.starts_with("root_decoder.4") {
            value.fill(0.0);
        }
    }
    for (n, frame) in [(2, 1), (30, 12), (41, 41)] {
        let (window, _) = generated_windows(n, 1, n as u64);
        let predicted = predict(&built, &window);
        let missed = &predicted.slice(s![frame - 1, 0, ..69]) - &window.slice(s![frame, 0, ..69]);
        let scaled = missed
            .iter()
            .zip(&statistics.std)
            .map(|(x, std)| x * std / statistics.position_scale);
        expected += (scaled.map(|x| x * x).sum::<f64>() + 1e-8).sqrt();
        single_frames.push(SingleFrame { window, frame });
    }
    let mut batch = Batch {
        single_frames,
        // With two more in another shard.
        total_single_frames: 5,
        ..Batch::of(features)
    };
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&built.parameters, &mut workspace);
    let losses = built
        .network
        .losses(&mut tape, &batch, Forcing::FreeRunning);
    let terms = losses.unwrap().terms;
    let (_, term) = terms
        .iter()
        .find(|(name, _)| *name == "single_frames")
        .unwrap();
    let found = tape.values(*term)[0];
    assert!(
        (found - expected / 5.0).abs() < 1e-9 * found,
        "{found} {expected}"
    );
    for frame in [0, 42] {
        batch.single_frames[2].frame = frame;
        let losses = built
            .network
            .losses(&mut tape, &batch, Forcing::FreeRunning);
        let error = losses.unwrap_err().to_string();
        let named = format!("frame {frame} of a window");
        assert!(error.contains(&named), "{error}");
    }
}

#[test]
fn an_ensemble_of_control_paths_adds_the_mean_of_its_members_and_trains_each_by_its_own_distance() {
    let member = with_control_path().small();
    let ensemble = Pan2021Config {
        control_path_members: 3,
        ..member.clone()
    };
    let (features, statistics) = generated_windows(9, 2, 13);
    let mut together: Built<f64> = build(&ensemble, &statistics).disturbed();
    for (name, mut value) in together.parameters.values_mut() {
        // The paths alone: whatever the decoders would add is 0.
        if name.starts_with("state_decoder.4") || name.starts_with("root_decoder.4") {
            value.fill(0.0);
        }
    }
    let single_frames = || {
        [(30, 12), (7, 7)].map(|(n, frame)| SingleFrame {
            window: generated_windows(n, 1, n as u64).0,
            frame,
        })
    };
    let loss = |built: &Built<f64>| {
        let batch = Batch {
            single_frames: single_frames().into(),
            total_single_frames: 2,
            ..Batch::of(features.clone())
        };
        let mut workspace = Workspace::new();
        let mut tape = Tape::recording(&built.parameters, &mut workspace);
        let losses = built
            .network
            .losses(&mut tape, &batch, Forcing::FreeRunning);
        let terms = losses.unwrap().terms;
        let term = terms.iter().find(|(name, _)| *name == "single_frames");
        tape.values(term.unwrap().1)[0]
    };
    let weights: BTreeMap<String, ArrayD<f64>> = together
        .parameters
        .iter()
        .map(|(name, value)| (name.to_owned(), value.clone()))
        .collect();
    let mut alone = Vec::new();
    for path in ["control_path.", "control_path_2.", "control_path_3."] {
        let mut built: Built<f64> = build(&member, &statistics);
        for (name, mut value) in built.parameters.values_mut() {
            value.assign(&weights[&name.replace("control_path.", path)]);
        }
        alone.push((predict(&built, &features), loss(&built)));
    }
    let mean = (&alone[0].0 + &alone[1].0 + &alone[2].0) / 3.0;
    let frames = predict(&together, &features);
    let furthest = (&frames - &mean)
        .iter()
        .fold(0.0_f64, |most, x| most.max(x.abs()));
    assert!(furthest < 1e-12, "{furthest}");
    assert!((&alone[0].0 - &alone[1].0).iter().any(|x| x.abs() > 0.01));
    let expected = alone.iter().map(|(_, loss)| loss).sum::<f64>() / 3.0;
    let found = loss(&together);
    assert!(
        (found - expected).abs() < 1e-9 * found,
        "{found} {expected}"
    );
}

#[test]
fn the_control_path_sees_controls_twenty_frames_ahead_that_the_controllers_do_not() {
    let (features, statistics) = generated_windows(40, 1, 13);
    let mut changed = features.clone();
    changed[[30, 0, 150]] += 1.0;
    let first_changed = |config: &Pan2021Config| {
        let built: Built<f64> = build(&config.small(), &statistics).disturbed();
        let [before, after] = [&features, &changed].map(|given| predict(&built, given));
        let rows = before.axis_iter(Axis(0)).zip(after.axis_iter(Axis(0)));
        1 + rows.take_while(|(before, after)| before == after).count()
    };
    assert_eq!(first_changed(&with_control_path()), 30 - 20);
    assert!((30 - 4..30).contains(&first_changed(&residual())));
}
