//! Windows of one length as arrays. A row is a frame, the frames of a window stand together.

use ndarray::{Array2, s};

use super::config::{LossConfig, WindowConfig};
use crate::autograd::Real;
use crate::nn::sinusoidal_positions;

/// A window as it is given, in numbers of its own frame of reference.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenWindow {
    /// y_1 to y_T', `[T', 6 J + 3]`.
    pub seed: Array2<f64>,
    /// x_1 to x_T, standardised, `[T, music]`.
    pub music: Array2<f64>,
    /// Key poses `[6 J]` by frame, T' to T - 1 counted from 0, ascending.
    pub key_poses: Vec<(usize, Vec<f64>)>,
}

/// W windows.
#[derive(Debug, Clone)]
pub struct Batch<T> {
    /// W.
    pub windows: usize,
    /// T' and T.
    pub window: WindowConfig,
    /// `[W T', 6 J + 3]`.
    pub seed: Array2<T>,
    /// `[W T, music]`.
    pub music: Array2<T>,
    /// The key pose of a frame, zeros where there is none, `[W T, 6 J]`.
    pub key_poses: Array2<T>,
    /// 1 where there is a key pose, `[W T, 1]`.
    pub is_key: Array2<T>,
    /// Frames to the nearest known one before and after, `[W T][2]`; the second none after the
    /// last.
    pub known: Vec<(usize, Option<usize>)>,
    /// w_t of the frames that are generated, `[W (T - T'), 1]`.
    pub weights: Array2<T>,
    /// y_T'+1 to y_T, `[W (T - T'), 6 J + 3]`; none where they are asked for.
    pub truth: Option<Array2<T>>,
    /// Windows of the whole step, of which these are a part.
    pub total_windows: usize,
}

impl<T: Real> Batch<T> {
    /// Windows of one body, with their recorded frames or without.
    pub fn of(
        windows: &[GivenWindow],
        truths: &[Array2<f64>],
        window: &WindowConfig,
        loss: &LossConfig,
    ) -> Self {
        let (length, numbers) = (
            window.length,
            windows.first().map_or(0, |it| it.seed.ncols()),
        );
        let poses = numbers.saturating_sub(3);
        let stacked = |parts: Vec<&Array2<f64>>| -> Array2<T> {
            let columns = parts.first().map_or(0, |part| part.ncols());
            let rows = parts.iter().map(|part| part.nrows()).sum();
            let mut all = Array2::zeros((rows, columns));
            let values = parts.iter().flat_map(|part| part.iter());
            all.iter_mut()
                .zip(values)
                .for_each(|(into, &x)| *into = T::from_f64(x));
            all
        };
        let mut key_poses = Array2::zeros((windows.len() * length, poses));
        let mut is_key = Array2::zeros((windows.len() * length, 1));
        for (index, given) in windows.iter().enumerate() {
            for (frame, pose) in &given.key_poses {
                let row = index * length + frame;
                is_key[[row, 0]] = T::one();
                let into = key_poses.row_mut(row);
                into.into_iter()
                    .zip(pose)
                    .for_each(|(into, &x)| *into = T::from_f64(x));
            }
        }
        let frames: Vec<Vec<usize>> = windows.iter().map(GivenWindow::key_frames).collect();
        let known = frames.iter().flat_map(|keys| known(keys, window));
        let weights: Vec<T> = frames
            .iter()
            .flat_map(|keys| frame_weights(keys, window, loss))
            .map(T::from_f64)
            .collect();
        Self {
            windows: windows.len(),
            window: window.clone(),
            seed: stacked(windows.iter().map(|it| &it.seed).collect()),
            music: stacked(windows.iter().map(|it| &it.music).collect()),
            key_poses,
            is_key,
            known: known.collect(),
            weights: Array2::from_shape_fn((weights.len(), 1), |(row, _)| weights[row]),
            truth: (!truths.is_empty()).then(|| stacked(truths.iter().collect())),
            total_windows: windows.len(),
        }
    }

    /// l_t (eq. 8 to 10), `[W T, d]`: positions of the distances to the nearest known frame before
    /// and after, each of d / 2 numbers; zeros where there is none after.
    pub fn local_positions(&self, width: usize) -> Array2<T> {
        let table = sinusoidal_positions(self.window.length, width / 2);
        let mut positions = Array2::zeros((self.known.len(), width));
        for (mut row, (before, after)) in positions.rows_mut().into_iter().zip(&self.known) {
            let (mut left, mut right) = row.view_mut().split_at(ndarray::Axis(0), width / 2);
            left.assign(&table.row(*before).mapv(T::from_f64));
            if let Some(after) = after {
                right.assign(&table.row(*after).mapv(T::from_f64));
            }
        }
        positions
    }

    /// P of the first `frames` frames of every window, `[W frames, d]`.
    pub fn positions(&self, frames: usize, width: usize) -> Array2<T> {
        let table = sinusoidal_positions(frames, width);
        let mut positions = Array2::zeros((self.windows * frames, width));
        for window in 0..self.windows {
            let rows = window * frames..(window + 1) * frames;
            let mut own = positions.slice_mut(s![rows, ..]);
            own.assign(&table.mapv(T::from_f64));
        }
        positions
    }
}

impl GivenWindow {
    fn key_frames(&self) -> Vec<usize> {
        self.key_poses.iter().map(|(frame, _)| *frame).collect()
    }
}

/// Frames to the nearest known one before and after, for each of the T frames.
fn known(keys: &[usize], window: &WindowConfig) -> Vec<(usize, Option<usize>)> {
    let of_frame = |frame: usize| {
        if frame < window.seed {
            return (0, Some(0));
        }
        let after = keys.partition_point(|&key| key < frame);
        let next = keys.get(after).map(|key| key - frame);
        let before = match next {
            Some(0) => frame,
            _ => after.checked_sub(1).map_or(window.seed - 1, |at| keys[at]),
        };
        (frame - before, next)
    };
    (0..window.length).map(of_frame).collect()
}

/// w_t (eq. 15) of the frames that are generated, `[T - T']`: 1 + lambda max over key frames t_k of
/// exp(-(t - t_k)^2 / (2 (sigma (T - T'))^2)).
pub fn frame_weights(keys: &[usize], window: &WindowConfig, loss: &LossConfig) -> Vec<f64> {
    let reach = loss.sigma * window.generated() as f64;
    let weight = |frame: usize| {
        let near = |&key: &usize| {
            let distance = frame.abs_diff(key) as f64 / reach;
            (-0.5 * distance * distance).exp()
        };
        1.0 + loss.lambda * keys.iter().map(near).fold(0.0, f64::max)
    };
    (window.seed..window.length).map(weight).collect()
}
