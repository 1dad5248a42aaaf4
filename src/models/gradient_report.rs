//! The checks of a model's gradient in all the ways that it is trained, as text, and whether they
//! pass.

use std::fmt;

use super::ModelError;
use super::settings::{GradientCheckOptions, ModelSettings};
use super::{CRITICS, LossTerms};
use crate::autograd::check::{CheckReport, ParameterReport, check_parameters};
use crate::autograd::{AutogradError, Gradients, Parameters, Tape, Workspace};

/// Largest error that passes.
const TOLERANCE: f64 = 1e-5;
/// Largest share of numbers that may stand at a kink.
const MOST_KINKS: f64 = 0.02;
/// A check of each case that the model has; its `Display` is a table for each and a line on them
/// all.
pub struct GradientReport {
    /// Title and report.
    cases: Vec<(String, CheckReport)>,
}

impl GradientReport {
    /// Checks a model in all the ways that it is trained.
    ///
    /// # Errors
    /// The model has nothing to train, or an operation fails.
    pub fn of(
        model: &dyn ModelSettings,
        options: &GradientCheckOptions,
    ) -> Result<Self, ModelError> {
        let cases = model.check_gradients(options)?;
        Ok(Self { cases })
    }

    /// Whether it passes.
    ///
    /// # Errors
    /// An error is too large, or too few numbers could be compared.
    pub fn verdict(&self) -> Result<(), ModelError> {
        let (error, kinks) = (self.error(), self.sum(CheckReport::kinks));
        let drawn = self.sum(CheckReport::compared) + kinks;
        let reason = if error > TOLERANCE {
            format!("a gradient is wrong: its error {error:.1e} is above {TOLERANCE:.0e}")
        } else if drawn == 0 || kinks as f64 > MOST_KINKS * drawn as f64 {
            format!(
                "too little was compared: {kinks} of {drawn} numbers stand at a kink; another \
                 --seed may draw better ones"
            )
        } else {
            return Ok(());
        };
        Err(ModelError::Data { reason })
    }

    fn error(&self) -> f64 {
        let errors = self.cases.iter().map(|(_, report)| report.error());
        errors.fold(0.0, f64::max)
    }

    fn sum(&self, of: fn(&CheckReport) -> usize) -> usize {
        self.cases.iter().map(|(_, report)| of(report)).sum()
    }
}

impl fmt::Display for GradientReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (title, report) in &self.cases {
            writeln!(f, "{title}\n{}", table(report))?;
        }
        writeln!(
            f,
            "{} numbers compared, {} at kinks left out; largest error {:.1e}",
            self.sum(CheckReport::compared),
            self.sum(CheckReport::kinks),
            self.error()
        )
    }
}

/// Compares the gradient of a loss with central differences: for critics of their own part of it,
/// for all other weights of the rest (see [`LossTerms::critics`]). `dropout` is the key of its
/// random masks, the same at every evaluation.
///
/// # Errors
/// What `losses` returns; numbers that are not finite.
pub fn check_losses(
    parameters: &mut Parameters<f64>,
    dropout: Option<u64>,
    per_parameter: usize,
    losses: impl Fn(&mut Tape<'_, f64>) -> Result<LossTerms, AutogradError>,
) -> Result<CheckReport, AutogradError> {
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(parameters);
    let mut tape = Tape::recording(parameters, &mut workspace);
    tape.set_dropout(dropout);
    let total = losses(&mut tape)?.total;
    tape.check_finite()?;
    tape.backward(total, &mut gradients)?;
    check_parameters(parameters, &gradients, per_parameter, |parameters, name| {
        let mut tape = Tape::inference(parameters, &mut workspace);
        tape.set_dropout(dropout);
        let losses = losses(&mut tape)?;
        let total = tape.values(losses.total)[0];
        let critics = losses.critics.map_or(0.0, |it| tape.values(it)[0]);
        Ok(match name.starts_with(CRITICS) {
            true => critics,
            false => total - critics,
        })
    })
}

/// A row for each part of the network: what its parameters' names begin with.
fn table(report: &CheckReport) -> String {
    let mut groups: Vec<(&str, Vec<&ParameterReport>)> = Vec::new();
    for parameter in &report.parameters {
        let group = parameter.parameter.split('.').next().unwrap_or_default();
        match groups.iter_mut().find(|(name, _)| *name == group) {
            Some((_, members)) => members.push(parameter),
            None => groups.push((group, vec![parameter])),
        }
    }
    let mut text = format!(
        "  {:<28} {:>8} {:>6} {:>9}  {}\n",
        "part", "compared", "kinks", "error", "where"
    );
    for (group, members) in groups {
        let compared: usize = members.iter().map(|p| p.compared).sum();
        let kinks: usize = members.iter().map(|p| p.kinks).sum();
        let worst = members.iter().filter_map(|p| Some((p, p.worst.as_ref()?)));
        let worst = worst.max_by(|(_, a), (_, b)| a.error.total_cmp(&b.error));
        let mut shown = ("-".to_string(), "-".to_string());
        if let Some((ParameterReport { parameter, .. }, worst)) = worst {
            shown.0 = format!("{:.1e}", worst.error);
            shown.1 = format!(
                "{parameter}[{}]: gradient {:.8e}, difference {:.8e}",
                worst.index, worst.analytic, worst.numeric
            );
        }
        let (error, place) = shown;
        text += &format!("  {group:<28} {compared:>8} {kinks:>6} {error:>9}  {place}\n");
    }
    text
}
