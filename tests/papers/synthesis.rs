//! From keyframes and controls to motion.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Mutex;

use glam::{DQuat, DVec3};
use keydance::data::DataConfig;
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::evaluation::transitions::window_request;
use keydance::models::ModelError;
use keydance::models::baselines::interpolation::Interpolation;
use keydance::models::transition::DanceClip;
use keydance::models::transition::{DataRanges, window_features};
use keydance::models::transition::{Transition, TransitionModel, TransitionRequest};
use keydance::motion::contact::{FOOT_JOINTS, foot_skate};
use keydance::motion::features::{
    BODY_POSITIONS, BODY_VELOCITIES, CONTACTS, FACING, FRAME, ROOT_POSITION, VELOCITY_FACTORS,
};
use keydance::synthesis::controls::{Speed, smooth_curve};
use keydance::synthesis::{
    KeyframeSource, Sequence, SequenceRequest, SynthesisError, SynthesisOptions, control_warnings,
    moved_warnings, synthesise, transition_motion,
};
use ndarray::{Array2, s};
use proptest::prelude::*;

const LENGTH: usize = 40;

/// A generated clip.
fn dance(seed: u64, frames: usize) -> DanceClip {
    let config = ChoreographyConfig {
        clips: 1,
        frames_per_clip: frames,
        seed,
    };
    let clip = generate(&config).unwrap().remove(0).clip;
    DanceClip::new(clip, None, &DataConfig::default()).unwrap()
}

/// A window of a generated clip as a request, and its own frames as if a model had predicted them.
fn perfect_prediction() -> (DanceClip, TransitionRequest, Transition) {
    let clip = dance(5, 100);
    let window = window_features(&clip.features, 30, LENGTH);
    let request =
        TransitionRequest::of(&window_request(&clip.clip, 30, window.view()).unwrap()).unwrap();
    let frames = window.slice(s![1.., ..FRAME]).to_owned();
    (clip, request, Transition { frames })
}

#[test]
fn a_perfect_prediction_becomes_the_recorded_motion_from_k1_on() {
    let (clip, request, transition) = perfect_prediction();
    let motion = transition_motion(&request, &transition, "transition", 1.0 / 30.0).unwrap();
    assert_eq!(motion.clip.poses.len(), LENGTH + 1);
    assert_eq!(motion.clip.poses[0], request.start.pose);
    let skeleton = &clip.clip.skeleton;
    for (found, recorded) in motion.clip.poses.iter().zip(&clip.clip.poses[30..]) {
        let recorded = recorded.world_positions(skeleton);
        for (found, recorded) in found.world_positions(skeleton).iter().zip(recorded) {
            assert!(found.distance(recorded) < 0.1, "{found} {recorded}");
        }
    }
    assert!(motion.max_error < 0.1, "{}", motion.max_error);
}

#[test]
fn a_bone_that_is_predicted_too_long_shows_in_the_errors() {
    let (_, request, mut transition) = perfect_prediction();
    // The last joint of p^b is the head's end of a chain: 10 cm further up.
    let height = BODY_POSITIONS.end - 2;
    transition.frames[[LENGTH - 1, height]] += 10.0;
    let motion = transition_motion(&request, &transition, "transition", 1.0 / 30.0).unwrap();
    assert!(
        (5.0..=10.0).contains(&motion.max_error),
        "{}",
        motion.max_error
    );
    transition.frames[[0, height]] = f64::NAN;
    assert!(transition_motion(&request, &transition, "transition", 1.0 / 30.0).is_err());
}

/// Interpolation between two other poses, on another path, with bones that are too long: it misses
/// every keyframe, and its first frames already. Keeps what it was asked.
#[derive(Default)]
struct Astray {
    asked: Mutex<Vec<TransitionRequest>>,
}

impl TransitionModel for Astray {
    fn name(&self) -> &str {
        "astray"
    }

