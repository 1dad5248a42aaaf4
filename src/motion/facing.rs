//! The facing angle: which way the dancer looks, smoothed over time and unwrapped along the clip.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::contact_foot::{MissingJoint, joint_called};
use super::skeleton::Skeleton;

/// The joints that lie across the body; forward is at a right angle to both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FacingJoints {
    /// Left and right.
    pub hips: [usize; 2],
    /// Left and right.
    pub arms: [usize; 2],
}

impl FacingJoints {
    /// Those of the dance skeleton.
    pub const DANCE: Self = Self {
        hips: [1, 5],
        arms: [19, 15],
    };

    /// Those of a skeleton by their names: `LeftUpLeg` and `RightUpLeg`, `LeftArm` and `RightArm`.
    ///
    /// # Errors
    /// A joint is missing.
    pub fn of(skeleton: &Skeleton) -> Result<Self, MissingJoint> {
        let joint = |name| joint_called(skeleton, &[name]);
        Ok(Self {
            hips: [joint("LeftUpLeg")?, joint("RightUpLeg")?],
            arms: [joint("LeftArm")?, joint("RightArm")?],
        })
    }

    /// The angle about Y that a body by itself faces, rad: 0 looks along +Z, pi/2 along +X.
    ///
    /// `positions`: of the joints in one frame, `[joints]`.
    pub fn angle(&self, positions: &[DVec3]) -> f64 {
        let forward = self.forward(positions);
        forward.x.atan2(forward.y)
    }

    /// `across x up`, as (x, z); not normalised, so that a frame with a foreshortened body counts
    /// less in the smoothing.
    fn forward(&self, positions: &[DVec3]) -> DVec2 {
        let across = |[left, right]: [usize; 2]| positions[left] - positions[right];
        let forward = (across(self.hips) + across(self.arms)).cross(DVec3::Y);
        DVec2::new(forward.x, forward.z)
    }
}

/// Facing angle about Y of every frame, `[frames]`, rad: 0 looks along +Z, pi/2 along +X.
///
/// `world` holds the world positions of a skeleton's joints, `[frames][joints]`, cm. The forward
/// direction is smoothed with a Gaussian of standard deviation `sigma` frames before its angle is
/// taken. The first angle lies in (-pi, pi]; from there the angle is followed without jumps of 2
/// pi.
pub fn facing_angles(world: &[Vec<DVec3>], joints: &FacingJoints, sigma: f64) -> Vec<f64> {
    let (Some(first), Some(last)) = (world.first(), world.last()) else {
        return Vec::new();
    };
    let ends = [joints.forward(first), joints.forward(last)];
    smooth_angles(world, joints, ends, sigma)
}

/// Facing angles of predicted frames between two keyframes whose own facing angles are known,
/// `[N + 1]`, rad.
///
/// `world` holds the world positions of keyframe k1 and of the N frames after it, cm, an array of
/// `[N + 1][joints]`; `start` and `target` are the facing angles of k1 and k2. [`facing_angles`]
/// smooths over the frames before k1 and after k2 too; here those are not there, and the dancer is
/// taken to face along `start` before k1 and along `target` after k2. What the smoothed angles of
/// k1 and k2 then still differ from the known ones is taken off, at the keyframe whole and less
/// from frame to frame, until nothing is left `sigma` frames (or N, where that is less) away. So
/// the first angle is `start`, the last is `target` up to full turns, and in between the angles
/// follow the frames' own bodies.
pub fn facing_angles_between(
    world: &[Vec<DVec3>],
    joints: &FacingJoints,
    [start, target]: [f64; 2],
    sigma: f64,
) -> Vec<f64> {
    let (Some(first), Some(last)) = (world.first(), world.last()) else {
        return Vec::new();
    };
    let along = |angle: f64, like: DVec2| DVec2::new(angle.sin(), angle.cos()) * like.length();
    let ends = [
        along(start, joints.forward(first)),
        along(target, joints.forward(last)),
    ];
    let angles = smooth_angles(world, joints, ends, sigma);
    let last = angles.len() - 1;
    // Between -pi and pi, so that the first frame keeps the turns that `start` counts.
    let missing = |known: f64, found: f64| (known - found) - ((known - found) / TAU).round() * TAU;
    let (at_start, at_target) = (missing(start, angles[0]), missing(target, angles[last]));
    let turns = start - angles[0] - at_start;
    let reach = sigma.min(last as f64).max(f64::MIN_POSITIVE);
    let share = |distance: usize| (1.0 - distance as f64 / reach).max(0.0);
    angles
        .iter()
        .enumerate()
        .map(|(time, angle)| {
            angle + turns + at_start * share(time) + at_target * share(last - time)
        })
        .collect()
}

/// Angles of the smoothed forward directions, unwrapped; `ends` are the directions before the first
/// frame and after the last.
fn smooth_angles(
    world: &[Vec<DVec3>],
    joints: &FacingJoints,
    ends: [DVec2; 2],
    sigma: f64,
) -> Vec<f64> {
    let forward = world.iter().map(|positions| joints.forward(positions));
    let forward: Vec<DVec2> = forward.collect();
    let mut angles: Vec<f64> = gaussian(&forward, ends, sigma)
        .into_iter()
        .map(|direction| direction.x.atan2(direction.y))
        .collect();
    unwrap(&mut angles);
    angles
}

/// Gaussian smoothing over time, `sigma` in frames: the kernel reaches 4 sigma to either side;
/// `before` and `after` stand beyond the ends.
pub fn gaussian(values: &[DVec2], [before, after]: [DVec2; 2], sigma: f64) -> Vec<DVec2> {
    let radius = (4.0 * sigma + 0.5) as usize;
    let mut kernel: Vec<f64> = (0..=2 * radius)
        .map(|tap| {
            let distance = tap as f64 - radius as f64;
            (-0.5 * (distance / sigma).powi(2)).exp()
        })
        .collect();
    let sum: f64 = kernel.iter().sum();
    kernel.iter_mut().for_each(|weight| *weight /= sum);
    (0..values.len())
        .map(|time| {
            kernel
                .iter()
                .enumerate()
                .map(|(tap, &weight)| {
                    let value = match (time + tap).checked_sub(radius) {
                        None => before,
                        Some(at) => values.get(at).copied().unwrap_or(after),
                    };
                    value * weight
                })
                .sum()
        })
        .collect()
}

/// Shifts each angle (rad) by a multiple of 2 pi so that it is the nearest to the one before.
pub fn unwrap(angles: &mut [f64]) {
    for time in 1..angles.len() {
        let turns = ((angles[time] - angles[time - 1]) / TAU).round();
        angles[time] -= turns * TAU;
    }
}
