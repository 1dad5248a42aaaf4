//! Errors say which operation, which shapes and what was wrong.

use keydance::autograd::ops::attention::{AttentionShape, HeadColumns};
use keydance::autograd::ops::lstm_cell::LstmWeights;
use keydance::autograd::ops::query_attention::QueryAttentionWeights;
use keydance::autograd::{
    AutogradError, Backward, Gradients, Operation, Parameters, Tape, Var, Workspace,
};
use ndarray::{ArrayD, IxDyn, arr1, arr2};

type Build = fn(&mut Tape<'_, f64>, Var, Var) -> Result<Var, AutogradError>;

/// The error of an operation on values of two shapes.
fn refusal(left: &[usize], right: &[usize], build: Build) -> String {
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let [a, b] = [left, right].map(|shape| tape.constant(ArrayD::zeros(IxDyn(shape))));
    build(&mut tape, a, b).unwrap_err().to_string()
}

#[test]
fn shapes_that_do_not_fit_are_named_with_the_operation() {
    let cases: [(&str, &[usize], &[usize], Build); 17] = [
        ("add", &[2, 3], &[2, 4], |t, a, b| t.add(a, b)),
        ("sub", &[2, 3], &[3, 3], |t, a, b| t.sub(a, b)),
        ("mul", &[5], &[4], |t, a, b| t.mul(a, b)),
        ("matmul", &[2, 3], &[2, 3], |t, a, b| t.matmul(a, b)),
        ("matmul", &[2, 3], &[3], |t, a, b| t.matmul(a, b)),
        ("linear", &[2, 3], &[4, 5], |t, a, b| {
            t.linear(a, b, None, false)
        }),
        ("linear", &[4, 5], &[3], |t, a, b| {
            t.linear(a, a, Some(b), false)
                .and(t.linear(a, b, None, false))
        }),
        ("stack", &[2, 3], &[3, 2], |t, a, b| t.stack(&[a, b])),
        ("concat", &[2, 3], &[3, 3], |t, a, b| t.concat(&[a, b])),
        ("convolve_rows", &[2, 3], &[4, 5, 3], |t, a, b| {
            t.convolve_rows(a, b, a, 2)
        }),
        ("convolve_rows", &[2, 3], &[4, 3, 2], |t, a, b| {
            t.convolve_rows(a, b, a, 2)
        }),
        ("convolve_rows", &[4, 3, 3], &[3], |t, a, b| {
            let x = t.constant(ArrayD::zeros(IxDyn(&[2, 3])));
            t.convolve_rows(x, a, b, 2)
        }),
        ("layer_norm", &[2, 3], &[4], |t, a, b| t.layer_norm(a, b, b)),
        ("add_layer_norm", &[2, 3], &[2, 4], |t, a, b| {
            let gamma = t.constant(ArrayD::ones(IxDyn(&[3])));
            t.add_layer_norm(a, b, (gamma, gamma), 0.0)
        }),
        ("lstm_cell", &[2, 3], &[4, 6], |t, a, b| {
            let weights = LstmWeights {
                weight_ih: a,
                weight_hh: a,
                bias_ih: a,
                bias_hh: a,
            };
            t.lstm_cell(a, b, weights)
        }),
        ("query_attention", &[2, 4], &[7, 5], |t, a, b| {
            let weights = QueryAttentionWeights {
                keys: vec![a],
                values: vec![a],
                value_bias: a,
            };
            t.query_attention(a, b, weights, 3, 0.0)
        }),
        ("attention", &[2, 3, 3], &[3, 3], |t, _, b| {
            let x = t.constant(ArrayD::zeros(IxDyn(&[6, 4])));
            let whole = HeadColumns { value: x, start: 0 };
            let shape = AttentionShape {
                heads: 2,
                width: 4,
                queries: 3,
                keys: 3,
            };
            t.attention([whole; 3], shape, Some(b), 0.0)
        }),
    ];
    for (name, left, right, build) in cases {
        let message = refusal(left, right, build);
        assert!(message.starts_with(&format!("{name}:")), "{message}");
        for shape in [left, right] {
            assert!(message.contains(&format!("{shape:?}")), "{name}: {message}");
        }
    }
}

#[test]
fn arguments_that_do_not_fit_a_shape_are_named_with_both() {
    let cases: [(&str, &[usize], &str, Build); 9] = [
        ("reshape", &[2, 3], "[7]", |t, a, _| t.reshape(a, &[7])),
        ("columns", &[2, 3], "2..4", |t, a, _| t.columns(a, 2..4)),
        ("rows", &[2, 3], "1..3", |t, a, _| t.rows(a, 1..3)),
        ("strided_rows", &[5, 2], "steps of 2", |t, a, _| {
            t.strided_rows(a, 0, 2)
        }),
        ("cumulative_sum", &[5, 2], "of 2 frames", |t, a, _| {
            t.cumulative_sum(a, 2)
        }),
        ("drop_path", &[5, 2], "of 2 rows", |t, a, _| {
            t.drop_path(a, 0.0, 2)
        }),
        ("convolve_rows", &[5, 2], "of 2 frames", |t, a, b| {
            let weight = t.constant(ArrayD::zeros(IxDyn(&[1, 2, 3])));
            t.convolve_rows(a, weight, b, 2)
        }),
        ("prelu", &[2, 3], "[2, 3]", |t, a, _| t.prelu(a, a)),
        ("attention", &[6, 8], "width: 6", |t, a, _| {
            let whole = HeadColumns { value: a, start: 3 };
            let shape = AttentionShape {
                heads: 2,
                width: 6,
                queries: 3,
                keys: 3,
            };
            t.attention([whole; 3], shape, None, 0.0)
        }),
    ];
    for (name, shape, argument, build) in cases {
        let message = refusal(shape, &[1], build);
        assert!(message.starts_with(&format!("{name}:")), "{message}");
        assert!(message.contains(&format!("{shape:?}")), "{message}");
        assert!(message.contains(argument), "{message}");
    }
}

#[test]
fn a_loss_of_several_numbers_is_refused() {
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let x = tape.input(arr1(&[1.0, 2.0]).into_dyn());
    let message = tape.backward(x, &mut gradients).unwrap_err().to_string();
    assert!(
        message.contains("backward") && message.contains("[2]"),
        "{message}"
    );
}

#[test]
fn the_first_value_that_is_not_finite_is_traced_to_its_operation() {
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let x = tape.input(arr2(&[[1.0, -4.0, 9.0]]).into_dyn());
    let doubled = tape.affine(x, 2.0, 0.0);
    assert_eq!(tape.check_finite(), Ok(()));
    let root = tape.sqrt(doubled);
    let total = tape.sum(root);
    let large = tape.affine(total, 1e3, 0.0);
    tape.exp(large);
    let AutogradError::NonFinite {
        operation,
        index,
        what,
        place,
        shape,
        inputs,
    } = tape.check_finite().unwrap_err()
    else {
        panic!("another error");
    };
    assert_eq!((operation, index, what, place), ("sqrt", 2, "NaN", "value"));
    assert_eq!((shape, inputs), (vec![1, 3], vec![vec![1, 3]]));
}

#[test]
fn an_infinity_is_told_from_a_nan() {
    let parameters = Parameters::<f32>::new();
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&parameters, &mut workspace);
    let x = tape.constant(arr1(&[100.0f32]).into_dyn());
    tape.exp(x);
    let message = tape.check_finite().unwrap_err().to_string();
    assert!(
        message.contains("exp") && message.contains("infinity"),
        "{message}"
    );
}

