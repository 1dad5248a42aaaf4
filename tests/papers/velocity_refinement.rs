//! Predicted bodies brought to the velocity factors that were asked for.

use glam::{DQuat, DVec3};
use keydance::data::DataConfig;
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::evaluation::transitions::window_request;
use keydance::models::transition::DanceClip;
use keydance::models::transition::TransitionRequest;
use keydance::models::transition::velocity_refinement;
use keydance::models::transition::window_features;
use keydance::motion::features::{
    BODY_POSITIONS, BODY_VELOCITIES, FRAME, ROOT_POSITION, VELOCITY_FACTORS,
};
use keydance::motion::velocity_factor::{PART_WEIGHTS, measured_velocity_factors};
use keydance::motion::{DANCE_PARENTS, JOINTS};
use ndarray::{Array1, Array2, ArrayView1, ArrayView2, Axis, concatenate, s};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn clip() -> DanceClip {
    let generated = generate(&ChoreographyConfig {
        clips: 1,
        frames_per_clip: 160,
        seed: 4,
    });
    let clip = generated.unwrap().into_iter().next().unwrap().clip;
    DanceClip::new(clip, None, &DataConfig::default()).unwrap()
}

/// A transition of the clip, as recorded `[N + 1, 154]`, and what a model is asked for.
fn transition(clip: &DanceClip, length: usize) -> (Array2<f64>, TransitionRequest) {
    let window = window_features(&clip.features, 30, length);
    let request =
        TransitionRequest::of(&window_request(&clip.clip, 30, window.view()).unwrap()).unwrap();
    (window, request)
}

/// What a model might predict: half of the movement about the mean pose, trembling by up to 1 cm,
/// with the true keyframe at the end.
fn slow_and_trembling(window: ArrayView2<f64>) -> Array2<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let last = window.nrows() - 1;
    let mut frames = window.slice(s![1.., ..FRAME]).to_owned();
    let mean = window.mean_axis(Axis(0)).unwrap();
    for mut frame in frames.rows_mut().into_iter().take(last - 1) {
        for number in BODY_POSITIONS {
            let middle = (frame[number] + mean[number]) / 2.0;
            frame[number] = middle + rng.random_range(-1.0..1.0);
        }
    }
    frames
}

fn refined(request: &TransitionRequest, predicted: &Array2<f64>) -> Array2<f64> {
    let mut frames = predicted.clone();
    velocity_refinement::refine(request, frames.view_mut());
    frames
}

/// k1 and the frames after it, `[N + 1, 149]`.
fn with_first(window: ArrayView2<f64>, frames: &Array2<f64>) -> Array2<f64> {
    concatenate(Axis(0), &[window.slice(s![..1, ..FRAME]), frames.view()]).unwrap()
}

/// The mean distance from the velocity factors asked for, cm/frame (eq. 14).
fn missed(window: ArrayView2<f64>, frames: &Array2<f64>) -> f64 {
    let measured = measured_velocity_factors(with_first(window, frames).view());
    let asked = window.slice(s![1.., VELOCITY_FACTORS]);
    let missed: Vec<f64> = measured[1..]
        .iter()
        .flatten()
        .zip(asked)
        .map(|(measured, asked)| (measured - asked).abs())
        .collect();
    missed.iter().sum::<f64>() / missed.len() as f64
}

/// The mean norm of the change of all bodies' velocities, cm/frame^2.
fn acceleration(window: ArrayView2<f64>, frames: &Array2<f64>) -> f64 {
    let all = with_first(window, frames);
    let bodies = all.slice(s![.., BODY_POSITIONS]);
    let steps = &bodies.slice(s![1.., ..]) - &bodies.slice(s![..-1, ..]);
    let changes = &steps.slice(s![1.., ..]) - &steps.slice(s![..-1, ..]);
    let norms = changes.rows().into_iter().map(|row| row.dot(&row).sqrt());
    norms.sum::<f64>() / changes.nrows() as f64
}

/// The mean distance of p^b from the recorded one, cm (eq. 12).
fn distance(window: ArrayView2<f64>, frames: &Array2<f64>) -> f64 {
    let missed = &frames.slice(s![.., BODY_POSITIONS]) - &window.slice(s![1.., BODY_POSITIONS]);
    let norms = missed.rows().into_iter().map(|row| row.dot(&row).sqrt());
    norms.sum::<f64>() / frames.nrows() as f64
}

#[test]
fn a_slow_and_trembling_motion_becomes_as_fast_as_asked_and_smooth_and_no_further_from_the_truth() {
    let (window, request) = transition(&clip(), 60);
    let predicted = slow_and_trembling(window.view());
    let refined = refined(&request, &predicted);
    let before_and_after = |measure: fn(ArrayView2<f64>, &Array2<f64>) -> f64| {
        [&predicted, &refined].map(|frames| measure(window.view(), frames))
    };
    let [before, after] = before_and_after(missed);
    assert!(after < 0.25 * before, "velocity factors: {before}, {after}");
    let [before, after] = before_and_after(acceleration);
    assert!(after < 0.5 * before, "acceleration: {before}, {after}");
    let [before, after] = before_and_after(distance);
    assert!(after < before, "distance: {before}, {after}");
}