    fn transitions(&self, requests: &[TransitionRequest]) -> Result<Vec<Transition>, ModelError> {
        self.asked.lock().unwrap().extend_from_slice(requests);
        let mut astray = requests.to_vec();
        for request in &mut astray {
            for (keyframe, angle) in [(&mut request.start, 0.3), (&mut request.target, 0.9)] {
                for joint in [1, 6, 11, 15, 19] {
                    let turned = DQuat::from_rotation_z(angle) * keyframe.pose.rotations[joint];
                    keyframe.pose.rotations[joint] = turned;
                }
            }
        }
        let mut transitions = Interpolation::default().transitions(&astray)?;
        for transition in &mut transitions {
            let frames = transition.frames.nrows() as f64;
            for (step, mut row) in transition.frames.rows_mut().into_iter().enumerate() {
                let share = (step + 1) as f64 / frames;
                for column in BODY_POSITIONS {
                    row[column] *= 1.05;
                }
                row[ROOT_POSITION.start] += 5.0 + 10.0 * share;
                row[FACING.start] += 0.1 + 0.4 * share;
            }
        }
        Ok(transitions)
    }
}

const PLAIN: SynthesisOptions = SynthesisOptions {
    foot_cleanup: false,
};

fn world(sequence: &Sequence) -> Vec<Vec<DVec3>> {
    let clip = &sequence.clip;
    clip.skeleton.world_positions(&clip.poses)
}

fn positions(clip: &DanceClip) -> Vec<Vec<DVec3>> {
    clip.clip.skeleton.world_positions(&clip.clip.poses)
}

/// Length of the second difference of every joint's position around a frame, cm/frame^2.
fn accelerations(world: &[Vec<DVec3>], frame: usize) -> Vec<f64> {
    let joints = world[frame].iter().enumerate();
    joints
        .map(|(joint, now)| {
            (world[frame + 1][joint] + world[frame - 1][joint] - 2.0 * *now).length()
        })
        .collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn assert_at_keyframes(sequence: &Sequence, request: &SequenceRequest) {
    let world = world(sequence);
    for timed in &request.keyframes {
        let wanted = timed.keyframe.pose.world_positions(&request.skeleton);
        for (found, wanted) in world[timed.time].iter().zip(wanted) {
            assert!(found.distance(wanted) < 1e-6, "frame {}", timed.time);
        }
    }
}

#[test]
fn a_model_that_misses_is_bent_onto_every_keyframe_without_a_jump() {
    let clip = dance(1, 300);
    let frames = [20, 80, 130, 200];
    let request = SequenceRequest::from_clip(&clip, &frames).unwrap();
    let sequence = synthesise(&Astray::default(), &request, &PLAIN, "dance").unwrap();
    assert_eq!(sequence.clip.poses.len(), 181);
    assert_eq!(sequence.keyframes, [0, 60, 110, 180]);
    assert_at_keyframes(&sequence, &request);
    let recorded = positions(&clip);
    let world = world(&sequence);
    for (time, frame) in sequence.keyframes.iter().zip(frames) {
        for (found, recorded) in world[*time].iter().zip(&recorded[frame]) {
            assert!(found.distance(*recorded) < 0.01);
        }
    }
    assert_eq!(sequence.misses.len(), 3);
    for miss in &sequence.misses {
        assert!(miss.mean > 10.0 && miss.max > miss.mean, "{miss:?}");
    }
    // What the data does in all but one frame of a hundred, at its fastest joint.
    let mut data: Vec<f64> = (1..recorded.len() - 1)
        .map(|frame| largest(&accelerations(&recorded, frame)))
        .collect();
    data.sort_by(f64::total_cmp);
    let bound = data[data.len() * 99 / 100];
    for time in [60, 110] {
        let found = largest(&accelerations(&world, time));
        assert!(
            found < bound,
            "frame {time}: {found} cm/frame^2, the data {bound}"
        );
    }
}

#[test]
fn transitions_of_few_frames_meet_their_keyframes_too() {
    let clip = dance(1, 60);
    let request = SequenceRequest::from_clip(&clip, &[10, 11, 13, 18, 38]).unwrap();
    let sequence = synthesise(&Astray::default(), &request, &PLAIN, "dance").unwrap();
    assert_eq!(sequence.clip.poses.len(), 29);
    assert_at_keyframes(&sequence, &request);
}

#[test]
fn bones_keep_their_lengths_in_every_frame() {
    let clip = dance(2, 150);
    let request = SequenceRequest::from_clip(&clip, &[0, 60, 140]).unwrap();
    let options = SynthesisOptions { foot_cleanup: true };
    let sequence = synthesise(&Astray::default(), &request, &options, "dance").unwrap();
    for positions in world(&sequence) {
        for (index, joint) in clip.clip.skeleton.joints.iter().enumerate() {
            if let Some(parent) = joint.parent {
                let length = positions[index].distance(positions[parent]);
                assert!(
                    (length - joint.offset.length()).abs() < 1e-6,
                    "{}",
                    joint.name
                );
            }
        }
    }
}

#[test]
fn each_transition_starts_from_what_was_generated_before_it() {
    let clip = dance(3, 150);
    let request = SequenceRequest::from_clip(&clip, &[10, 60, 140]).unwrap();
    let model = Astray::default();
    let sequence = synthesise(&model, &request, &PLAIN, "dance").unwrap();
    let asked = model.asked.lock().unwrap();
    assert_eq!(asked[0].start.features, clip.features.row(10));
    let start = &asked[1].start;
    assert_eq!(start.pose, sequence.clip.poses[50]);
    let columns = |range: std::ops::Range<usize>| {
        let (found, generated) = (
            start.features.slice(s![range.clone()]),
            sequence.features.slice(s![50, range]),
        );
        found
            .iter()
            .zip(generated)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max)
    };
    assert!(columns(BODY_POSITIONS) < 1e-9);
    assert!(columns(BODY_VELOCITIES) < 1e-9);
    // The generated motion does not move as the recorded one did.
    let recorded = clip.features.slice(s![60, BODY_VELOCITIES]);
    let generated = sequence.features.slice(s![50, BODY_VELOCITIES]);
    assert!(
        recorded
            .iter()
            .zip(generated)
            .any(|(a, b)| (a - b).abs() > 0.1)
    );
    assert_eq!(
        start.features.slice(s![VELOCITY_FACTORS]),
        clip.features.slice(s![60, VELOCITY_FACTORS])
    );
    assert_eq!(
        asked[1].root_trajectory,
        clip.features.slice(s![60..=140, ROOT_POSITION])
    );
}

