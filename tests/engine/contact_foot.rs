//! Feet by name, and the foot in contact.

use glam::DVec3;
use keydance::motion::{ContactRule, Feet, Foot, Joint, Skeleton};

use crate::dance_clip::turning_clip;

/// Joints of these names in a row below the first.
fn named(names: &[&str]) -> Skeleton {
    let joints = names.iter().enumerate();
    let joint = |(index, name): (usize, &&str)| Joint {
        name: name.to_string(),
        parent: (index > 0).then_some(0),
        offset: DVec3::ZERO,
        end_sites: Vec::new(),
    };
    Skeleton {
        joints: joints.map(joint).collect(),
    }
}

/// Right ankle, right toe, left ankle, left toe.
const FEET: Feet = Feet {
    ankles: [0, 2],
    toes: [1, 3],
};

/// No foot is drawn.
fn never() -> Foot {
    panic!("drawn")
}

#[test]
fn feet_are_found_by_name_and_a_missing_one_is_named() {
    let dance = turning_clip("a", 1, |_| (DVec3::Y, 0.0)).skeleton;
    let feet = Feet::of(&dance).unwrap();
    assert_eq!((feet.ankles, feet.toes), ([7, 3], [8, 4]));
    let other = ["Hips", "RightFoot", "RightToe", "LeftFoot", "LeftToe"];
    let feet = Feet::of(&named(&other)).unwrap();
    assert_eq!((feet.ankles, feet.toes), ([1, 3], [2, 4]));
    let text = Feet::of(&named(&other[..4])).unwrap_err().to_string();
    assert!(
        text.contains("4 joints") && text.contains("LeftToe or LeftToeBase"),
        "{text}"
    );
}

#[test]
fn the_larger_weight_is_the_foot_and_a_tie_is_the_left() {
    assert_eq!(Foot::larger([0.6, 0.4]), Foot::Right);
    assert_eq!(Foot::larger([0.5, 0.5]), Foot::Left);
    for foot in [Foot::Right, Foot::Left] {
        assert_eq!(Foot::larger(foot.one_hot()), foot);
        assert_eq!(foot.one_hot()[foot.index()], 1.0);
    }
}

#[test]
fn the_lower_ankle_is_in_contact_whatever_the_toes_do() {
    let frame = |right: f64, left: f64| {
        let heights = [right, 100.0 - right, left, 100.0 - left];
        heights.map(|height| DVec3::Y * height).to_vec()
    };
    let world = [frame(1.0, 2.0), frame(2.0, 2.0), frame(3.0, 2.0)];
    let labels = ContactRule::LowerAnkle.labels(&world, &FEET, 0.2, never);
    assert_eq!(labels, [Foot::Right, Foot::Left, Foot::Left]);
    assert_eq!(ContactRule::LowerAnkle.joints(&FEET), [0, 2]);
}

#[test]
fn the_slower_toe_is_told_by_the_step_to_come_and_the_last_frame_repeats() {
    // Steps of the right toe 1, 2, 0; of the left 2, 2, 1. The right ankle is the lower throughout.
    let frame = |right: f64, left: f64| {
        let ankle = |height: f64| DVec3::Y * height;
        vec![ankle(1.0), DVec3::X * right, ankle(2.0), DVec3::X * left]
    };
    let world = [
        frame(0.0, 0.0),
        frame(1.0, 2.0),
        frame(3.0, 4.0),
        frame(3.0, 5.0),
    ];
    let labels = |frames: usize| ContactRule::SlowerToe.labels(&world[..frames], &FEET, 0.2, never);
    assert_eq!(
        labels(4),
        [Foot::Right, Foot::Left, Foot::Right, Foot::Right]
    );
    assert_eq!(labels(3), [Foot::Right, Foot::Left, Foot::Left]);
    // A frame by itself has no step: the lower ankle.
    assert_eq!(labels(1), [Foot::Right]);
    assert_eq!(labels(0), []);
    assert_eq!(ContactRule::SlowerToe.joints(&FEET), [1, 3]);
}

#[test]
fn while_both_toes_stand_a_foot_is_drawn_once_and_held() {
    // The right ankle is the lower. The left toe moves from frame 2 to frame 3.
    let frame = |left: f64| vec![DVec3::ZERO, DVec3::ZERO, DVec3::Y, DVec3::X * left];
    let world = [0.0, 0.1, 0.1, 9.0, 9.0, 9.1].map(frame);
    let mut drawn = Vec::new();
    let labels = ContactRule::RandomWhenBoth.labels(&world, &FEET, 0.2, || {
        drawn.push(Foot::Left);
        Foot::Left
    });
    let [left, right] = [Foot::Left, Foot::Right];
    assert_eq!(labels, [left, left, right, left, left, left]);
    assert_eq!(drawn.len(), 2);
    assert_eq!(ContactRule::RandomWhenBoth.joints(&FEET), [0, 2]);
}
