//! Controls that contradict each other or go beyond what a model has seen.

use std::fmt;

use ndarray::ArrayView1;

use super::SequenceRequest;
use crate::counted::counted;
use crate::models::generator::Condition;
use crate::models::transition::DataRanges;
use crate::motion::{PART_NAMES, PART_WEIGHTS};

/// The longest transition of the paper, frames.
const LONGEST: usize = 250;
/// A root that a keyframe was moved by more than this is worth a word, cm.
const MOVED: f64 = 1.0;
const TRUNK: usize = 0;
/// A contradiction is a trunk that would have to move at more than this many times its velocity
/// factor, and by more than `SLACK` cm/frame more.
const TOLERANCE: f64 = 1.2;
const SLACK: f64 = 0.2;

/// The frames in which a control is out of range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Excess {
    /// The worst of them.
    pub frame: usize,
    /// What is asked for there.
    pub asked: f64,
    pub bound: f64,
    /// How many they are.
    pub frames: usize,
}

/// A control out of range; its `Display` says by how much.
#[derive(Debug, Clone, PartialEq)]
pub enum ControlWarning {
    RootSpeed(Excess),
    RootHeight(Excess),
    /// Of a part of the body.
    VelocityFactor(usize, Excess),
    /// The trunk's velocity factor counts the root, so the trajectory alone makes it at least the
    /// bound.
    Contradiction(Excess),
    Length {
        from: usize,
        to: usize,
    },
    /// Controls that the model does not read.
    Unread(Condition),
    /// The trajectory misses a keyframe's root, which is moved onto it.
    Moved {
        time: usize,
        distance: f64,
    },
}

impl fmt::Display for ControlWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::RootSpeed(Excess {
                frame,
                asked,
                bound,
                frames,
            }) => write!(
                f,
                "the root trajectory goes {asked:.1} cm/frame at frame {frame}, {:.1} times the training data's fastest ({bound:.1} in 99.9 % of \
                 its frames); too fast in {}",
                asked / bound,
                counted(frames, "frame")
            ),
            Self::RootHeight(Excess {
                frame,
                asked,
                bound,
                frames,
            }) => write!(
                f,
                "the root trajectory is at {asked:.0} cm height at frame {frame}, {:.0} cm {} the training data's {} ({bound:.0} in 99.9 % of its \
                 frames); so in {}",
                (asked - bound).abs(),
                if asked > bound { "above" } else { "below" },
                if asked > bound { "highest" } else { "lowest" },
                counted(frames, "frame")
            ),
            Self::VelocityFactor(
                part,
                Excess {
                    frame,
                    asked,
                    bound,
                    frames,
                },
            ) => write!(
                f,
                "the velocity factor of {} is {asked:.1} cm/frame at frame {frame}, {:.1} times the training data's highest ({bound:.1} in 99.9 % of \
                 its frames); too high in {}",
                PART_NAMES[part],
                asked / bound,
                counted(frames, "frame")
            ),
            Self::Contradiction(Excess {
                frame,
                asked,
                bound,
                frames,
            }) => write!(
                f,
                "the velocity factor of the trunk is {asked:.1} cm/frame at frame {frame}, but the root trajectory alone makes it {bound:.1} or \
                 more there; the two contradict each other in {}",
                counted(frames, "frame")
            ),
            Self::Length { from, to } => write!(
                f,
                "the transition from frame {from} to {to} has {} frames, longer than the paper's longest, {LONGEST}",
                to - from
            ),
            Self::Unread(condition) => write!(
                f,
                "the model reads no {}: what is asked for changes nothing between the keyframes",
                condition.title()
            ),
            Self::Moved { time, distance } => write!(
                f,
                "the root trajectory misses the root of the keyframe at frame {time} by {distance:.1} cm; the keyframe is moved onto it"
            ),
        }
    }
}

