//! Numbers at the edges of what a type can hold.

use keydance::autograd::ops::attention::{AttentionShape, HeadColumns};
use keydance::autograd::ops::lstm_cell::LstmWeights;
use keydance::autograd::{AutogradError, Gradients, Parameters, Real, Tape, Var, Workspace};
use ndarray::{ArrayD, IxDyn};

fn array<T: Real>(shape: &[usize], values: &[f64]) -> ArrayD<T> {
    let values = values.iter().map(|&x| T::from_f64(x)).collect();
    ArrayD::from_shape_vec(IxDyn(shape), values).unwrap()
}

/// The output, and the gradient of each input for an upstream gradient of 1, 2, 3, ..
fn run<T: Real>(
    inputs: Vec<ArrayD<T>>,
    build: impl FnOnce(&mut Tape<'_, T>, &[Var]) -> Result<Var, AutogradError>,
) -> (Vec<f64>, Vec<Vec<f64>>) {
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let vars: Vec<Var> = inputs.into_iter().map(|input| tape.input(input)).collect();
    let y = build(&mut tape, &vars).unwrap();
    let output: Vec<f64> = tape.values(y).iter().map(|&x| Real::to_f64(x)).collect();
    let upstream: Vec<T> = (0..output.len())
        .map(|i| T::from_f64(i as f64 + 1.0))
        .collect();
    let found = tape
        .backward_from(y, &upstream, &vars, &mut gradients)
        .unwrap();
    let to_f64 = |gradient: ArrayD<T>| gradient.iter().map(|&x| Real::to_f64(x)).collect();
    (output, found.into_iter().map(to_f64).collect())
}

fn softmax_of<T: Real>(row: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let input = array::<T>(&[1, row.len()], row);
    let (y, mut gradients) = run(vec![input], |tape, v| Ok(tape.softmax(v[0])));
    (y, gradients.remove(0))
}

fn softmax_holds<T: Real>(largest: f64) {
    // One logit far above the others takes all, and nothing flows back.
    for row in [[0.0, largest, -largest], [-largest, largest, largest / 2.0]] {
        let (y, dx) = softmax_of::<T>(&row);
        assert_eq!(y, [0.0, 1.0, 0.0], "{row:?}");
        assert_eq!(dx, [0.0, 0.0, 0.0], "{row:?}");
    }
    // Large and equal, or smaller than all others together: as if they were small.
    let (y, dx) = softmax_of::<T>(&[largest, largest]);
    assert_eq!((y, dx), (vec![0.5, 0.5], vec![-0.25, 0.25]));
    let (y, _) = softmax_of::<T>(&[f64::NEG_INFINITY, -largest]);
    assert_eq!(y, [0.0, 1.0]);
    let (y, _) = softmax_of::<T>(&[0.0, f64::NAN, largest]);
    assert!(y.iter().all(|y| y.is_nan()), "{y:?}");
}

#[test]
fn log_softmax_is_exact_where_the_softmax_is_0() {
    let input = vec![array::<f32>(&[1, 3], &[0.0, -1e30, -200.0])];
    let (y, dx) = run(input, |tape, v| Ok(tape.log_softmax(v[0])));
    assert_eq!(y, [0.0, f64::from(-1e30f32), -200.0]);
    // Upstream 1, 2, 3 minus p times their sum.
    assert_eq!(dx, [[-5.0, 2.0, 3.0]]);
}

#[test]
fn softmax_stays_finite_for_the_largest_logits_and_shows_a_nan() {
    softmax_holds::<f64>(1e300);
    softmax_holds::<f32>(1e38);
}

#[test]
fn attention_stays_finite_for_large_scores() {
    // Scores of +-1e10 on one head of two numbers, three tokens.
    let queries = [1e5, 0.0, -1e5, 0.0, 0.0, 0.0];
    let keys = [1e5, 0.0, -1e5, 0.0, 0.0, 1.0];
    let values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let inputs = [queries, keys, values].map(|x| array::<f32>(&[3, 2], &x));
    let (y, gradients) = run(inputs.to_vec(), |tape, v| {
        let [q, k, w] = [0, 1, 2].map(|k| HeadColumns {
            value: v[k],
            start: 0,
        });
        let shape = AttentionShape {
            heads: 1,
            width: 2,
            queries: 3,
            keys: 3,
        };
        tape.attention([q, k, w], shape, None, 0.0)
    });
    assert_eq!(y[..4], [1.0, 2.0, 3.0, 4.0]);
    assert!(
        (y[4] - 3.0).abs() < 1e-6 && (y[5] - 4.0).abs() < 1e-6,
        "{y:?}"
    );
    assert!(
        gradients.iter().flatten().all(|x| x.is_finite()),
        "{gradients:?}"
    );
}

/// Attention of two tokens to `keys` keys on one head of two numbers.
fn attend(keys: usize, bias: Option<&[f64]>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let numbers = |n: usize| -> Vec<f64> { (0..n).map(|i| (i as f64 * 1.3).sin()).collect() };
    let mut inputs = vec![
        array::<f64>(&[2, 2], &numbers(4)),
        array(&[keys, 2], &numbers(2 * keys)),
    ];
    inputs.extend(bias.map(|bias| array(&[1, 2, keys], bias)));
    run(inputs, |tape, v| {
        let columns = |value| HeadColumns { value, start: 0 };
        let shape = AttentionShape {
            heads: 1,
            width: 2,
            queries: 2,
            keys,
        };
        let operands = [columns(v[0]), columns(v[1]), columns(v[1])];
        tape.attention(operands, shape, v.get(2).copied(), 0.0)
    })
}

#[test]
fn a_key_with_a_bias_of_negative_infinity_is_as_if_it_were_not_there() {
    let masked = f64::NEG_INFINITY;
    let (y, gradients) = attend(4, Some(&[0.0, 0.0, 0.0, masked, 0.0, 0.0, 0.0, masked]));
    let (expected, without) = attend(3, None);
    assert_eq!(y, expected);
    assert_eq!(gradients[0], without[0]);
    assert_eq!(gradients[1][..6], without[1]);
    assert_eq!(gradients[1][6..], [0.0, 0.0]);
    assert_eq!((gradients[2][3], gradients[2][7]), (0.0, 0.0));
}

fn gates_hold<T: Real>(tolerance: f64) {
    // One unit; x drives the gates i, f, g, o by its sign, far beyond where they saturate.
    let weights = [
        array::<T>(&[4, 1], &[1.0, 1.0, 1.0, 1.0]),
        array(&[4, 1], &[0.5, -0.5, 0.5, -0.5]),
        array(&[4], &[0.0; 4]),
        array(&[4], &[0.0; 4]),
    ];
    for (drive, h, c) in [(1e4, 1.0, 0.5 + 1.0), (-1e4, 0.0, 0.0)] {
        let mut inputs = vec![array(&[1, 1], &[drive]), array(&[1, 2], &[0.3, 0.5])];
        inputs.extend(weights.clone());
        let (y, gradients) = run(inputs, |tape, v| {
            let weights = LstmWeights {
                weight_ih: v[2],
                weight_hh: v[3],
                bias_ih: v[4],
                bias_hh: v[5],
            };
            tape.lstm_cell(v[0], v[1], weights)
        });
        // All gates open: c' = c + 1, h' = tanh(c'); all shut: c' = h' = 0.
        assert!((y[0] - h * f64::tanh(c)).abs() <= tolerance, "{y:?}");
        assert!((y[1] - c).abs() <= tolerance, "{y:?}");
        assert_eq!(gradients[0], [0.0], "saturated gates pass no gradient to x");
        // c passes through where the forget gate is open: dh' and dc' (1 and 2) reach it.
        let through = if drive > 0.0 {
            2.0 + (1.0 - f64::tanh(c).powi(2))
        } else {
            0.0
        };
        assert!(
            (gradients[1][1] - through).abs() <= 4.0 * tolerance,
            "{gradients:?}"
        );
        assert!(gradients.iter().flatten().all(|x| x.is_finite()));
    }
}

#[test]
fn saturated_gates_keep_or_forget_the_cell_and_stay_finite() {
    gates_hold::<f64>(1e-15);
    gates_hold::<f32>(3e-7);
}

fn functions_saturate<T: Real>() {
    let input = || vec![array::<T>(&[4], &[1e30, -1e30, 1e3, -1e3])];
    let (y, dx) = run(input(), |tape, v| Ok(tape.sigmoid(v[0])));
    assert_eq!((y, dx), (vec![1.0, 0.0, 1.0, 0.0], vec![vec![0.0; 4]]));
    let (y, dx) = run(input(), |tape, v| Ok(tape.tanh(v[0])));
    assert_eq!((y, dx), (vec![1.0, -1.0, 1.0, -1.0], vec![vec![0.0; 4]]));
    let (y, dx) = run(input(), |tape, v| Ok(tape.clamp(v[0], 0.0, 1.0)));
    assert_eq!((y, dx), (vec![1.0, 0.0, 1.0, 0.0], vec![vec![0.0; 4]]));
    let large = T::from_f64(1e30).to_f64();
    let (y, dx) = run(input(), |tape, v| Ok(tape.gelu(v[0])));
    let slopes = vec![vec![1.0, 0.0, 3.0, 0.0]];
    assert_eq!((y, dx), (vec![large, 0.0, 1e3, 0.0], slopes));
}

#[test]
fn sigmoid_tanh_clamp_and_gelu_saturate_without_a_gradient() {
    functions_saturate::<f64>();
    functions_saturate::<f32>();
}

#[test]
fn a_norm_at_zero_has_a_gradient_of_zero() {
    let (y, dx) = run(vec![array::<f32>(&[2, 3], &[0.0; 6])], |tape, v| {
        tape.vector_norm(v[0], 1e-8)
    });
    assert!(y.iter().all(|y| (y - 1e-4).abs() < 1e-9));
    assert_eq!(dx, [[0.0; 6]]);
}

#[test]
fn layer_norm_of_equal_numbers_is_its_bias() {
    let inputs = vec![
        array::<f32>(&[1, 4], &[7e5; 4]),
        array(&[4], &[1.0, 2.0, 3.0, 4.0]),
        array(&[4], &[0.1, 0.2, 0.3, 0.4]),
    ];
    let (y, gradients) = run(inputs, |tape, v| tape.layer_norm(v[0], v[1], v[2]));
    assert!(
        y.iter()
            .zip([0.1, 0.2, 0.3, 0.4])
            .all(|(y, b)| (y - b).abs() < 1e-7)
    );
    assert!(
        gradients.iter().flatten().all(|x| x.is_finite()),
        "{gradients:?}"
    );
}
