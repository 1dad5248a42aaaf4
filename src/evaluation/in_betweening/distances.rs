//! L2Q and L2P of one frame.

use glam::{DQuat, DVec3};

use super::Deviations;
use crate::motion::rotation_window::nearer_sign;

/// L2Q of a frame: the norm of the differences of all joints' quaternions, `[joints]`, each of the
/// prediction with the sign nearer to the truth's. Local rotations or the world's.
pub fn l2q(truth: &[DQuat], predicted: &[DQuat]) -> f64 {
    let joints = truth.iter().zip(predicted);
    let squares = joints.map(|(&truth, &q)| (nearer_sign(q, truth) - truth).length_squared());
    squares.sum::<f64>().sqrt()
}

/// L2P of a frame: the norm of the differences of all joints' positions, `[joints]`, cm, each
/// coordinate in its standard deviations. World positions, or those relative to the root.
pub fn l2p(truth: &[DVec3], predicted: &[DVec3], deviations: &Deviations) -> f64 {
    let joints = truth.iter().zip(predicted).zip(&deviations.0);
    let squares = joints.map(|((truth, p), deviation)| ((p - truth) / deviation).length_squared());
    squares.sum::<f64>().sqrt()
}