#[test]
fn only_bodies_between_the_keyframes_change_and_velocities_are_their_steps() {
    let (window, request) = transition(&clip(), 60);
    let predicted = slow_and_trembling(window.view());
    let refined = refined(&request, &predicted);
    let between = BODY_POSITIONS.end..BODY_VELOCITIES.start;
    for columns in [between, BODY_VELOCITIES.end..FRAME] {
        assert_eq!(
            predicted.slice(s![.., columns.clone()]),
            refined.slice(s![.., columns])
        );
    }
    assert_eq!(
        predicted.slice(s![-1, BODY_POSITIONS]),
        refined.slice(s![-1, BODY_POSITIONS])
    );
    let all = with_first(window.view(), &refined);
    let bodies = all.slice(s![.., BODY_POSITIONS]);
    let steps = &bodies.slice(s![1.., ..]) - &bodies.slice(s![..-1, ..]);
    assert_eq!(refined.slice(s![.., BODY_VELOCITIES]), steps);
}

#[test]
fn a_straight_motion_that_is_as_fast_as_asked_stays_as_it_is() {
    let (mut window, mut request) = transition(&clip(), 20);
    let first = window.row(0).to_owned();
    for (t, mut row) in window.rows_mut().into_iter().enumerate() {
        row.assign(&first);
        for number in BODY_POSITIONS {
            row[number] *= 1.0 + 0.01 * t as f64;
        }
        for number in ROOT_POSITION {
            row[number] += t as f64 * (number as f64).sin();
        }
    }
    let predicted = window.slice(s![1.., ..FRAME]).to_owned();
    let factors = measured_velocity_factors(window.view());
    let factors = Array2::from_shape_fn((21, 5), |(t, part)| factors[t][part]);
    request.velocity_factors.assign(&factors);
    let root = window.slice(s![.., ROOT_POSITION]);
    request.root_trajectory.assign(&root);
    let refined = refined(&request, &predicted);
    for number in BODY_POSITIONS {
        for t in 0..20 {
            let moved = refined[[t, number]] - predicted[[t, number]];
            assert!(moved.abs() < 1e-9, "{t} {number}: {moved}");
        }
    }
}

/// A joint's place from the root, cm.
fn joint_at(body: ArrayView1<f64>, joint: usize) -> DVec3 {
    match joint.checked_sub(1) {
        None => DVec3::ZERO,
        Some(at) => DVec3::new(body[3 * at], body[3 * at + 1], body[3 * at + 2]),
    }
}

/// From its parent to a joint, cm.
fn bone(body: ArrayView1<f64>, joint: usize) -> DVec3 {
    joint_at(body, joint) - joint_at(body, DANCE_PARENTS[joint].unwrap())
}

fn bone_length(body: ArrayView1<f64>, joint: usize) -> f64 {
    bone(body, joint).length()
}

#[test]
fn bones_of_the_dancers_lengths_keep_them() {
    let (window, request) = transition(&clip(), 60);
    let mut predicted = window.slice(s![1.., ..FRAME]).to_owned();
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    for mut frame in predicted.rows_mut().into_iter().take(59) {
        let recorded = frame.to_owned();
        for joint in 1..JOINTS {
            let mut turned = || rng.random_range(-0.3..0.3);
            let turn = DQuat::from_scaled_axis(DVec3::new(turned(), turned(), turned()));
            let placed = joint_at(frame.view(), DANCE_PARENTS[joint].unwrap())
                + turn * bone(recorded.view(), joint);
            for (axis, number) in placed.to_array().into_iter().enumerate() {
                frame[3 * joint - 3 + axis] = number;
            }
        }
    }
    let refined = refined(&request, &predicted);
    assert_ne!(refined, predicted);
    for frame in refined.rows() {
        for joint in 1..JOINTS {
            let expected = bone_length(window.row(0), joint);
            let found = bone_length(frame, joint);
            assert!((found - expected).abs() < 1e-9, "{joint}: {found}");
        }
    }
}

/// Solves a dense system by elimination; enough for a positive definite matrix.
fn solve(mut matrix: Array2<f64>, mut right: Array1<f64>) -> Array1<f64> {
    let n = right.len();
    for pivot in 0..n {
        for row in pivot + 1..n {
            let factor = matrix[[row, pivot]] / matrix[[pivot, pivot]];
            for column in pivot..n {
                matrix[[row, column]] -= factor * matrix[[pivot, column]];
            }
            right[row] -= factor * right[pivot];
        }
    }
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|at| matrix[[row, at]] * right[at]).sum();
        right[row] = (right[row] - known) / matrix[[row, row]];
    }
    right
}

