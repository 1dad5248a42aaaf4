//! The mel spectrum in decibels.

use ndarray::Array2;

use super::sound::RATE;
use super::spectrum::{BINS, WINDOW};

/// Bands of the mel spectrum.
pub const BANDS: usize = 128;
/// Power below which a band counts as this.
pub(super) const LEAST_POWER: f64 = 1e-10;
/// How far below a file's loudest band the quietest can be, dB.
pub(super) const RANGE: f64 = 80.0;

/// Slaney's mel filters (librosa's `filters.mel`): edges equally spaced in mel from 0 Hz on, two
/// more than bands; triangle i rises from edge i to edge i + 1, falls to edge i + 2, and has the
/// area 1.
pub struct MelFilters {
    /// The first frequency of each triangle, and its weights from there.
    triangles: Vec<(usize, Vec<f64>)>,
}

impl Default for MelFilters {
    fn default() -> Self {
        Self::new()
    }
}

impl MelFilters {
    /// 128 bands up to 11,025 Hz.
    #[must_use]
    pub fn new() -> Self {
        Self::up_to(BANDS, f64::from(RATE) / 2.0)
    }

    /// So many bands up to a frequency, Hz.
    #[must_use]
    pub fn up_to(bands: usize, hertz: f64) -> Self {
        let top = to_mel(hertz);
        let edge = |i: usize| to_hertz(top * i as f64 / (bands + 1) as f64);
        let triangle = |band: usize| {
            let (low, middle, high) = (edge(band), edge(band + 1), edge(band + 2));
            let weight = |bin: usize| {
                let frequency = bin as f64 * f64::from(RATE) / WINDOW as f64;
                let rise = (frequency - low) / (middle - low);
                let fall = (high - frequency) / (high - middle);
                rise.min(fall).max(0.0) * 2.0 / (high - low)
            };
            let first = (0..BINS).find(|&bin| weight(bin) > 0.0).unwrap_or(0);
            let weights = (first..BINS).map(weight);
            (first, weights.take_while(|&weight| weight > 0.0).collect())
        };
        Self {
            triangles: (0..bands).map(triangle).collect(),
        }
    }

    /// The power in each of the bands of a spectrum of 1,025 frequencies.
    pub fn apply<'a>(&'a self, power: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.triangles.iter().map(|(first, weights)| {
            let below = power.get(*first..).unwrap_or_default();
            below.iter().zip(weights).map(|(x, w)| x * w).sum()
        })
    }
}

/// Turns powers [frames, 128] into decibels, 10 log10(max(power, 1e-10)), at least the maximum of
/// the whole file minus 80 (librosa's `power_to_db`).
pub fn to_decibels(power: &mut Array2<f64>) {
    power.mapv_inplace(|x| 10.0 * x.max(LEAST_POWER).log10());
    let floor = power.iter().copied().fold(f64::NEG_INFINITY, f64::max) - RANGE;
    power.mapv_inplace(|x| x.max(floor));
}

/// Slaney's scale: linear below 1,000 Hz, logarithmic above.
fn to_mel(hertz: f64) -> f64 {
    if hertz < 1000.0 {
        3.0 * hertz / 200.0
    } else {
        15.0 + 27.0 * (hertz / 1000.0).ln() / 6.4_f64.ln()
    }
}

fn to_hertz(mel: f64) -> f64 {
    if mel < 15.0 {
        mel * 200.0 / 3.0
    } else {
        1000.0 * ((mel - 15.0) * 6.4_f64.ln() / 27.0).exp()
    }
}
