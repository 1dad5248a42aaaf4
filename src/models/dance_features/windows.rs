//! At which frames of a piece there is a window (spec, section 1).

use std::ops::Range;

use crate::data::WindowCut;

/// Frames that a window reads and predicts about its frame i.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contexts {
    /// Motion i - motion .. i - 1 is known.
    pub motion: usize,
    /// Music i - audio_past .. i + audio_future - 1 is known.
    pub audio_past: usize,
    pub audio_future: usize,
    /// N: motion i .. i + N - 1 is predicted.
    pub predicted: usize,
}

impl Contexts {
    /// Frames before i that must be there.
    pub fn past(&self) -> usize {
        self.motion.max(self.audio_past)
    }

    /// Frames from i on that must be there.
    pub fn future(&self) -> usize {
        self.audio_future.max(self.predicted)
    }

    /// The frames i of a piece of `frames` frames at which a window lies inside it.
    pub fn starts(&self, frames: usize) -> Range<usize> {
        let past = self.past();
        past..(frames + 1).saturating_sub(self.future()).max(past)
    }

    /// The windows of pieces at every `every`-th of these frames of each. A
    /// [`Window::start`](crate::data::Window::start) is the first frame of all that is read:
    /// i - [`Contexts::past`].
    pub fn cut(&self, every: usize) -> WindowCut {
        WindowCut {
            frames: self.past() + self.future(),
            every,
            strictly: false,
        }
    }

    /// Rows of a piece's motion that are known at i, one of its [`Contexts::starts`], as below.
    pub fn motion_rows(&self, i: usize) -> Range<usize> {
        i - self.motion..i
    }

    /// Rows of a piece's music that are known at i.
    pub fn audio_rows(&self, i: usize) -> Range<usize> {
        i - self.audio_past..i + self.audio_future
    }

    /// Rows of a piece's motion that are predicted at i.
    pub fn target_rows(&self, i: usize) -> Range<usize> {
        i..i + self.predicted
    }
}
