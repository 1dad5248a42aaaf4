//! What the protocols of transitions share: windows of recorded clips, a model's raw output for
//! each, and means over the windows of a length.

mod window_request;

use ndarray::{Array2, ArrayView2};
use rayon::prelude::*;

use super::protocol::{EvaluationError, EvaluationOptions};
use crate::counted::counted;
use crate::data::{DataPart, Dataset};
use crate::models::transition::{DanceClip, Window, window_features, windows};
use crate::models::{Generator, ModelError};
use crate::motion::FeatureConfig;

pub use window_request::window_request;

/// What a protocol of transitions may choose. The default is the paper's; scores of other lengths
/// or thresholds are not comparable with it.
#[derive(Debug, Clone, PartialEq)]
pub struct TransitionScoring {
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

impl Default for TransitionScoring {
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

/// What was measured of the windows of each length N.
pub struct Measured<S> {
    pub lengths: Vec<(usize, Vec<S>)>,
    /// Clips that are shorter than a window.
    pub warnings: Vec<String>,
}

impl TransitionScoring {
    /// The paper's, with clips measured like this, and with what is chosen of it.
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

    /// The clips of a part of the data, measured.
    pub(super) fn clips(
        &self,
        data: &Dataset,
        part: DataPart,
    ) -> Result<Vec<DanceClip>, EvaluationError> {
        DanceClip::measure_all(part.of(data)?, &self.features)
            .map_err(|error| bad(error.to_string()))
    }

    /// Frames of all windows of recordings of these numbers of frames.
    pub(super) fn frames(&self, recordings: &[usize], window: fn(usize) -> usize) -> u64 {
        let of_length = |&length: &usize| match window(length).checked_sub(1) {
            None | Some(0) => 0,
            Some(span) => (self.cut(recordings, span).0.len() * (span + 1)) as u64,
        };
        self.lengths.iter().map(of_length).sum()
    }

    /// Asks a model about all windows and measures each answer.
    ///
    /// `window`: frames of the window of a length N; windows start every ceil(0.1 window) frames of
    /// each clip. `measure` is given the recorded window, `[window, 154]`, and the predicted frames
    /// after its first, `[window - 1, 149]`, neither standardised.
    ///
    /// Chunks of windows run in parallel on rayon's current pool. The chunks do not depend on the
    /// number of threads and their results are kept in order.
    ///
    /// # Errors
    /// A length without windows, or a model that fails or gives frames that do not fit.
    pub(super) fn measure<S: Send>(
        &self,
        model: &dyn Generator,
        clips: &[DanceClip],
        window: fn(usize) -> usize,
        measure: impl Fn(ArrayView2<f64>, ArrayView2<f64>) -> Result<S, ModelError> + Sync,
    ) -> Result<Measured<S>, EvaluationError> {
        let clip_frames: Vec<usize> = clips.iter().map(DanceClip::frames).collect();
        let (mut measured, mut warnings) = (Vec::new(), Vec::new());
        for &length in &self.lengths {
            let needed = window(length);
            let Some(span) = needed.checked_sub(1).filter(|&span| span > 0) else {
                let least = length + 2 - needed;
                return Err(bad(format!(
                    "a window of length {length} has no frame to predict; give lengths of {least} \
                     or more"
                )));
            };
            let (cut, skipped) = self.cut(&clip_frames, span);
            if cut.is_empty() {
                return Err(EvaluationError::NoWindows {
                    length,
                    needed,
                    clips: clips.len(),
                    longest: clip_frames.iter().copied().max().unwrap_or(0),
                });
            }
            warnings.extend(skipped.into_iter().map(|clip| {
                format!(
                    "{} has {}, fewer than a window of {needed} (N = {length}): left out of the \
                     scores at this length",
                    clips[clip].name,
                    counted(clip_frames[clip], "frame"),
                )
            }));
            let chunks = cut.par_chunks(self.chunk.max(1));
            let of_chunk = |chunk: &[Window]| measure_chunk(model, clips, chunk, span, &measure);
            let scores: Vec<Vec<S>> = chunks.map(of_chunk).collect::<Result<_, _>>()?;
            measured.push((length, scores.into_iter().flatten().collect()));
        }
        Ok(Measured {
            lengths: measured,
            warnings,
        })
    }

    /// Windows of `span + 1` frames, and the clips that are shorter.
    fn cut(&self, clip_frames: &[usize], span: usize) -> (Vec<Window>, Vec<usize>) {
        let cut = windows(clip_frames, span);
        let windows = match self.most_windows {
            Some(most) => spread(&cut.windows, most),
            None => cut.windows,
        };
        (windows, cut.skipped)
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

/// Predicts and measures a chunk of windows of `span + 1` frames.
fn measure_chunk<S>(
    model: &dyn Generator,
    clips: &[DanceClip],
    chunk: &[Window],
    span: usize,
    measure: &impl Fn(ArrayView2<f64>, ArrayView2<f64>) -> Result<S, ModelError>,
) -> Result<Vec<S>, EvaluationError> {
    let features = |it: &Window| window_features(&clips[it.clip].features, it.start, span);
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
    let predicted: Vec<Array2<f64>> = model.raw(&requests).map_err(|source| {
        let Window { clip, start, .. } = chunk[0];
        let (clip, frames) = (&clips[clip].name, span + 1);
        let what =
            format!("a chunk of windows of {frames} frames that starts with {clip}, frame {start}");
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
            measure(recorded.view(), predicted.view()).map_err(|source| {
                let (clip, start) = (&clips[window.clip].name, window.start);
                let end = start + span;
                failed(format!("{clip}, frames {start} to {end}"), source)
            })
        })
        .collect()
}
