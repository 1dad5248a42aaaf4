//! The protocol `in_betweening` of Li et al.: L2Q, L2P and NPSS of the frames between two
//! keyframes, on the dance clips and on LaFAN1; beside them the root and the feet, which none of
//! these see.

mod answer;
mod data_set;
mod deviations;
mod distances;
mod metrics;
mod npss;
mod placement;
mod posed;
mod recorded;
mod scores;

use std::ops::Range;

use rayon::prelude::*;

use super::protocol::{Evaluation, EvaluationError, EvaluationOptions, Protocol};
use super::windows::{CHUNK, answers, bad, failed, in_chunks, left_out, spread};
use super::{Metric, Scores};
use crate::data::{DataConfig, DataPart, Dataset, Recording, Window, WindowCut};
use crate::models::generator::{NeededPoses, Request};
use crate::models::{Generator, ModelError};
use crate::motion::{Clip, FeatureConfig, Skeleton};
use answer::Answer;
use data_set::DataSet;
use recorded::{RecordedClip, RecordedWindow};
use scores::Sums;

pub use deviations::Deviations;
pub use distances::{l2p, l2q};
pub use npss::Npss;

/// How Li et al. score (spec, section 7). All means are over windows and missing frames.
///
/// | | dance | LaFAN1 |
/// | --- | --- | --- |
/// | windows | 50 frames every 10 | 65 frames every 40, none that ends with the clip |
/// | N | 10, 30, 50 | 5, 15, 30, 45 |
/// | k1, k2 | 0, N - 1: N - 2 frames are missing | 9, 10 + N: N frames are missing |
/// | orientation | the body at frame 0 to +Z | the root's +Y at frame 9 to +X |
///
/// A model is asked for the frames k1 to k2 and given the poses at both; the past before k1 only
/// where it needs past poses, contacts, root trajectory and velocity factors only where it reads
/// them. Scored are the missing frames: joint rotations (of a model that gives positions, those
/// that are fitted to them), and the positions that these and its root have on the clip's bones.
///
/// Sigma of L2P is taken over all windows of 50 frames of the training clips, those that are set
/// aside for validation included, so that it is the same whatever the share.
///
/// Contacts are labelled by the rule of the model that is asked: the lower ankle, unless it was
/// trained on others. They are given to it where it reads them, and the root that it is compared
/// with is reconstructed from them.
///
/// Lengths that the model was not trained to answer are left out, with a warning.
///
/// Clips may be on any skeleton that has the joints that feet and facing are told by, all on one.
#[derive(Debug, Clone, PartialEq)]
pub struct InBetweening {
    set: DataSet,
    lengths: Vec<usize>,
    most_windows: Option<usize>,
    features: FeatureConfig,
}

impl InBetweening {
    /// For the dance clips, read as `data` says.
    pub fn dance(data: &DataConfig, options: &EvaluationOptions) -> Self {
        Self::new(DataSet::DANCE, data, options)
    }

    /// For LaFAN1, read as `data` says.
    pub fn lafan1(data: &DataConfig, options: &EvaluationOptions) -> Self {
        Self::new(DataSet::LAFAN1, data, options)
    }

    fn new(set: DataSet, data: &DataConfig, options: &EvaluationOptions) -> Self {
        Self {
            lengths: match options.lengths.is_empty() {
                true => set.lengths.to_vec(),
                false => options.lengths.clone(),
            },
            most_windows: options.most_windows,
            features: data.features(),
            set,
        }
    }

    /// How the windows that are scored are cut from the clips.
    pub fn scored_windows(&self) -> WindowCut {
        self.set.scored
    }

    /// How the windows are cut from the training clips that sigma is taken over.
    pub fn training_windows(&self) -> WindowCut {
        self.set.training
    }

