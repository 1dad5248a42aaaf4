//! Gradients compared with central differences, in f64.

use super::error::AutogradError;
use super::parameters::{Gradients, Parameters};

/// How far a gradient is from the central difference, at its worst.
#[derive(Debug, Clone, PartialEq)]
pub struct Disagreement {
    /// Index of the number in the parameter, row-major.
    pub index: usize,
    pub analytic: f64,
    pub numeric: f64,
    /// |analytic - numeric| / max(|analytic|, |numeric|, root mean square of the parameter's gradient, 1e-3).
    pub error: f64,
}

/// What was found in one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterReport {
    /// Name of the parameter.
    pub parameter: String,
    /// Numbers compared.
    pub compared: usize,
    /// Numbers left out: a kink (a PReLU at 0, a clamp's edge) lies within the smallest step of the
    /// difference, and the gradient is that of one side.
    pub kinks: usize,
    /// The largest disagreement among those compared.
    pub worst: Option<Disagreement>,
}

/// Result of [`check_parameters`].
#[derive(Debug, Clone, PartialEq)]
pub struct CheckReport {
    /// In the parameters' order.
    pub parameters: Vec<ParameterReport>,
}

impl CheckReport {
    /// The largest error of all.
    pub fn error(&self) -> f64 {
        let worst = self.parameters.iter().filter_map(|p| p.worst.as_ref());
        worst.map(|worst| worst.error).fold(0.0, f64::max)
    }

    /// Numbers compared.
    pub fn compared(&self) -> usize {
        self.parameters.iter().map(|p| p.compared).sum()
    }

    /// Numbers left out at kinks.
    pub fn kinks(&self) -> usize {
        self.parameters.iter().map(|p| p.kinks).sum()
    }
}

/// Steps of the differences, largest first: a smooth loss is most exact with the first, the others
/// get between kinks.
const STEPS: [f64; 4] = [1e-3, 1e-4, 1e-5, 1e-6];
/// Error at which a difference and a gradient agree and no smaller step is tried.
const AGREES: f64 = 1e-7;
/// Error at which a one-sided difference, less exact than a central one, and a gradient agree; a
/// central difference with more may stand at a kink.
const AGREES_ON_ONE_SIDE: f64 = 1e-6;
/// Gradients are compared relative to their own size, but to no less than this: below it the loss's
/// rounding shows.
const SMALLEST_SCALE: f64 = 1e-3;

/// Compares `gradients` of `loss` with central differences of fourth order, for at most
/// `per_parameter` numbers of each parameter (spread evenly, the first and last among them).
///
/// The steps of the difference shrink until it agrees with the gradient; if none does, and a
/// one-sided difference does, then the number sits at a kink and is counted as such. A gradient
/// that is wrong agrees with neither side, kink or not. `loss` is given the name of the parameter
/// whose gradient is compared: where gradients are stopped, not every parameter's gradient is that
/// of the same sum. It must be deterministic.
///
/// # Errors
/// What `loss` returns.
pub fn check_parameters(
    parameters: &mut Parameters<f64>,
    gradients: &Gradients<f64>,
    per_parameter: usize,
    mut loss: impl FnMut(&Parameters<f64>, &str) -> Result<f64, AutogradError>,
) -> Result<CheckReport, AutogradError> {
    let names: Vec<String> = parameters.iter().map(|(name, _)| name.to_owned()).collect();
    let mut reports = Vec::new();
    for (p, (name, gradient)) in names.into_iter().zip(gradients.iter()).enumerate() {
        let centre = loss(parameters, &name)?;
        let scale = root_mean_square(gradient).max(SMALLEST_SCALE);
        let mut report = ParameterReport {
            parameter: name.clone(),
            compared: 0,
            kinks: 0,
            worst: None,
        };
        for index in spread(gradient.len(), per_parameter) {
            let mut at = |offset: f64| -> Result<f64, AutogradError> {
                let before = nudge(parameters, p, index, offset);
                let value = loss(parameters, &name)?;
                nudge_to(parameters, p, index, before);
                Ok(value)
            };
            let Some(found) = compare(gradient[index], scale, centre, &mut at)? else {
                report.kinks += 1;
                continue;
            };
            report.compared += 1;
            let worst = report.worst.as_ref();
            if worst.is_none_or(|worst| found.error > worst.error) {
                report.worst = Some(Disagreement { index, ..found });
            }
        }
        reports.push(report);
    }
    Ok(CheckReport {
        parameters: reports,
    })
}

