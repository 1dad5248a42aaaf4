//! What a control does to a generated motion.

use keydance::models::transition::effect::{
    Response, body_distance, mean_velocity_factors, root_response,
};
use keydance::motion::features::FRAME;
use keydance::motion::features::{BODY_POSITIONS, ROOT_POSITION};
use ndarray::Array2;
use ndarray::s;

/// A motion whose joints all go along x by `body` and whose root goes along z by `root`,
/// cm/frame.
fn moving(frames: usize, body: f64, root: f64) -> Array2<f64> {
    Array2::from_shape_fn((frames, FRAME), |(frame, column)| {
        let time = frame as f64;
        if BODY_POSITIONS.contains(&column) && column % 3 == 0 {
            body * time
        } else if column == ROOT_POSITION.start + 2 {
            root * time
        } else {
            0.0
        }
    })
}

fn target(frames: usize, root: f64) -> Array2<f64> {
    moving(frames, 0.0, root)
        .slice(s![.., ROOT_POSITION])
        .to_owned()
}

#[test]
fn a_root_that_goes_half_of_the_way_that_its_target_moved_follows_by_a_half() {
    let response = |root| {
        root_response(
            (target(11, 3.0).view(), moving(11, 0.0, root).view()),
            (target(11, 1.0).view(), moving(11, 0.0, 1.0).view()),
        )
    };
    let half = response(2.0);
    assert!((half.asked - 10.0).abs() < 1e-12 && (half.share() - 0.5).abs() < 1e-12);
    assert!(half.follows());
    assert!((response(0.0).share() + 0.5).abs() < 1e-12 && !response(0.0).follows());
    assert!(!response(1.6).follows());
}

#[test]
fn responses_to_less_and_to_more_do_not_cancel() {
    let mean = Response::mean(
        [(-2.0, -1.0), (2.0, 1.0)].map(|(asked, measured)| Response { asked, measured }),
    );
    assert_eq!((mean.asked, mean.measured), (2.0, 1.0));
}

#[test]
fn the_same_movement_in_twice_the_time_is_no_distance_and_half_the_factor() {
    let (slow, fast) = (moving(21, 1.0, 0.0), moving(11, 2.0, 0.0));
    assert!(body_distance(fast.view(), slow.view()) < 1e-12);
    let other = body_distance(moving(11, 3.0, 0.0).view(), fast.view());
    assert!((other - 5.5).abs() < 1e-12, "{other}");
    let factors = mean_velocity_factors(slow.view());
    assert!((factors[1] - 1.0).abs() < 1e-12, "{factors:?}");
    // The trunk's weights are 9, the root's 1 of them.
    assert!((factors[0] - 8.0 / 9.0).abs() < 1e-12, "{factors:?}");
}