    /// Sigma of L2P.
    ///
    /// # Errors
    /// No training clip is long enough for a window, or one lacks a joint.
    pub fn deviations(&self, data: &Dataset) -> Result<Deviations, EvaluationError> {
        let clips = data.train.iter().chain(&data.validation);
        let clips: Vec<&Clip> = clips.map(|recording| &recording.clip).collect();
        let deviations = Deviations::of(&self.set, &clips);
        let deviations = deviations.map_err(|missing| bad(missing.to_string()))?;
        deviations.ok_or_else(|| {
            let needed = self.set.training.needed();
            bad(format!(
                "no training clip has the {needed} frames of a window, over which the deviations \
                 of L2P are taken; give longer clips"
            ))
        })
    }

    /// Clips with what is told once of all their windows.
    fn recorded<'d>(
        &self,
        recordings: &'d [Recording],
        model: &dyn Generator,
    ) -> Result<Vec<RecordedClip<'d>>, EvaluationError> {
        let recorded = |Recording { clip, .. }: &'d Recording| {
            let recorded = RecordedClip::new(&self.set, clip);
            let recorded = recorded.map_err(|missing| bad(format!("{}: {missing}", clip.name)))?;
            let measured = recorded.measured(model, &self.features);
            measured.map_err(|error| bad(error.to_string()))
        };
        let clips: Vec<_> = recordings.par_iter().map(recorded).collect();
        clips.into_iter().collect()
    }

    fn cut(&self, clip_frames: &[usize]) -> Vec<Window> {
        spread(self.set.scored.windows(clip_frames), self.most_windows)
    }

    /// The lengths that a model answers, and a warning of each of the others.
    ///
    /// # Errors
    /// It answers none.
    fn answered(
        &self,
        model: &dyn Generator,
    ) -> Result<(Vec<usize>, Vec<String>), EvaluationError> {
        let Some(longest) = model.longest_span() else {
            return Ok((self.lengths.clone(), Vec::new()));
        };
        let why = format!(
            "{} was trained on at most {longest} frames from keyframe to keyframe \
             (schedule.lengths.max)",
            model.name()
        );
        let lengths = self.lengths.iter().copied();
        let (answered, others): (Vec<usize>, Vec<usize>) =
            lengths.partition(|&length| self.set.span(length) <= longest);
        match answered.is_empty() {
            true => Err(bad(format!("{why}; give smaller --lengths"))),
            false => {
                let left_out = |length: usize| format!("N = {length} is left out: {why}");
                Ok((answered, others.into_iter().map(left_out).collect()))
            }
        }
    }

    /// Asks a model about windows of a length and measures each answer.
    fn measure(
        &self,
        model: &dyn Generator,
        clips: &[RecordedClip<'_>],
        windows: &[Window],
        deviations: &Deviations,
        length: usize,
    ) -> Result<Vec<Sums>, EvaluationError> {
        let (needs, rule) = (model.needs(), model.contact_rule());
        let span = self.set.span(length);
        let threshold = self.features.contact_threshold;
        let windows: Vec<RecordedWindow> = windows
            .iter()
            .map(|&Window { clip, start }| {
                clips[clip].window(&self.set, start, span, rule, threshold)
            })
            .collect();
        let requests = windows.iter().map(|window| window.request(&needs));
        let requests: Vec<Request> = requests.collect();
        let name = |window: &RecordedWindow| {
            let (clip, start) = (&window.of.clip.name, window.start);
            format!("{clip}, frames {start} to {}", start + span - 1)
        };
        let what = || format!("a chunk of windows that starts with {}", name(&windows[0]));
        let motions = answers(model, &requests, |requests| model.generate(requests), what)?;
        let answers = windows.iter().zip(requests.iter().zip(&motions));
        answers
            .map(|(window, (request, motion))| {
                let answer = Answer::of(request, motion);
                let answer = answer.map_err(|source| failed(model, &name(window), source))?;
                Ok(Sums::of(window, &answer, deviations, rule, threshold))
            })
            .collect()
    }
}

