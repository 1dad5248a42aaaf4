//! What is heard every twentieth of a second (Valle-Pérez et al. 2021, section 4.1; spec, section
//! 3): a finer-banded loudness of the moment, and how much louder eight bands became about it.

use ndarray::{Array2, ArrayView2, Axis};
use serde::{Deserialize, Serialize};

use super::mel::{LEAST_POWER, MelFilters, RANGE};
use super::sound::RATE;
use super::spectrum::{PowerSpectra, WINDOW};

/// Frames a second.
pub const FRAME_RATE: f64 = 20.0;
/// Bands of the mel spectrum.
pub const MEL_BANDS: usize = 80;
/// Hz, where the highest of them ends.
const MEL_TOP: f64 = 10_000.0;
/// Bands whose rise is followed.
pub const FLUX_BANDS: usize = 8;
/// Their edges, Hz.
const FLUX_EDGES: [f64; FLUX_BANDS + 1] = [
    0.0, 100.0, 200.0, 400.0, 800.0, 1_600.0, 3_200.0, 6_400.0, 10_000.0,
];
/// Samples of the window that hears a rise.
const FLUX_WINDOW: usize = 1024;
/// Rises are heard this many times a frame.
const FLUX_STEPS: usize = 5;
/// Rises so many steps before and after a frame are the frame's, too.
const FLUX_REACH: usize = 2;

/// Numbers of F frames of 1/20 s; frame k is centred on sample floor(1102.5 k + 0.5), and all are
/// there whose centre lies in the sound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Twentieths<T = f32> {
    /// 80 Slaney bands from 0 to 10 kHz, dB below the file's loudest, at least -80, `[F, 80]`.
    pub mel: Array2<T>,
    /// log(1 + x), x the largest rise (dB in 10 ms) of a band within 20 ms of the frame, `[F, 8]`;
    /// bands end at 100, 200, 400, 800, 1,600, 3,200, 6,400 and 10,000 Hz.
    pub flux: Array2<T>,
}

impl Twentieths<f64> {
    /// Of samples at 22,050 Hz.
    #[must_use]
    pub fn of<S: Copy + Into<f64>>(samples: &[S]) -> Self {
        Self {
            mel: mel(samples),
            flux: flux(samples),
        }
    }

    /// In f32.
    #[must_use]
    pub fn single(&self) -> Twentieths {
        Twentieths {
            mel: self.mel.mapv(|x| x as f32),
            flux: self.flux.mapv(|x| x as f32),
        }
    }
}

/// How many frames of 1/20 s have their centre in so many samples.
#[must_use]
pub fn twentieths(samples: usize) -> usize {
    frames_inside(samples, FRAME_RATE)
}

/// Onset strength of each frame of mel decibels [frames, bands]: the mean over the bands of what
/// they rose from the frame before, falls left out; 0 in frame 0.
#[must_use]
pub fn rises(decibels: ArrayView2<'_, f64>) -> Vec<f64> {
    let rise = |pair: ArrayView2<'_, f64>| {
        let rises = pair.row(1).into_iter().zip(pair.row(0));
        rises
            .map(|(now, before)| (now - before).max(0.0))
            .sum::<f64>()
            / pair.ncols() as f64
    };
    let pairs = decibels.axis_windows(Axis(0), 2).into_iter().map(rise);
    let first = decibels.rows().into_iter().take(1).map(|_| 0.0);
    first.chain(pairs).collect()
}

/// `[F, 80]`, dB.
fn mel<S: Copy + Into<f64>>(samples: &[S]) -> Array2<f64> {
    let filters = MelFilters::up_to(MEL_BANDS, MEL_TOP);
    let mut spectra = PowerSpectra::with_window(samples, WINDOW);
    let mut mel = Array2::zeros((twentieths(samples.len()), MEL_BANDS));
    for (frame, mut row) in mel.rows_mut().into_iter().enumerate() {
        let power = spectra.around(centre(frame, FRAME_RATE));
        row.iter_mut()
            .zip(filters.apply(power))
            .for_each(|(into, band)| *into = band);
    }
    below_the_loudest(&mut mel);
    mel
}

/// `[F, 8]`.
fn flux<S: Copy + Into<f64>>(samples: &[S]) -> Array2<f64> {
    let rate = FRAME_RATE * FLUX_STEPS as f64;
    let mut spectra = PowerSpectra::with_window(samples, FLUX_WINDOW);
    let band_of = |bin: usize| {
        let hertz = bin as f64 * f64::from(RATE) / FLUX_WINDOW as f64;
        FLUX_EDGES
            .windows(2)
            .position(|edges| (edges[0]..edges[1]).contains(&hertz))
    };
    let bands: Vec<Option<usize>> = (0..=FLUX_WINDOW / 2).map(band_of).collect();
    let mut loudness = Array2::zeros((frames_inside(samples.len(), rate), FLUX_BANDS));
    for (step, mut row) in loudness.rows_mut().into_iter().enumerate() {
        let power = spectra.around(centre(step, rate));
        for (power, band) in power.iter().zip(&bands) {
            if let Some(band) = band {
                row[*band] += power;
            }
        }
    }
    below_the_loudest(&mut loudness);
    let steps = loudness.nrows();
    let rise = |step: usize, band: usize| match step {
        0 => 0.0,
        _ => (loudness[[step, band]] - loudness[[step - 1, band]]).max(0.0),
    };
    Array2::from_shape_fn((twentieths(samples.len()), FLUX_BANDS), |(frame, band)| {
        let middle = FLUX_STEPS * frame;
        let around = middle.saturating_sub(FLUX_REACH)..(middle + FLUX_REACH + 1).min(steps);
        around
            .map(|step| rise(step, band))
            .fold(0.0, f64::max)
            .ln_1p()
    })
}

/// The sample that a frame is centred on.
fn centre(frame: usize, rate: f64) -> usize {
    (f64::from(RATE) / rate * frame as f64 + 0.5).floor() as usize
}

/// How many frames have their centre in so many samples.
fn frames_inside(samples: usize, rate: f64) -> usize {
    let about = (samples as f64 * rate / f64::from(RATE)) as usize + 2;
    (0..about)
        .rev()
        .find(|&frame| centre(frame, rate) < samples)
        .map_or(0, |last| last + 1)
}

/// Turns powers into decibels below the largest, at least -80.
fn below_the_loudest(power: &mut Array2<f64>) {
    power.mapv_inplace(|x| 10.0 * x.max(LEAST_POWER).log10());
    let loudest = power.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    power.mapv_inplace(|x| (x - loudest).max(-RANGE));
}
