//! The protocol `equations`: LRP, AVF and ART of Pan et al. 2021 as the paper's equations 12 to 16
//! define them.

mod metrics;

use ndarray::ArrayView2;

use super::scores::ScoreRow;
use super::transitions::{Measured, TransitionProtocol, TransitionScoring, row};
use super::{Better, Metric};
use crate::models::ModelError;

pub use metrics::{WindowScores, foot_skate, means, window_scores};

const METRICS: [Metric; 4] = [
    Metric {
        key: "lrp",
        title: "LRP",
        unit: "cm",
        better: Better::Lower,
        decimals: 2,
        about: "average L2 distance of root-relative positions (eq. 12), cm",
    },
    Metric {
        key: "avf",
        title: "AVF",
        unit: "share of windows",
        better: Better::Higher,
        decimals: 2,
        about: "share of windows with the velocity factors asked for (eq. 13 and 14)",
    },
    Metric {
        key: "art",
        title: "ART",
        unit: "share of windows",
        better: Better::Higher,
        decimals: 2,
        about: "share of windows on the root trajectory asked for (eq. 15 and 16)",
    },
    Metric {
        key: "foot_skate",
        title: "foot skate",
        unit: "cm/frame",
        better: Better::Lower,
        decimals: 2,
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

impl TransitionProtocol for Equations {
    const NAME: &'static str = "equations";
    const ABOUT: &'static str = "as the paper's equations define them";
    const METRICS: &'static [Metric] = &METRICS;

    type Window = WindowScores;

    fn scoring(&self) -> &TransitionScoring {
        &self.0
    }

    fn frames_of(length: usize) -> usize {
        length + 1
    }

    fn window_scores(
        &self,
        recorded: ArrayView2<f64>,
        predicted: ArrayView2<f64>,
    ) -> Result<WindowScores, ModelError> {
        window_scores(recorded, predicted)
    }

    fn rows(&self, measured: &Measured<WindowScores>) -> Vec<(&'static str, ScoreRow)> {
        let (velocity, root) = (self.0.velocity_threshold, self.0.root_threshold);
        let mean = |metric: usize| row(measured, |windows| means(windows, velocity, root)[metric]);
        let mut rows: Vec<ScoreRow> = (0..3).map(mean).collect();
        let skate = |windows: &[WindowScores]| foot_skate(windows).unwrap_or(f64::NAN);
        let mut lengths = measured.iter();
        if lengths.all(|(_, windows)| skate(windows).is_finite()) {
            rows.push(row(measured, skate));
        }
        METRICS.iter().map(|metric| metric.key).zip(rows).collect()
    }
}