/// sum(sqrt(x^2)) at 0, whose gradient is infinity times 0.
fn backward_of_a_root_at_zero(trace: bool) -> (Result<(), AutogradError>, Vec<f64>) {
    let mut parameters = Parameters::new();
    let (_, block) = parameters.add("x", arr1(&[3.0, 0.0]).into_dyn());
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace);
    if trace {
        tape = tape.with_trace();
    }
    let x = tape.block(block);
    let square = tape.square(x);
    let root = tape.sqrt(square);
    let total = tape.sum(root);
    assert_eq!(tape.check_finite(), Ok(()));
    let result = tape.backward(total, &mut gradients);
    (result, gradients.iter().flatten().copied().collect())
}

#[test]
fn the_first_gradient_that_is_not_finite_is_traced_to_the_operation_that_made_it() {
    let (result, gradient) = backward_of_a_root_at_zero(false);
    assert_eq!(result, Ok(()));
    assert!(gradient[0] == 1.0 && gradient[1].is_nan());
    let (result, _) = backward_of_a_root_at_zero(true);
    let message = result.unwrap_err().to_string();
    assert!(message.starts_with("sqrt "), "{message}");
    assert!(
        message.contains("infinity") && message.contains("gradient"),
        "{message}"
    );
}

/// A loss whose gradient is finite everywhere but in the product that is the gradient of a weight:
/// 1e30 * 1e30 in f32.
fn backward_of_an_overflow_in_a_weight(
    trace: bool,
    rows: usize,
) -> (Result<(), AutogradError>, f32) {
    let mut parameters = Parameters::<f32>::new();
    let (_, block) = parameters.add("w", arr2(&[[1e-30f32]]).into_dyn());
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace);
    if trace {
        tape = tape.with_trace();
    }
    let x = tape.constant(ArrayD::from_elem(IxDyn(&[rows, 1]), 1e30f32));
    let w = tape.block(block);
    let y = tape.linear(x, w, None, false).unwrap();
    let total = tape.sum(y);
    let large = tape.affine(total, 1e30, 0.0);
    assert_eq!(tape.check_finite(), Ok(()));
    let result = tape.backward(large, &mut gradients);
    (result, gradients.iter().flatten().sum())
}

