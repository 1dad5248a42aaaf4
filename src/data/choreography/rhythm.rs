//! Tempo: from beats to frames, with the slight breathing of a dancer who counts.

use rand::RngExt;
use rand_chacha::ChaCha12Rng;

/// Frames a second of every generated clip.
pub const FRAME_RATE: f64 = 30.0;

/// The frame of every beat.
#[derive(Debug, Clone)]
pub struct Rhythm {
    /// Frames per beat on average.
    beat: f64,
    /// Share by which the tempo swells and ebbs.
    rubato: f64,
    /// Beats in one swell.
    phrase: f64,
    phase: f64,
}

impl Rhythm {
    /// A rhythm of about `bpm` beats a minute, its tempo swelling by up to `rubato` (a share of the
    /// tempo).
    pub fn new(bpm: f64, rubato: f64, rng: &mut ChaCha12Rng) -> Self {
        Self {
            beat: 60.0 * FRAME_RATE / bpm,
            rubato: rubato * rng.random_range(0.3..1.0),
            phrase: f64::from(rng.random_range(12u8..24)),
            phase: rng.random_range(0.0..std::f64::consts::TAU),
        }
    }

    /// The frame of a beat (beats may be fractions), a whole number: events fall on frames.
    pub fn frame(&self, beat: f64) -> f64 {
        let turn = std::f64::consts::TAU / self.phrase;
        let swell = ((turn * beat + self.phase).sin() - self.phase.sin()) / turn;
        (self.beat * (beat + self.rubato * swell)).round()
    }

    /// Frames in a beat on average.
    pub fn beat(&self) -> f64 {
        self.beat
    }
}
