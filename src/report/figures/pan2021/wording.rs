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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_says_none_all_or_how_many() {
        let text = |measured: [f64; 3]| {
            let responses = measured.map(|measured| Response {
                asked: 3.0,
                measured,
            });
            verdict("M", "the speed", &responses)
        };
        assert!(text([0.9, -3.0, 0.0]).starts_with("M does not follow the speed"));
        assert!(text([1.1, 3.0, 2.0]).starts_with("M follows the speed"));
        assert!(text([1.1, 3.0, 0.2]).ends_with("in 2 of 3 cases only"));
        assert_eq!(percent(-0.001), "0\u{a0}%");
    }
}
