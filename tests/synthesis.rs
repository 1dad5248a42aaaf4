//! Predicted frames as a clip with joint rotations.

use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::data::{DanceClip, DataConfig, window_features};
use keydance::evaluation::window_request;
use keydance::models::{Transition, TransitionRequest};
use keydance::motion::features::{BODY_POSITIONS, FRAME};
use keydance::synthesis::transition_motion;
use ndarray::s;

const LENGTH: usize = 40;

/// A window of a generated clip as a request, and its own frames as if a model had predicted them.
fn perfect_prediction() -> (DanceClip, TransitionRequest, Transition) {
    let config = ChoreographyConfig {
        clips: 1,
        frames_per_clip: 100,
        seed: 5,
    };
    let clip = generate(&config).unwrap().remove(0).clip;
    let clip = DanceClip::new(clip, None, &DataConfig::default()).unwrap();
    let window = window_features(&clip.features, 30, LENGTH);
    let request = window_request(&clip.clip, 30, window.view()).unwrap();
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
