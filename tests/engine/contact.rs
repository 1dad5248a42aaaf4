//! Contact labels and foot skate.

use glam::DVec3;
use keydance::motion::contact::{FOOT_JOINTS, contacts, foot_skate};

#[test]
fn skate_counts_only_feet_in_contact() {
    let mut frames = vec![vec![DVec3::ZERO; 24]; 3];
    frames[1][3].x = 2.0;
    frames[2][3].x = 3.0;
    frames[2][7].y = 50.0;
    let on = |left, right| [left, false, right, false];
    let contacts = [on(true, true), on(true, false), on(true, false)];
    assert_eq!(foot_skate(&frames, FOOT_JOINTS, &contacts), Some(1.5));
    assert_eq!(foot_skate(&frames, FOOT_JOINTS, &[[false; 4]; 3]), None);
}

#[test]
fn a_planted_foot_of_a_moving_dancer_is_in_contact() {
    let mut frames = vec![vec![DVec3::ZERO; 24]; 3];
    for (time, frame) in frames.iter_mut().enumerate() {
        frame[0] = DVec3::new(5.0 * time as f64, 90.0, 0.0);
        frame[7] = DVec3::new(0.0, 0.0, 2.0 * time as f64);
    }
    frames[2][4] = DVec3::new(0.0, 0.5, 0.0);
    let labels = contacts(&frames, FOOT_JOINTS, 0.2);
    assert_eq!(
        labels,
        vec![
            [1.0, 1.0, 0.0, 1.0],
            [1.0, 1.0, 0.0, 1.0],
            [1.0, 0.0, 0.0, 1.0]
        ]
    );
}

#[test]
fn feet_of_another_skeleton_are_those_that_are_named() {
    let mut frames = vec![vec![DVec3::ZERO; 3]; 2];
    frames[1][2].x = 1.0;
    assert_eq!(contacts(&frames, [1, 2], 0.2), vec![[1.0, 0.0]; 2]);
    assert_eq!(foot_skate(&frames, [2], &[[true]; 2]), Some(1.0));
}
