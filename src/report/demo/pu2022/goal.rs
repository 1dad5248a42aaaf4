//! Whether the model keeps to its key poses and to the beat.

use std::fmt;

use crate::evaluation::ProtocolScores;

/// Largest distance of a motion beat from a music beat that counts as a hit, frames: a tenth of a
/// second.
pub const DELTA: usize = 3;
/// The consistency error is to be below this share of what a held pose has.
const SHARE: f64 = 0.5;

/// What decides; its `Display` says it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Consistency errors of the model and of the seed's last pose, held.
    pub consistency: f64,
    pub held: f64,
    /// %; the other is what the model's own dance has by chance at most in 97.5 % of the shifts of
    /// the beats.
    pub beat_hits: f64,
    pub by_chance: f64,
}

impl Goal {
    /// NaN for a score that is not there.
    pub fn of(model: &ProtocolScores, held: &ProtocolScores) -> Self {
        let score = |scores: &ProtocolScores, metric: &str, column: &str| {
            let mut protocols = scores.iter();
            let found = protocols.find_map(|(_, scores)| scores.row(metric)?.at(column));
            found.unwrap_or(f64::NAN)
        };
        let delta = DELTA.to_string();
        Self {
            consistency: score(model, "consistency", "all"),
            held: score(held, "consistency", "all"),
            beat_hits: score(model, "beat_hit_rate", &delta),
            by_chance: score(model, "beat_hit_rate_shifted", &delta),
        }
    }

    pub fn is_reached(&self) -> bool {
        self.consistency < SHARE * self.held && self.beat_hits > self.by_chance
    }
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "consistency error {:.3}, of a held pose {:.3} (half of it: {:.3}); beat hit rate at \
             delta = {DELTA} {:.1} %, with shifted beats at most {:.1} % in 97.5 of 100",
            self.consistency,
            self.held,
            SHARE * self.held,
            self.beat_hits,
            self.by_chance
        )
    }
}