/// The module's formula, one number at a time, with a dense matrix over all frames whose ends are
/// held by their own rows.
fn expected(request: &TransitionRequest, frames: &Array2<f64>) -> Array2<f64> {
    let n = frames.nrows();
    let first = request
        .start
        .features
        .slice(s![..FRAME])
        .insert_axis(Axis(0));
    let all = concatenate(Axis(0), &[first, frames.view()]).unwrap();
    let p = all.slice(s![.., BODY_POSITIONS]).to_owned();
    let stencil = |rows: usize, numbers: &[f64]| {
        let mut matrix = Array2::<f64>::zeros((rows, n + 1));
        for row in 0..rows {
            for (at, &number) in numbers.iter().enumerate() {
                matrix[[row, row + at]] = number;
            }
        }
        matrix
    };
    let steps = stencil(n, &[-1.0, 1.0]);
    let bends = stencil(n - 1, &[1.0, -2.0, 1.0]);
    let mut smooth = Array2::<f64>::eye(n + 1) + 100.0 * bends.t().dot(&bends);
    let mut matrix = &smooth + 300.0 * steps.t().dot(&steps);
    for matrix in [&mut smooth, &mut matrix] {
        for end in [0, n] {
            matrix.row_mut(end).fill(0.0);
            matrix[[end, end]] = 1.0;
        }
    }
    let lengths: Vec<Array1<f64>> = (1..JOINTS)
        .map(|joint| {
            let lengths = (0..=n).map(|t| bone_length(p.row(t), joint)).collect();
            let smoothed = solve(smooth.clone(), lengths);
            Array1::from_shape_fn(n + 1, |t| {
                let share = t as f64 / n as f64;
                let of_dancer = (1.0 - share) * smoothed[0] + share * smoothed[n];
                (smoothed[t] + of_dancer) / 2.0
            })
        })
        .collect();
    let mut x = p.clone();
    for _ in 0..10 {
        let mut w = steps.dot(&x);
        for t in 0..n {
            let root: Vec<f64> = (0..3)
                .map(|axis| {
                    let now = frames[[t, ROOT_POSITION.start + axis]];
                    let before = match t {
                        0 => request.root_trajectory[[0, axis]],
                        _ => frames[[t - 1, ROOT_POSITION.start + axis]],
                    };
                    now - before
                })
                .collect();
            for (part, joints) in PART_WEIGHTS.iter().enumerate() {
                let total: f64 = joints.iter().map(|(_, weight)| weight).sum();
                let mut bodies = 0.0;
                let mut asked = request.velocity_factors[[t + 1, part]] * total;
                for &(joint, weight) in *joints {
                    if joint == 0 {
                        asked -= weight * root.iter().map(|x| x * x).sum::<f64>().sqrt();
                    } else {
                        let speed = w.slice(s![t, 3 * joint - 3..3 * joint]);
                        bodies += weight * speed.dot(&speed).sqrt();
                    }
                }
                let times = (asked.max(0.0) / bodies).min(3.0);
                for &(joint, _) in joints.iter().filter(|(joint, _)| *joint > 0) {
                    let mut velocity = w.slice_mut(s![t, 3 * joint - 3..3 * joint]);
                    velocity *= times;
                }
            }
        }
        let mut right = &p + &(300.0 * steps.t().dot(&w));
        for end in [0, n] {
            right.row_mut(end).assign(&p.row(end));
        }
        for number in BODY_POSITIONS {
            let solved = solve(matrix.clone(), right.column(number).to_owned());
            x.column_mut(number).assign(&solved);
        }
        let solved = x.clone();
        for t in 1..n {
            for joint in 1..JOINTS {
                let bone = bone(solved.row(t), joint);
                let wanted = lengths[joint - 1][t];
                let parent = joint_at(x.row(t), DANCE_PARENTS[joint].unwrap());
                let placed = parent + bone * wanted / bone.length();
                for (axis, number) in placed.to_array().into_iter().enumerate() {
                    x[[t, 3 * joint - 3 + axis]] = number;
                }
            }
        }
    }
    x.slice(s![1.., ..]).to_owned()
}

#[test]
fn the_result_is_the_documented_minimum_at_every_length() {
    let clip = clip();
    for length in [1, 2, 3, 4, 17] {
        let (window, request) = transition(&clip, length);
        let predicted = slow_and_trembling(window.view());
        let expected = expected(&request, &predicted);
        let refined = refined(&request, &predicted);
        for ((t, number), expected) in expected.indexed_iter() {
            let found = refined[[t, number]];
            assert!(
                (found - expected).abs() < 1e-8,
                "N = {length}, {t} {number}: {found}, {expected}"
            );
        }
    }
}

#[test]
fn a_part_that_is_asked_to_stand_still_or_does_not_move_gives_finite_frames() {
    let (window, mut request) = transition(&clip(), 20);
    let predicted = slow_and_trembling(window.view());
    for (factor, still) in [(0.0, false), (1e6, false), (2.0, true)] {
        request.velocity_factors.fill(factor);
        let mut predicted = predicted.clone();
        if still {
            for mut frame in predicted.rows_mut() {
                frame.assign(&window.slice(s![0, ..FRAME]));
            }
        }
        let refined = refined(&request, &predicted);
        assert!(refined.iter().all(|x| x.is_finite()), "{factor} {still}");
    }
}