/// Interpolation that makes a whole turn too many on its first transition. Keeps what it was asked.
#[derive(Default)]
struct Spinning {
    asked: Mutex<Vec<TransitionRequest>>,
}

impl TransitionModel for Spinning {
    fn name(&self) -> &str {
        "spinning"
    }

    fn transitions(&self, requests: &[TransitionRequest]) -> Result<Vec<Transition>, ModelError> {
        let mut asked = self.asked.lock().unwrap();
        let mut transitions = Interpolation::default().transitions(requests)?;
        if asked.is_empty() {
            let frames = &mut transitions[0].frames;
            let length = frames.nrows() as f64;
            for (step, angle) in frames.column_mut(FACING.start).iter_mut().enumerate() {
                *angle += TAU * (step + 1) as f64 / length;
            }
        }
        asked.extend_from_slice(requests);
        Ok(transitions)
    }
}

#[test]
fn a_turn_too_many_is_not_asked_back_in_the_next_transition() {
    let clip = dance(3, 150);
    let request = SequenceRequest::from_clip(&clip, &[10, 60, 140]).unwrap();
    let model = Spinning::default();
    synthesise(&model, &request, &PLAIN, "dance").unwrap();
    let asked = model.asked.lock().unwrap();
    let facing = |k: usize| request.keyframes[k].keyframe.features[FACING.start];
    let (start, target) = (&asked[1].start.features, &asked[1].target.features);
    assert!((start[FACING.start] - facing(1) - TAU).abs() < 1e-9);
    let turn = target[FACING.start] - start[FACING.start];
    assert!((turn - (facing(2) - facing(1))).abs() < 1e-9, "{turn}");
}

/// Gives back recorded frames, the root sliding to and fro under them.
struct Sliding {
    frames: Array2<f64>,
}

impl TransitionModel for Sliding {
    fn name(&self) -> &str {
        "sliding"
    }