/// What a model trained on data with these ranges has not seen, and transitions longer than the
/// paper's: one warning a kind.
pub fn control_warnings(
    request: &SequenceRequest,
    ranges: Option<&DataRanges>,
) -> Vec<ControlWarning> {
    let mut warnings = Vec::new();
    for pair in request.times().windows(2) {
        let (from, to) = (pair[0], pair[1]);
        if to - from > LONGEST {
            warnings.push(ControlWarning::Length { from, to });
        }
    }
    let contradiction = beyond(shortfalls(request), 0.0).map(|excess| Excess {
        asked: request.velocity_factors[[excess.frame, TRUNK]],
        bound: least_trunk(request, excess.frame),
        ..excess
    });
    warnings.extend(contradiction.map(ControlWarning::Contradiction));
    let Some(ranges) = ranges else {
        return warnings;
    };
    let root = &request.root_trajectory;
    let speeds = (0..root.nrows()).map(|frame| match frame.checked_sub(1) {
        None => 0.0,
        Some(before) => distance(root.row(before), root.row(frame)),
    });
    warnings.extend(beyond(speeds, ranges.root_speed).map(ControlWarning::RootSpeed));
    let [lowest, highest] = ranges.root_height;
    let heights = root.column(1);
    let above = beyond(heights.iter().copied(), highest);
    let below = beyond(heights.iter().map(|height| -height), -lowest).map(|excess| Excess {
        asked: -excess.asked,
        bound: lowest,
        ..excess
    });
    let heights = [above, below].into_iter().flatten();
    warnings.extend(heights.map(ControlWarning::RootHeight));
    for (part, &bound) in ranges.velocity_factors.iter().enumerate() {
        let factors = request.velocity_factors.column(part);
        let excess = beyond(factors.iter().copied(), bound);
        warnings.extend(excess.map(|excess| ControlWarning::VelocityFactor(part, excess)));
    }
    warnings
}

/// What the trajectory alone makes of the trunk's velocity factor (eq. 1 with a body that keeps its
/// pose), cm/frame.
fn least_trunk(request: &SequenceRequest, frame: usize) -> f64 {
    let Some(before) = frame.checked_sub(1) else {
        return 0.0;
    };
    let root = &request.root_trajectory;
    let weights: f64 = PART_WEIGHTS[TRUNK].iter().map(|(_, weight)| weight).sum();
    let of_root = PART_WEIGHTS[TRUNK].iter().find(|(joint, _)| *joint == 0);
    let share = of_root.map_or(0.0, |(_, weight)| weight / weights);
    share * distance(root.row(before), root.row(frame))
}

/// How far the trunk's velocity factors fall short of what the trajectory makes them, in frames
/// where that is more than rounding.
fn shortfalls(request: &SequenceRequest) -> impl Iterator<Item = f64> + '_ {
    (0..request.frames()).map(|frame| {
        let asked = request.velocity_factors[[frame, TRUNK]];
        least_trunk(request, frame) - TOLERANCE * asked - SLACK
    })
}

/// Warnings of keyframes that were moved onto a trajectory by these distances (cm), in their order.
pub fn moved_warnings(request: &SequenceRequest, moved: &[f64]) -> Vec<ControlWarning> {
    let times = request.times();
    let far = times.into_iter().zip(moved.iter().copied());
    far.filter(|&(_, distance)| distance > MOVED)
        .map(|(time, distance)| ControlWarning::Moved { time, distance })
        .collect()
}

/// The values beyond a bound, the largest as what is asked for.
fn beyond(values: impl Iterator<Item = f64>, bound: f64) -> Option<Excess> {
    let beyond: Vec<(usize, f64)> = values.enumerate().filter(|(_, x)| *x > bound).collect();
    let &(frame, asked) = beyond.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Excess {
        frame,
        asked,
        bound,
        frames: beyond.len(),
    })
}

fn distance(a: ArrayView1<f64>, b: ArrayView1<f64>) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}
