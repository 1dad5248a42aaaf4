//! What the protocols of transitions share: windows of recorded clips, a model's raw output for
//! each, and scores of the windows of a length. They differ in how they count.

mod window_request;

use std::ops::Range;

use ndarray::{ArrayView1, ArrayView2};

use super::Metric;
use super::protocol::{Evaluation, EvaluationError, EvaluationOptions, Protocol};
use super::scores::{ScoreRow, Scores};
use super::windows::{CHUNK, answers, bad, failed, in_chunks, left_out, spread};
use crate::data::{DataPart, Dataset};
use crate::models::transition::{DanceClip, Window, check_frames, window_features, windows};
use crate::models::{Generator, ModelError};
use crate::motion::FeatureConfig;
use crate::motion::features::FEATURES;

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
            chunk: CHUNK,
        }
    }
}

/// What was measured of the windows of each length N, `[lengths][windows]`.
pub type Measured<S> = Vec<(usize, Vec<S>)>;

/// How a protocol of transitions counts; it is a [`Protocol`] through that.
pub trait TransitionProtocol: Send + Sync {
    /// [`Protocol::name`].
    const NAME: &'static str;
    /// [`Protocol::about`].
    const ABOUT: &'static str;
    /// [`Protocol::metrics`].
    const METRICS: &'static [Metric];

    /// What is measured of one window.
    type Window: Send;

    fn scoring(&self) -> &TransitionScoring;

    /// Frames of the window of a length N. Windows start every ceil(0.1 of them) frames of a clip.
    fn frames_of(length: usize) -> usize;

    /// Measures a prediction against the recorded window.
    ///
    /// `recorded`: `[window, 154]`, frames k1 to k2; `predicted`: `[window - 1, 149]`, frames
    /// k1 + 1 to k2; neither is standardised.
    ///
    /// # Errors
    /// [`ModelError::Shape`], [`ModelError::NoFrames`] or [`ModelError::NotFinite`] where the two
    /// do not fit together.
    fn window_scores(
        &self,
        recorded: ArrayView2<f64>,
        predicted: ArrayView2<f64>,
    ) -> Result<Self::Window, ModelError>;

    /// The scores by the metrics' keys; a metric that cannot be told is left out.
    fn rows(&self, measured: &Measured<Self::Window>) -> Vec<(&'static str, ScoreRow)>;

    /// Scores a model on all windows of clips that are measured already. The scores are the same to
    /// the bit on any number of threads.
    ///
    /// # Errors
    /// A length without windows, or a model that fails or gives frames that do not fit.
    fn evaluate_clips(
        &self,
        model: &dyn Generator,
        clips: &[DanceClip],
    ) -> Result<Evaluation, EvaluationError>
    where
        Self: Sized,
    {
        let (measured, warnings) = measure(self, model, clips)?;
        let counts = measured.iter();
        let counts = counts.map(|(length, windows)| (length, windows.len()));
        Ok(Evaluation {
            scores: Scores::new(self.rows(&measured), counts),
            warnings,
        })
    }
}

impl<P: TransitionProtocol> Protocol for P {
    fn name(&self) -> &'static str {
        P::NAME
    }

    fn about(&self) -> &'static str {
        P::ABOUT
    }

    fn metrics(&self) -> &[Metric] {
        P::METRICS
    }

    fn lengths(&self) -> &[usize] {
        &self.scoring().lengths
    }

    fn frames(&self, recordings: &[usize]) -> u64 {
        let scoring = self.scoring();
        let of_length = |&length: &usize| match P::frames_of(length) {
            0 | 1 => 0,
            frames => (scoring.cut(recordings, frames).0.len() * frames) as u64,
        };
        scoring.lengths.iter().map(of_length).sum()
    }

    fn evaluate(
        &self,
        subject: &dyn Generator,
        data: &Dataset,
        part: DataPart,
    ) -> Result<Evaluation, EvaluationError> {
        let clips = DanceClip::measure_all(part.of(data)?, &self.scoring().features);
        self.evaluate_clips(subject, &clips.map_err(|error| bad(error.to_string()))?)
    }
}