    fn transitions(&self, requests: &[TransitionRequest]) -> Result<Vec<Transition>, ModelError> {
        let mut frames = self.frames.clone();
        let length = frames.nrows() as f64;
        for (step, mut row) in frames.rows_mut().into_iter().enumerate() {
            row[ROOT_POSITION.start] += 8.0 * (3.0 * TAU * (step + 1) as f64 / length).sin();
        }
        Ok(requests
            .iter()
            .map(|_| Transition {
                frames: frames.clone(),
            })
            .collect())
    }
}

#[test]
fn feet_on_the_floor_are_pinned_and_keyframes_stay() {
    let clip = dance(4, 200);
    let request = SequenceRequest::from_clip(&clip, &[20, 170]).unwrap();
    let model = Sliding {
        frames: clip.features.slice(s![21..=170, ..FRAME]).to_owned(),
    };
    let options = SynthesisOptions { foot_cleanup: true };
    let plain = synthesise(&model, &request, &PLAIN, "dance").unwrap();
    let pinned = synthesise(&model, &request, &options, "dance").unwrap();
    let skates = |sequence: &Sequence| {
        let feet = sequence.feet.unwrap();
        [feet.before, feet.after].map(|toes| toes.travel.mean().unwrap())
    };
    let [before, after] = skates(&pinned);
    assert_eq!(skates(&plain), [before; 2]);
    assert!(before > 0.5 && after < before, "{before} {after}");
    // A toe on the floor may be taking off; one in contact stands.
    let [before, after] = [&plain, &pinned]
        .map(|sequence| foot_skate(&world(sequence), FOOT_JOINTS, &sequence.contacts).unwrap());
    assert!(before > 0.5 && after < 0.3 * before, "{before} {after}");
    assert_at_keyframes(&pinned, &request);
    // The correction comes and goes smoothly: nothing jumps that did not before.
    let (plain, pinned) = (world(&plain), world(&pinned));
    for frame in 1..pinned.len() - 1 {
        let worst = largest(&accelerations(&pinned, frame));
        let bound = largest(&accelerations(&plain, frame)) + 4.0;
        assert!(worst < bound, "frame {frame}: {worst} {bound}");
    }
    assert_eq!(pinned[75][23], plain[75][23]);
}

#[test]
fn feet_that_are_pinned_do_not_go_through_the_floor() {
    for seed in 1..6 {
        let clip = dance(seed, 200);
        let request = SequenceRequest::from_clip(&clip, &[20, 90, 130, 190]).unwrap();
        let options = SynthesisOptions { foot_cleanup: true };
        let plain = synthesise(&Astray::default(), &request, &PLAIN, "dance").unwrap();
        let pinned = synthesise(&Astray::default(), &request, &options, "dance").unwrap();
        let [before, after] = [&plain, &pinned].map(|it| it.feet.unwrap().after.lowest);
        assert!(before < -1.0 && after > -1e-6, "{before} {after}");
        assert_at_keyframes(&pinned, &request);
    }
}

#[test]
fn what_a_model_predicts_too_little_of_or_no_numbers_for_is_an_error_that_names_the_frames() {
    let clip = dance(4, 120);
    let request = SequenceRequest::from_clip(&clip, &[20, 100]).unwrap();
    let predicted = clip.features.slice(s![21..=100, ..FRAME]);
    let error = |frames: Array2<f64>| {
        let error = synthesise(&Sliding { frames }, &request, &PLAIN, "dance").unwrap_err();
        let SynthesisError::Transition { from, to, source } = error else {
            panic!("{error}");
        };
        assert_eq!((from, to), (0, 80));
        source.to_string()
    };
    let text = error(predicted.slice(s![..79, ..]).to_owned());
    assert!(
        text.contains("[79, 149]") && text.contains("[80, 149]"),
        "{text}"
    );
    let mut infinite = predicted.to_owned();
    infinite[[3, CONTACTS.start]] = f64::INFINITY;
    let text = error(infinite);
    assert!(text.contains("a NaN or an infinity"), "{text}");
}

