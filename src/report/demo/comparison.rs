//! Whether the model is ahead of what needs no training.

use std::fmt;

use crate::evaluation::{Scores, TableRow};
use crate::experiment::ExperimentConfig;
use crate::report::{NO_TRAINING, schedule_note};
use crate::run::Manifest;

/// Lengths of transition (frames) at which a model must be ahead: where the keyframes say little of
/// the dance between them.
const LONG: [usize; 2] = [100, 150];

/// The scores of a model, of interpolation and of the model before its training on the same
/// windows; its `Display` sets their LRP side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    pub interpolation: Scores,
    /// The best linear estimate from the keyframes, which a residual network begins with.
    pub untrained: Scores,
    pub model: Scores,
}

impl Comparison {
    /// Whether the model's LRP is the lowest at every long transition.
    pub fn is_ahead(&self) -> bool {
        self.long()
            .all(|(_, [model, untrained, other])| model < untrained && model < other)
    }

    /// The rows of the three in the tables, the model trained as config and manifest say.
    pub fn rows(&self, config: &ExperimentConfig, manifest: &Manifest) -> [TableRow; 3] {
        let row = |name: &str, seed, scores: &Scores, schedule_note: &str| TableRow {
            name: name.into(),
            seed,
            scores: Some(scores.clone()),
            schedule_note: schedule_note.into(),
        };
        [
            row(
                "interpolation, generated clips",
                None,
                &self.interpolation,
                NO_TRAINING,
            ),
            row(
                "linear estimate, generated clips",
                None,
                &self.untrained,
                "the small whole model before its training",
            ),
            row(
                "small whole model, generated clips",
                Some(manifest.seed),
                &self.model,
                &schedule_note(config, manifest),
            ),
        ]
    }

    /// Length, LRP (cm) of the model, of the model untrained and of interpolation.
    fn long(&self) -> impl Iterator<Item = (usize, [f64; 3])> {
        LONG.into_iter().map(|length| {
            let lrp = |scores: &Scores| {
                scores
                    .row("lrp")
                    .and_then(|row| row.at(length))
                    .unwrap_or(f64::NAN)
            };
            let scores = [&self.model, &self.untrained, &self.interpolation].map(lrp);
            (length, scores)
        })
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "LRP at long transitions:")?;
        for (index, (length, [model, untrained, other])) in self.long().enumerate() {
            let end = if index > 0 { ";" } else { "" };
            write!(
                f,
                "{end} N = {length}: model {model:.2} cm, untrained {untrained:.2} cm, interpolation {other:.2} cm"
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::ScoreRow;

    fn scores(lrp: [f64; 2]) -> Scores {
        let row = ScoreRow::new(LONG.into_iter().zip(lrp));
        Scores::new([("lrp", row)], LONG.map(|length| (length, 1)))
    }

    #[test]
    fn ahead_is_ahead_at_every_long_transition() {
        let ahead = |model: [f64; 2]| {
            Comparison {
                interpolation: scores([70.0, 80.0]),
                untrained: scores([75.0, 78.0]),
                model: scores(model),
            }
            .is_ahead()
        };
        assert!(ahead([69.9, 77.9]));
        assert!(!ahead([69.9, 78.0]));
        assert!(!ahead([70.1, 10.0]));
        assert!(!ahead([f64::NAN, 10.0]));
    }
}
