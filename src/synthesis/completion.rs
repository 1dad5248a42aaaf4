//! A dance between keyframes by a model that makes rotations, on any skeleton.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use glam::DVec3;
use ndarray::Array2;
use rand::RngExt as _;
use serde::Serialize;

use super::SynthesisError;
use super::request::check_times;
use super::summary::Units;
use crate::counted::counted;
use crate::models::generator::{Condition, Given, Request};
use crate::models::{Generator, Streams};
use crate::motion::{Clip, Feet, Foot, Pose, Skeleton};

/// A root further than this from its keyframe gets a warning, cm.
const WIDE_GAP: f64 = 5.0;

/// Keyframes of one dancer, and which foot stands when.
#[derive(Debug, Clone, PartialEq)]
pub struct CompletionRequest {
    pub skeleton: Skeleton,
    /// Seconds from one frame to the next.
    pub frame_time: f64,
    /// By ascending frame of the result, the first at 0.
    pub keyframes: Vec<(usize, Pose)>,
    /// The foot in contact, `[F]`; none where none is asked for.
    pub contacts: Option<Vec<Foot>>,
}

/// A dance that a model made of a [`CompletionRequest`].
#[derive(Debug, Clone, PartialEq)]
pub struct Completion {
    /// F poses on the request's skeleton; the rotations of the keyframes are the keyframes'.
    pub clip: Clip,
    /// By how much the root misses each keyframe but the first, with its frame, cm.
    pub gaps: Vec<(usize, f64)>,
    /// The foot that stands, `[F]`; none of a model that does not say.
    pub contacts: Option<Vec<Foot>>,
    /// Mean distance that the joint of the standing foot moves a frame in the world, cm/frame; the
    /// less of ankle and toe.
    pub foot_speed: Option<f64>,
}

/// Feet on the ground by ranges of frames: "left:0-9,right:10-24,both:25-30".
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ContactSequence {
    /// A foot, none for both, and its frames.
    parts: Vec<(Option<Foot>, RangeInclusive<usize>)>,
}

impl FromStr for ContactSequence {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let part = |part: &str| {
            let (foot, frames) = part.trim().split_once(':')?;
            let foot = match foot.trim() {
                "left" => Some(Foot::Left),
                "right" => Some(Foot::Right),
                "both" => None,
                _ => return None,
            };
            let (first, last) = frames.split_once('-').unwrap_or((frames, frames));
            let (first, last) = (first.trim().parse().ok()?, last.trim().parse().ok()?);
            (first <= last).then_some((foot, first..=last))
        };
        let parts: Option<Vec<_>> = text.split(',').map(part).collect();
        let parts =
            parts.ok_or("expected FOOT:FIRST-LAST, such as left:0-9,right:10-24,both:25-30")?;
        Ok(Self { parts })
    }
}

impl ContactSequence {
    /// The foot of every frame, `[frames]`. Where both stand one is drawn from the seed and held
    /// (Li et al., section 4.6).
    ///
    /// # Errors
    /// A frame without a foot, with two, or beyond the last.
    pub fn labels(&self, frames: usize, seed: u64) -> Result<Vec<Foot>, SynthesisError> {
        let mut labels = vec![None; frames];
        for (index, (foot, range)) in self.parts.iter().enumerate() {
            let mut drawn = Streams::new(seed).stream("both_feet", &[index as u64]);
            let foot = foot.unwrap_or(match drawn.random() {
                true => Foot::Right,
                false => Foot::Left,
            });
            for frame in range.clone() {
                match labels.get_mut(frame) {
                    Some(label @ None) => *label = Some(foot),
                    Some(_) => return Err(SynthesisError::ContactTwice { frame }),
                    None => {
                        let last = frames.saturating_sub(1);
                        return Err(SynthesisError::ContactBeyond { frame, last });
                    }
                }
            }
        }
        let missing = labels.iter().position(Option::is_none);
        match missing {
            Some(frame) => Err(SynthesisError::NoContact { frame, frames }),
            None => Ok(labels.into_iter().flatten().collect()),
        }
    }
}

impl CompletionRequest {
    /// F.
    pub fn frames(&self) -> usize {
        self.keyframes.last().map_or(0, |(time, _)| time + 1)
    }

    fn as_request(&self, seed: u64) -> Request {
        let keyframes = self.keyframes.iter().map(|(time, pose)| Given {
            frame: *time as i64,
            pose: pose.clone(),
            features: None,
        });
        let contacts = self.contacts.as_ref().map(|feet| {
            Array2::from_shape_fn((feet.len(), 2), |(frame, foot)| feet[frame].one_hot()[foot])
        });
        Request {
            given: keyframes.collect(),
            contacts,
            seed,
            ..Request::new(self.skeleton.clone(), self.frame_time, self.frames())
        }
    }
}

