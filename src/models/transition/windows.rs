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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stride_is_the_tenth_of_the_window_rounded_up() {
        for (transition, stride) in [
            (5, 1),
            (9, 1),
            (10, 2),
            (50, 6),
            (99, 10),
            (100, 11),
            (150, 16),
        ] {
            assert_eq!(
                windows(&[1000], transition).windows[1].start,
                stride,
                "N = {transition}"
            );
        }
    }

    #[test]
    fn the_last_window_fits_and_no_further_one_would() {
        let found = windows(&[23, 11, 10], 10);
        let starts = |clip| {
            found
                .windows
                .iter()
                .filter(|w| w.clip == clip)
                .map(|w| w.start)
                .collect::<Vec<_>>()
        };
        assert_eq!(starts(0), [0, 2, 4, 6, 8, 10, 12]);
        assert_eq!(starts(1), [0]);
        assert_eq!(found.skipped, [2]);
    }
}
