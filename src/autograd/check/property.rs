//! The property that every operation's file states: its gradient is that of central differences.
//!
//! For operations of one's own: `keydance = { .., features = ["proptest"] }` among the
//! dev-dependencies, and
//!
//! ```
//! use keydance::autograd::check::property;
//!
//! // As a `#[test]`: x * x + x, on values and on parameters of drawn shapes.
//! property::check(
//!     "x * x + x",
//!     property::of_one_value(0.0, |tape, x| {
//!         let square = tape.mul(x, x)?;
//!         tape.add(square, x)
//!     }),
//! );
//!
//! // Two operands of one shape, whose numbers keep 0.1 from the kink at 0.
//! property::check(
//!     "|x| y",
//!     property::drawn(property::shapes(), |shape, seed| {
//!         property::case(&[&shape, &shape], seed, 0.1, |tape, v| {
//!             let x = tape.abs(v[0]);
//!             tape.mul(x, v[1])
//!         })
//!     }),
//! );
//! ```
//!
//! [`drawn`] takes whatever proptest draws, such as `(1usize..5, 1usize..5)` for sizes.

use std::fmt;
use std::sync::Arc;

use ndarray::{ArrayD, IxDyn};
use proptest::prelude::*;
use proptest::strategy::BoxedStrategy;
use proptest::test_runner::{Config, TestRunner};
use rand::{RngExt, SeedableRng};

use super::super::{AutogradError, Gradients, Parameters, Tape, Var, Workspace};
use super::compare;

/// Applies an operation to inputs.
pub type Build = Arc<dyn Fn(&mut Tape<f64>, &[Var]) -> Result<Var, AutogradError> + Send + Sync>;

/// An operation applied to drawn inputs.
#[derive(Clone)]
pub struct Case {
    pub inputs: Vec<ArrayD<f64>>,
    pub build: Build,
    /// Seed of the upstream gradient.
    pub seed: u64,
}

/// Where an operation's cases are drawn from.
pub type Cases = BoxedStrategy<Case>;

impl fmt::Debug for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "seed {} inputs {:?}", self.seed, self.inputs)
    }
}

/// A case whose inputs have the given shapes, with numbers between -2 and 2 that keep `margin`
/// from 0 (for kinks there).
pub fn case(
    shapes: &[&[usize]],
    seed: u64,
    margin: f64,
    build: impl Fn(&mut Tape<f64>, &[Var]) -> Result<Var, AutogradError> + Send + Sync + 'static,
) -> Case {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let inputs = shapes
        .iter()
        .map(|shape| {
            ArrayD::from_shape_simple_fn(IxDyn(shape), || {
                let x: f64 = rng.random_range(-2.0..2.0);
                x + margin * x.signum()
            })
        })
        .collect();
    Case {
        inputs,
        build: Arc::new(build),
        seed,
    }
}

fn upstream(len: usize, seed: u64) -> Vec<f64> {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed ^ 0xfeed);
    (0..len).map(|_| rng.random_range(-1.0..1.0)).collect()
}

/// Runs at least 200 drawn cases (`PROPTEST_CASES` for more), each with its inputs as values and as
/// parameters: the gradient of each number is compared with a central difference of fourth order,
/// to 2e-7 of its size, and a value of another tape must be refused.
///
/// Panics, as a test does, with the smallest case that was found to fail.
pub fn check(name: &str, cases: Cases) {
    let config = Config::default();
    let mut runner = TestRunner::new(Config {
        cases: config.cases.max(200),
        failure_persistence: None,
        ..config
    });
    if let Err(error) = runner.run(&cases, |case| check_case(&case)) {
        panic!("{name}: {error}");
    }
}

fn scalar(case: &Case, inputs: &[ArrayD<f64>]) -> Result<f64, AutogradError> {
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let vars: Vec<Var> = inputs.iter().map(|x| tape.constant(x.clone())).collect();
    let y = (case.build)(&mut tape, &vars)?;
    let values = tape.values(y);
    let weights = upstream(values.len(), case.seed);
    Ok(values.iter().zip(&weights).map(|(a, b)| a * b).sum())
}

fn fails(error: AutogradError) -> TestCaseError {
    TestCaseError::fail(error.to_string())
}

