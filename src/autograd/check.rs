//! Gradients compared with central differences, in f64.

use super::error::AutogradError;
use super::parameters::{Gradients, Parameters};

/// How far a gradient is from the central difference, at its worst.
#[derive(Debug, Clone, PartialEq)]
pub struct Disagreement {
    /// Name of the parameter.
    pub parameter: String,
    /// Index of the number in the parameter, row-major.
    pub index: usize,
    pub analytic: f64,
    pub numeric: f64,
    /// |analytic - numeric| / max(1, |analytic|, |numeric|).
    pub error: f64,
}

/// Result of [`check_parameters`].
#[derive(Debug, Clone, PartialEq)]
pub struct CheckReport {
    /// Numbers compared.
    pub compared: usize,
    /// Those left out since a kink (a PReLU at 0, a clamp's edge) lies within the step of the difference.
    pub kinks: usize,
    /// The largest disagreement in each parameter, in the parameters' order.
    pub worst: Vec<Disagreement>,
}

impl CheckReport {
    /// The largest error of all.
    pub fn error(&self) -> f64 {
        self.worst.iter().map(|d| d.error).fold(0.0, f64::max)
    }
}

/// Step of the central difference: near the cube root of the machine's epsilon.
const STEP: f64 = 1e-5;

/// Compares `gradients` of `loss` with central differences, for at most `per_parameter` numbers of each parameter (spread evenly,
/// the first and last among them).
///
/// A number at which the two one-sided differences disagree far more than a smooth function's would is a kink and is left out
/// and counted; the loss must be deterministic.
///
/// # Errors
/// What `loss` returns.
pub fn check_parameters(
    parameters: &mut Parameters<f64>,
    gradients: &Gradients<f64>,
    per_parameter: usize,
    mut loss: impl FnMut(&Parameters<f64>) -> Result<f64, AutogradError>,
) -> Result<CheckReport, AutogradError> {
    let analytic: Vec<Vec<f64>> = gradients.iter().map(<[f64]>::to_vec).collect();
    let names: Vec<String> = parameters.iter().map(|(name, _)| name.to_owned()).collect();
    let centre = loss(parameters)?;
    let mut report = CheckReport {
        compared: 0,
        kinks: 0,
        worst: Vec::new(),
    };
    for (p, name) in names.into_iter().enumerate() {
        let len = analytic[p].len();
        let count = per_parameter.min(len);
        let mut worst: Option<Disagreement> = None;
        for k in 0..count {
            let index = if count > 1 {
                k * (len - 1) / (count - 1)
            } else {
                0
            };
            let mut at = |offset: f64| -> Result<f64, AutogradError> {
                let before = nudge(parameters, p, index, offset);
                let value = loss(parameters)?;
                nudge_to(parameters, p, index, before);
                Ok(value)
            };
            let (above, below) = (at(STEP)?, at(-STEP)?);
            let numeric = (above - below) / (2.0 * STEP);
            let (right, left) = ((above - centre) / STEP, (centre - below) / STEP);
            let exact = analytic[p][index];
            let error = (exact - numeric).abs() / 1f64.max(exact.abs()).max(numeric.abs());
            if error > 1e-6 && (right - left).abs() > 1e-3 * 1f64.max(numeric.abs()) {
                report.kinks += 1;
                continue;
            }
            report.compared += 1;
            if worst.as_ref().is_none_or(|w| error > w.error) {
                worst = Some(Disagreement {
                    parameter: name.clone(),
                    index,
                    analytic: exact,
                    numeric,
                    error,
                });
            }
        }
        report.worst.extend(worst);
    }
    Ok(report)
}

fn nudge(parameters: &mut Parameters<f64>, p: usize, index: usize, offset: f64) -> f64 {
    let mut before = 0.0;
    if let Some(x) = number(parameters, p, index) {
        before = *x;
        *x += offset;
    }
    before
}

fn nudge_to(parameters: &mut Parameters<f64>, p: usize, index: usize, value: f64) {
    if let Some(x) = number(parameters, p, index) {
        *x = value;
    }
}

fn number(parameters: &mut Parameters<f64>, p: usize, index: usize) -> Option<&mut f64> {
    parameters
        .values_mut()
        .nth(p)
        .and_then(|(_, array)| array.as_slice_mut())
        .and_then(|values| values.get_mut(index))
}

/// The property that every operation's file states: its gradient is that of central differences.
#[cfg(test)]
pub(super) mod property {
    use std::fmt;
    use std::sync::Arc;

