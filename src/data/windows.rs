//! Windows of frames, cut from clips at even distances.

/// A window: frames of a clip from `start` on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Index of the clip.
    pub clip: usize,
    /// Index of the window's first frame in the clip.
    pub start: usize,
}

/// How windows are cut from clips.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WindowCut {
    /// Frames of a window.
    pub frames: usize,
    /// Frames from the start of one window to that of the next; 0 counts as 1.
    pub every: usize,
    /// Whether the window that would end with a clip's last frame is left out.
    pub strictly: bool,
}

impl WindowCut {
    /// Frames that a clip must have to give a window.
    pub fn needed(&self) -> usize {
        self.frames + usize::from(self.strictly)
    }

    /// How many windows clips with these numbers of frames give.
    pub fn count(&self, clip_frames: &[usize]) -> usize {
        let of_clip = |&frames: &usize| self.starts(frames).div_ceil(self.every.max(1));
        clip_frames.iter().map(of_clip).sum()
    }

    /// Frames of a clip at which a window could start.
    fn starts(&self, frames: usize) -> usize {
        (frames + 1).saturating_sub(self.needed())
    }

    /// The windows of clips with these numbers of frames, by clip, then by start; the first starts
    /// at frame 0.
    pub fn windows(&self, clip_frames: &[usize]) -> Vec<Window> {
        let clips = clip_frames.iter().enumerate();
        let windows = clips.flat_map(|(clip, &frames)| {
            let starts = (0..self.starts(frames)).step_by(self.every.max(1));
            starts.map(move |start| Window { clip, start })
        });
        windows.collect()
    }

    /// Indices of the clips that give no window.
    pub fn too_short(&self, clip_frames: &[usize]) -> Vec<usize> {
        let clips = clip_frames.iter().enumerate();
        clips
            .filter(|(_, frames)| **frames < self.needed())
            .map(|(clip, _)| clip)
            .collect()
    }
}
