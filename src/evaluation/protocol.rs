//! The evaluation protocol: which windows, what is given, which thresholds.

use std::collections::BTreeMap;
use std::fmt;

use rayon::prelude::*;

use super::metrics::{WindowScores, foot_skate, means, window_scores};
use super::scores::{Evaluation, LengthScores};
use super::window_request::window_request;
use crate::data::DanceClip;
use crate::models::ModelError;
use crate::models::transition::TransitionModel;
use crate::models::transition::{Window, window_features, windows};

/// The protocol behind tables 2 to 4. The default is the paper's; scores of other lengths or thresholds are not comparable with it.
///
/// For each N, windows of N + 1 frames start every ceil(0.1 (N + 1)) frames of each clip. A model is given frame k1 (the first),
/// the keyframe k2 (the last), root trajectory and velocity factors, and predicts the N frames k1 + 1 to k2.
#[derive(Debug, Clone, PartialEq)]
pub struct Protocol {
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

impl Default for Protocol {
    fn default() -> Self {
        Self {
            lengths: vec![10, 50, 100, 150],
            velocity_threshold: 1.0,
            root_threshold: 7.0,
            most_windows: None,
            chunk: 64,
        }
    }
}

/// Scores, and the clips that had no share in some of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    pub evaluation: Evaluation,
    /// Clips without a window of some length, by length, then in the order of the clips; each a warning to print.
    pub skipped: Vec<SkippedClip>,
}

/// A clip that is shorter than a window; its `Display` is the warning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SkippedClip {
    pub clip: String,
    /// Number of frames that it has.
    pub frames: usize,
    /// N of the windows that it is too short for.
    pub length: usize,
}

impl fmt::Display for SkippedClip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} has {} frames, fewer than a window of {} (N = {}): left out of the scores at this length",
            self.clip,
            self.frames,
            self.length + 1,
            self.length
        )
    }
}

/// Why there are no scores.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EvaluationError {
    #[error("the protocol names no transition lengths; give at least one")]
    NoLengths,
    #[error("a transition length of 0 frames has nothing to predict; give lengths of 1 or more")]
    ZeroLength,
    #[error(
        "none of the {clips} clips has the {needed} frames of a window at N = {length} (the longest has {longest}); \
         give longer clips or leave this length out"
    )]
    NoWindows {
        length: usize,
        needed: usize,
        clips: usize,
        longest: usize,
    },
    #[error("{clip}: has {poses} poses but features of {frames} frames")]
    ClipMismatch {
        clip: String,
        poses: usize,
        frames: usize,
    },
    #[error("{model} gave {found} transitions for {expected} requests")]
    TransitionCount {
        model: String,
        expected: usize,
        found: usize,
    },
    #[error("{model}, {clip}, frames {start} to {end}")]
    Prediction {
        model: String,
        clip: String,
        start: usize,
        end: usize,
        source: Box<ModelError>,
    },
    #[error("{model}, a chunk of windows at N = {length} that starts with {clip}, frame {start}")]
    Chunk {
        model: String,
        length: usize,
        clip: String,
        start: usize,
        source: Box<ModelError>,
    },
}

