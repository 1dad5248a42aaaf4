//! How captions say numbers.

use crate::models::transition::effect::Response;

/// Whether a model follows a control, by its mean responses to the changes of `what`: the end of a
/// caption.
pub fn verdict(model: &str, what: &str, responses: &[Response]) -> String {
    let follows = |response: &&Response| response.follows();
    let enough = format!("{model} follows {what} (a third of the change or more)");
    match (responses.iter().filter(follows).count(), responses.len()) {
        (0, _) => format!("{model} does not follow {what} (less than a third of the change)"),
        (followed, all) if followed == all => enough,
        (followed, all) => format!("{enough} in {followed} of {all} cases only"),
    }
}

/// A share as "42 %", which no line breaks.
pub fn percent(share: f64) -> String {
    let rounded = (100.0 * share).round();
    // No "-0 %".
    let rounded = if rounded == 0.0 { 0.0 } else { rounded };
    format!("{rounded:.0}\u{a0}%")
}

/// The plain mean; NaN for none.
pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.into_iter().collect();
    values.iter().sum::<f64>() / values.len() as f64
}
