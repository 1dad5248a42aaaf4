//! Windows as joint rotations and bone offsets: what networks with quaternion output read beside
//! the features.

use ndarray::{Array2, Array3};

use crate::autograd::Real;
use crate::motion::{JOINTS, Pose};

/// Numbers of the rotations of a frame.
pub const ROTATIONS: usize = 4 * JOINTS;
/// Numbers of the offsets of a body.
pub const OFFSETS: usize = 3 * JOINTS;

/// The poses of windows of one length.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseWindows<T> {
    /// Local rotations of the 24 joints, `[N + 1, windows, 96]`: quaternions (x, y, z, w), the
    /// root's in the world. Along a window the signs are those that make a quaternion the nearer of
    /// two to the one before. Rows that are not given are 0.
    pub rotations: Array3<T>,
    /// Translations of the joints in their parents' frames, `[windows, 72]`, cm: those of the
    /// window's first frame, and 0 for the root.
    pub offsets: Array2<T>,
}

impl<T: Real> PoseWindows<T> {
    /// Zeros for `frames` (N + 1) frames of each window.
    pub fn zeros(frames: usize, windows: usize) -> Self {
        Self {
            rotations: Array3::zeros((frames, windows, ROTATIONS)),
            offsets: Array2::zeros((windows, OFFSETS)),
        }
    }

    /// Writes poses on the dance skeleton into a window: those of the frames `rows`, in the order
    /// of time.
    pub fn write<'p>(
        &mut self,
        window: usize,
        rows: impl IntoIterator<Item = usize>,
        poses: impl IntoIterator<Item = &'p Pose>,
    ) {
        let mut before: Option<&Pose> = None;
        let mut signs = [1.0; JOINTS];
        for (row, pose) in rows.into_iter().zip(poses) {
            if before.is_none() {
                let bones = pose
                    .translations
                    .iter()
                    .enumerate()
                    .skip(1)
                    .take(JOINTS - 1);
                for (joint, translation) in bones {
                    for (axis, x) in translation.to_array().into_iter().enumerate() {
                        self.offsets[[window, 3 * joint + axis]] = T::from_f64(x);
                    }
                }
            }
            for (joint, rotation) in pose.rotations.iter().enumerate().take(JOINTS) {
                let turned_over = match before.and_then(|pose| pose.rotations.get(joint)) {
                    None => rotation.w < 0.0,
                    Some(before) => (*before * signs[joint]).dot(*rotation) < 0.0,
                };
                signs[joint] = if turned_over { -1.0 } else { 1.0 };
                for (k, x) in rotation.to_array().into_iter().enumerate() {
                    self.rotations[[row, window, 4 * joint + k]] = T::from_f64(signs[joint] * x);
                }
            }
            before = Some(pose);
        }
    }
}
