//! The protocol `published`: LRP, AVF and ART as the evaluation program of Pan et al. 2021 counts
//! them, which the numbers of their tables come of.

use ndarray::{ArrayView2, s};

use super::protocol::{Evaluation, EvaluationError, Protocol};
use super::scores::{ScoreRow, Scores};
use super::transitions::TransitionScoring;
use super::{Better, Metric};
use crate::data::{DataPart, Dataset};
use crate::models::transition::{DanceClip, check_frames};
use crate::models::{Generator, ModelError};
use crate::motion::features::{FACING, FEATURES, POSITIONS, ROOT_POSITION, VELOCITY_FACTORS};
use crate::motion::velocity_factor::{PARTS, velocity_factors_between};

const METRICS: [Metric; 3] = [
    Metric {
        key: "lrp",
        title: "LRP",
        unit: "cm",
        better: Better::Lower,
        about: "average L2 distance of root-relative positions and the root, both keyframes counted, cm",
    },
    Metric {
        key: "avf",
        title: "AVF",
        unit: "share of velocity factors",
        better: Better::Higher,
        about: "share of single velocity factors (frame and body part) that are met",
    },
    Metric {
        key: "art",
        title: "ART",
        unit: "share of frames",
        better: Better::Higher,
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

/// Frames of a window.
fn window(length: usize) -> usize {
    length
}

impl Protocol for Published {
    fn name(&self) -> &'static str {
        "published"
    }

    fn about(&self) -> &'static str {
        "as the authors' program counts, which their tables come of"
    }

    fn metrics(&self) -> &[Metric] {
        &METRICS
    }

    fn lengths(&self) -> &[usize] {
        &self.0.lengths
    }

    fn frames(&self, recordings: &[usize]) -> u64 {
        self.0.frames(recordings, window)
    }

    fn evaluate(
        &self,
        subject: &dyn Generator,
        data: &Dataset,
        part: DataPart,
    ) -> Result<Evaluation, EvaluationError> {
        self.evaluate_clips(subject, &self.0.clips(data, part)?)
    }
}

impl Published {
    /// Scores a model on all windows of clips that are measured already.
    ///
    /// # Errors
    ///
    /// [`EvaluationError`]: a length without windows, or a model that fails or gives frames that do
    /// not fit.
    pub fn evaluate_clips(
        &self,
        model: &dyn Generator,
        clips: &[DanceClip],
    ) -> Result<Evaluation, EvaluationError> {
        let score = |recorded: ArrayView2<f64>, predicted: ArrayView2<f64>| {
            self.window_scores(recorded, predicted)
        };
        let measured = self.0.measure(model, clips, window, score)?;
        let row = |of: fn(&PublishedScores) -> f64| {
            let mean = |windows: &[PublishedScores]| {
                windows.iter().map(of).sum::<f64>() / windows.len() as f64
            };
            let lengths = measured.lengths.iter();
            ScoreRow::new(lengths.map(|(length, windows)| (length, mean(windows)))).with_average()
        };
        let rows = [
            row(|scores| scores.position),
            row(|scores| scores.velocity_factors_met),
            row(|scores| scores.roots_met),
        ];
        let counts = measured.lengths.iter();
        Ok(Evaluation {
            scores: Scores::new(
                METRICS.iter().map(|metric| metric.key).zip(rows),
                counts.map(|(length, windows)| (length, windows.len())),
            ),
            warnings: measured.warnings,
        })
    }

    /// Measures a prediction against the recorded window.
    ///
    /// `recorded`: `[N, 154]`, frames k1 to k2, not standardised. `predicted`: `[N - 1, 149]`,
    /// frames k1 + 1 to k2; of the last one the true positions, root and facing are taken.
    ///
    /// # Errors
    ///
    /// [`ModelError::Shape`], [`ModelError::NoFrames`] or [`ModelError::NotFinite`] where the two
    /// do not fit together.
    pub fn window_scores(
        &self,
        recorded: ArrayView2<f64>,
        predicted: ArrayView2<f64>,
    ) -> Result<PublishedScores, ModelError> {
        let (rows, columns) = recorded.dim();
        if rows < 2 {
            return Err(ModelError::NoFrames { rows });
        }
        if columns != FEATURES {
            return Err(ModelError::Shape {
                what: "recorded window".into(),
                expected: vec![rows, FEATURES],
                found: vec![rows, columns],
            });
        }
        check_frames(predicted, rows - 1)?;
        let mut shown = predicted.to_owned();
        let known = POSITIONS.start..FACING.end;
        let end = recorded.slice(s![rows - 1, known.clone()]);
        shown.slice_mut(s![rows - 2, known]).assign(&end);

        let (mut position, mut factors_met, mut roots_met) = (0.0, PARTS, 1);
        let mut before = recorded.row(0);
        for (truth, frame) in recorded.rows().into_iter().skip(1).zip(shown.rows()) {
            let distance = |range: std::ops::Range<usize>| {
                let squares = range.map(|column| (frame[column] - truth[column]).powi(2));
                squares.sum::<f64>().sqrt()
            };
            position += distance(POSITIONS);
            roots_met += usize::from(distance(ROOT_POSITION) < self.0.root_threshold);
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