#[test]
fn contacts_are_those_that_the_model_predicts() {
    let clip = dance(4, 120);
    let request = SequenceRequest::from_clip(&clip, &[20, 100]).unwrap();
    let mut frames = clip.features.slice(s![21..=100, ..FRAME]).to_owned();
    frames.slice_mut(s![.., CONTACTS]).fill(0.2);
    frames[[9, CONTACTS.start + 2]] = 0.9;
    let sequence = synthesise(&Sliding { frames }, &request, &PLAIN, "dance").unwrap();
    assert_eq!(sequence.contacts[10], [false, false, true, false]);
    assert_eq!(sequence.contacts[11], [false; 4]);
}

#[test]
fn a_longer_transition_keeps_way_keyframes_and_speeds() {
    let clip = dance(6, 200);
    let short = SequenceRequest::from_clip(&clip, &[10, 60, 110]).unwrap();
    let long = short.clone().with_length(250).unwrap();
    assert_eq!(long.times(), [0, 250, 500]);
    assert_eq!(long.root_trajectory.nrows(), 501);
    for frame in 0..=100 {
        for axis in 0..3 {
            let (a, b) = (
                short.root_trajectory[[frame, axis]],
                long.root_trajectory[[5 * frame, axis]],
            );
            assert!((a - b).abs() < 1e-9);
        }
        for part in 0..5 {
            let (a, b) = (
                short.velocity_factors[[frame, part]],
                long.velocity_factors[[5 * frame, part]],
            );
            assert!((a - b).abs() < 1e-9);
        }
    }
    let sequence = synthesise(&Interpolation::default(), &long, &PLAIN, "long").unwrap();
    assert_at_keyframes(&sequence, &long);
    assert!(matches!(
        short.clone().at_times(&[0, 5]),
        Err(SynthesisError::Times { .. })
    ));
    assert!(matches!(
        short.clone().at_times(&[0, 5, 5]),
        Err(SynthesisError::Order { .. })
    ));
    assert!(short.with_length(0).is_err());
}

#[test]
fn a_turned_request_gives_the_same_dance_turned() {
    let clip = dance(7, 150);
    let straight = SequenceRequest::from_clip(&clip, &[10, 120]).unwrap();
    let turned = straight.clone().turned(FRAC_PI_2);
    let [a, b] = [&straight, &turned].map(|request| {
        world(&synthesise(&Interpolation::default(), request, &PLAIN, "dance").unwrap())
    });
    let centre = a[0][0];
    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
        let from = *a - centre;
        let expected = centre + DVec3::new(from.z, from.y, -from.x);
        assert!(b.distance(expected) < 1e-6, "{b} {expected}");
    }
}

#[test]
fn keyframes_lie_on_every_trajectory_that_is_asked_for() {
    let clip = dance(8, 150);
    let request = SequenceRequest::from_clip(&clip, &[10, 70, 120]).unwrap();
    let drawn = smooth_curve(
        &[DVec3::new(0.0, 90.0, 0.0), DVec3::new(100.0, 90.0, 50.0)],
        request.frames(),
        &Speed::Constant,
    );
    let (drawn, moved) = request.clone().on_path(&drawn).unwrap();
    let roots = request.keyframe_roots();
    for ((root, new), moved) in roots.iter().zip(drawn.keyframe_roots()).zip(&moved) {
        assert!((root.distance(new) - moved).abs() < 1e-9);
    }
    let warnings = moved_warnings(&drawn, &moved);
    let text = warnings[0].to_string();
    assert!(text.contains(&format!("by {:.1} cm", moved[0])), "{text}");
    for request in [
        drawn.scaled(2.0).unwrap(),
        request.clone().scaled(0.5).unwrap(),
        request.clone().raised(30.0),
        request.clone().turned(1.0),
    ] {
        for timed in &request.keyframes {
            for (axis, value) in timed.keyframe.pose.translations[0]
                .to_array()
                .iter()
                .enumerate()
            {
                let asked = request.root_trajectory[[timed.time, axis]];
                assert!((asked - value).abs() < 1e-9);
                assert_eq!(timed.keyframe.features[ROOT_POSITION.start + axis], *value);
            }
        }
    }
    let raised = request.clone().raised(30.0).root_trajectory;
    assert!((raised[[30, 1]] - request.root_trajectory[[30, 1]] - 30.0).abs() < 1e-9);
}