#[test]
fn an_overflow_in_the_gradient_of_a_weight_is_traced_to_the_operation_that_made_it() {
    // Few rows are collected before they are multiplied, many are not.
    for rows in [1, 200] {
        let (result, gradient) = backward_of_an_overflow_in_a_weight(false, rows);
        assert_eq!((result, gradient), (Ok(()), f32::INFINITY));
        let (result, _) = backward_of_an_overflow_in_a_weight(true, rows);
        let message = result.unwrap_err().to_string();
        assert!(message.starts_with("linear "), "{message}");
        assert!(
            message.contains("infinity")
                && message.contains("gradient")
                && message.contains("[1, 1]"),
            "{message}"
        );
    }
}

/// Gradients of x^4 at x = 3 from its two squarings, of what `pick` takes from x and x^2.
fn gradients_of(
    upstream: &[f64],
    pick: impl Fn(Var, Var) -> Vec<Var>,
) -> Result<Vec<f64>, AutogradError> {
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let x = tape.input(arr1(&[3.0]).into_dyn());
    let y = tape.square(x);
    let z = tape.square(y);
    let mut sums = Gradients::zeros(&parameters);
    let found = tape.backward_from(z, upstream, &pick(x, y), &mut sums)?;
    Ok(found.into_iter().map(|gradient| gradient[[0]]).collect())
}

#[test]
fn a_way_back_from_what_does_not_fit_is_refused_and_an_input_asked_for_twice_answered_twice() {
    assert_eq!(gradients_of(&[1.0], |x, _| vec![x, x]).unwrap(), [108.0; 2]);
    for upstream in [&[][..], &[1.0, 1.0]] {
        let error = gradients_of(upstream, |x, _| vec![x])
            .unwrap_err()
            .to_string();
        let numbers = format!("an upstream gradient of {} numbers", upstream.len());
        assert!(
            error.contains("backward_from") && error.contains(&numbers),
            "{error}"
        );
    }
    assert_eq!(
        gradients_of(&[1.0], |x, y| vec![y, x]).unwrap(),
        [18.0, 108.0],
        "a value on the way"
    );
}

#[test]
fn the_gradient_of_a_constant_or_a_parameter_is_refused() {
    let mut parameters = Parameters::new();
    let (_, block) = parameters.add("w", arr1(&[3.0]).into_dyn());
    for constant in [true, false] {
        let mut workspace = Workspace::new();
        let mut tape = Tape::recording(&parameters, &mut workspace);
        let (fixed, weight) = (tape.constant(arr1(&[2.0])), tape.block(block));
        let product = tape.mul(fixed, weight).unwrap();
        let mut sums = Gradients::zeros(&parameters);
        let (asked, expected) = match constant {
            true => (fixed, "Tape::input"),
            false => (weight, "no parameter"),
        };
        let error = tape.backward_from(product, &[1.0], &[asked], &mut sums);
        let error = error.unwrap_err().to_string();
        assert!(
            error.contains("value 0") && error.contains(expected),
            "{error}"
        );
    }
}

/// Its way back does what it must not.
struct Astray {
    other: Var,
    surplus: bool,
}

impl Operation<f64> for Astray {
    fn backward(&self, _dy: &mut [f64], context: &mut Backward<'_, f64>) {
        let numbers = vec![1.0; context.values(self.other).len() + usize::from(self.surplus)];
        if let Some(target) = context.target(self.other) {
            target.add_values(&numbers);
        }
    }
}

#[test]
fn an_operation_of_ones_own_that_goes_astray_ends_the_way_back_with_its_name() {
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let foreign = {
        let mut tape = Tape::recording(&parameters, &mut workspace);
        tape.input(arr1(&[1.0, 2.0]))
    };
    for (surplus, expected) in [(false, "not among its inputs"), (true, "more or fewer")] {
        let mut tape = Tape::recording(&parameters, &mut workspace);
        let x = tape.input(arr1(&[1.0, 2.0]));
        let other = if surplus { x } else { foreign };
        let astray = || Astray { other, surplus };
        let y = tape.record("astray", &[x], arr1(&[0.0]), astray).unwrap();
        let mut sums = Gradients::zeros(&parameters);
        let error = tape.backward_from(y, &[1.0], &[x], &mut sums).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("astray") && text.contains(expected), "{text}");
        let mut tape = Tape::recording(&parameters, &mut workspace);
        let error = tape.record("astray", &[foreign], arr1(&[0.0]), astray);
        assert!(error.unwrap_err().to_string().contains("not on this tape"));
    }
}
