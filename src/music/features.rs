//! The numbers of a frame that a model hears.

use std::fmt;

use ndarray::{Array2, ArrayView2, Axis, aview1, concatenate};
use serde::{Deserialize, Serialize};

use super::analysis::Analysis;
use super::chroma::PITCH_CLASSES;
use super::mel::BANDS;
use super::mfcc::COEFFICIENTS;

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
}

impl FeatureSet {
    /// Numbers of a frame.
    #[must_use]
    pub fn numbers(self) -> usize {
        match self {
            Self::Paper15 => PITCH_CLASSES + 3,
            Self::Fact35 => 1 + COEFFICIENTS + PITCH_CLASSES + 2,
            Self::Mel128 => BANDS,
        }
    }

    /// What stands in the columns, in their order.
    #[must_use]
    pub fn columns(self) -> &'static str {
        match self {
            Self::Paper15 => "12 chroma from C, beat, downbeat, onset strength",
            Self::Fact35 => "onset strength, 20 MFCC, 12 chroma from C, onset peak, beat",
            Self::Mel128 => "128 mel bands, dB",
        }
    }
}

impl fmt::Display for FeatureSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Paper15 => "paper15",
            Self::Fact35 => "fact35",
            Self::Mel128 => "mel128",
        })
    }
}

impl Analysis {
    /// The features of every frame [F, numbers], not standardised.
    ///
    /// In `paper15` beat and downbeat are exp(-0.5 d^2), d the frames to the nearest one; in
    /// `fact35` peak and beat are 1 in their frames and 0 elsewhere.
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
        }
    }
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
