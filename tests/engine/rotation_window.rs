//! Signs that are continuous in time, and the ways from one keyframe to the next.

use std::f64::consts::FRAC_PI_2;

use glam::DQuat;
use keydance::motion::rotation_window::{
    Interpolation, between, continue_from, make_continuous, nearer_sign,
};
use proptest::prelude::*;

fn rotation() -> impl Strategy<Value = DQuat> {
    prop::array::uniform4(-1.0..1.0f64)
        .prop_filter("a direction", |q| {
            q.iter().map(|x| x * x).sum::<f64>() > 0.01
        })
        .prop_map(|q| DQuat::from_array(q).normalize())
}

proptest! {
    #[test]
    fn neighbours_have_the_nearer_signs_and_keep_their_rotations(
        frames in prop::collection::vec(prop::collection::vec(rotation(), 3), 1..12),
        before in prop::collection::vec(rotation(), 3),
    ) {
        let mut continuous = frames.clone();
        make_continuous(&mut continuous);
        let mut continued = frames.clone();
        continue_from(&before, &mut continued);
        for joint in 0..3 {
            prop_assert!(continuous[0][joint].w >= 0.0);
            prop_assert!(continued[0][joint].dot(before[joint]) >= 0.0);
            for found in [&continuous, &continued] {
                for t in 0..frames.len() {
                    let (q, was) = (found[t][joint], frames[t][joint]);
                    prop_assert!(q == was || q == -was);
                    prop_assert!(t == 0 || q.dot(found[t - 1][joint]) >= 0.0);
                }
            }
        }
    }

    #[test]
    fn slerp_goes_the_shorter_way_at_constant_speed(
        start in rotation(),
        end in rotation(),
        share in 0.0..1.0f64,
    ) {
        let at = |share: f64| between(&[start], &[end], share, Interpolation::Slerp)[0];
        let near = nearer_sign(end, start);
        prop_assert!((at(0.0) - start).length() < 1e-9);
        prop_assert!((at(1.0) - near).length() < 1e-9);
        prop_assert!((at(share).length() - 1.0).abs() < 1e-9);
        // The angle between two unit quaternions from the chord: well conditioned near 0.
        let angle = |q: DQuat| 2.0 * (0.5 * (q - start).length()).asin();
        prop_assert!(angle(near) <= FRAC_PI_2 + 1e-9);
        prop_assert!((angle(at(share)) - share * angle(near)).abs() < 1e-7);
    }
}

#[test]
fn linear_takes_the_sign_of_the_shorter_arc_and_is_not_made_unit() {
    let (start, end) = (DQuat::IDENTITY, -DQuat::from_rotation_y(FRAC_PI_2));
    let half = between(&[start], &[end], 0.5, Interpolation::Linear)[0];
    assert_eq!(half, start * 0.5 - end * 0.5);
    assert!(half.length() < 0.95);
}

#[test]
fn no_frames_stay_none() {
    let mut none: [Vec<DQuat>; 0] = [];
    make_continuous(&mut none);
    continue_from(&[DQuat::IDENTITY], &mut none);
}
