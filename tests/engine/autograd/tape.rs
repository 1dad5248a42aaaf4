//! What a tape keeps, forgets and reuses; dropout's masks.

use keydance::autograd::{Gradients, Parameters, Tape, Var, Workspace};
use ndarray::{Array2, ArrayD, Axis, IxDyn, arr1, arr2, s};

/// Some operations on a weight and an input; the values of each.
fn chain(tape: &mut Tape<'_, f64>, weight: Var) -> Vec<Vec<f64>> {
    let x = tape.input(arr2(&[[0.3, -0.2, 0.9], [1.0, 0.5, -0.7]]).into_dyn());
    let y = tape.linear(x, weight, None, true).unwrap();
    let p = tape.softmax(y);
    let dropped = tape.dropout(p, 0.5);
    let norm = tape.vector_norm(dropped, 1e-4).unwrap();
    let total = tape.sum(norm);
    let shown = [y, p, dropped, norm, total].map(|var| tape.values(var).to_vec());
    shown.to_vec()
}

#[test]
fn recording_and_inference_give_the_same_values() {
    let mut parameters = Parameters::new();
    let (_, block) = parameters.add(
        "weight",
        arr2(&[[1.0, 2.0, -1.0], [0.5, 0.1, 0.2]]).into_dyn(),
    );
    let mut workspace = Workspace::new();
    let mut values = Vec::new();
    for recording in [true, false] {
        let mut tape = if recording {
            Tape::recording(&parameters, &mut workspace)
        } else {
            Tape::inference(&parameters, &mut workspace)
        }
        .with_dropout(5);
        assert_eq!(tape.is_recording(), recording);
        let weight = tape.block(block);
        values.push(chain(&mut tape, weight));
    }
    assert_eq!(values[0], values[1]);
}

#[test]
fn forgetting_keeps_what_is_kept_and_gives_the_rest_back() {
    let mut parameters = Parameters::new();
    let (_, early) = parameters.add("early", arr1(&[1.0, 2.0]).into_dyn());
    let (_, late) = parameters.add("late", arr1(&[3.0, 4.0]).into_dyn());
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&parameters, &mut workspace);
    let early_var = tape.block(early);
    let mut old = tape.affine(early_var, 10.0, 0.0);
    let mark = tape.mark();
    for round in 1..=5 {
        let weight = tape.block(late);
        let gone = tape.add(old, weight).unwrap();
        let mut first = tape.affine(gone, f64::from(round), 0.0);
        let gone = tape.square(first);
        let mut second = tape.sum(gone);
        let (kept_first, kept_second) = (tape.values(first).to_vec(), tape.values(second).to_vec());
        // In another order than that on the tape, one of them twice, one made before the mark.
        let mut again = first;
        tape.forget_since(mark, &mut [&mut second, &mut again, &mut first, &mut old]);
        assert_eq!(tape.values(first), kept_first);
        assert_eq!(tape.values(again), kept_first);
        assert_eq!(tape.values(second), kept_second);
        assert_eq!(tape.values(old), [10.0, 20.0]);
        let weight = tape.block(late);
        assert_eq!(tape.values(weight), [3.0, 4.0]);
        // Two kept, the block that was asked for, nothing else.
        assert_eq!(tape.mark(), mark + 3, "round {round}");
        tape.forget_since(mark, &mut []);
        assert_eq!(tape.mark(), mark + 1);
    }
    let weight = tape.block(late);
    let sum = tape.add(old, weight).unwrap();
    assert_eq!(tape.values(sum), [13.0, 24.0]);
}

#[test]
fn a_recording_tape_forgets_nothing() {
    let parameters = Parameters::<f64>::new();
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let mark = tape.mark();
    let x = tape.input(arr1(&[2.0]).into_dyn());
    let y = tape.square(x);
    let mut kept = y;
    tape.forget_since(mark, &mut [&mut kept]);
    assert_eq!(kept, y);
    assert_eq!((tape.values(x), tape.values(y)), (&[2.0][..], &[4.0][..]));
}

#[test]
fn a_workspace_hands_the_same_buffers_out_again() {
    let mut parameters = Parameters::new();
    let (_, block) = parameters.add(
        "weight",
        arr2(&[[1.0, 2.0, -1.0], [0.5, 0.1, 0.2]]).into_dyn(),
    );
    let mut workspace = Workspace::new();
    let mut held = Vec::new();
    for _ in 0..4 {
        let mut tape = Tape::recording(&parameters, &mut workspace).with_dropout(1);
        let weight = tape.block(block);
        chain(&mut tape, weight);
        drop(tape);
        held.push(workspace.held());
    }
    assert!(held[0] > 0);
    assert_eq!(held, [held[0]; 4]);
    let large = workspace.take(1000);
    let place = large.as_ptr();
    workspace.give(large);
    let again = workspace.take(990);
    assert_eq!((again.as_ptr(), again.len()), (place, 990));
}

