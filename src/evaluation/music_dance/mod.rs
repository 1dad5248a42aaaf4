//! The protocol `music_dance`: dances made to music from a seed and key poses, after Pu and Shan
//! (2022), who give its three scores and no more of it.
//!
//! - [`consistency`]: how well key poses are kept to (eq. 13), and distances about the root;
//! - [`smoothness`] (eq. 16), [`jerk`]: how evenly a dance moves;
//! - [`beats`]: hit rate, alignment and what chance gives;
//! - [`kinetic`], [`geometric`], [`standardisation`]: features of a window, for FID and diversity.

mod answer;
mod beat_scores;
pub mod beats;
pub mod consistency;
pub mod geometric;
pub mod jerk;
pub mod kinetic;
mod metrics;
mod paper;
mod relations;
mod request;
pub mod smoothness;
pub mod standardisation;
mod window;

use std::ops::Range;

use rayon::prelude::*;

use super::protocol::{Evaluation, EvaluationError, EvaluationOptions, Protocol};
use super::windows::{CHUNK, answers, bad, failed, in_chunks, spread};
use super::{Metric, Scores};
use crate::counted::counted;
use crate::data::{BeatExtrema, DataPart, Dataset, Recording, Window, WindowCut};
use crate::models::Generator;
use crate::models::generator::{Condition, Request};
use crate::motion::{Pose, Skeleton};
use answer::Answer;
use beat_scores::{ClipBeats, DELTAS};
use metrics::{ALL, Measured, NOVEL};
use request::request;
use window::{Body, Character, Errors};

pub use paper::PU2022;
pub use request::{SEED, key_frames};

/// The rate of motion and music that every speed is told by.
const FRAMES_PER_SECOND: f64 = crate::music::FRAME_RATE;
/// Frames that clips name as those of new poses.
const NOVEL_FRAMES: &str = "novel";
/// Windows of 240 frames, every 90.
const CUT: WindowCut = WindowCut {
    frames: 240,
    every: 90,
    strictly: false,
};

/// How dances to music are scored (spec, section 8).
///
/// **Windows** of 240 frames start every 90: 60 frames of seed, key poses every 45 frames after it
/// (frames 104, 149, 194 and 239 from 0), the music. Scored are the 180 frames after the seed, as
/// rotations; the consistency error alone takes the numbers as the model gave them. Errors stand in
/// two columns: over all frames, and over those that the data calls new.
///
/// **Whole clips** for the beats: the first 60 frames are the seed and scored with the rest, key
/// poses stand every 45 frames to the clip's end.
///
/// Beside a score of the model stand those of the recorded dance, of chance (the recorded dance and
/// beats shifted round the clip), and of the training clips, which are the floor of the Frechet
/// distances; beside its beat hits those that its own dance has by chance.
///
/// Clips are on one skeleton with the joints of the dance skeleton, at 30 frames a second, with
/// music.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MusicDance {
    extrema: BeatExtrema,
    most_windows: Option<usize>,
}

impl MusicDance {
    pub fn new(options: &EvaluationOptions) -> Self {
        Self {
            extrema: BeatExtrema::default(),
            most_windows: options.most_windows,
        }
    }

    /// The same with other extrema of the speed as beats of the motion.
    #[must_use]
    pub fn with_beats(self, extrema: BeatExtrema) -> Self {
        Self { extrema, ..self }
    }

    /// How windows are cut from clips.
    pub fn windows(&self) -> WindowCut {
        CUT
    }

    /// Frames at which key poses are given in a whole dance of so many frames.
    pub fn key_frames(&self, frames: usize) -> impl Iterator<Item = usize> {
        request::key_frames(frames)
    }

    fn cut(&self, frames: &[usize]) -> Vec<Window> {
        spread(CUT.windows(frames), self.most_windows)
    }
}

/// What all requests of an evaluation share.
struct Asked<'d> {
    model: &'d dyn Generator,
    recordings: &'d [Recording],
    /// Of each recording.
    bodies: Vec<Body<'d>>,
    extrema: BeatExtrema,
}