    use ndarray::{ArrayD, IxDyn};
    use proptest::prelude::*;
    use proptest::strategy::BoxedStrategy;
    use proptest::test_runner::{Config, TestRunner};
    use rand::{RngExt, SeedableRng};

    use super::super::{AutogradError, Gradients, Parameters, Tape, Var, Workspace};

    pub type Build =
        Arc<dyn Fn(&mut Tape<f64>, &[Var]) -> Result<Var, AutogradError> + Send + Sync>;

    /// An operation applied to drawn inputs.
    #[derive(Clone)]
    pub struct Case {
        pub inputs: Vec<ArrayD<f64>>,
        pub build: Build,
        /// Seed of the upstream gradient.
        pub seed: u64,
    }

    impl fmt::Debug for Case {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "seed {} inputs {:?}", self.seed, self.inputs)
        }
    }

    /// A case whose inputs have the given shapes, with numbers between -2 and 2 that keep `margin` from 0 (for kinks there).
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

    /// Runs at least 200 drawn cases (`PROPTEST_CASES` for more), each with its inputs as values and as parameters.
    pub fn check(name: &str, cases: BoxedStrategy<Case>) {
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

    fn scalar(case: &Case, inputs: &[ArrayD<f64>]) -> f64 {
        let parameters = Parameters::new();
        let mut workspace = Workspace::new();
        let mut tape = Tape::recording(&parameters, &mut workspace);
        let vars: Vec<Var> = inputs.iter().map(|x| tape.constant(x.clone())).collect();
        let y = (case.build)(&mut tape, &vars).expect("the case is valid");
        let values = tape.values(y);
        let weights = upstream(values.len(), case.seed);
        values.iter().zip(&weights).map(|(a, b)| a * b).sum()
    }

    pub fn check_case(case: &Case) -> Result<(), TestCaseError> {
        let as_values = gradients_of_values(case);
        let as_parameters = gradients_of_parameters(case);
        for (i, input) in case.inputs.iter().enumerate() {
            for k in 0..input.len() {
                let at = |offset: f64| {
                    let mut inputs = case.inputs.clone();
                    inputs[i].as_slice_mut().expect("contiguous")[k] += offset;
                    scalar(case, &inputs)
                };
                let step = 1e-5;
                let numeric = (at(step) - at(-step)) / (2.0 * step);
                for (how, analytic) in [
                    ("value", as_values[i][k]),
                    ("parameter", as_parameters[i][k]),
                ] {
                    let scale = 1f64.max(numeric.abs());
                    prop_assert!(
                        (analytic - numeric).abs() <= 2e-7 * scale,
                        "input {i} as {how}, number {k}: gradient {analytic}, difference {numeric}"
                    );
                }
            }
        }
        Ok(())
    }

    fn gradients_of_values(case: &Case) -> Vec<Vec<f64>> {
        let parameters = Parameters::new();
        let mut workspace = Workspace::new();
        let mut gradients = Gradients::zeros(&parameters);
        let mut tape = Tape::recording(&parameters, &mut workspace);
        let vars: Vec<Var> = case.inputs.iter().map(|x| tape.input(x.clone())).collect();
        let y = (case.build)(&mut tape, &vars).expect("the case is valid");
        let weights = upstream(tape.values(y).len(), case.seed);
        tape.backward_from(y, &weights, &vars, &mut gradients)
            .expect("finite")
            .into_iter()
            .map(|g| g.into_raw_vec_and_offset().0)
            .collect()
    }

    fn gradients_of_parameters(case: &Case) -> Vec<Vec<f64>> {
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
        let vars: Vec<Var> = blocks.iter().map(|&b| tape.block(b)).collect();
        let y = (case.build)(&mut tape, &vars).expect("the case is valid");
        let weights = upstream(tape.values(y).len(), case.seed);
        tape.backward_from(y, &weights, &[], &mut gradients)
            .expect("finite");
        gradients.iter().map(<[f64]>::to_vec).collect()
    }

    /// Two shapes that broadcast together (numpy's rules), of up to three axes of up to three, zero among them.
    pub fn broadcast_shapes() -> BoxedStrategy<(Vec<usize>, Vec<usize>)> {
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

    /// A shape of one to three axes, zero-size ones among them.
    pub fn shapes() -> BoxedStrategy<Vec<usize>> {
        prop::collection::vec(0usize..5, 1..4).boxed()
    }
}
