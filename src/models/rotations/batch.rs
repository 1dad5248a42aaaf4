//! Windows of one length as arrays. A row is a frame, the frames of a window stand together.

use glam::{DQuat, DVec3};
use ndarray::Array2;

use super::{GivenWindow, WindowTruth};
use crate::autograd::Real;
use crate::motion::rotation_window::Interpolation;

/// W windows of T frames, rows = W T.
#[derive(Debug, Clone)]
pub struct Batch<T> {
    /// W.
    pub windows: usize,
    /// T.
    pub frames: usize,
    /// X, rotations between the keyframes (x, y, z, w), `[rows, 4 J]`.
    pub input: Array2<T>,
    /// S_k, keyframe [1, 0] or unknown [0, 1], `[rows, 2]`.
    pub keyframes: Array2<T>,
    /// S_c, right and left foot, `[rows, 2]`.
    pub contacts: Array2<T>,
    /// Frames to the nearer keyframe, `[rows, 1]`.
    pub distances: Array2<T>,
    /// Translations in the parent's frame, the root's 0, `[rows, 3 J]`, cm.
    pub offsets: Array2<T>,
    /// The root on straight lines between the keyframes, from R_1, `[rows, 3]`, cm.
    pub root: Array2<T>,
    /// P, frames before the first keyframe that are given of every window.
    pub past_frames: usize,
    /// Rotations of these, P rows a window, `[W P, 4 J]`.
    pub past_rotations: Array2<T>,
    /// The root of these from R_1, `[W P, 3]`, cm.
    pub past_root: Array2<T>,
    /// What was recorded; none where it is asked for.
    pub truth: Option<Truth<T>>,
    /// Windows of the whole step, of which these are a part.
    pub total_windows: usize,
}

/// The recorded windows of a [`Batch`].
#[derive(Debug, Clone)]
pub struct Truth<T> {
    /// Q, `[rows, 4 J]`.
    pub rotations: Array2<T>,
    /// R from R_1, `[rows, 3]`, cm.
    pub root: Array2<T>,
}

impl<T: Real> Batch<T> {
    /// Windows of one length, all of one body and with as much of the past; their truths, or none.
    /// `input` says how X is made.
    pub fn of(windows: &[GivenWindow], truths: &[WindowTruth], input: Interpolation) -> Self {
        let frames = windows.first().map_or(0, |window| window.frames);
        let rows = windows.len() * frames;
        let joints = windows.first().map_or(0, |window| window.offsets.len());
        let all = || {
            windows
                .iter()
                .flat_map(|window| (0..frames).map(move |t| (window, t)))
        };
        let quaternions = |of: Vec<Vec<Vec<DQuat>>>| {
            let rotations = of.into_iter().flatten().flatten();
            table(rows, 4 * joints, rotations.flat_map(|q| q.to_array()))
        };
        let vectors = |columns, of: Vec<DVec3>| {
            table(rows, columns, of.into_iter().flat_map(|x| x.to_array()))
        };
        let is_keyframe = |(window, t): (&GivenWindow, usize)| match window.distance(t) {
            0 => [1.0, 0.0],
            _ => [0.0, 1.0],
        };
        let past_frames = windows.first().map_or(0, |window| window.past.len());
        let past = || windows.iter().flat_map(|window| &window.past);
        let past_rotations = past().flat_map(|frame| &frame.rotations);
        let past_rotations = past_rotations.flat_map(|q| q.to_array());
        let truth = Truth {
            rotations: quaternions(truths.iter().map(|truth| truth.rotations.clone()).collect()),
            root: vectors(
                3,
                truths.iter().flat_map(|truth| truth.root.clone()).collect(),
            ),
        };
        Self {
            windows: windows.len(),
            frames,
            input: quaternions(windows.iter().map(|it| it.interpolated(input)).collect()),
            keyframes: table(rows, 2, all().flat_map(is_keyframe)),
            contacts: table(rows, 2, all().flat_map(|(window, t)| window.contacts[t])),
            distances: table(rows, 1, all().map(|(window, t)| window.distance(t) as f64)),
            offsets: vectors(
                3 * joints,
                all().flat_map(|(it, _)| it.offsets.clone()).collect(),
            ),
            root: vectors(
                3,
                windows
                    .iter()
                    .flat_map(GivenWindow::straight_root)
                    .collect(),
            ),
            past_frames,
            past_rotations: table(windows.len() * past_frames, 4 * joints, past_rotations),
            past_root: table(
                windows.len() * past_frames,
                3,
                past().flat_map(|frame| frame.root.to_array()),
            ),
            truth: (!truths.is_empty()).then_some(truth),
            total_windows: windows.len(),
        }
    }

    /// The same numbers in f32.
    pub fn single(&self) -> Batch<f32> {
        let single = |x: &Array2<T>| x.mapv(|x| x.to_f64() as f32);
        Batch {
            windows: self.windows,
            frames: self.frames,
            input: single(&self.input),
            keyframes: single(&self.keyframes),
            contacts: single(&self.contacts),
            distances: single(&self.distances),
            offsets: single(&self.offsets),
            root: single(&self.root),
            past_frames: self.past_frames,
            past_rotations: single(&self.past_rotations),
            past_root: single(&self.past_root),
            truth: self.truth.as_ref().map(|truth| Truth {
                rotations: single(&truth.rotations),
                root: single(&truth.root),
            }),
            total_windows: self.total_windows,
        }
    }

    /// W T.
    pub fn rows(&self) -> usize {
        self.windows * self.frames
    }
}

/// Numbers row by row; where there are fewer, the rest is 0.
fn table<T: Real>(rows: usize, columns: usize, numbers: impl Iterator<Item = f64>) -> Array2<T> {
    let mut table = Array2::zeros((rows, columns));
    table
        .iter_mut()
        .zip(numbers)
        .for_each(|(x, number)| *x = T::from_f64(number));
    table
}
