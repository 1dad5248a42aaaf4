//! Numbers of a recording's music that its data set gives where there is no sound to hear.

use ndarray::Array2;

/// What a data set says of the music of a recording, from frame 0 of the motion on.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenMusic {
    /// Numbers of every frame, at the motion's rate, `[frames, numbers]`.
    pub columns: Array2<f32>,
    /// The columns that are raw magnitudes, over several powers of ten, ascending.
    pub magnitudes: Vec<usize>,
    /// The column of onset strength.
    pub onset: usize,
    /// Times of the music's beats, s, ascending.
    pub beats: Vec<f64>,
}