#[test]
fn controls_beyond_the_data_and_against_each_other_are_warned_of_by_how_much() {
    let clip = dance(9, 150);
    let request = SequenceRequest::from_clip(&clip, &[10, 70, 120]).unwrap();
    let ranges = DataRanges::of([clip.features.view()]).unwrap();
    let warned = |request: &SequenceRequest| -> Vec<String> {
        let warnings = control_warnings(request, Some(&ranges));
        warnings.iter().map(ToString::to_string).collect()
    };
    // A recorded motion is within its own bounds, but for the frame in a thousand that they leave
    // out.
    for text in warned(&request) {
        assert!(
            text.contains("1.0 times") || text.contains(" 0 cm") || text.contains(" 1 cm"),
            "{text}"
        );
    }
    let fast = request
        .clone()
        .velocity_times([1.0, 1.0, 1.0, 50.0, 1.0])
        .unwrap();
    let highest = fast
        .velocity_factors
        .column(3)
        .iter()
        .copied()
        .fold(0.0, f64::max);
    let times = format!("{:.1} times", highest / ranges.velocity_factors[3]);
    let found = warned(&fast);
    assert!(
        found
            .iter()
            .any(|text| text.contains("right_arm") && text.contains(&times)),
        "{found:?}"
    );
    let high = warned(&request.clone().raised(200.0));
    assert!(
        high.iter()
            .any(|text| text.contains("cm above the training data's highest")),
        "{high:?}"
    );
    let low = warned(&request.clone().raised(-200.0));
    assert!(
        low.iter()
            .any(|text| text.contains("cm below the training data's lowest")),
        "{low:?}"
    );
    let far = warned(&request.clone().scaled(300.0).unwrap());
    assert!(
        far.iter().any(|text| text.contains("cm/frame at frame")),
        "{far:?}"
    );
    let still = request.clone().scaled(30.0).unwrap();
    let still = warned(&still.velocity_times([0.0; 5]).unwrap());
    assert!(
        still.iter().any(|text| text.contains("contradict")),
        "{still:?}"
    );
    let long = control_warnings(&request.with_length(300).unwrap(), None);
    assert!(long[0].to_string().contains("300 frames"));
}

#[test]
fn keyframes_of_other_clips_come_onto_the_first_dancers_bones() {
    let first = dance(10, 60);
    let mut other = dance(11, 60);
    for joint in &mut other.clip.skeleton.joints {
        joint.offset *= 1.2;
    }
    for pose in &mut other.clip.poses {
        pose.translations.iter_mut().for_each(|place| *place *= 1.2);
    }
    let other = DanceClip::new(other.clip, None, &DataConfig::default()).unwrap();
    let source = |clip, frame, time| KeyframeSource { clip, frame, time };
    let request =
        SequenceRequest::from_keyframes(&[source(&first, 5, 0), source(&other, 40, 50)]).unwrap();
    assert_eq!(request.skeleton, first.clip.skeleton);
    let keyframe = &request.keyframes[1].keyframe;
    let floor = |world: &[DVec3]| {
        world
            .iter()
            .map(|joint| joint.y)
            .fold(f64::INFINITY, f64::min)
    };
    let placed = keyframe.pose.world_positions(&request.skeleton);
    // The other dancer is the same one, 1.2 times as tall.
    assert!((floor(&placed) - floor(&positions(&other)[40]) / 1.2).abs() < 1e-6);
    assert!(
        (keyframe.features[FACING.start] - request.keyframes[0].keyframe.features[FACING.start])
            .abs()
            <= TAU / 2.0
    );
    let sequence = synthesise(&Interpolation::default(), &request, &PLAIN, "both").unwrap();
    assert_at_keyframes(&sequence, &request);
    let mut strange = other.clone();
    strange.clip.skeleton.joints[15].offset = DVec3::new(0.0, 14.0, 0.0);
    for pose in &mut strange.clip.poses {
        pose.translations[15] = DVec3::new(0.0, 14.0, 0.0);
    }
    let error = SequenceRequest::from_keyframes(&[source(&first, 5, 0), source(&strange, 40, 50)]);
    assert!(
        error
            .unwrap_err()
            .to_string()
            .contains("RightArm points 90 degrees")
    );
}