/// Asks a model that makes rotations for the dance of a request and makes it a clip `name`.
///
/// # Errors
/// Keyframes out of order; a model that fails, or that gives no rotations.
pub fn complete(
    model: &dyn Generator,
    request: &CompletionRequest,
    seed: u64,
    name: &str,
) -> Result<Completion, SynthesisError> {
    let times: Vec<usize> = request.keyframes.iter().map(|(time, _)| *time).collect();
    check_times(&times)?;
    let mut asked = request.as_request(seed);
    if !model.needs().reads(Condition::Contacts) {
        asked.contacts = None;
    }
    let to = request.frames() - 1;
    let failed = |source| SynthesisError::Transition {
        from: 0,
        to,
        source: Box::new(source),
    };
    let motions = model
        .generate(std::slice::from_ref(&asked))
        .map_err(failed)?;
    let motion = motions.into_iter().next();
    let lacking = || SynthesisError::NoTransition {
        model: model.name().into(),
    };
    let motion = motion.ok_or_else(lacking)?;
    motion.check(&asked).map_err(failed)?;
    let poses = motion.poses.ok_or_else(lacking)?;
    let gaps = request.keyframes[1..].iter().map(|(time, pose)| {
        let gap = poses[*time].translations[0].distance(pose.translations[0]);
        (*time, gap)
    });
    let contacts = motion.contacts.filter(|contacts| contacts.ncols() == 2);
    let contacts = contacts.map(|contacts| {
        let rows = contacts.rows().into_iter();
        rows.map(|row| Foot::larger([row[0], row[1]]))
            .collect::<Vec<Foot>>()
    });
    let world = request.skeleton.world_positions(&poses);
    let feet = Feet::of(&request.skeleton).ok();
    let foot_speed = contacts.as_ref().zip(feet).map(|(contacts, feet)| {
        let [ankles, toes] = [feet.ankles, feet.toes].map(|joints| speed(&world, joints, contacts));
        ankles.min(toes)
    });
    Ok(Completion {
        gaps: gaps.collect(),
        contacts,
        foot_speed,
        clip: Clip {
            name: name.into(),
            skeleton: request.skeleton.clone(),
            frame_time: request.frame_time,
            poses,
        },
    })
}

/// Mean distance that the joint of the standing foot moves to the next frame, cm/frame.
fn speed(world: &[Vec<DVec3>], joints: [usize; 2], contacts: &[Foot]) -> f64 {
    let steps = world.windows(2).zip(contacts);
    let steps: Vec<f64> = steps
        .map(|(pair, foot)| {
            let joint = joints[foot.index()];
            pair[1][joint].distance(pair[0][joint])
        })
        .collect();
    steps.iter().sum::<f64>() / steps.len().max(1) as f64
}

impl Completion {
    /// Warnings of keyframes whose root the dance misses.
    pub fn gap_warnings(&self) -> Vec<String> {
        let wide = self.gaps.iter().filter(|(_, gap)| *gap > WIDE_GAP);
        wide.map(|(time, gap)| {
            format!(
                "the root is {gap:.1} cm from that of the keyframe at frame {time}: the dance goes \
                 where the feet carry it; --set rtr.meet_target=linear spreads the gap, and the \
                 feet slide"
            )
        })
        .collect()
    }
}

/// The numbers of a completed dance: as text and as JSON.
#[derive(Debug, Serialize)]
pub struct CompletionSummary {
    model: String,
    frames: usize,
    fps: f64,
    keyframes: Vec<KeyframeGap>,
    /// Mean distance that the standing foot moves a frame, cm/frame.
    standing_foot_speed: Option<f64>,
    warnings: Vec<String>,
    units: Units,
}

#[derive(Debug, Serialize)]
struct KeyframeGap {
    frame: usize,
    /// From the root of the result to the keyframe's, cm; none for the first.
    root_gap: Option<f64>,
}

impl CompletionSummary {
    /// `model`: what to call the model.
    pub fn new(
        model: &str,
        request: &CompletionRequest,
        completion: &Completion,
        warnings: Vec<String>,
    ) -> Self {
        let first = KeyframeGap {
            frame: 0,
            root_gap: None,
        };
        let others = completion.gaps.iter().map(|&(frame, gap)| KeyframeGap {
            frame,
            root_gap: Some(gap),
        });
        Self {
            model: model.into(),
            frames: completion.clip.poses.len(),
            fps: 1.0 / request.frame_time,
            keyframes: [first].into_iter().chain(others).collect(),
            standing_foot_speed: completion.foot_speed,
            warnings,
            units: Units::from([
                ("fps", "frames/s"),
                ("root_gap", "cm"),
                ("standing_foot_speed", "cm/frame"),
            ]),
        }
    }
}

impl fmt::Display for CompletionSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.model)?;
        let frames = counted(self.frames, "frame");
        writeln!(f, "{frames} at {:.4} a second", self.fps)?;
        for KeyframeGap { frame, root_gap } in &self.keyframes {
            match root_gap {
                Some(gap) => writeln!(
                    f,
                    "keyframe at frame {frame}: its pose is met, its root missed by {gap:.1} cm"
                )?,
                None => writeln!(f, "keyframe at frame {frame}")?,
            }
        }
        match self.standing_foot_speed {
            Some(speed) => writeln!(f, "the standing foot slides {speed:.2} cm/frame"),
            None => writeln!(f, "the model says of no foot that it stands"),
        }
    }
}
