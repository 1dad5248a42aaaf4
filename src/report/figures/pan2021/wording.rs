//! How captions say numbers.

use std::fmt;

use crate::models::transition::effect::Response;

/// Whether a model follows a control; its `Display` is the end of a caption.
pub struct Verdict<'a> {
    model: &'a str,
    what: &'a str,
    followed: usize,
    of: usize,
}

impl<'a> Verdict<'a> {
    /// By the mean responses to the changes of `what`.
    pub fn of(model: &'a str, what: &'a str, responses: &[Response]) -> Self {
        let follows = |response: &&Response| response.follows();
        Self {
            model,
            what,
            followed: responses.iter().filter(follows).count(),
            of: responses.len(),
        }
    }
}

impl fmt::Display for Verdict<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { model, what, .. } = self;
        let enough = "(a third of the change or more)";
        match self.followed {
            0 => write!(
                f,
                "{model} does not follow {what} (less than a third of the change)"
            ),
            all if all == self.of => write!(f, "{model} follows {what} {enough}"),
            some => write!(
                f,
                "{model} follows {what} {enough} in {some} of {} cases only",
                self.of
            ),
        }
    }
}

/// A share as "42 %", which no line breaks.
pub fn percent(share: f64) -> String {
    let rounded = (100.0 * share).round();
    // No "-0 %".
    let rounded = if rounded == 0.0 { 0.0 } else { rounded };
    format!("{rounded:.0}\u{a0}%")
}

pub fn mean(values: &[f64]) -> f64 {
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
            Verdict::of("M", "the speed", &responses).to_string()
        };
        assert!(text([0.9, -3.0, 0.0]).starts_with("M does not follow the speed"));
        assert!(text([1.1, 3.0, 2.0]).starts_with("M follows the speed"));
        assert!(text([1.1, 3.0, 0.2]).ends_with("in 2 of 3 cases only"));
        assert_eq!(percent(-0.001), "0\u{a0}%");
    }
}