#[test]
fn a_dancer_is_scaled_by_the_bones_of_the_keyframe_where_those_at_rest_are_others() {
    let first = dance(10, 60);
    let mut other = dance(11, 60);
    // Twice as tall at rest, 1.2 times as tall in every frame.
    for joint in &mut other.clip.skeleton.joints {
        joint.offset *= 2.0;
    }
    for pose in &mut other.clip.poses {
        pose.translations.iter_mut().for_each(|place| *place *= 1.2);
    }
    let height = other.clip.poses[40].translations[0].y;
    let other = DanceClip::new(other.clip, None, &DataConfig::default()).unwrap();
    let source = |clip, frame, time| KeyframeSource { clip, frame, time };
    let request =
        SequenceRequest::from_keyframes(&[source(&first, 5, 0), source(&other, 40, 50)]).unwrap();
    let root = request.keyframes[1].keyframe.pose.translations[0];
    assert!((root.y - height / 1.2).abs() < 1e-6, "{root}");
}

#[test]
fn requests_that_do_not_fit_together_are_errors() {
    let clip = dance(12, 60);
    let error = |frames: &[usize]| {
        SequenceRequest::from_clip(&clip, frames)
            .unwrap_err()
            .to_string()
    };
    assert!(error(&[]).contains("two keyframes or more"));
    assert!(error(&[3]).contains("it has 1"));
    assert!(error(&[3, 3]).contains("ascending"));
    assert!(error(&[10, 5]).contains("frame 5 follows one at frame 10"));
    assert!(error(&[10, 60]).contains("has no frame 60: its frames are 0 to 59"));
    let request = SequenceRequest::from_clip(&clip, &[0, 20]).unwrap();
    let trajectory = request.clone().on_trajectory(Array2::zeros((20, 3)));
    assert_eq!(
        trajectory.unwrap_err().to_string(),
        "the root trajectory has 20 rows of 3 numbers; expected 21 rows, one a frame, of 3"
    );
    let factors = request
        .clone()
        .with_velocity_factors(Array2::zeros((21, 4)));
    assert_eq!(
        factors.unwrap_err().to_string(),
        "the array of velocity factors has 21 rows of 4 numbers; expected 21 rows, one a frame, of 5"
    );
    assert!(request.clone().scaled(0.0).is_err());
    assert!(request.velocity_times([-1.0; 5]).is_err());
}

proptest! {
    #[test]
    fn a_smooth_curve_goes_through_its_points_at_one_speed(
        points in prop::collection::vec(prop::array::uniform3(-200.0..200.0f64), 2..7),
    ) {
        let points: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
        let path = smooth_curve(&points, 400, &Speed::Constant);
        prop_assert_eq!(path[0], points[0]);
        prop_assert!(path[399].distance(points[points.len() - 1]) < 1e-6);
        let steps: Vec<f64> = path.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
        let longest = largest(&steps);
        for point in &points {
            let nearest = path.iter().map(|place| place.distance(*point)).fold(f64::INFINITY, f64::min);
            prop_assert!(nearest <= longest);
        }
        // A chord is no longer than its arc, and all arcs are equally long.
        let whole: f64 = steps.iter().sum();
        prop_assert!(longest <= 1.1 * whole / 399.0);
    }

    #[test]
    fn a_curve_is_timed_like_the_speeds_it_is_given(speeds in prop::collection::vec(0.1..10.0f64, 30)) {
        let points = [DVec3::ZERO, DVec3::new(300.0, 0.0, 0.0)];
        let path = smooth_curve(&points, 31, &Speed::Like(speeds.clone()));
        let whole: f64 = speeds.iter().sum();
        for (pair, speed) in path.windows(2).zip(&speeds) {
            prop_assert!((pair[0].distance(pair[1]) - 300.0 * speed / whole).abs() < 1e-6);
        }
    }
}