pub(super) fn check_case(case: &Case) -> Result<(), TestCaseError> {
    let as_values = gradients_of_values(case).map_err(fails)?;
    let as_parameters = gradients_of_parameters(case).map_err(fails)?;
    for (i, gradient) in as_values.iter().enumerate() {
        // Where it has a gradient the case reads it.
        let read = gradient.iter().any(|&g| g != 0.0);
        let foreign = with_a_value_of_another_tape(case, i);
        let refused = matches!(foreign, Err(AutogradError::Misplaced { .. }));
        if read && !refused {
            let found = foreign.map_or_else(|error| error.to_string(), |()| "no error".into());
            return Err(TestCaseError::fail(format!(
                "input {i} of another tape is not refused as such (Tape::own does it): {found}"
            )));
        }
    }
    let centre = scalar(case, &case.inputs).map_err(fails)?;
    for (i, input) in case.inputs.iter().enumerate() {
        for k in 0..input.len() {
            let mut at = |offset: f64| {
                let mut inputs = case.inputs.clone();
                inputs[i]
                    .iter_mut()
                    .skip(k)
                    .take(1)
                    .for_each(|x| *x += offset);
                scalar(case, &inputs)
            };
            for (how, analytic) in [
                ("value", as_values[i][k]),
                ("parameter", as_parameters[i][k]),
            ] {
                let found = compare(analytic, 1.0, centre, &mut at).map_err(fails)?;
                // None at a kink: the gradient is that of one side.
                let Some(found) = found.filter(|found| found.error > 2e-7) else {
                    continue;
                };
                let (of, shape) = (found.analytic, input.shape());
                let numeric = found.numeric;
                return Err(TestCaseError::fail(format!(
                    "the gradient of number {k} of input {i} {shape:?}, given as a {how}, is {of}, \
                     by central differences {numeric}"
                )));
            }
        }
    }
    Ok(())
}

/// The operation with its inputs on one tape but number `other`, which is on an earlier one.
fn with_a_value_of_another_tape(case: &Case, other: usize) -> Result<(), AutogradError> {
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let inputs = |tape: &mut Tape<'_, f64>| -> Vec<Var> {
        case.inputs.iter().map(|x| tape.input(x.clone())).collect()
    };
    let earlier = inputs(&mut Tape::recording(&parameters, &mut workspace));
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let mut vars = inputs(&mut tape);
    vars[other] = earlier[other];
    (case.build)(&mut tape, &vars)?;
    tape.check_finite()
}

fn gradients_of_values(case: &Case) -> Result<Vec<Vec<f64>>, AutogradError> {
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let vars: Vec<Var> = case.inputs.iter().map(|x| tape.input(x.clone())).collect();
    let y = (case.build)(&mut tape, &vars)?;
    let weights = upstream(tape.values(y).len(), case.seed);
    let found = tape.backward_from(y, &weights, &vars, &mut gradients)?;
    Ok(found.iter().map(|g| g.iter().copied().collect()).collect())
}

fn gradients_of_parameters(case: &Case) -> Result<Vec<Vec<f64>>, AutogradError> {
    let mut parameters = Parameters::new();
    let blocks: Vec<_> = case
        .inputs
        .iter()
        .enumerate()
        .map(|(i, x)| parameters.add(format!("input {i}"), x.clone()).1)
        .collect();
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let vars: Vec<Var> = blocks.iter().map(|&block| tape.block(block)).collect();
    let y = (case.build)(&mut tape, &vars)?;
    let weights = upstream(tape.values(y).len(), case.seed);
    tape.backward_from(y, &weights, &[], &mut gradients)?;
    Ok(gradients.iter().map(<[f64]>::to_vec).collect())
}

/// Cases that follow from what is drawn and a seed.
pub fn drawn<D: fmt::Debug>(
    drawn: impl Strategy<Value = D> + 'static,
    make: impl Fn(D, u64) -> Case + 'static,
) -> Cases {
    (drawn, any::<u64>())
        .prop_map(move |(drawn, seed)| make(drawn, seed))
        .boxed()
}

/// Cases of an operation on one value, whose numbers keep `margin` from 0.
pub fn of_one_value<F>(margin: f64, build: F) -> Cases
where
    F: Fn(&mut Tape<f64>, Var) -> Result<Var, AutogradError> + Copy + Send + Sync + 'static,
{
    drawn(shapes(), move |x, seed| {
        case(&[&x], seed, margin, move |tape, v| build(tape, v[0]))
    })
}

/// Cases of an operation on two values that broadcast together.
pub fn of_two_values<F>(build: F) -> Cases
where
    F: Fn(&mut Tape<f64>, Var, Var) -> Result<Var, AutogradError> + Copy + Send + Sync + 'static,
{
    drawn(broadcast_shapes(), move |(a, b), seed| {
        case(&[&a, &b], seed, 0.0, move |tape, v| build(tape, v[0], v[1]))
    })
}

/// Two shapes that broadcast together (numpy's rules), of up to three axes of up to three, zero
/// among them.
fn broadcast_shapes() -> BoxedStrategy<(Vec<usize>, Vec<usize>)> {
    (
        prop::collection::vec(0usize..4, 0..4),
        any::<[bool; 6]>(),
        0usize..4,
        0usize..4,
    )
        .prop_map(|(shape, ones, cut_a, cut_b)| {
            let shrink = |from: usize, cut: usize| -> Vec<usize> {
                shape
                    .iter()
                    .enumerate()
                    .map(|(i, &n)| if ones[from + i] { 1 } else { n })
                    .skip(cut.min(shape.len()))
                    .collect()
            };
            (shrink(0, cut_a), shrink(3, cut_b))
        })
        .boxed()
}

/// A factor on what saturates a function: mild or strong.
pub fn strength() -> BoxedStrategy<f64> {
    prop_oneof![Just(1.0), Just(30.0)].boxed()
}

/// A shape of one to three axes, zero-size ones among them.
pub fn shapes() -> BoxedStrategy<Vec<usize>> {
    prop::collection::vec(0usize..5, 1..4).boxed()
}
