//! The protocol `published` on cases worked out by hand, and against the equations.

use keydance::evaluation::Protocol as _;
use keydance::evaluation::equations::Equations;
use keydance::evaluation::published::{Published, PublishedScores};
use keydance::evaluation::transitions::TransitionProtocol as _;
use keydance::models::ModelError;
use keydance::motion::features::{FACING, FEATURES, FRAME, ROOT_POSITION};
use ndarray::{Array2, s};

/// A window of N frames at rest at the origin, and its frames after the first as a prediction.
fn still(length: usize) -> (Array2<f64>, Array2<f64>) {
    (
        Array2::zeros((length, FEATURES)),
        Array2::zeros((length - 1, FRAME)),
    )
}

fn scores(recorded: &Array2<f64>, predicted: &Array2<f64>) -> PublishedScores {
    let protocol = Published::default();
    protocol
        .window_scores(recorded.view(), predicted.view())
        .unwrap()
}

#[test]
fn the_truth_has_no_error_and_meets_everything() {
    let (recorded, predicted) = still(10);
    let PublishedScores {
        position,
        velocity_factors_met,
        roots_met,
    } = scores(&recorded, &predicted);
    assert_eq!((position, velocity_factors_met, roots_met), (0.0, 1.0, 1.0));
}

#[test]
fn lrp_takes_the_root_in_and_both_keyframes_count_without_an_error() {
    let (recorded, mut predicted) = still(5);
    // Frame 1 of 5 is off by 3 cm at a joint and 4 cm at the root, the keyframe by 100 cm.
    predicted[[0, 10]] = 3.0;
    predicted[[0, ROOT_POSITION.start]] = 4.0;
    predicted[[3, 10]] = 100.0;
    predicted[[3, FACING.start]] = 1.0;
    assert_eq!(scores(&recorded, &predicted).position, 5.0 / 5.0);
}

#[test]
fn a_root_is_met_frame_by_frame_strictly_below_the_threshold() {
    let (recorded, mut predicted) = still(5);
    let root = ROOT_POSITION.start;
    predicted[[0, root]] = 6.999;
    predicted[[1, root]] = 7.0;
    predicted[[2, root]] = -8.0;
    // Frames 0, 1 and the true keyframe of five.
    assert_eq!(scores(&recorded, &predicted).roots_met, 3.0 / 5.0);
}

#[test]
fn velocity_factors_are_met_one_by_one_and_the_last_step_leads_to_the_true_keyframe() {
    let (recorded, mut predicted) = still(4);
    // The right hand (joint 17, weight 4 of 10) leaves by 5 cm in frame 1 and stays there: 2
    // cm/frame too much in frame 1 and, back at the true keyframe, in frame 3.
    let hand = 3 * (17 - 1);
    predicted.slice_mut(s![.., hand]).fill(5.0);
    let found = scores(&recorded, &predicted).velocity_factors_met;
    assert_eq!(found, (4.0 * 5.0 - 2.0) / (4.0 * 5.0));
}

#[test]
fn its_windows_are_those_of_the_equations_for_a_length_one_shorter() {
    let own = Published::default();
    let mut shorter = Equations::default();
    shorter.0.lengths.iter_mut().for_each(|length| *length -= 1);
    let recordings = [61, 200, 9, 1000];
    assert_eq!(own.frames(&recordings), shorter.frames(&recordings));
}

#[test]
fn what_does_not_fit_together_is_an_error() {
    let (recorded, predicted) = still(5);
    let of = |recorded: &Array2<f64>, predicted: &Array2<f64>| {
        Published::default()
            .window_scores(recorded.view(), predicted.view())
            .unwrap_err()
    };
    let (_, short) = still(4);
    assert!(matches!(of(&recorded, &short), ModelError::Shape { .. }));
    let single = recorded.slice(s![..1, ..]).to_owned();
    assert!(matches!(of(&single, &short), ModelError::NoFrames { .. }));
    let narrow = recorded.slice(s![.., ..FRAME]).to_owned();
    assert!(matches!(of(&narrow, &predicted), ModelError::Shape { .. }));
    let mut wild = predicted;
    wild[[1, 1]] = f64::NAN;
    assert!(matches!(of(&recorded, &wild), ModelError::NotFinite { .. }));
}
