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
    /// |analytic - numeric| / max(|analytic|, |numeric|, root mean square of the parameter's
    /// gradient, 1e-3).
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
/// Gradients of other parameters; what `loss` returns.
pub fn check_parameters(
    parameters: &mut Parameters<f64>,
    gradients: &Gradients<f64>,
    per_parameter: usize,
    mut loss: impl FnMut(&Parameters<f64>, &str) -> Result<f64, AutogradError>,
) -> Result<CheckReport, AutogradError> {
    if !gradients.fit(parameters) {
        return Err(AutogradError::Misplaced {
            operation: "check_parameters",
            what: "the gradients are those of other parameters",
        });
    }
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
                let before = set_number(parameters, p, index, |x| x + offset);
                let value = loss(parameters, &name);
                set_number(parameters, p, index, |_| before);
                value
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

/// Sets number `index` of parameter `p` to what `change` makes of it. Returns what it was.
fn set_number(
    parameters: &mut Parameters<f64>,
    p: usize,
    index: usize,
    change: impl Fn(f64) -> f64,
) -> f64 {
    let parameter = parameters.values_mut().nth(p);
    let (_, mut value) = parameter.expect("a gradient has its parameter");
    let number = value.iter_mut().nth(index);
    let number = number.expect("a parameter has as many numbers as its gradient");
    std::mem::replace(number, change(*number))
}

#[cfg(test)]
mod mutations;
#[cfg(any(test, feature = "proptest"))]
pub mod property;