/// A score of each length, and their mean.
pub(super) fn row<S>(measured: &Measured<S>, score: impl Fn(&[S]) -> f64) -> ScoreRow {
    let lengths = measured.iter();
    ScoreRow::new(lengths.map(|(length, windows)| (length, score(windows)))).with_average()
}

/// Refuses a recorded window and a prediction that do not fit together, or that hold no numbers.
pub(super) fn check_window(
    recorded: ArrayView2<f64>,
    predicted: ArrayView2<f64>,
) -> Result<(), ModelError> {
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
    check_frames(predicted, rows - 1)
}

/// How far apart two frames are in these numbers, L2.
pub(super) fn distance(a: ArrayView1<f64>, b: ArrayView1<f64>, numbers: Range<usize>) -> f64 {
    let squares = numbers.map(|number| (a[number] - b[number]).powi(2));
    squares.sum::<f64>().sqrt()
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

    /// Windows of so many frames, and the clips that are shorter.
    pub(super) fn cut(&self, clip_frames: &[usize], frames: usize) -> (Vec<Window>, Vec<usize>) {
        let cut = windows(clip_frames, frames - 1);
        (spread(cut.windows, self.most_windows), cut.skipped)
    }
}

/// Asks a model about all windows and measures each answer. With them, warnings of clips that are
/// shorter than a window.
fn measure<P: TransitionProtocol>(
    protocol: &P,
    model: &dyn Generator,
    clips: &[DanceClip],
) -> Result<(Measured<P::Window>, Vec<String>), EvaluationError> {
    let scoring = protocol.scoring();
    let clip_frames: Vec<usize> = clips.iter().map(DanceClip::frames).collect();
    let (mut measured, mut warnings) = (Vec::new(), Vec::new());
    for &length in &scoring.lengths {
        let needed = P::frames_of(length);
        if needed < 2 {
            let (least, name) = (length + 2 - needed, P::NAME);
            return Err(bad(format!(
                "a window of length {length} has no frame to predict by {name}; give lengths of \
                 {least} or more"
            )));
        }
        let (cut, skipped) = scoring.cut(&clip_frames, needed);
        if cut.is_empty() {
            return Err(EvaluationError::NoWindows {
                length,
                needed,
                clips: clips.len(),
                longest: clip_frames.iter().copied().max().unwrap_or(0),
            });
        }
        let warning = |clip: usize| left_out(&clips[clip].name, clip_frames[clip], needed, length);
        warnings.extend(skipped.into_iter().map(warning));
        let of_chunk = |chunk: &[Window]| measure_chunk(protocol, model, clips, chunk, needed);
        measured.push((length, in_chunks(&cut, scoring.chunk, of_chunk)?));
    }
    Ok((measured, warnings))
}

/// Predicts and measures a chunk of windows of so many frames.
fn measure_chunk<P: TransitionProtocol>(
    protocol: &P,
    model: &dyn Generator,
    clips: &[DanceClip],
    chunk: &[Window],
    frames: usize,
) -> Result<Vec<P::Window>, EvaluationError> {
    let span = frames - 1;
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
    let what = || {
        let Window { clip, start, .. } = chunk[0];
        let clip = &clips[clip].name;
        format!("a chunk of windows of {frames} frames that starts with {clip}, frame {start}")
    };
    let predicted = answers(model, &requests, |requests| model.raw(requests), what)?;
    windows()
        .zip(&predicted)
        .map(|((window, recorded), predicted)| {
            let scores = protocol.window_scores(recorded.view(), predicted.view());
            scores.map_err(|source| {
                let (clip, start) = (&clips[window.clip].name, window.start);
                let end = start + span;
                failed(model, &format!("{clip}, frames {start} to {end}"), source)
            })
        })
        .collect()
}
