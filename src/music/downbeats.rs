//! Which beats are first in their bar.

use ndarray::{ArrayView2, Axis};

use super::chroma::PITCH_CLASSES;

/// Beats from which on the metre is heard, not assumed.
const ENOUGH: usize = 8;

/// Beats of a bar, and the first beat that begins one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metre {
    pub beats: usize,
    pub phase: usize,
}

impl Metre {
    /// Of beats, the downbeats.
    #[must_use]
    pub fn downbeats(&self, beats: &[usize]) -> Vec<usize> {
        let own = beats.iter().skip(self.phase);
        own.step_by(self.beats.max(1)).copied().collect()
    }
}

/// The metre, 3 or 4, and phase whose downbeats are the most accented: those with the largest
/// (mean accent inside - mean accent outside) / sqrt(var (1 / n_in + 1 / n_out)); of equal ones the
/// smaller metre, then phase. 4 and 0 where there are fewer than 8 beats.
///
/// A beat's accent is how loud its onset is (the most of three frames) and how much the chord
/// changes with it (1 - the cosine of the mean chroma before and behind it), each as a z-score.
/// `onset` and `chroma`, frames x 12, have the same frames, `beats` ascends among them.
#[must_use]
pub fn metre(onset: &[f64], chroma: ArrayView2<'_, f64>, beats: &[usize]) -> Metre {
    let mut best = Metre { beats: 4, phase: 0 };
    if beats.len() < ENOUGH {
        return best;
    }
    let accents = accents(onset, chroma, beats);
    let mut most = f64::NEG_INFINITY;
    for beats in [3, 4] {
        for phase in 0..beats {
            let score = contrast(&accents, beats, phase);
            if score > most {
                (best, most) = (Metre { beats, phase }, score);
            }
        }
    }
    best
}

fn accents(onset: &[f64], chroma: ArrayView2<'_, f64>, beats: &[usize]) -> Vec<f64> {
    let loudness = |&beat: &usize| {
        let end = (beat + 2).min(onset.len());
        let around = onset.get(beat.saturating_sub(1)..end).unwrap_or_default();
        around.iter().copied().fold(0.0, f64::max)
    };
    let mut loud: Vec<f64> = beats.iter().map(loudness).collect();
    let ends = beats.iter().copied().chain([chroma.nrows()]);
    let starts = [0].into_iter().chain(beats.iter().copied());
    let chords: Vec<_> = starts
        .zip(ends)
        .map(|(start, end)| mean_chroma(chroma, start, end))
        .collect();
    let mut changes: Vec<f64> = chords
        .windows(2)
        .map(|pair| 1.0 - cosine(&pair[0], &pair[1]))
        .collect();
    // What is before the first beat is no bar's end.
    if let Some(first) = changes.first_mut() {
        *first = 0.0;
    }
    standardise(&mut loud);
    standardise(&mut changes);
    loud.iter().zip(changes).map(|(a, b)| a + b).collect()
}

fn mean_chroma(chroma: ArrayView2<'_, f64>, start: usize, end: usize) -> [f64; PITCH_CLASSES] {
    let mut mean = [0.0; PITCH_CLASSES];
    let span = chroma.axis_iter(Axis(0)).take(end).skip(start);
    for frame in span {
        for (mean, value) in mean.iter_mut().zip(frame) {
            *mean += value;
        }
    }
    let frames = end.saturating_sub(start).max(1) as f64;
    mean.map(|sum| sum / frames)
}

/// 0 where one of them is nothing.
fn cosine(a: &[f64], b: &[f64]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let norms = (dot(a, a) * dot(b, b)).sqrt();
    if norms > 0.0 { dot(a, b) / norms } else { 0.0 }
}

/// Mean and variance, of the population.
fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    (mean, squares / count)
}

/// Z-scores; all 0 where all are the same.
fn standardise(values: &mut [f64]) {
    let (mean, variance) = moments(values);
    let deviation = variance.sqrt();
    for value in values {
        *value = if deviation > 0.0 {
            (*value - mean) / deviation
        } else {
            0.0
        };
    }
}

fn contrast(accents: &[f64], beats: usize, phase: usize) -> f64 {
    let (inside, outside): (Vec<_>, Vec<_>) = accents
        .iter()
        .enumerate()
        .partition(|(beat, _)| beat % beats == phase);
    let mean = |part: &[(usize, &f64)]| {
        part.iter().map(|(_, accent)| **accent).sum::<f64>() / part.len() as f64
    };
    let (_, variance) = moments(accents);
    let shares = 1.0 / inside.len() as f64 + 1.0 / outside.len() as f64;
    let spread = (variance * shares).sqrt();
    if spread > 0.0 {
        (mean(&inside) - mean(&outside)) / spread
    } else {
        0.0
    }
}
