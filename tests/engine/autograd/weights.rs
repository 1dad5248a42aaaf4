//! Gradients of weights that are used often, in parts, and by several tapes.

use keydance::autograd::{BlockId, Gradients, Parameters, Tape, Var, Workspace};
use ndarray::{Array2, ArrayD, arr1};

fn numbers(rows: usize, columns: usize, seed: f64) -> ArrayD<f64> {
    Array2::from_shape_fn((rows, columns), |(i, j)| {
        ((i * columns + j) as f64 * 0.37 + seed).sin()
    })
    .into_dyn()
}

/// The gradient of sum((x W^T)^2) for the parts of x, each multiplied by W on its own.
fn gradient_of_parts(weight: &ArrayD<f64>, x: &ArrayD<f64>, parts: &[usize]) -> Vec<f64> {
    let mut parameters = Parameters::new();
    let (_, block) = parameters.add("weight", weight.clone());
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let weight = tape.block(block);
    let mut total = tape.constant(arr1(&[0.0]).into_dyn());
    let mut start = 0;
    for &rows in parts {
        let part = x.slice_axis(ndarray::Axis(0), (start..start + rows).into());
        let part = tape.constant(part.to_owned());
        let y = tape.linear(part, weight, None, false).unwrap();
        let squares = tape.square(y);
        let sum = tape.sum(squares);
        total = tape.add(total, sum).unwrap();
        start += rows;
    }
    assert_eq!(start, x.shape()[0]);
    tape.backward(total, &mut gradients).unwrap();
    gradients.iter().flatten().copied().collect()
}

#[test]
fn a_weight_used_at_many_steps_has_the_gradient_of_one_large_product() {
    let (weight, x) = (numbers(7, 5, 0.3), numbers(1500, 5, 1.1));
    let whole = gradient_of_parts(&weight, &x, &[1500]);
    let largest = whole.iter().fold(0f64, |m, g| m.max(g.abs()));
    // Few rows at a time, more than are collected; just below and just above what is multiplied at
    // once; a mixture.
    let mixture = [1, 95, 96, 300, 2, 511, 95, 95, 95, 95, 95, 20];
    for parts in [&[1; 1500][..], &[50; 30], &[95; 15], &[96; 15], &mixture] {
        let rows: usize = parts.iter().sum();
        let mut parts = parts.to_vec();
        if rows < 1500 {
            parts.push(1500 - rows);
        }
        for (a, b) in gradient_of_parts(&weight, &x, &parts).iter().zip(&whole) {
            assert!((a - b).abs() < 1e-12 * largest, "{parts:?}: {a} {b}");
        }
    }
}

#[test]
fn an_input_of_no_rows_leaves_the_gradient_alone() {
    let (weight, x) = (numbers(7, 5, 0.3), numbers(4, 5, 1.1));
    assert_eq!(
        gradient_of_parts(&weight, &x, &[0, 4, 0]),
        gradient_of_parts(&weight, &x, &[4])
    );
}

/// Gradient of a parameter [6, 4] that is used whole and by blocks of its rows, as `pick` says.
fn gradient_of_blocks(pick: impl Fn(&mut Tape<'_, f64>, [BlockId; 3]) -> Var) -> Vec<f64> {
    let mut parameters = Parameters::new();
    let (id, whole) = parameters.add("weight", numbers(6, 4, 0.9));
    let [first, rest] = [0..2, 1..6].map(|rows| parameters.rows(id, rows).unwrap());
    let blocks = [whole, first, rest];
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let y = pick(&mut tape, blocks);
    let squares = tape.square(y);
    let total = tape.sum(squares);
    tape.backward(total, &mut gradients).unwrap();
    gradients.iter().flatten().copied().collect()
}

#[test]
fn blocks_of_rows_add_to_the_gradient_of_their_parameter() {
    let x = || numbers(3, 4, 2.2);
    let by_blocks = gradient_of_blocks(|tape, [whole, first, rest]| {
        let x = tape.constant(x());
        let parts = [first, rest, whole].map(|block| {
            let weight = tape.block(block);
            tape.linear(x, weight, None, false).unwrap()
        });
        tape.concat(&parts).unwrap()
    });
    let by_rows = gradient_of_blocks(|tape, [whole, ..]| {
        let x = tape.constant(x());
        let weight = tape.block(whole);
        let y = tape.linear(x, weight, None, false).unwrap();
        let first = tape.columns(y, 0..2).unwrap();
        let rest = tape.columns(y, 1..6).unwrap();
        tape.concat(&[first, rest, y]).unwrap()
    });
    assert!(by_rows.iter().all(|g| g.abs() > 1e-6));
    for (a, b) in by_blocks.iter().zip(&by_rows) {
        assert!((a - b).abs() < 1e-13, "{a} {b}");
    }
}

#[test]
fn a_block_shows_its_rows_and_follows_a_change_of_the_parameter() {
    let mut parameters = Parameters::new();
    let (id, _) = parameters.add("weight", numbers(6, 4, 0.9));
    let rows = parameters.rows(id, 2..5).unwrap();
    let mut workspace = Workspace::new();
    for factor in [1.0, 3.0] {
        parameters
            .values_mut()
            .for_each(|(_, mut value)| value *= factor);
        let mut tape = Tape::inference(&parameters, &mut workspace);
        let block = tape.block(rows);
        assert_eq!(tape.shape(block), [3, 4]);
        let expected = numbers(6, 4, 0.9) * factor;
        let expected: Vec<f64> = expected.iter().skip(8).take(12).copied().collect();
        assert_eq!(tape.values(block), expected);
        // Also in a product, which runs on a packed copy.
        let unit = tape.constant(Array2::eye(4).into_dyn());
        let product = tape.linear(unit, block, None, false).unwrap();
        let product = tape.array(product).t().iter().copied().collect::<Vec<_>>();
        assert_eq!(product, expected);
    }
}

#[test]
fn gradients_of_several_tapes_add_up() {
    let mut parameters = Parameters::new();
    let (_, block) = parameters.add("weight", numbers(3, 4, 0.9));
    let x = numbers(5, 4, 0.1);
    let mut workspace = Workspace::new();
    let mut gradient_of = |cuts: &[usize]| {
        let mut gradients = Gradients::zeros(&parameters);
        for ends in cuts.windows(2) {
            let mut tape = Tape::recording(&parameters, &mut workspace);
            let part = x.slice_axis(ndarray::Axis(0), (ends[0]..ends[1]).into());
            let part = tape.constant(part.to_owned());
            let weight = tape.block(block);
            let y = tape.linear(part, weight, None, false).unwrap();
            let y = tape.tanh(y);
            let total = tape.sum(y);
            tape.backward(total, &mut gradients).unwrap();
        }
        gradients.iter().flatten().copied().collect::<Vec<f64>>()
    };
    let whole = gradient_of(&[0, 5]);
    let added = gradient_of(&[0, 1, 3, 5]);
    for (a, b) in added.iter().zip(&whole) {
        assert!((a - b).abs() < 1e-14, "{a} {b}");
    }
}
