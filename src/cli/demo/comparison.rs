//! Whether the model is ahead of interpolation.

use std::fmt;

use crate::evaluation::Evaluation;

/// Lengths of transition (frames) at which a model must be ahead: where slerp knows nothing of the dance any more.
const LONG: [usize; 2] = [100, 150];

/// The scores of a model and of interpolation on the same windows; its `Display` sets their LRP side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    pub interpolation: Evaluation,
    pub model: Evaluation,
}

impl Comparison {
    /// Whether the model's LRP is the lower one at every long transition.
    pub fn is_ahead(&self) -> bool {
        self.long().all(|(_, model, other)| model < other)
    }

    /// Length, LRP of the model and of interpolation, cm.
    fn long(&self) -> impl Iterator<Item = (usize, f64, f64)> {
        LONG.into_iter().map(|length| {
            let lrp = |evaluation: &Evaluation| evaluation.lrp.at(length).unwrap_or(f64::NAN);
            (length, lrp(&self.model), lrp(&self.interpolation))
        })
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "LRP at long transitions:")?;
        for (index, (length, model, other)) in self.long().enumerate() {
            let comma = if index > 0 { "," } else { "" };
            write!(
                f,
                "{comma} N = {length}: model {model:.2} cm, interpolation {other:.2} cm"
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::LengthScores;

    fn evaluation(lrp: [f64; 2]) -> Evaluation {
        let scores = LengthScores::new(LONG.into_iter().zip(lrp).collect());
        Evaluation {
            lrp: scores.clone(),
            avf: scores.clone(),
            art: scores,
            foot_skate: None,
            windows: LONG.map(|length| (length, 1)).into(),
        }
    }

    #[test]
    fn ahead_is_ahead_at_every_long_transition() {
        let ahead = |model: [f64; 2]| {
            Comparison {
                interpolation: evaluation([70.0, 80.0]),
                model: evaluation(model),
            }
            .is_ahead()
        };
        assert!(ahead([69.9, 79.9]));
        assert!(!ahead([69.9, 80.0]));
        assert!(!ahead([70.1, 10.0]));
        assert!(!ahead([f64::NAN, 10.0]));
    }
}
