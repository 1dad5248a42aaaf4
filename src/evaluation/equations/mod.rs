//! The protocol `equations`: LRP, AVF and ART of Pan et al. 2021 as the paper's equations 12 to 16
//! define them.

mod metrics;

use super::protocol::{Evaluation, EvaluationError, Protocol};
use super::scores::{ScoreRow, Scores};
use super::transitions::TransitionScoring;
use super::{Better, Metric};
use crate::data::{DataPart, Dataset};
use crate::models::Generator;
use crate::models::transition::DanceClip;

pub use metrics::{WindowScores, foot_skate, means, window_scores};

const METRICS: [Metric; 4] = [
    Metric {
        key: "lrp",
        title: "LRP",
        unit: "cm",
        better: Better::Lower,
        about: "average L2 distance of root-relative positions (eq. 12), cm",
    },
    Metric {
        key: "avf",
        title: "AVF",
        unit: "share of windows",
        better: Better::Higher,
        about: "share of windows with the velocity factors asked for (eq. 13 and 14)",
    },
    Metric {
        key: "art",
        title: "ART",
        unit: "share of windows",
        better: Better::Higher,
        about: "share of windows on the root trajectory asked for (eq. 15 and 16)",
    },
    Metric {
        key: "foot_skate",
        title: "foot skate",
        unit: "cm/frame",
        better: Better::Lower,
        about: "how far a foot joint moves in a frame in which the recorded one is in contact, cm/frame",
    },
];

/// The paper's equations as they are printed. Its tables come of another way to count, see
/// [`Published`](super::published::Published).
///
/// For each N, windows of N + 1 frames start every ceil(0.1 (N + 1)) frames of each clip. A model
/// is given frame k1 (the first), the keyframe k2 (the last), root trajectory and velocity factors,
/// and predicts the N frames k1 + 1 to k2. What is scored is its raw output, `[N, 149]`.
///
/// Foot skate has no score where some length has no contact.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Equations(pub TransitionScoring);

/// Frames of a window.
fn window(length: usize) -> usize {
    length + 1
}

impl Protocol for Equations {
    fn name(&self) -> &'static str {
        "equations"
    }

    fn about(&self) -> &'static str {
        "as the paper's equations define them"
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

impl Equations {
    /// Scores a model on all windows of clips that are measured already. The scores are the same to
    /// the bit on any number of threads.
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
        let measured = self.0.measure(model, clips, window, window_scores)?;
        Ok(Evaluation {
            scores: self.scores(&measured.lengths),
            warnings: measured.warnings,
        })
    }

    /// The scores of the windows of each length.
    fn scores(&self, measured: &[(usize, Vec<WindowScores>)]) -> Scores {
        let row = |score: &dyn Fn(&[WindowScores]) -> f64| {
            let scored = measured.iter();
            ScoreRow::new(scored.map(|(length, windows)| (length, score(windows)))).with_average()
        };
        let (velocity, root) = (self.0.velocity_threshold, self.0.root_threshold);
        let mut rows: Vec<_> = (0..3)
            .map(|metric| row(&|windows| means(windows, velocity, root)[metric]))
            .collect();
        let skate = |windows: &[WindowScores]| foot_skate(windows).unwrap_or(f64::NAN);
        let mut lengths = measured.iter();
        if lengths.all(|(_, windows)| skate(windows).is_finite()) {
            rows.push(row(&skate));
        }
        let counts = measured.iter();
        Scores::new(
            METRICS.iter().map(|metric| metric.key).zip(rows),
            counts.map(|(length, windows)| (length, windows.len())),
        )
    }
}
