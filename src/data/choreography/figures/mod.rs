//! Figures: what a dancer does for a bar or so. Each family is one file; arms and trunk come with
//! them.

mod arms;
mod gestures;
mod jumps;
mod steps;
mod sways;
mod turns;

use rand::RngExt;
use rand_chacha::ChaCha12Rng;

use super::score::Score;

/// A family of figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Walks, side steps, boxes, lunges.
    Steps,
    /// Turns with the feet stepping round, and pirouettes.
    Turns,
    /// Weight shifts on planted feet, plies, bows.
    Sways,
    /// Jumps on two feet and leaps.
    Jumps,
    /// A leg in the air over one planted foot.
    Gestures,
}

impl Family {
    /// Writes one figure of this family at the end of the score.
    pub fn perform(self, score: &mut Score, rng: &mut ChaCha12Rng) {
        match self {
            Family::Steps => steps::perform(score, rng),
            Family::Turns => turns::perform(score, rng),
            Family::Sways => sways::perform(score, rng),
            Family::Jumps => jumps::perform(score, rng),
            Family::Gestures => gestures::perform(score, rng),
        }
    }
}

/// Brings a dancer who has come far out back towards the middle.
pub fn return_to_the_middle(score: &mut Score, rng: &mut ChaCha12Rng) {
    turns::to_the_middle(score, rng);
    steps::walk(score, rng);
}

/// Distance (cm) from the middle of the floor over which going on outwards becomes three times less
/// likely.
const ROOM: f64 = 75.0;

/// Draws one of the directions (forward, left: shares of `distance` cm), rather those that stay
/// near the middle of the floor.
fn draw_direction(
    score: &Score,
    directions: &[(f64, f64)],
    distance: f64,
    rng: &mut ChaCha12Rng,
) -> (f64, f64) {
    let weights: Vec<f64> = directions
        .iter()
        .map(|(forward, left)| {
            let way = Score::floor(score.heading, distance * forward, distance * left);
            (-((score.centre + way).length() - score.centre.length()) / ROOM
                * (1.0 + score.centre.length() / ROOM))
                .exp()
        })
        .collect();
    let mut left = rng.random_range(0.0..1.0) * weights.iter().sum::<f64>();
    for (direction, weight) in directions.iter().zip(&weights) {
        if left < *weight {
            return *direction;
        }
        left -= weight;
    }
    directions.last().copied().unwrap_or((0.0, 0.0))
}

/// +1 or -1.
fn draw_side(rng: &mut ChaCha12Rng) -> f64 {
    if rng.random_bool(0.5) { 1.0 } else { -1.0 }
}
