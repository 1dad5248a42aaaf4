//! The protocol `published`: LRP, AVF and ART as the evaluation program of Pan et al. 2021 counts
//! them, which the numbers of their tables come of.

use ndarray::{ArrayView2, s};

use super::scores::ScoreRow;
use super::transitions::{
    Measured, TransitionProtocol, TransitionScoring, check_window, distance, row,
};
use super::{Better, Metric};
use crate::models::ModelError;
use crate::motion::features::{FACING, POSITIONS, ROOT_POSITION, VELOCITY_FACTORS};
use crate::motion::velocity_factor::{PARTS, velocity_factors_between};

const METRICS: [Metric; 3] = [
    Metric {
        key: "lrp",
        title: "LRP",
        unit: "cm",
        better: Better::Lower,
        decimals: 2,
        about: "average L2 distance of root-relative positions and the root, both keyframes counted, cm",
    },
    Metric {
        key: "avf",
        title: "AVF",
        unit: "share of velocity factors",
        better: Better::Higher,
        decimals: 2,
        about: "share of single velocity factors (frame and body part) that are met",
    },
    Metric {
        key: "art",
        title: "ART",
        unit: "share of frames",
        better: Better::Higher,
        decimals: 2,
        about: "share of single frames on the root trajectory asked for",
    },
];

/// How the authors' program counts, against the equations of their paper
/// ([`Equations`](super::equations::Equations)):
///
/// - a window of length N has N frames, k1 = 0 and k2 = N - 1, and starts every ceil(0.1 N) frames;
/// - all N frames count, both keyframes with the true positions, root and facing;
/// - LRP is the norm over 72 numbers, p^b and p^r, instead of 69;
/// - AVF and ART are shares of single entries and frames instead of windows. The velocity factors
///   of frame 0 count as met, those of the last frame lead to the true k2.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Published(pub TransitionScoring);

/// How far one predicted window is from the recorded one, means over its N frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishedScores {
    /// `||p~ - p^||_2` over p^b and p^r, cm.
    pub position: f64,
    /// Share of the velocity factors whose error is below delta_v.
    pub velocity_factors_met: f64,
    /// Share of the frames whose root is nearer than delta_r.
    pub roots_met: f64,
}

impl TransitionProtocol for Published {
    const NAME: &'static str = "published";
    const ABOUT: &'static str = "as the authors' program counts, which their tables come of";
    const METRICS: &'static [Metric] = &METRICS;

    type Window = PublishedScores;

    fn scoring(&self) -> &TransitionScoring {
        &self.0
    }

    fn frames_of(length: usize) -> usize {
        length
    }

    fn rows(&self, measured: &Measured<PublishedScores>) -> Vec<(&'static str, ScoreRow)> {
        let of: [fn(&PublishedScores) -> f64; 3] = [
            |scores| scores.position,
            |scores| scores.velocity_factors_met,
            |scores| scores.roots_met,
        ];
        let mean = |of: fn(&PublishedScores) -> f64| {
            row(measured, |windows| {
                windows.iter().map(of).sum::<f64>() / windows.len() as f64
            })
        };
        METRICS
            .iter()
            .map(|metric| metric.key)
            .zip(of.map(mean))
            .collect()
    }

    /// Of the last predicted frame the true positions, root and facing are taken.
    fn window_scores(
        &self,
        recorded: ArrayView2<f64>,
        predicted: ArrayView2<f64>,
    ) -> Result<PublishedScores, ModelError> {
        check_window(recorded, predicted)?;
        let rows = recorded.nrows();
        let mut shown = predicted.to_owned();
        let known = POSITIONS.start..FACING.end;
        let end = recorded.slice(s![rows - 1, known.clone()]);
        shown.slice_mut(s![rows - 2, known]).assign(&end);

        let (mut position, mut factors_met, mut roots_met) = (0.0, PARTS, 1);
        let mut before = recorded.row(0);
        for (truth, frame) in recorded.rows().into_iter().skip(1).zip(shown.rows()) {
            position += distance(frame, truth, POSITIONS);
            roots_met += usize::from(distance(frame, truth, ROOT_POSITION) < self.0.root_threshold);
            let factors = velocity_factors_between(before, frame);
            let wanted = truth.slice(s![VELOCITY_FACTORS]);
            let met = |(x, wanted): (&f64, &f64)| (x - wanted).abs() < self.0.velocity_threshold;
            factors_met += factors.iter().zip(wanted).filter(|&it| met(it)).count();
            before = frame;
        }
        let frames = rows as f64;
        Ok(PublishedScores {
            position: position / frames,
            velocity_factors_met: factors_met as f64 / (frames * PARTS as f64),
            roots_met: roots_met as f64 / frames,
        })
    }
}