/// Compares one number's gradient; none at a kink. `at` is the loss with an offset on that number.
fn compare(
    analytic: f64,
    scale: f64,
    centre: f64,
    at: &mut impl FnMut(f64) -> Result<f64, AutogradError>,
) -> Result<Option<Disagreement>, AutogradError> {
    let error = |numeric: f64| {
        let error = (analytic - numeric).abs() / scale.max(analytic.abs()).max(numeric.abs());
        if error.is_nan() { f64::INFINITY } else { error }
    };
    let mut best: Option<Disagreement> = None;
    let mut one_sided = f64::INFINITY;
    for step in STEPS {
        let (right, left) = (at(step)?, at(-step)?);
        let (right2, left2) = (at(2.0 * step)?, at(-2.0 * step)?);
        let numeric = (8.0 * (right - left) - (right2 - left2)) / (12.0 * step);
        let found = Disagreement {
            index: 0,
            analytic,
            numeric,
            error: error(numeric),
        };
        if found.error <= AGREES {
            return Ok(Some(found));
        }
        for side in [
            (4.0 * right - right2 - 3.0 * centre) / (2.0 * step),
            (3.0 * centre - 4.0 * left + left2) / (2.0 * step),
        ] {
            one_sided = one_sided.min(error(side));
        }
        if best.as_ref().is_none_or(|best| found.error < best.error) {
            best = Some(found);
        }
    }
    Ok(best.filter(|best| best.error <= AGREES_ON_ONE_SIDE || one_sided > AGREES_ON_ONE_SIDE))
}

/// At most `count` indices below `len`, spread evenly, the first and last among them.
fn spread(len: usize, count: usize) -> impl Iterator<Item = usize> {
    let count = count.min(len);
    (0..count).map(move |k| match count {
        1 => 0,
        _ => k * (len - 1) / (count - 1),
    })
}

fn root_mean_square(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|x| x * x).sum();
    (sum / values.len().max(1) as f64).sqrt()
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
    use super::compare;

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

    /// Runs at least 200 drawn cases (`PROPTEST_CASES` for more), each with its inputs as values
    /// and as parameters.
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
        let centre = scalar(case, &case.inputs);
        for (i, input) in case.inputs.iter().enumerate() {
            for k in 0..input.len() {
                let mut at = |offset: f64| {
                    let mut inputs = case.inputs.clone();
                    inputs[i].as_slice_mut().expect("contiguous")[k] += offset;
                    Ok(scalar(case, &inputs))
                };
                for (how, analytic) in [
                    ("value", as_values[i][k]),
                    ("parameter", as_parameters[i][k]),
                ] {
                    let found = compare(analytic, 1.0, centre, &mut at).expect("the case is valid");
                    // None at a kink: the gradient is that of one side.
                    let agrees = found.as_ref().is_none_or(|found| found.error <= 2e-7);
                    prop_assert!(agrees, "input {i} as {how}, number {k}: {found:?}");
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

    /// Two shapes that broadcast together (numpy's rules), of up to three axes of up to three, zero
    /// among them.
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

    /// A factor on what saturates a function: mild or strong.
    pub fn strength() -> BoxedStrategy<f64> {
        prop_oneof![Just(1.0), Just(30.0)].boxed()
    }

    /// A shape of one to three axes, zero-size ones among them.
    pub fn shapes() -> BoxedStrategy<Vec<usize>> {
        prop::collection::vec(0usize..5, 1..4).boxed()
    }
}

#[cfg(test)]
mod mutations;
