//! The tempo of a whole sound.

use realfft::RealFftPlanner;

use super::sound::FRAME_RATE;
use super::spectrum::hann;

/// Tempo that a sound without any onset has and to which others are drawn, beats a minute.
pub const START: f64 = 100.0;
/// Frames of a window: 8 seconds.
const WINDOW: usize = 240;
/// Long enough that the window's end does not come round to its beginning.
const TRANSFORM: usize = 2 * WINDOW;
/// Tempi from here on are too fast, beats a minute.
const TOO_FAST: f64 = 320.0;

/// A sound's tempo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tempo {
    /// Frames of a beat.
    pub period: usize,
    /// Beats a minute: 1800 / period.
    pub bpm: f64,
}

impl Tempo {
    fn of_period(period: usize) -> Self {
        Self {
            period,
            bpm: 60.0 * FRAME_RATE / period as f64,
        }
    }
}

/// The tempo of an onset envelope (librosa's `feature.tempo` with `start_bpm=100`): the lag r of
/// the mean local autocorrelation with the largest ln(1 + 1e6 r) - 0.5 (log2(tempo / 100))^2.
#[must_use]
pub fn tempo(onset: &[f64]) -> Tempo {
    let correlation = mean_autocorrelation(onset);
    let score = |lag: usize| {
        let octaves = (Tempo::of_period(lag).bpm / START).log2();
        (1e6 * correlation[lag]).ln_1p() - 0.5 * octaves * octaves
    };
    let lags = (1..WINDOW).filter(|&lag| Tempo::of_period(lag).bpm < TOO_FAST);
    let mut scored = lags.map(|lag| (lag, score(lag)));
    let first = scored.next().unwrap_or((WINDOW, f64::NEG_INFINITY));
    // Of equal lags the first.
    let best = scored.fold(
        first,
        |best, next| if next.1 > best.1 { next } else { best },
    );
    Tempo::of_period(best.0)
}

/// The mean over the frames of the autocorrelation of the 8 seconds around each, lags 0 to 239,
/// each divided by its largest absolute value (librosa's `tempogram`).
fn mean_autocorrelation(onset: &[f64]) -> [f64; WINDOW] {
    let mut mean = [0.0; WINDOW];
    let padded = ramped(onset);
    let hann = hann(WINDOW);
    let mut planner = RealFftPlanner::new();
    let forward = planner.plan_fft_forward(TRANSFORM);
    let inverse = planner.plan_fft_inverse(TRANSFORM);
    let mut values = forward.make_input_vec();
    let mut spectrum = forward.make_output_vec();
    let mut forward_scratch = forward.make_scratch_vec();
    let mut inverse_scratch = inverse.make_scratch_vec();
    for window in padded.windows(WINDOW).take(onset.len()) {
        values.fill(0.0);
        for ((into, onset), weight) in values.iter_mut().zip(window).zip(&hann) {
            *into = onset * weight;
        }
        let there = forward.process_with_scratch(&mut values, &mut spectrum, &mut forward_scratch);
        spectrum.iter_mut().for_each(|x| *x = x.norm_sqr().into());
        let back = inverse.process_with_scratch(&mut spectrum, &mut values, &mut inverse_scratch);
        // Their only errors are lengths other than their own, and a spectrum of no real numbers.
        debug_assert!(there.is_ok() && back.is_ok());
        let lags = &values[..WINDOW];
        let largest = lags.iter().fold(0.0, |most: f64, lag| most.max(lag.abs()));
        if largest > f64::from(f32::MIN_POSITIVE) * TRANSFORM as f64 {
            for (mean, lag) in mean.iter_mut().zip(lags) {
                *mean += lag / largest / onset.len() as f64;
            }
        }
    }
    mean
}

/// With half a window at both ends in which it goes to 0 in a straight line.
fn ramped(onset: &[f64]) -> Vec<f64> {
    const HALF: usize = WINDOW / 2;
    let ramp = |edge: f64| (0..HALF).map(move |k| edge * k as f64 / HALF as f64);
    let first = onset.first().copied().unwrap_or(0.0);
    let last = onset.last().copied().unwrap_or(0.0);
    let middle = onset.iter().copied();
    ramp(first).chain(middle).chain(ramp(last).rev()).collect()
}