impl Protocol {
    /// Scores a model on all windows of the clips.
    ///
    /// Chunks of windows run in parallel on rayon's current pool. The chunks do not depend on the number of threads and their
    /// results are added in order, so the scores are the same to the bit on any number of threads.
    ///
    /// # Errors
    ///
    /// [`EvaluationError`]: a length without windows, or a model that fails or gives frames that do not fit.
    pub fn evaluate(
        &self,
        model: &dyn TransitionModel,
        clips: &[DanceClip],
    ) -> Result<Outcome, EvaluationError> {
        if self.lengths.is_empty() {
            return Err(EvaluationError::NoLengths);
        }
        let clip_frames: Vec<usize> = clips.iter().map(|clip| clip.features.nrows()).collect();
        let mut scores = [BTreeMap::new(), BTreeMap::new(), BTreeMap::new()];
        let mut skates = Some(BTreeMap::new());
        let mut counts = BTreeMap::new();
        let mut skipped = Vec::new();
        for &length in &self.lengths {
            if length == 0 {
                return Err(EvaluationError::ZeroLength);
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
            skipped.extend(cut.skipped.iter().map(|&clip| SkippedClip {
                clip: clips[clip].name.clone(),
                frames: clip_frames[clip],
                length,
            }));
            if let Some(most) = self.most_windows {
                cut.windows = spread(&cut.windows, most);
            }
            let measured = self.measure(model, clips, &cut.windows, length)?;
            let means = means(&measured, self.velocity_threshold, self.root_threshold);
            for (scores, mean) in scores.iter_mut().zip(means) {
                scores.insert(length, mean);
            }
            skates = skates
                .zip(foot_skate(&measured))
                .map(|(mut skates, skate)| {
                    skates.insert(length, skate);
                    skates
                });
            counts.insert(length, measured.len());
        }
        let [lrp, avf, art] = scores.map(LengthScores::new);
        Ok(Outcome {
            evaluation: Evaluation {
                lrp,
                avf,
                art,
                foot_skate: skates.map(LengthScores::new),
                windows: counts,
            },
            skipped,
        })
    }

    /// Scores of the windows of one length, in their order.
    fn measure(
        &self,
        model: &dyn TransitionModel,
        clips: &[DanceClip],
        windows: &[Window],
        length: usize,
    ) -> Result<Vec<WindowScores>, EvaluationError> {
        let chunks: Vec<Vec<WindowScores>> = windows
            .par_chunks(self.chunk.max(1))
            .map(|chunk| measure_chunk(model, clips, chunk, length))
            .collect::<Result<_, _>>()?;
        Ok(chunks.into_iter().flatten().collect())
    }
}

/// At most `most` of the windows, evenly spread over them.
fn spread(windows: &[Window], most: usize) -> Vec<Window> {
    let count = windows.len().min(most);
    (0..count)
        .map(|k| windows[k * windows.len() / count])
        .collect()
}

fn measure_chunk(
    model: &dyn TransitionModel,
    clips: &[DanceClip],
    chunk: &[Window],
    length: usize,
) -> Result<Vec<WindowScores>, EvaluationError> {
    let recorded: Vec<_> = chunk
        .iter()
        .map(|window| window_features(&clips[window.clip].features, window.start, length))
        .collect();
    let requests: Vec<_> = chunk
        .iter()
        .zip(&recorded)
        .map(|(window, features)| {
            let clip = &clips[window.clip];
            window_request(&clip.clip, window.start, features.view()).ok_or_else(|| {
                EvaluationError::ClipMismatch {
                    clip: clip.name.clone(),
                    poses: clip.clip.poses.len(),
                    frames: clip.features.nrows(),
                }
            })
        })
        .collect::<Result<_, _>>()?;
    let transitions = model
        .transitions(&requests)
        .map_err(|source| EvaluationError::Chunk {
            model: model.name().to_string(),
            length,
            clip: clips[chunk[0].clip].name.clone(),
            start: chunk[0].start,
            source: Box::new(source),
        })?;
    if transitions.len() != chunk.len() {
        return Err(EvaluationError::TransitionCount {
            model: model.name().to_string(),
            expected: chunk.len(),
            found: transitions.len(),
        });
    }
    chunk
        .iter()
        .zip(&recorded)
        .zip(&transitions)
        .map(|((window, recorded), transition)| {
            window_scores(recorded.view(), transition).map_err(|source| {
                EvaluationError::Prediction {
                    model: model.name().to_string(),
                    clip: clips[window.clip].name.clone(),
                    start: window.start,
                    end: window.start + length,
                    source: Box::new(source),
                }
            })
        })
        .collect()
}
