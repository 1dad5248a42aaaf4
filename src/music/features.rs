//! The numbers of a frame that a model hears.

use std::fmt;

use ndarray::{Array2, ArrayView2, Axis, aview1, concatenate};
use serde::{Deserialize, Serialize};

use super::analysis::Analysis;
use super::chroma::PITCH_CLASSES;
use super::mel::BANDS;
use super::mfcc::COEFFICIENTS;
use super::sound::FRAME_RATE;
use super::twentieths::{self, FLUX_BANDS, MEL_BANDS, rises};

/// Standard deviation of what a beat is in [`beat_curve`], s.
const BEAT_WIDTH: f64 = 0.05;
/// Onset strengths that vary less do not vary.
const LEAST_DEVIATION: f64 = 1e-6;

/// Which features, and in which order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum FeatureSet {
    /// 12 chroma, nearness of a beat, nearness of a downbeat, onset strength (Pu and Shan 2022)
    #[default]
    Paper15,
    /// Onset strength, 20 MFCC, 12 chroma, onset peaks, beats (Li et al. 2021, AI Choreographer)
    Fact35,
    /// 128 bands of the mel spectrum, dB
    Mel128,
    /// At 20 frames a second: 80 mel bands, onset strength, nearness of a beat and of a downbeat,
    /// 8-band flux, of which a model takes two principal components (Valle-Perez et al. 2021)
    Transflower91,
    /// At 20 frames a second: onset strength, standardised, and nearness of a beat
    #[serde(rename = "onset_beats")]
    #[cfg_attr(feature = "cli", value(name = "onset_beats"))]
    OnsetBeats,
}

impl FeatureSet {
    /// Numbers of a frame.
    #[must_use]
    pub fn numbers(self) -> usize {
        match self {
            Self::Paper15 => PITCH_CLASSES + 3,
            Self::Fact35 => 1 + COEFFICIENTS + PITCH_CLASSES + 2,
            Self::Mel128 => BANDS,
            Self::Transflower91 => MEL_BANDS + 3 + FLUX_BANDS,
            Self::OnsetBeats => 2,
        }
    }

    /// Frames a second.
    #[must_use]
    pub fn frame_rate(self) -> f64 {
        match self {
            Self::Paper15 | Self::Fact35 | Self::Mel128 => FRAME_RATE,
            Self::Transflower91 | Self::OnsetBeats => twentieths::FRAME_RATE,
        }
    }

    /// What stands in the columns, in their order.
    #[must_use]
    pub fn columns(self) -> &'static str {
        match self {
            Self::Paper15 => "12 chroma from C, beat, downbeat, onset strength",
            Self::Fact35 => "onset strength, 20 MFCC, 12 chroma from C, onset peak, beat",
            Self::Mel128 => "128 mel bands, dB",
            Self::Transflower91 => {
                "at 20 frames a second 80 mel bands, dB, onset strength, beat, downbeat, 8-band flux"
            }
            Self::OnsetBeats => "at 20 frames a second onset strength, beat",
        }
    }
}

impl fmt::Display for FeatureSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Paper15 => "paper15",
            Self::Fact35 => "fact35",
            Self::Mel128 => "mel128",
            Self::Transflower91 => "transflower91",
            Self::OnsetBeats => "onset_beats",
        })
    }
}