impl Asked<'_> {
    fn request(&self, clip: usize, stretch: Range<usize>) -> Result<Request, EvaluationError> {
        // A draw of its own for every window, whatever else is scored.
        let seed = ((clip as u64) << 32) | stretch.start as u64;
        window_question(self.model, &self.recordings[clip], stretch, seed)
    }

    fn answers(&self, asked: &[(usize, Range<usize>)]) -> Result<Vec<Answer>, EvaluationError> {
        let name = |(clip, stretch): &(usize, Range<usize>)| {
            let (clip, last) = (self.recordings[*clip].name(), stretch.end.saturating_sub(1));
            format!("{clip}, frames {} to {last}", stretch.start)
        };
        let requests = asked
            .iter()
            .map(|(clip, stretch)| self.request(*clip, stretch.clone()));
        let requests: Vec<Request> = requests.collect::<Result<_, _>>()?;
        let what = || {
            let first = asked.first().map_or(String::new(), name);
            format!("a chunk of windows that starts with {first}")
        };
        let ask = |requests: &[Request]| self.model.generate(requests);
        let motions = answers(self.model, &requests, ask, what)?;
        let motions = asked.iter().zip(requests.iter().zip(motions));
        motions
            .map(|(asked, (request, motion))| {
                let answer = Answer::of(request, motion);
                answer.map_err(|source| failed(self.model, &name(asked), source))
            })
            .collect()
    }

    fn windows(
        &self,
        windows: &[Window],
        data: &Dataset,
    ) -> Result<Vec<(Errors, [Character; 2])>, EvaluationError> {
        let stretch = |window: &Window| (window.clip, window.start..window.start + CUT.frames);
        let stretches: Vec<(usize, Range<usize>)> = windows.iter().map(stretch).collect();
        let answers = self.answers(&stretches)?.into_iter().zip(stretches);
        let measured = answers.map(|(answer, (clip, stretch))| {
            let recording = &self.recordings[clip];
            let recorded = &recording.clip.poses[stretch.clone()];
            let novel = novel_frames(data, recording, stretch);
            let body = &self.bodies[clip];
            let errors = body.errors(recorded, &answer, &novel);
            (
                errors,
                [&answer.poses, recorded].map(|poses| body.character(poses)),
            )
        });
        Ok(measured.collect())
    }

    fn clip(&self, clip: usize) -> Result<ClipBeats, EvaluationError> {
        let recording = &self.recordings[clip];
        let recorded: &[Pose] = &recording.clip.poses;
        let music = recording
            .music
            .as_ref()
            .ok_or_else(|| no_music(recording))?;
        let mut sum = ClipBeats::default();
        for answer in self.answers(&[(clip, 0..recorded.len())])? {
            let (skeleton, poses) = (&recording.clip.skeleton, [recorded, &answer.poses]);
            let of = ClipBeats::of(
                recording.name(),
                skeleton,
                poses,
                &music.beats,
                self.extrema,
            );
            sum.add(&of);
        }
        Ok(sum)
    }
}

/// What a model is asked about frames of a recording, as the protocol asks: the poses of the seed
/// and of the key frames, and the music where it reads it. The recording must have the frames.
///
/// # Errors
/// The recording has no music.
pub fn window_question(
    model: &dyn Generator,
    recording: &Recording,
    frames: Range<usize>,
    seed: u64,
) -> Result<Request, EvaluationError> {
    let reads_music = model.needs().reads(Condition::Music);
    let music = reads_music.then(|| model.music_features());
    request(recording, frames, music, seed).ok_or_else(|| no_music(recording))
}

