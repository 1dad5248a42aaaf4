//! Whether the model is ahead of what needs no training.

use std::fmt;

use crate::evaluation::ProtocolScores;

/// Lengths of transition (frames) at which a model must be ahead: where the keyframes say little of
/// the dance between them.
const LONG: [usize; 2] = [100, 150];

/// The scores of a model, of interpolation and of the model before its training on the same
/// windows; its `Display` sets their LRP side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    pub interpolation: ProtocolScores,
    /// The best linear estimate from the keyframes, which a residual network begins with.
    pub untrained: ProtocolScores,
    pub model: ProtocolScores,
}

impl Comparison {
    /// Whether the model's LRP is the lowest at every long transition.
    pub fn is_ahead(&self) -> bool {
        self.long()
            .all(|(_, [model, untrained, other])| model < untrained && model < other)
    }

    /// Length, LRP (cm) of the model, of the model untrained and of interpolation.
    fn long(&self) -> impl Iterator<Item = (usize, [f64; 3])> {
        LONG.into_iter().map(|length| {
            let lrp = |scores: &ProtocolScores| {
                let mut protocols = scores.iter();
                let lrp = protocols.find_map(|(_, scores)| scores.row("lrp")?.at(length));
                lrp.unwrap_or(f64::NAN)
            };
            let scores = [&self.model, &self.untrained, &self.interpolation].map(lrp);
            (length, scores)
        })
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lengths = self.long().map(|(length, [model, untrained, other])| {
            format!(
                "N = {length}: model {model:.2} cm, untrained {untrained:.2} cm, interpolation \
                 {other:.2} cm"
            )
        });
        let lengths = lengths.collect::<Vec<_>>().join("; ");
        write!(f, "LRP at long transitions: {lengths}")
    }
}
