//! The protocol `equations`: LRP, AVF and ART of Pan et al. 2021 as the paper's equations 12 to 16
//! define them.

mod metrics;
mod window_request;

use rayon::prelude::*;

use super::protocol::{Evaluation, EvaluationError, EvaluationOptions, Protocol};
use super::scores::{ScoreRow, Scores};
use super::{Better, Metric};
use crate::data::{DataPart, Dataset};
use crate::models::Generator;
use crate::models::transition::{DanceClip, Window, window_features, windows};
use crate::motion::FeatureConfig;

pub use metrics::{WindowScores, foot_skate, means, window_scores};
pub use window_request::window_request;

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

/// The protocol behind tables 2 to 4. The default is the paper's; scores of other lengths or
/// thresholds are not comparable with it.
///
/// For each N, windows of N + 1 frames start every ceil(0.1 (N + 1)) frames of each clip. A model
/// is given frame k1 (the first), the keyframe k2 (the last), root trajectory and velocity factors,
/// and predicts the N frames k1 + 1 to k2. What is scored is its raw output, `[N, 149]`.
///
/// Foot skate has no score where some length has no contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Equations {
    /// How clips are measured.
    pub features: FeatureConfig,
    /// Transition lengths N, frames.
    pub lengths: Vec<usize>,
    /// delta_v of eq. 13, cm/frame.
    pub velocity_threshold: f64,
    /// delta_r of eq. 15, cm.
    pub root_threshold: f64,
    /// At most this many windows of each length, spread evenly over all of them; none: all.
    pub most_windows: Option<usize>,
    /// Windows that a model predicts in one call. Bounds memory.
    pub chunk: usize,
}

impl Default for Equations {
    fn default() -> Self {
        Self {
            features: FeatureConfig::default(),
            lengths: vec![10, 50, 100, 150],
            velocity_threshold: 1.0,
            root_threshold: 7.0,
            most_windows: None,
            chunk: 64,
        }
    }
}

impl Protocol for Equations {
    fn metrics(&self) -> &[Metric] {
        &METRICS
    }

    fn lengths(&self) -> &[usize] {
        &self.lengths
    }

    fn frames(&self, recordings: &[usize]) -> u64 {
        let of_length =
            |&length: &usize| (windows(recordings, length).windows.len() * (length + 1)) as u64;
        self.lengths.iter().map(of_length).sum()
    }

    fn evaluate(
        &self,
        subject: &dyn Generator,
        data: &Dataset,
        part: DataPart,
    ) -> Result<Evaluation, EvaluationError> {
        let clips = DanceClip::measure_all(part.of(data)?, &self.features);
        self.evaluate_clips(subject, &clips.map_err(|error| bad(error.to_string()))?)
    }
}

impl Equations {
    /// The protocol with clips measured like this, and with what is chosen of it.
    pub fn new(features: FeatureConfig, options: &EvaluationOptions) -> Self {
        let own = Self::default();
        Self {
            features,
            lengths: match options.lengths.is_empty() {
                true => own.lengths,
                false => options.lengths.clone(),
            },
            most_windows: options.most_windows,
            ..own
        }
    }

    /// Scores a model on all windows of clips that are measured already.
    ///
    /// Chunks of windows run in parallel on rayon's current pool. The chunks do not depend on the
    /// number of threads and their results are added in order, so the scores are the same to the
    /// bit on any number of threads.
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
        let clip_frames: Vec<usize> = clips.iter().map(DanceClip::frames).collect();
        let mut measured = Vec::new();
        let mut warnings = Vec::new();
        for &length in &self.lengths {
            if length == 0 {
                let reason =
                    "a length of 0 frames has nothing to predict; give lengths of 1 or more";
                return Err(bad(reason.into()));
            }
            let mut cut = windows(&clip_frames, length);
            if cut.windows.is_empty() {
                return Err(EvaluationError::NoWindows {
                    length,
                    needed: length + 1,
                    clips: clips.len(),
                    longest: clip_frames.iter().copied().max().unwrap_or(0),
                });
            }
            warnings.extend(cut.skipped.iter().map(|&clip| {
                format!(
                    "{} has {} frames, fewer than a window of {} (N = {length}): left out of the \
                     scores at this length",
                    clips[clip].name,
                    clip_frames[clip],
                    length + 1
                )
            }));
            if let Some(most) = self.most_windows {
                cut.windows = spread(&cut.windows, most);
            }
            let chunks = cut.windows.par_chunks(self.chunk.max(1));
            let scores: Vec<Vec<WindowScores>> = chunks
                .map(|chunk| measure_chunk(model, clips, chunk, length))
                .collect::<Result<_, _>>()?;
            measured.push((length, scores.concat()));
        }
        Ok(Evaluation {
            scores: self.scores(&measured),
            warnings,
        })
    }

    /// The scores of the windows of each length.
    fn scores(&self, measured: &[(usize, Vec<WindowScores>)]) -> Scores {
        let row = |score: &dyn Fn(&[WindowScores]) -> f64| {
            let scored = measured.iter();
            ScoreRow::new(scored.map(|(length, windows)| (length, score(windows)))).with_average()
        };
        let (velocity, root) = (self.velocity_threshold, self.root_threshold);
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

fn bad(reason: String) -> EvaluationError {
    EvaluationError::Data { reason }
}

/// At most `most` of the windows, evenly spread over them.
fn spread(windows: &[Window], most: usize) -> Vec<Window> {
    let count = windows.len().min(most);
    (0..count)
        .map(|k| windows[k * windows.len() / count])
        .collect()
}

fn measure_chunk(
    model: &dyn Generator,
    clips: &[DanceClip],
    chunk: &[Window],
    length: usize,
) -> Result<Vec<WindowScores>, EvaluationError> {
    let features = |it: &Window| window_features(&clips[it.clip].features, it.start, length);
    let recorded: Vec<_> = chunk.iter().map(features).collect();
    let windows = || chunk.iter().zip(&recorded);
    let requests: Vec<_> = windows()
        .map(|(window, features)| {
            let clip = &clips[window.clip];
            window_request(&clip.clip, window.start, features.view()).ok_or_else(|| {
                let (poses, frames) = (clip.clip.poses.len(), clip.features.nrows());
                bad(format!(
                    "{}: has {poses} poses but features of {frames} frames",
                    clip.name
                ))
            })
        })
        .collect::<Result<_, _>>()?;
    let failed = |what: String, source| EvaluationError::Model {
        what: format!("{}, {what}", model.name()),
        source: Box::new(source),
    };
    let predicted = model.raw(&requests).map_err(|source| {
        let Window { clip, start, .. } = chunk[0];
        let clip = &clips[clip].name;
        let what =
            format!("a chunk of windows at N = {length} that starts with {clip}, frame {start}");
        failed(what, source)
    })?;
    if predicted.len() != chunk.len() {
        let (model, answers, requests) = (model.name(), predicted.len(), chunk.len());
        return Err(bad(format!(
            "{model} gave {answers} answers to {requests} requests"
        )));
    }
    windows()
        .zip(&predicted)
        .map(|((window, recorded), predicted)| {
            window_scores(recorded.view(), predicted.view()).map_err(|source| {
                let (clip, start) = (&clips[window.clip].name, window.start);
                let end = start + length;
                failed(format!("{clip}, frames {start} to {end}"), source)
            })
        })
        .collect()
}
