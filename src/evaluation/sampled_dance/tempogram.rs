//! Tempograms (figure 3): how strongly a curve repeats itself at each tempo, over time.
//!
//! By local autocorrelation, as the tempograms of Davis and Agrawala (2018) that the paper names: a
//! curve that repeats every beat does so every two and three beats, too, so a tempo shows at its
//! half and third, not at its double.

use ndarray::{Array2, Axis};

use super::kinematic_beats::KinematicBeat;

/// Length of a window, seconds.
const WINDOW: f64 = 8.0;
/// From one window's middle to the next, seconds.
const EVERY: f64 = 0.5;
/// Tempi, beats a minute: first, last and step.
const SLOWEST: u32 = 30;
const FASTEST: u32 = 240;
const STEP: usize = 5;
/// Standard deviation of a beat's pulse, seconds.
const PULSE: f64 = 0.05;
/// A share of a window's energy about its mean that is rounding alone.
const ROUNDING: f64 = 1e-12;

/// Strength of tempi over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Tempogram {
    /// Middles of the windows, seconds, ascending.
    pub times: Vec<f64>,
    /// Beats a minute, 30 to 240, ascending.
    pub tempi: Vec<f64>,
    /// Autocorrelation in a window at a tempo's lag, `[times, tempi]`: 1 where the curve repeats
    /// exactly, about 0 where it has nothing to do with itself, below 0 where it alternates.
    pub strength: Array2<f64>,
}

impl Tempogram {
    /// That of a curve, `[frames]`, at `rate` a second: onset strength, or the pulses of beats.
    ///
    /// Windows of 8 s (Hann) stand every half second and end where the curve ends. A window's
    /// weighted mean is taken off, products at a lag are divided by the products of the weights
    /// there, and lags between frames are interpolated. None of a curve shorter than a window, or
    /// under 8 frames a second, where the fastest tempo has a lag of fewer than two.
    #[must_use]
    pub fn of(curve: &[f64], rate: f64) -> Option<Self> {
        let frames = curve.len() as f64;
        let has_lags = rate * 60.0 / f64::from(FASTEST) >= 2.0;
        if !has_lags || frames < WINDOW * rate {
            return None;
        }
        let tempi: Vec<f64> = (SLOWEST..=FASTEST).step_by(STEP).map(f64::from).collect();
        let windows = (frames / rate / EVERY) as usize;
        let times: Vec<f64> = (0..=windows).map(|at| at as f64 * EVERY).collect();
        let mut strength = Vec::with_capacity(times.len() * tempi.len());
        for time in &times {
            let window = Window::around(curve, time * rate, WINDOW * rate / 2.0);
            // Each lag is that of several tempi.
            let most = (60.0 * rate / f64::from(SLOWEST)).ceil() as usize;
            let lags: Vec<f64> = (0..=most + 1).map(|lag| window.at(lag)).collect();
            strength.extend(tempi.iter().map(|tempo| {
                let lag = 60.0 * rate / tempo;
                let (whole, part) = (lag as usize, lag.fract());
                let at = |lag: usize| lags.get(lag).copied().unwrap_or(0.0);
                at(whole) * (1.0 - part) + at(whole + 1) * part
            }));
        }
        let strength = Array2::from_shape_vec((times.len(), tempi.len()), strength).ok()?;
        Some(Self {
            times,
            tempi,
            strength,
        })
    }

    /// Strength at each tempo, a mean over time, `[tempi]`.
    #[must_use]
    pub fn mean_strength(&self) -> Vec<f64> {
        let mean = self.strength.mean_axis(Axis(0));
        mean.map_or_else(Vec::new, |mean| mean.to_vec())
    }
}

/// The curve of a dance's beats, `[frames]`: a Gaussian pulse of 0.05 s at each, as high as the
/// body falls fast there, cm/s.
#[must_use]
pub fn beat_curve(beats: &[KinematicBeat], frames: usize, fps: f64) -> Vec<f64> {
    let height = |frame: usize| {
        let pulse = |beat: &KinematicBeat| {
            let distance = (frame as f64 / fps - beat.time) / PULSE;
            beat.velocity.abs() * (-0.5 * distance.powi(2)).exp()
        };
        beats.iter().map(pulse).sum()
    };
    (0..frames).map(height).collect()
}

/// A piece of a curve about its mean.
struct Window {
    weights: Vec<f64>,
    /// Weighted.
    values: Vec<f64>,
    /// Those at lag 0: sum of squares of the values, and of the weights.
    energy: f64,
    squares: f64,
}

impl Window {
    /// The frames less than `half` from `middle`.
    fn around(curve: &[f64], middle: f64, half: f64) -> Self {
        let first = (middle - half).max(0.0) as usize;
        let end = ((middle + half).ceil() as usize).min(curve.len());
        let piece = curve.get(first..end).unwrap_or_default();
        let weight = |at: usize| {
            let distance = ((first + at) as f64 - middle).abs().min(half);
            0.5 + 0.5 * (std::f64::consts::PI * distance / half).cos()
        };
        let weights: Vec<f64> = (0..piece.len()).map(weight).collect();
        let weighted = || piece.iter().zip(&weights);
        let mean = weighted().map(|(x, w)| x * w).sum::<f64>() / weights.iter().sum::<f64>();
        let values: Vec<f64> = weighted().map(|(x, w)| (x - mean) * w).collect();
        let whole: f64 = weighted().map(|(x, w)| (x * w).powi(2)).sum();
        let energy: f64 = values.iter().map(|x| x * x).sum();
        Self {
            squares: weights.iter().map(|w| w * w).sum(),
            energy: if energy <= ROUNDING * whole {
                0.0
            } else {
                energy
            },
            values,
            weights,
        }
    }

    /// Autocorrelation at a lag in frames; 0 of a constant piece, and of one that is too short.
    fn at(&self, lag: usize) -> f64 {
        let product = |of: &[f64]| -> f64 {
            let later = of.iter().skip(lag);
            of.iter().zip(later).map(|(a, b)| a * b).sum()
        };
        let (shared, weights) = (product(&self.values), product(&self.weights));
        // What is left of few products tells nothing.
        match self.energy == 0.0 || weights <= ROUNDING * self.squares {
            true => 0.0,
            false => shared / self.energy * self.squares / weights,
        }
    }
}
