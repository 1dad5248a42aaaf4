//! Power spectra of frames that follow each other.

use std::f64::consts::TAU;
use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{RealFftPlanner, RealToComplex};

use super::sound::HOP;

/// Samples of a frame's window.
pub const WINDOW: usize = 2048;
/// Frequencies of a spectrum, from 0 to half the sampling rate.
pub const BINS: usize = WINDOW / 2 + 1;

/// The power spectra of a sound's frames, one after another.
///
/// Frame k is the window of 2,048 samples around sample 735 k, zeros where it reaches beyond the
/// sound, times the periodic Hann window 0.5 - 0.5 cos(2 pi n / 2048): librosa's `stft` with
/// `center=True, pad_mode="constant"`, squared. Other windows and centres may be asked for.
pub struct PowerSpectra<'a, S = f32> {
    samples: &'a [S],
    hann: Vec<f64>,
    transform: Arc<dyn RealToComplex<f64>>,
    windowed: Vec<f64>,
    spectrum: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
    power: Vec<f64>,
}

impl<'a, S: Copy + Into<f64>> PowerSpectra<'a, S> {
    /// Of samples at 22,050 Hz.
    #[must_use]
    pub fn new(samples: &'a [S]) -> Self {
        Self::with_window(samples, WINDOW)
    }

    /// The same through windows of another, even length.
    #[must_use]
    pub fn with_window(samples: &'a [S], length: usize) -> Self {
        let transform = RealFftPlanner::new().plan_fft_forward(length);
        Self {
            samples,
            hann: hann(length),
            windowed: transform.make_input_vec(),
            spectrum: transform.make_output_vec(),
            scratch: transform.make_scratch_vec(),
            power: vec![0.0; length / 2 + 1],
            transform,
        }
    }

    /// The squared magnitudes of a frame's frequencies.
    pub fn of(&mut self, frame: usize) -> &[f64] {
        self.around(frame * HOP)
    }

    /// The squared magnitudes of the frequencies around a sample.
    pub fn around(&mut self, centre: usize) -> &[f64] {
        let half = self.hann.len() / 2;
        for (k, (into, weight)) in self.windowed.iter_mut().zip(&self.hann).enumerate() {
            let sample = (centre + k).checked_sub(half);
            let sample = sample.and_then(|at| self.samples.get(at));
            *into = weight * sample.map_or(0.0, |&sample| sample.into());
        }
        let (input, output) = (&mut self.windowed, &mut self.spectrum);
        let done = self
            .transform
            .process_with_scratch(input, output, &mut self.scratch);
        // Its only errors are lengths other than those that it made itself.
        debug_assert!(done.is_ok());
        for (power, value) in self.power.iter_mut().zip(&self.spectrum) {
            *power = value.norm_sqr();
        }
        &self.power
    }
}

/// The periodic Hann window.
pub(super) fn hann(length: usize) -> Vec<f64> {
    let angle = |n: usize| TAU * n as f64 / length as f64;
    (0..length).map(|n| 0.5 - 0.5 * angle(n).cos()).collect()
}
