//! Which windows are cut from the clips.

use crate::data::{Window, WindowCut};

/// The windows of one length, and the clips that are too short for it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Windows {
    /// N + 1 frames each (frame k1 = `start`, k2 = `start + N`); by clip, then by start.
    pub windows: Vec<Window>,
    /// Indices of the clips with fewer than N + 1 frames.
    pub skipped: Vec<usize>,
}

/// How windows of `transition + 1` frames are cut: one starts every ceil(0.1 (N + 1)) frames.
pub(super) fn cut(transition: usize) -> WindowCut {
    let frames = transition + 1;
    WindowCut {
        frames,
        every: frames.div_ceil(10),
        strictly: false,
    }
}

/// Windows of `transition + 1` frames of clips with these numbers of frames; one starts every
/// ceil(0.1 (N + 1)) frames.
pub fn windows(clip_frames: &[usize], transition: usize) -> Windows {
    let cut = cut(transition);
    Windows {
        windows: cut.windows(clip_frames),
        skipped: cut.too_short(clip_frames),
    }
}
