//! Styles of dance: tempo, stance, and how much of each kind of figure.

use rand::RngExt;
use rand_chacha::ChaCha12Rng;

use super::figures::Family;

/// What a dance of one clip is like.
#[derive(Debug, Clone)]
pub struct Style {
    pub name: &'static str,
    /// Range of tempi, beats a minute.
    tempo: (f64, f64),
    /// Share by which the tempo breathes.
    pub rubato: f64,
    /// Beats in a bar.
    pub bar: f64,
    /// Half the distance between the ankles in the resting stance, cm.
    pub half_stance: f64,
    /// Turn-out of each foot, rad.
    pub turnout: f64,
    /// Length of a step, cm.
    pub step: f64,
    /// How far the pelvis hangs below straight legs, cm.
    pub bend: f64,
    /// Depth of a plie, cm.
    pub depth: f64,
    /// Scale of trunk bends.
    pub trunk: f64,
    /// Scale of arm poses: 1 goes to the full pose.
    pub arms: f64,
    /// How often arm figures follow the feet's figure (else drawn freely).
    pub coupling: f64,
    /// Weight of each of the [`FAMILIES`].
    families: [f64; FAMILIES.len()],
}

/// The families of figures, as styles weigh them.
const FAMILIES: [Family; 5] = [
    Family::Steps,
    Family::Turns,
    Family::Sways,
    Family::Jumps,
    Family::Gestures,
];

/// The styles, in the order in which clips take turns.
const STYLES: [Style; 6] = [
    Style {
        name: "waltz",
        tempo: (92.0, 118.0),
        rubato: 0.05,
        bar: 3.0,
        half_stance: 8.0,
        turnout: 0.2,
        step: 54.0,
        bend: 0.5,
        depth: 8.0,
        trunk: 0.8,
        arms: 0.9,
        coupling: 0.93,
        families: [4.0, 3.0, 1.5, 0.2, 0.8],
    },
    Style {
        name: "lyrical",
        tempo: (76.0, 98.0),
        rubato: 0.12,
        bar: 4.0,
        half_stance: 9.0,
        turnout: 0.3,
        step: 60.0,
        bend: 0.5,
        depth: 14.0,
        trunk: 1.2,
        arms: 1.0,
        coupling: 0.88,
        families: [4.0, 2.5, 1.8, 0.6, 2.0],
    },
    Style {
        name: "contemporary",
        tempo: (84.0, 120.0),
        rubato: 0.15,
        bar: 4.0,
        half_stance: 11.0,
        turnout: 0.15,
        step: 64.0,
        bend: 2.0,
        depth: 22.0,
        trunk: 1.5,
        arms: 1.0,
        coupling: 0.82,
        families: [4.0, 2.5, 1.8, 1.2, 1.8],
    },
    Style {
        name: "jazz",
        tempo: (104.0, 132.0),
        rubato: 0.02,
        bar: 4.0,
        half_stance: 11.0,
        turnout: 0.1,
        step: 50.0,
        bend: 1.0,
        depth: 12.0,
        trunk: 1.0,
        arms: 1.0,
        coupling: 0.90,
        families: [4.0, 2.5, 1.5, 1.5, 1.5],
    },
    Style {
        name: "folk",
        tempo: (96.0, 120.0),
        rubato: 0.02,
        bar: 4.0,
        half_stance: 8.0,
        turnout: 0.12,
        step: 46.0,
        bend: 0.5,
        depth: 8.0,
        trunk: 0.6,
        arms: 0.85,
        coupling: 0.95,
        families: [4.0, 2.0, 1.0, 2.0, 1.0],
    },
    Style {
        name: "adagio",
        tempo: (60.0, 78.0),
        rubato: 0.12,
        bar: 4.0,
        half_stance: 8.5,
        turnout: 0.35,
        step: 54.0,
        bend: 0.5,
        depth: 16.0,
        trunk: 1.1,
        arms: 1.0,
        coupling: 0.85,
        families: [3.0, 1.8, 2.0, 0.1, 2.5],
    },
];

impl Style {
    /// The style of the clip with this number, with some of a dancer's own variation.
    pub fn draw(number: usize, rng: &mut ChaCha12Rng) -> Self {
        let mut style = STYLES[number % STYLES.len()].clone();
        style.step *= rng.random_range(0.85..1.15);
        style.bend += rng.random_range(-0.5..1.5);
        style.depth *= rng.random_range(0.8..1.25);
        style.trunk *= rng.random_range(0.8..1.25);
        style.arms *= rng.random_range(0.88..1.0);
        style
    }

    /// A tempo of this style, beats a minute.
    pub fn draw_tempo(&self, rng: &mut ChaCha12Rng) -> f64 {
        rng.random_range(self.tempo.0..self.tempo.1)
    }

    /// A family of figures, drawn by weight.
    pub fn draw_family(&self, rng: &mut ChaCha12Rng) -> Family {
        let total: f64 = self.families.iter().sum();
        let mut left = rng.random_range(0.0..total);
        for (family, weight) in FAMILIES.into_iter().zip(self.families) {
            if left < weight {
                return family;
            }
            left -= weight;
        }
        Family::Steps
    }
}
