//! The check catches what it is there for: operations with a mistake in their way back fail it, the
//! same ones without it pass.

use ndarray::{ArrayD, Dimension as _, IxDyn, arr1};

use super::super::kernels::{Mat, MatMut, product, product_at, product_bt};
use super::super::{
    AutogradError, Backward, Gradients, Operation, Parameters, Tape, Var, Workspace,
};
use super::property::{case, check_case};
use super::{CheckReport, check_parameters};

/// a - b for values of one shape; the mistake: the sign of db.
struct Difference {
    a: Var,
    b: Var,
    mistake: bool,
}

impl Operation<f64> for Difference {
    fn backward(&self, dy: &mut [f64], context: &mut Backward<'_, f64>) {
        if let Some(target) = context.target(self.a) {
            target.add(|i| dy[i]);
        }
        let sign = if self.mistake { 1.0 } else { -1.0 };
        if let Some(target) = context.target(self.b) {
            target.add(|i| sign * dy[i]);
        }
    }
}

fn difference(
    tape: &mut Tape<'_, f64>,
    a: Var,
    b: Var,
    mistake: bool,
) -> Result<Var, AutogradError> {
    tape.own("difference", &[a, b])?;
    let shape = tape.shape(a).to_vec();
    let pairs = tape.values(a).iter().zip(tape.values(b));
    let y = pairs.map(|(a, b)| a - b).collect();
    Ok(tape.put("difference", &[a, b], &shape, y, || Difference {
        a,
        b,
        mistake,
    }))
}

/// x [rows, n] + b [n]; the mistake: db is that of the last row, not the sum over rows.
struct Shift {
    x: Var,
    b: Var,
    mistake: bool,
}

impl Operation<f64> for Shift {
    fn backward(&self, dy: &mut [f64], context: &mut Backward<'_, f64>) {
        let n = context.values(self.b).len();
        if let Some(target) = context.target(self.x) {
            target.add(|i| dy[i]);
        }
        let rows = dy.len() / n;
        let first = if self.mistake { rows - 1 } else { 0 };
        if let Some(target) = context.target(self.b) {
            target.add(|j| (first..rows).map(|row| dy[row * n + j]).sum());
        }
    }
}

fn shift(tape: &mut Tape<'_, f64>, x: Var, b: Var, mistake: bool) -> Result<Var, AutogradError> {
    tape.own("shift", &[x, b])?;
    let shape = tape.shape(x).to_vec();
    let bias = tape.values(b).iter().cycle();
    let y = tape
        .values(x)
        .iter()
        .zip(bias)
        .map(|(x, b)| x + b)
        .collect();
    Ok(tape.put("shift", &[x, b], &shape, y, || Shift { x, b, mistake }))
}

/// A B for matrices [n, n]; the mistake: dA = dC B instead of dC B^T.
struct Product {
    a: Var,
    b: Var,
    n: usize,
    mistake: bool,
}

impl Operation<f64> for Product {
    fn backward(&self, dy: &mut [f64], context: &mut Backward<'_, f64>) {
        let n = self.n;
        let dc = Mat::new(dy, n, n);
        let a = Mat::new(context.values(self.a), n, n);
        let b = Mat::new(context.values(self.b), n, n);
        if let Some(target) = context.target(self.a) {
            let form = if self.mistake { product } else { product_bt };
            form(dc, b, MatMut::new(target.data, n, n), !target.fresh);
        }
        if let Some(target) = context.target(self.b) {
            product_at(a, dc, MatMut::new(target.data, n, n), !target.fresh);
        }
    }
}

fn matrices(tape: &mut Tape<'_, f64>, a: Var, b: Var, mistake: bool) -> Result<Var, AutogradError> {
    tape.own("product", &[a, b])?;
    let n = tape.shape(a)[0];
    let mut y = vec![0.0; n * n];
    let (left, right) = (
        Mat::new(tape.values(a), n, n),
        Mat::new(tape.values(b), n, n),
    );
    product(left, right, MatMut::new(&mut y, n, n), false);
    Ok(tape.put("product", &[a, b], &[n, n], y, || Product {
        a,
        b,
        n,
        mistake,
    }))
}