impl Analysis {
    /// The features of every frame [F, numbers] at the set's frame rate, not standardised.
    ///
    /// In `paper15` beat and downbeat are exp(-0.5 d^2), d the frames to the nearest one; in
    /// `fact35` peak and beat are 1 in their frames and 0 elsewhere; in those of 20 frames a second
    /// beat and downbeat are [`beat_curve`]s and the onset strength is that of
    /// [`rises`], in `onset_beats` as [`accents`].
    ///
    /// # Panics
    /// A field of the analysis was given another number of frames than the others have.
    #[must_use]
    pub fn features(&self, set: FeatureSet) -> Array2<f32> {
        let frames = self.frames();
        let onset = aview1(&self.onset).insert_axis(Axis(1));
        let near = |marks: &[usize]| column(frames, |frame| nearness(marks, frame));
        let at = |marks: &[usize]| {
            let is_one = |frame| f32::from(u8::from(marks.binary_search(&frame).is_ok()));
            column(frames, is_one)
        };
        let joined = |parts: &[ArrayView2<'_, f32>]| {
            concatenate(Axis(1), parts).expect("all parts have the analysis's frames")
        };
        let chroma = self.chroma.view();
        match set {
            FeatureSet::Paper15 => joined(&[
                chroma,
                near(&self.beats).view(),
                near(&self.downbeats).view(),
                onset,
            ]),
            FeatureSet::Fact35 => joined(&[
                onset,
                self.mfcc.view(),
                chroma,
                at(&self.onset_peaks).view(),
                at(&self.beats).view(),
            ]),
            FeatureSet::Mel128 => self.mel.clone(),
            FeatureSet::Transflower91 => joined(&[
                self.twentieths.mel.view(),
                aview1(&self.slow_onset()).insert_axis(Axis(1)),
                self.slow_curve(&self.beats).view(),
                self.slow_curve(&self.downbeats).view(),
                self.twentieths.flux.view(),
            ]),
            FeatureSet::OnsetBeats => joined(&[
                aview1(&accents(&self.slow_onset())).insert_axis(Axis(1)),
                self.slow_curve(&self.beats).view(),
            ]),
        }
    }

    /// Onset strength, 20 frames a second.
    fn slow_onset(&self) -> Vec<f32> {
        let onset = rises(self.twentieths.mel.mapv(f64::from).view());
        onset.into_iter().map(|x| x as f32).collect()
    }

    /// Nearness of some frames of 1/30 s, 20 frames a second, [F, 1].
    fn slow_curve(&self, marks: &[usize]) -> Array2<f32> {
        let times: Vec<f64> = marks.iter().map(|&mark| mark as f64 / FRAME_RATE).collect();
        let frames = self.twentieths.mel.nrows();
        let curve = beat_curve(&times, frames, twentieths::FRAME_RATE);
        column(frames, |frame| curve[frame])
    }
}

/// exp(-(t - b)^2 / (2 x 0.05^2)) at the time t of every frame, b the nearest of some ascending
/// times, s; 0 where there are none.
#[must_use]
pub fn beat_curve(times: &[f64], frames: usize, frame_rate: f64) -> Vec<f32> {
    let at = |frame: usize| {
        let time = frame as f64 / frame_rate;
        let next = times.partition_point(|&beat| beat < time);
        let around = times.iter().take(next + 1).skip(next.saturating_sub(1));
        let nearest = around.map(|beat| (beat - time).abs()).reduce(f64::min);
        nearest.map_or(0.0, |away| {
            let deviations = away / BEAT_WIDTH;
            (-0.5 * deviations * deviations).exp() as f32
        })
    };
    (0..frames).map(at).collect()
}

/// log(1 + x) of onset strengths, with mean 0 and deviation 1 over the whole sound, so that those of
/// different measures compare; 0 where they do not vary.
#[must_use]
pub fn accents(onset: &[f32]) -> Vec<f32> {
    let logarithms: Vec<f64> = onset
        .iter()
        .map(|&x| f64::from(x).max(0.0).ln_1p())
        .collect();
    let count = logarithms.len().max(1) as f64;
    let mean = logarithms.iter().sum::<f64>() / count;
    let variance = logarithms.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
    let deviation = variance.sqrt();
    let accent = |x: f64| match deviation > LEAST_DEVIATION {
        true => ((x - mean) / deviation) as f32,
        false => 0.0,
    };
    logarithms.into_iter().map(accent).collect()
}

fn column(frames: usize, value: impl Fn(usize) -> f32) -> Array2<f32> {
    Array2::from_shape_fn((frames, 1), |(frame, _)| value(frame))
}

/// exp(-0.5 d^2) of the distance to the nearest of some ascending frames, 0 where there are none.
fn nearness(marks: &[usize], frame: usize) -> f32 {
    let next = marks.partition_point(|&mark| mark < frame);
    let around = marks.iter().take(next + 1).skip(next.saturating_sub(1));
    let nearest = around.map(|mark| mark.abs_diff(frame)).min();
    nearest.map_or(0.0, |distance| {
        let distance = distance as f64;
        (-0.5 * distance * distance).exp() as f32
    })
}
