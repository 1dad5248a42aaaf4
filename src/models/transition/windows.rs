//! Which windows are cut from the clips.

/// One window: N + 1 frames of a clip, from `start` on (frame k1 = `start`, k2 = `start + N`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Index of the clip.
    pub clip: usize,
    /// Index of the window's first frame in the clip.
    pub start: usize,
}

/// The windows of one length, and the clips that are too short for it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Windows {
    /// By clip, then by start.
    pub windows: Vec<Window>,
    /// Indices of the clips with fewer than N + 1 frames.
    pub skipped: Vec<usize>,
}

/// Windows of `transition + 1` frames of clips with these numbers of frames; a window starts every
/// ceil(0.1 (N + 1)) frames.
pub fn windows(clip_frames: &[usize], transition: usize) -> Windows {
    let length = transition + 1;
    let stride = length.div_ceil(10);
    let mut found = Windows {
        windows: Vec::new(),
        skipped: Vec::new(),
    };
    for (clip, &frames) in clip_frames.iter().enumerate() {
        match frames.checked_sub(length) {
            Some(last) => found.windows.extend(
                (0..=last)
                    .step_by(stride)
                    .map(|start| Window { clip, start }),
            ),
            None => found.skipped.push(clip),
        }
    }
    found
}
