//! What differs from one data set to the other (spec, section 7): windows, keyframes, lengths and
//! the orientation of the scores.

use super::placement::Heading;
use crate::data::WindowCut;
use crate::motion::facing::FacingJoints;
use crate::motion::{MissingJoint, Skeleton};

/// How the protocol cuts and places the windows of a data set. Frames of a window count from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DataSet {
    /// Windows that are scored.
    pub scored: WindowCut,
    /// Windows of training clips that sigma of L2P is taken over.
    pub training: WindowCut,
    /// The lengths N of the paper's tables and figures.
    pub lengths: &'static [usize],
    /// Frame of keyframe k1; the frames before it are the past.
    pub start: usize,
    /// Whether N counts the two keyframes.
    pub counts_keyframes: bool,
    /// Whether the scores look along the root's +Y, else along the body.
    pub along_root: bool,
    pub about: &'static str,
}

impl DataSet {
    pub const DANCE: Self = Self {
        scored: WindowCut {
            frames: 50,
            every: 10,
            strictly: false,
        },
        training: WindowCut {
            frames: 50,
            every: 10,
            strictly: false,
        },
        lengths: &[10, 30, 50],
        start: 0,
        counts_keyframes: true,
        along_root: false,
        about: "the N - 2 frames between two keyframes, in windows of 50 frames every 10",
    };

    /// Strictly, as in the public benchmark.
    pub const LAFAN1: Self = Self {
        scored: WindowCut {
            frames: 65,
            every: 40,
            strictly: true,
        },
        training: WindowCut {
            frames: 50,
            every: 20,
            strictly: true,
        },
        lengths: &[5, 15, 30, 45],
        start: 9,
        counts_keyframes: false,
        along_root: true,
        about: "the N frames between two keyframes after 9 past ones, in windows of 65 frames \
                every 40",
    };

    /// Frames from k1 to k2, both counted.
    pub fn span(&self, length: usize) -> usize {
        length + if self.counts_keyframes { 0 } else { 2 }
    }

    /// Refuses a length that leaves nothing to score, or that a window does not hold.
    pub fn check(&self, length: usize) -> Result<(), String> {
        let (least, room) = (3, self.scored.frames - self.start);
        if (least..=room).contains(&self.span(length)) {
            return Ok(());
        }
        let keyframes = self.span(0);
        let (least, most, frames) = (least - keyframes, room - keyframes, self.scored.frames);
        let counted = match self.counts_keyframes {
            true => "N counts both keyframes",
            false => "N counts the frames between the keyframes, the first of which is frame 9",
        };
        Err(format!(
            "a window of {frames} frames has no place for N = {length}: {counted}; give lengths \
             of {least} to {most}"
        ))
    }

    /// Which way windows on this skeleton look in the scores.
    pub fn heading(&self, skeleton: &Skeleton) -> Result<Heading, MissingJoint> {
        Ok(match self.along_root {
            true => Heading::RootUp,
            false => Heading::Body(FacingJoints::of(skeleton)?),
        })
    }
}