type Build = fn(&mut Tape<'_, f64>, Var, Var, bool) -> Result<Var, AutogradError>;

/// What [`check_parameters`] finds of the sum of squares of an operation on two parameters.
fn whole_loss(shapes: [&[usize]; 2], build: Build, mistake: bool) -> CheckReport {
    let mut parameters = Parameters::new();
    let blocks = [0, 1].map(|k| {
        let value = ArrayD::from_shape_fn(IxDyn(shapes[k]), |index| {
            let place = index.slice().iter().fold(k + 1, |sum, i| 3 * sum + i);
            (place as f64).sin()
        });
        parameters.add(format!("operand {k}"), value).1
    });
    let loss = |tape: &mut Tape<'_, f64>| -> Result<Var, AutogradError> {
        let (a, b) = (tape.block(blocks[0]), tape.block(blocks[1]));
        let y = build(tape, a, b, mistake)?;
        let squares = tape.square(y);
        Ok(tape.sum(squares))
    };
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let total = loss(&mut tape).unwrap();
    tape.backward(total, &mut gradients).unwrap();
    check_parameters(&mut parameters, &gradients, 100, |parameters, _| {
        let mut tape = Tape::inference(parameters, &mut workspace);
        let total = loss(&mut tape)?;
        Ok(tape.values(total)[0])
    })
    .unwrap()
}

fn only_the_mistake_is_caught(shapes: [&[usize]; 2], build: Build) {
    for mistake in [false, true] {
        let property = check_case(&case(&shapes, 7, 0.0, move |tape, v| {
            build(tape, v[0], v[1], mistake)
        }));
        assert_eq!(property.is_err(), mistake, "property: {property:?}");
        let report = whole_loss(shapes, build, mistake);
        let numbers: usize = shapes
            .iter()
            .map(|shape| shape.iter().product::<usize>())
            .sum();
        assert_eq!((report.compared(), report.kinks()), (numbers, 0));
        if mistake {
            assert!(report.error() > 0.1, "whole loss: {report:?}");
        } else {
            assert!(report.error() < 1e-7, "whole loss: {report:?}");
        }
    }
}

#[test]
fn a_wrong_sign_is_caught() {
    only_the_mistake_is_caught([&[2, 3], &[2, 3]], difference);
}

#[test]
fn a_missing_sum_over_broadcast_rows_is_caught() {
    only_the_mistake_is_caught([&[4, 3], &[3]], shift);
}

#[test]
fn a_wrong_transpose_is_caught() {
    only_the_mistake_is_caught([&[3, 3], &[3, 3]], matrices);
}

/// The check of |x| at `x` with a gradient that claims to be `claimed`.
fn at_a_kink(x: f64, claimed: f64) -> Result<CheckReport, AutogradError> {
    let mut parameters = Parameters::new();
    parameters.add("x", arr1(&[x]).into_dyn());
    let mut gradients = Gradients::zeros(&parameters);
    gradients
        .iter_mut()
        .for_each(|gradient| gradient[0] = claimed);
    check_parameters(&mut parameters, &gradients, 1, |parameters, _| {
        Ok(parameters.iter().map(|(_, x)| x[[0]].abs()).sum())
    })
}

#[test]
fn at_a_kink_the_gradient_of_a_side_is_left_out_and_any_other_is_wrong() {
    for (x, claimed) in [(0.0, 1.0), (0.0, -1.0), (2e-7, 1.0)] {
        let report = at_a_kink(x, claimed).unwrap();
        assert_eq!(
            (report.compared(), report.kinks()),
            (0, 1),
            "{claimed} at {x}"
        );
    }
    for (x, claimed) in [(2e-7, 0.5), (0.0, 2.0), (2e-7, f64::NAN)] {
        let report = at_a_kink(x, claimed).unwrap();
        assert_eq!(
            (report.compared(), report.kinks()),
            (1, 0),
            "{claimed} at {x}"
        );
        assert!(report.error() > 0.1, "{claimed} at {x}");
    }
}

#[test]
fn a_kink_beyond_the_smallest_step_is_passed_by() {
    let report = at_a_kink(1e-5, 1.0).unwrap();
    assert_eq!((report.compared(), report.kinks()), (1, 0));
    assert!(report.error() < 1e-7);
}
