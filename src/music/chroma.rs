//! How much of each of the twelve pitch classes sounds.

use ndarray::Array2;

use super::sound::RATE;
use super::spectrum::{BINS, WINDOW};

/// Pitch classes: C, C sharp, .. B.
pub const PITCH_CLASSES: usize = 12;
/// The A of 27.5 Hz, from which octaves are counted.
const LOWEST_A: f64 = 27.5;
/// Where A is when C is row 0.
const ROWS_TO_C: usize = 3;

/// The weights [12, 1025] of frequencies in pitch classes, tuned to A = 440 Hz (librosa's
/// `filters.chroma` with `tuning=0`).
pub struct ChromaFilters(Array2<f64>);

impl Default for ChromaFilters {
    fn default() -> Self {
        Self::new()
    }
}

impl ChromaFilters {
    #[must_use]
    pub fn new() -> Self {
        let pitch = |bin: usize| {
            let frequency = bin as f64 * f64::from(RATE) / WINDOW as f64;
            12.0 * (frequency / LOWEST_A).log2()
        };
        // The frequency 0 has no pitch: 1.5 octaves below the next.
        let pitch = |bin: usize| match bin {
            0 => pitch(1) - 18.0,
            bin => pitch(bin),
        };
        let mut weights = Array2::zeros((PITCH_CLASSES, BINS));
        for (bin, mut column) in weights.columns_mut().into_iter().enumerate() {
            let width = (pitch(bin + 1) - pitch(bin)).max(1.0);
            let nearness = |class: usize| {
                let distance = (pitch(bin) - class as f64 + 126.0).rem_euclid(12.0) - 6.0;
                (-0.5 * (2.0 * distance / width).powi(2)).exp()
            };
            let norm = (0..PITCH_CLASSES).map(|class| nearness(class).powi(2));
            let norm = norm.sum::<f64>().sqrt();
            let octave = (-0.5 * ((pitch(bin) / 12.0 - 5.0) / 2.0).powi(2)).exp();
            for (row, weight) in column.iter_mut().enumerate() {
                *weight = nearness((row + ROWS_TO_C) % PITCH_CLASSES) / norm * octave;
            }
        }
        Self(weights)
    }

    /// The twelve numbers of a spectrum of 1,025 frequencies, divided by the largest of them; all
    /// zero stays zero (librosa's `chroma_stft`).
    #[must_use]
    pub fn apply(&self, power: &[f64]) -> [f64; PITCH_CLASSES] {
        let mut chroma = [0.0; PITCH_CLASSES];
        for (class, weights) in chroma.iter_mut().zip(self.0.rows()) {
            *class = power.iter().zip(weights).map(|(x, w)| x * w).sum();
        }
        let largest = chroma.iter().copied().fold(0.0, f64::max);
        // Below it librosa, whose numbers are f32, divides by nothing either.
        if largest >= f64::from(f32::MIN_POSITIVE) {
            chroma.iter_mut().for_each(|class| *class /= largest);
        }
        chroma
    }
}
