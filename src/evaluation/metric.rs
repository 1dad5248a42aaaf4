//! What a score measures.

/// A metric of a protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metric {
    /// Its name in JSON and in a paper's printed numbers, such as `lrp`.
    pub key: &'static str,
    /// Its name in tables, such as "LRP".
    pub title: &'static str,
    /// Such as "cm" or "share of windows".
    pub unit: &'static str,
    pub better: Better,
    /// Digits behind the point in tables.
    pub decimals: usize,
    /// What it is, in a few words, and the equation that defines it.
    pub about: &'static str,
}

/// Which scores are the better ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Better {
    Lower,
    Higher,
    /// It is a yardstick for others, or has one of its own.
    Neither,
}

impl Better {
    /// As tables say it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Lower => "lower is better",
            Self::Higher => "higher is better",
            Self::Neither => "neither end is better",
        }
    }
}