impl Protocol for MusicDance {
    fn name(&self) -> &'static str {
        "music_dance"
    }

    fn about(&self) -> &'static str {
        "the 180 frames after a seed of 60, key poses every 45, in windows of 240 frames every 90; \
         beats over whole clips"
    }

    fn metrics(&self) -> &[Metric] {
        &metrics::METRICS
    }

    fn number(&self) -> &'static str {
        "delta"
    }

    fn frames(&self, recordings: &[usize]) -> u64 {
        let whole = recordings.iter().filter(|frames| **frames >= CUT.needed());
        let whole: usize = whole.sum();
        (self.cut(recordings).len() * CUT.frames + whole) as u64
    }

    fn evaluate(
        &self,
        subject: &dyn Generator,
        data: &Dataset,
        part: DataPart,
    ) -> Result<Evaluation, EvaluationError> {
        let recordings = part.of(data)?;
        let frames: Vec<usize> = recordings.iter().map(Recording::frames).collect();
        let windows = self.cut(&frames);
        if windows.is_empty() {
            let (needed, longest) = (CUT.frames, frames.iter().max().unwrap_or(&0));
            return Err(bad(format!(
                "no clip has the {needed} frames of a window, the longest has {longest}; give longer \
                 clips"
            )));
        }
        check_clips(data)?;
        let asked = Asked {
            model: subject,
            recordings,
            bodies: bodies(recordings)?,
            extrema: self.extrema,
        };
        let mut measured = Measured::default();
        let mut with_novel = 0;
        let of_chunk = |windows: &[Window]| asked.windows(windows, data);
        for (errors, [made, real]) in in_chunks(&windows, CHUNK, of_chunk)? {
            with_novel += usize::from(errors.has_novel());
            measured.errors.join(&errors);
            measured.made.push(made);
            measured.real.push(real);
        }
        measured.train = training_windows(data)?;
        let short = CUT.too_short(&frames);
        let whole = (0..recordings.len()).filter(|clip| !short.contains(clip));
        let whole: Vec<usize> = whole.collect();
        let clips = in_chunks(&whole, 1, |clips: &[usize]| {
            clips.iter().map(|clip| asked.clip(*clip)).collect()
        })?;
        clips.iter().for_each(|clip| measured.beats.add(clip));

        let mut counts: Vec<(String, usize)> = (1..=DELTAS)
            .map(|delta| (delta.to_string(), whole.len()))
            .collect();
        counts.push((ALL.into(), windows.len()));
        if with_novel > 0 {
            counts.push((NOVEL.into(), with_novel));
        }
        let warning = |clip: usize| {
            let (name, had) = (recordings[clip].name(), counted(frames[clip], "frame"));
            format!(
                "{name} has {had}, fewer than a window of {}: left out of the scores",
                CUT.frames
            )
        };
        Ok(Evaluation {
            scores: Scores::new(metrics::rows(&measured), counts),
            warnings: short.into_iter().map(warning).collect(),
        })
    }
}

/// The windows of all training clips.
fn training_windows(data: &Dataset) -> Result<Vec<Character>, EvaluationError> {
    let frames: Vec<usize> = data.train.iter().map(Recording::frames).collect();
    let (windows, bodies) = (CUT.windows(&frames), bodies(&data.train)?);
    let character = |&Window { clip, start }: &Window| {
        bodies[clip].character(&data.train[clip].clip.poses[start..start + CUT.frames])
    };
    Ok(windows.par_iter().map(character).collect())
}

/// What is told once of the windows of each recording.
fn bodies(recordings: &[Recording]) -> Result<Vec<Body<'_>>, EvaluationError> {
    let bodies = recordings.iter().map(|recording| {
        let body = Body::of(&recording.clip.skeleton);
        body.map_err(|missing| bad(format!("{}: {missing}", recording.name())))
    });
    bodies.collect()
}

/// Those frames of a stretch whose poses are new, counted from its start.
fn novel_frames(data: &Dataset, recording: &Recording, stretch: Range<usize>) -> Vec<Range<usize>> {
    let ranges = data.named_frames.get(NOVEL_FRAMES);
    let ranges = ranges.and_then(|clips| clips.get(recording.name()));
    let within = |range: &Range<usize>| {
        let [first, end] = [range.start, range.end].map(|at| at.clamp(stretch.start, stretch.end));
        first - stretch.start..end - stretch.start
    };
    ranges.into_iter().flatten().map(within).collect()
}

fn no_music(recording: &Recording) -> EvaluationError {
    bad(format!(
        "{} has no music, which the beats of a dance are scored by; set data.music = true",
        recording.name()
    ))
}

/// Refuses clips on several skeletons, whose features have no common mean, and at other rates.
fn check_clips(data: &Dataset) -> Result<(), EvaluationError> {
    let joints = |skeleton: &Skeleton| -> Vec<(String, Option<usize>)> {
        let joints = skeleton.joints.iter();
        joints.map(|it| (it.name.clone(), it.parent)).collect()
    };
    let mut all = data.train.iter().chain(&data.validation).chain(&data.test);
    let mut first: Option<&Recording> = None;
    all.try_for_each(|recording| {
        let rate = 1.0 / recording.clip.frame_time;
        if (rate - FRAMES_PER_SECOND).abs() > 0.01 {
            let (name, expected) = (recording.name(), FRAMES_PER_SECOND);
            return Err(bad(format!(
                "{name} has {rate:.2} frames a second, but dances to music are scored at \
                 {expected}: set data.fps = {expected}"
            )));
        }
        let first = *first.get_or_insert(recording);
        match joints(&recording.clip.skeleton) == joints(&first.clip.skeleton) {
            true => Ok(()),
            false => Err(bad(format!(
                "{} ({}) and {} are on skeletons with other joints; scores need one for all clips: \
                 give clips of one kind, or a mapping",
                first.name(),
                counted(first.clip.skeleton.len(), "joint"),
                recording.name()
            ))),
        }
    })
}
