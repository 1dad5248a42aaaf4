//! Windows in the frame of keyframe k1, its root at the origin, as the recurrent network reads
//! them: there all are alike wherever the dancer is and looks.

/// What is given of windows of one length.
#[derive(Debug, Clone)]
pub(super) struct GivenWindows<T> {
    pub windows: usize,
    /// N: k2 is the N-th frame after k1.
    pub transition: usize,
    /// Parent of each joint, `[J]`.
    pub parents: Vec<Option<usize>>,
    /// Bones, `[windows, 3 J]`, cm; the root's is 0.
    pub offsets: Vec<T>,
    /// The frames of the past that the LSTM is run over, then k1.
    pub lead: Vec<GivenState<T>>,
    /// What the LSTM's first state follows from beside the first frame, `[windows, n]`.
    pub first: Vec<T>,
    /// Rotations of k2, each the nearer of two to k1's, `[windows, 4 J]`.
    pub target_rotations: Vec<T>,
    /// Root of k2, `[windows, 3]`, cm.
    pub target_root: Vec<T>,
}

/// A frame of all windows.
#[derive(Debug, Clone)]
pub(super) struct GivenState<T> {
    /// Local rotations (x, y, z, w), `[windows, 4 J]`.
    pub rotations: Vec<T>,
    /// `[windows, 3]`, cm.
    pub root: Vec<T>,
    /// Of the root, `[windows, 3]`, cm/frame.
    pub velocity: Vec<T>,
    /// Labels of left ankle and toe, right ankle and toe, `[windows, 4]`.
    pub contacts: Vec<T>,
}

/// The frames k1 .. k2 as recorded.
#[derive(Debug, Clone, Default)]
pub(super) struct Recorded<T> {
    /// `[windows, 4 J]` each, along a window with continuous signs.
    pub rotations: Vec<Vec<T>>,
    /// `[windows, 3]` each, cm.
    pub roots: Vec<Vec<T>>,
    /// `[windows, 4]` each.
    pub contacts: Vec<Vec<T>>,
}
