//! Whether the model dances on (spec of Valle-Pérez et al., section 9).

use std::fmt;

use crate::evaluation::ProtocolScores;

/// Most of the data's mean step that the dances' may be.
const MOST_STEP: f64 = 1.5;
/// Least share of the data's diversity within a dance.
const LEAST_DIVERSITY: f64 = 1.0 / 3.0;

/// What decides; its `Display` says it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Dances that freeze, and that diverge, %.
    pub freezing: f64,
    pub divergence: f64,
    /// Mean step of the dances and of the recorded ones, deviations.
    pub step: [f64; 2],
    /// Diversity within a dance, likewise.
    pub diversity: [f64; 2],
}

impl Goal {
    /// NaN for a score that is not there.
    pub fn of(model: &ProtocolScores) -> Self {
        let score = |metric: &str| {
            let mut protocols = model.iter();
            let found = protocols.find_map(|(_, scores)| scores.row(metric)?.at("all"));
            found.unwrap_or(f64::NAN)
        };
        Self {
            freezing: score("freezing"),
            divergence: score("divergence"),
            step: ["step", "step_real"].map(score),
            diversity: ["diversity", "diversity_real"].map(score),
        }
    }

    pub fn is_reached(&self) -> bool {
        let [step, usual] = self.step;
        let [diversity, real] = self.diversity;
        self.freezing == 0.0
            && self.divergence == 0.0
            && step < MOST_STEP * usual
            && diversity > LEAST_DIVERSITY * real
    }
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            freezing,
            divergence,
            step,
            diversity,
        } = self;
        write!(
            f,
            "{freezing:.0} % of the dances freeze, {divergence:.0} % diverge (none may); mean step \
             {:.3} deviations, recorded {:.3} (at most {MOST_STEP} times it); diversity within a \
             dance {:.2}, recorded {:.2} (at least a third of it)",
            step[0], step[1], diversity[0], diversity[1]
        )
    }
}