#[test]
fn arrays_in_any_layout_are_read_in_their_logical_order() {
    let base = Array2::from_shape_fn((4, 6), |(i, j)| (10 * i + j) as f64);
    let views: [ArrayD<f64>; 4] = [
        base.clone().reversed_axes().into_dyn(),
        base.clone().slice_move(s![1..;2, ..;-2]).into_dyn(),
        base.clone().slice_move(s![.., 2]).into_dyn(),
        base.clone()
            .into_dyn()
            .slice_axis_move(Axis(1), (3..5).into()),
    ];
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    for view in views {
        assert!(!view.is_standard_layout());
        let expected: Vec<f64> = view.iter().copied().collect();
        let mut tape = Tape::recording(&parameters, &mut workspace);
        let constant = tape.constant(view.clone());
        assert_eq!(tape.shape(constant), view.shape());
        assert_eq!(tape.values(constant), expected);
        let input = tape.input(view.clone());
        let y = tape.mul(input, constant).unwrap();
        let upstream: Vec<f64> = (0..expected.len()).map(|i| i as f64).collect();
        let found = tape
            .backward_from(y, &upstream, &[input], &mut gradients)
            .unwrap();
        let products = expected.iter().zip(&upstream).map(|(x, u)| x * u);
        assert!(found[0].iter().copied().eq(products));
        assert_eq!(found[0].shape(), view.shape());
    }
}

#[test]
fn a_parameter_in_any_layout_is_stored_in_its_logical_order() {
    let value = Array2::from_shape_fn((3, 2), |(i, j)| (10 * i + j) as f64);
    let mut parameters = Parameters::new();
    let (_, block) = parameters.add("weight", value.clone().reversed_axes().into_dyn());
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&parameters, &mut workspace);
    let block = tape.block(block);
    assert_eq!(tape.shape(block), [2, 3]);
    assert_eq!(tape.values(block), [0.0, 10.0, 20.0, 1.0, 11.0, 21.0]);
}

/// Dropout of ones on a tape of its own, with `before` values made first.
fn mask(key: Option<u64>, p: f64, len: usize, before: usize) -> Vec<f64> {
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&parameters, &mut workspace);
    tape.set_dropout(key);
    for _ in 0..before {
        tape.constant(arr1(&[0.0]).into_dyn());
    }
    let x = tape.input(ArrayD::ones(IxDyn(&[len])));
    let y = tape.dropout(x, p);
    tape.values(y).to_vec()
}

#[test]
fn dropout_keeps_the_expectation() {
    let n = 200_000;
    for p in [0.05, 0.1, 0.5, 0.9] {
        let y = mask(Some(3), p, n, 0);
        let mean = y.iter().sum::<f64>() / n as f64;
        // Five standard deviations of the mean.
        let deviation = (p / (1.0 - p) / n as f64).sqrt();
        assert!(
            (mean - 1.0).abs() < 5.0 * deviation + 1e-4,
            "p = {p}: {mean}"
        );
        let kept = 1.0 / (1.0 - p);
        assert!(y.iter().all(|&y| y == 0.0 || (y - kept).abs() < 1e-12));
    }
}

#[test]
fn dropout_of_nothing_or_without_a_key_is_the_value_itself() {
    assert_eq!(mask(Some(3), 0.0, 50, 0), [1.0; 50]);
    assert_eq!(mask(None, 0.5, 50, 0), [1.0; 50]);
}

#[test]
fn a_mask_follows_from_the_key_and_the_place_on_the_tape() {
    let reference = mask(Some(3), 0.5, 200, 0);
    assert_eq!(mask(Some(3), 0.5, 200, 0), reference);
    for (key, before) in [(4, 0), (3, 1), (3 + (1 << 32), 0)] {
        let other = mask(Some(key), 0.5, 200, before);
        let same = other.iter().zip(&reference).filter(|(a, b)| a == b).count();
        assert!(
            (60..140).contains(&same),
            "key {key} after {before}: {same} of 200"
        );
    }
}

#[test]
fn dropout_sends_gradients_through_the_same_mask() {
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace).with_dropout(8);
    let x = tape.input(ArrayD::ones(IxDyn(&[300])));
    let y = tape.dropout(x, 0.3);
    let values = tape.values(y).to_vec();
    let found = tape
        .backward_from(y, &[1.0; 300], &[x], &mut gradients)
        .unwrap();
    assert_eq!(found[0].as_slice().unwrap(), values);
    assert!(values.contains(&0.0) && values.iter().any(|&y| y > 1.0));
}
