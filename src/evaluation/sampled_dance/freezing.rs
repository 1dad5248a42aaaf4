//! Dances that stand still: "or freezes into a mean pose" (section 5.1 of the paper).

use glam::DVec3;

/// How long a dance must stand, seconds.
const LONG: f64 = 5.0;
/// What share of the usual speed is none.
const STILL: f64 = 0.1;

/// Speed of the joints, a mean over them, from each frame to the next, in the unit of the positions
/// per second, `[frames - 1]`. `world`: positions, `[frames][joints]`.
#[must_use]
pub fn mean_joint_speed(world: &[Vec<DVec3>], fps: f64) -> Vec<f64> {
    let speeds = world.windows(2).map(|pair| match pair {
        [before, after] if !after.is_empty() => {
            let steps = before.iter().zip(after).map(|(a, b)| a.distance(*b));
            fps * steps.sum::<f64>() / after.len() as f64
        }
        _ => 0.0,
    });
    speeds.collect()
}

/// Whether a dance freezes: some 5 s of it have a mean [joint speed](mean_joint_speed) below a tenth
/// of `usual`, that of the training part. A shorter dance does not.
#[must_use]
pub fn freezes(speed: &[f64], usual: f64, fps: f64) -> bool {
    let frames = (LONG * fps).round().max(1.0) as usize;
    let is_still = |piece: &[f64]| piece.iter().sum::<f64>() / (frames as f64) < STILL * usual;
    speed.windows(frames).any(is_still)
}