/// What a model is asked about frames of a clip, as the protocol asks: the poses of the first and
/// the last, the past before them and what else the model reads of the recording; `config` is how
/// that is measured. The clip must have the frames.
///
/// # Errors
/// The clip lacks a joint, or cannot be measured.
pub fn window_question(
    model: &dyn Generator,
    clip: &Clip,
    frames: Range<usize>,
    config: &FeatureConfig,
) -> Result<Request, ModelError> {
    let recorded = RecordedClip::new(&DataSet::DANCE, clip);
    let recorded = recorded.map_err(|missing| ModelError::data(&missing))?;
    let recorded = recorded.measured(model, config)?;
    let (start, needs) = (frames.start, model.needs());
    let (rule, threshold) = (model.contact_rule(), config.contact_threshold);
    let contacts = recorded.labels(start, frames.len(), rule, threshold);
    let past = match needs.poses {
        NeededPoses::Past(past) | NeededPoses::Keyframes { past } => past,
        NeededPoses::None | NeededPoses::Ends | NeededPoses::Seed(_) => 0,
    };
    let first = start.saturating_sub(past);
    Ok(recorded.request(first, start, &contacts, &needs))
}

impl Protocol for InBetweening {
    fn name(&self) -> &'static str {
        "in_betweening"
    }

    fn about(&self) -> &'static str {
        self.set.about
    }

    fn metrics(&self) -> &[Metric] {
        &metrics::METRICS
    }

    fn lengths(&self) -> &[usize] {
        &self.lengths
    }

    fn frames(&self, recordings: &[usize]) -> u64 {
        let windows = self.cut(recordings).len();
        let lengths = self.lengths.iter();
        let frames: usize = lengths.map(|&length| self.set.span(length)).sum();
        (windows * frames) as u64
    }

    fn evaluate(
        &self,
        subject: &dyn Generator,
        data: &Dataset,
        part: DataPart,
    ) -> Result<Evaluation, EvaluationError> {
        for &length in &self.lengths {
            self.set.check(length).map_err(bad)?;
        }
        let (lengths, mut warnings) = self.answered(subject)?;
        let recordings = part.of(data)?;
        check_skeletons(data, &recordings[0].clip)?;
        let clip_frames: Vec<usize> = recordings.iter().map(Recording::frames).collect();
        let (windows, needed) = (self.cut(&clip_frames), self.set.scored.needed());
        if windows.is_empty() {
            return Err(EvaluationError::NoWindows {
                length: self.lengths[0],
                needed,
                clips: recordings.len(),
                longest: clip_frames.iter().copied().max().unwrap_or(0),
            });
        }
        let clips = self.recorded(recordings, subject)?;
        let deviations = self.deviations(data)?;
        let mut sums = Vec::new();
        for length in lengths {
            let warning = |clip: usize| {
                let (name, frames) = (recordings[clip].name(), clip_frames[clip]);
                left_out(name, frames, needed, length)
            };
            let short = self.set.scored.too_short(&clip_frames).into_iter();
            warnings.extend(short.map(warning));
            let of_chunk =
                |chunk: &[Window]| self.measure(subject, &clips, chunk, &deviations, length);
            let mut all = Sums::default();
            for window in in_chunks(&windows, CHUNK, of_chunk)? {
                all.add(&window);
            }
            sums.push((length, all));
        }
        let counts = sums.iter().map(|(length, sums)| (length, sums.windows));
        Ok(Evaluation {
            scores: Scores::new(metrics::rows(&sums), counts),
            warnings,
        })
    }
}

/// Refuses clips on several skeletons: a sum over joints, and a deviation of each, need one.
fn check_skeletons(data: &Dataset, first: &Clip) -> Result<(), EvaluationError> {
    let joints = |skeleton: &Skeleton| -> Vec<(String, Option<usize>)> {
        let joints = skeleton.joints.iter();
        joints.map(|it| (it.name.clone(), it.parent)).collect()
    };
    let expected = joints(&first.skeleton);
    let all = data.train.iter().chain(&data.validation).chain(&data.test);
    let mut others = all.filter(|it| joints(&it.clip.skeleton) != expected);
    match others.next() {
        None => Ok(()),
        Some(other) => Err(bad(format!(
            "{} and {} are on skeletons with other joints; scores need one for all clips: give \
             clips of one kind, or a mapping",
            first.name,
            other.name()
        ))),
    }
}
