//! What is asked of a model that samples dances.

use ndarray::Array2;

use crate::data::{Dataset, Recording};
use crate::evaluation::protocol::EvaluationError;
use crate::evaluation::windows::{bad, failed};
use crate::models::Generator;
use crate::models::dance_features::heard_by;
use crate::models::generator::{Condition, Given, NeededPoses, Request};

/// Frames that clips name as those of new poses.
const NOVEL_FRAMES: &str = "novel";

/// How a model samples, frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sampler {
    /// Of true motion before the first that it makes.
    pub seed: usize,
    /// That it predicts together.
    pub predicted: usize,
    /// Of music behind a frame that it hears.
    pub look_ahead: usize,
}

impl Sampler {
    pub fn of(model: &dyn Generator) -> Result<Self, EvaluationError> {
        match (model.needs().poses, model.sampling()) {
            (NeededPoses::Seed(seed), Some(sampling)) => Ok(Self {
                seed,
                predicted: sampling.predicted,
                look_ahead: sampling.look_ahead,
            }),
            _ => Err(bad(format!(
                "{} does not sample a dance frame by frame from a seed",
                model.name()
            ))),
        }
    }

    /// As [`dance_question`], for music that is known.
    pub fn question(
        &self,
        (song, music): (&Recording, Option<Array2<f64>>),
        seed: &Recording,
        drawn: u64,
    ) -> Request {
        let clip = &seed.clip;
        let given = clip.poses.iter().take(self.seed).enumerate();
        let given = given.map(|(frame, pose)| Given {
            frame: frame as i64,
            pose: pose.clone(),
            features: None,
        });
        let frames = song.frames().saturating_sub(self.look_ahead);
        Request {
            given: given.collect(),
            music,
            seed: drawn,
            ..Request::new(clip.skeleton.clone(), clip.frame_time, frames)
        }
    }

    /// Frames of a window: seed, and what is predicted or heard from there on.
    pub fn window(&self) -> usize {
        self.seed + self.predicted.max(self.look_ahead + 1)
    }
}

/// What a model hears of a recording, `[frames, numbers]`; none of one that does not hear.
pub(super) fn music_of(
    model: &dyn Generator,
    recording: &Recording,
) -> Result<Option<Array2<f64>>, EvaluationError> {
    if !model.needs().reads(Condition::Music) {
        return Ok(None);
    }
    let heard = heard_by(model, recording);
    let heard = heard.map_err(|source| failed(model, recording.name(), source))?;
    Ok(Some(heard))
}

/// What a model is asked to dance: a song, from the first frames of a recording; the dance ends
/// where it would hear music behind the song's end. The song must be longer than the seed.
///
/// # Errors
/// The model does not sample dances, or hears what the song does not come with.
pub fn dance_question(
    model: &dyn Generator,
    song: &Recording,
    seed: &Recording,
    drawn: u64,
) -> Result<Request, EvaluationError> {
    let sampler = Sampler::of(model)?;
    Ok(sampler.question((song, music_of(model, song)?), seed, drawn))
}

/// Whether all of so many frames from `first` on show poses that the data calls new.
pub(super) fn are_novel(data: &Dataset, recording: &Recording, first: usize, count: usize) -> bool {
    let clips = data.named_frames.get(NOVEL_FRAMES);
    let ranges = clips.and_then(|clips| clips.get(recording.name()));
    let mut ranges = ranges.into_iter().flatten();
    ranges.any(|range| range.start <= first && first + count <= range.end)
}
