//! From the score to local rotations: legs by inverse kinematics, trunk, head and arms from their
//! curves.

use glam::{DQuat, DVec2, DVec3, EulerRot};
use rand::RngExt;
use rand_chacha::ChaCha12Rng;

use super::body::{ARMS, HEAD, HIPS, LEGS, NECK, SHIN, SPINE, SPINE_JOINTS, STANDING, THIGH};
use super::curve::smooth;
use super::feet::FootPose;
use super::pelvis::{Pelvis, STRETCH};
use super::score::Score;
use super::upper_body::ArmPose;
use crate::motion::ik::{aim, two_bone};
use crate::motion::{Pose, Skeleton};

/// Share of a bend of the spine that each of its joints takes, from below.
const SPINE_SHARES: [f64; SPINE_JOINTS] = [0.14, 0.2, 0.22, 0.24, 0.2];
/// Farthest stretch of a swinging leg, as a share of its length.
const SWING_STRETCH: f64 = 0.999;
/// How far an arm swings forward (degrees) for each cm that the opposite foot is ahead.
const STRIDE_SWING: f64 = 0.35;
/// How far the arms rise (degrees) for each cm that the pelvis does.
const RISE_LIFT: f64 = 1.4;
/// Frames by which the eyes are ahead of a turn.
const GAZE: usize = 9;

/// Slow small movements that no body is without: sums of sines for `K` angles, degrees.
struct Drift<const K: usize> {
    waves: [[(f64, f64); 3]; K],
    size: f64,
}

impl<const K: usize> Drift<K> {
    fn draw(size: f64, rng: &mut ChaCha12Rng) -> Self {
        let waves = std::array::from_fn(|_| {
            std::array::from_fn(|i| {
                let period = 40.0 * (1.0 + i as f64) * rng.random_range(0.8..1.25);
                (
                    std::f64::consts::TAU / period,
                    rng.random_range(0.0..std::f64::consts::TAU),
                )
            })
        });
        Self { waves, size }
    }

    fn at(&self, frame: usize, k: usize) -> f64 {
        let waves = self.waves[k].iter();
        self.size
            * waves
                .map(|(rate, phase)| (rate * frame as f64 + phase).sin())
                .sum::<f64>()
    }
}

/// The pose of every frame: translations are the root's path and the skeleton's offsets.
pub fn poses(
    score: &Score,
    skeleton: &Skeleton,
    feet: &[Vec<FootPose>; 2],
    pelvis: &[Pelvis],
    rng: &mut ChaCha12Rng,
) -> Vec<Pose> {
    let frames = pelvis.len();
    let spine = smooth(&score.spine.sample(frames), 2.5);
    let head = smooth(&score.head.sample(frames), 3.0);
    let flow = 1.2 + 0.05 * score.rhythm.beat();
    let arms = [0, 1].map(|arm| smooth(&score.arms[arm].sample(frames), flow));
    let trunk_drift = Drift::<6>::draw(0.7, rng);
    let arm_drift = [(); 2].map(|()| Drift::<5>::draw(1.4, rng));
    let turning: Vec<f64> = (0..frames)
        .map(|frame| pelvis[(frame + GAZE).min(frames - 1)].yaw - pelvis[frame].yaw)
        .collect();
    let carried = carried(score, feet, pelvis);
    (0..frames)
        .map(|frame| {
            let here = &pelvis[frame];
            let mut translations: Vec<DVec3> =
                skeleton.joints.iter().map(|joint| joint.offset).collect();
            translations[HIPS] = here.position;
            let mut rotations = vec![DQuat::IDENTITY; skeleton.len()];
            rotations[HIPS] = here.rotation;
            for (leg, side) in [(0, 1.0), (1, -1.0)] {
                rotations[LEGS[leg]..LEGS[leg] + 3].copy_from_slice(&leg_rotations(
                    here,
                    &feet[leg][frame],
                    side,
                ));
            }
            // The whole trunk follows the turn ahead a little, the head more.
            let ahead = (turning[frame] / 0.9).tanh();
            let [bend, left, turn] = spine[frame];
            let bend = bend + trunk_drift.at(frame, 0);
            let left = left + trunk_drift.at(frame, 1) - 4.0 * ahead;
            let turn = turn + trunk_drift.at(frame, 2) + 9.0 * ahead;
            for (joint, share) in SPINE_SHARES.iter().enumerate() {
                rotations[SPINE + joint] = bent(share * bend, share * left, share * turn);
            }
            let [nod, left, turn] = head[frame];
            // The head stays more upright than the trunk.
            let nod = nod + trunk_drift.at(frame, 3) - 0.35 * bend;
            let left = left + trunk_drift.at(frame, 4);
            let turn = turn + trunk_drift.at(frame, 5) + 32.0 * ahead;
            for (joint, share) in [(NECK, 0.45), (HEAD, 0.55)] {
                rotations[joint] = bent(share * nod, share * left, share * turn);
            }
            let [stride, rise] = carried[frame];
            for (arm, side) in [(0, 1.0), (1, -1.0)] {
                let mut values = arms[arm][frame];
                for (k, value) in values.iter_mut().enumerate() {
                    *value += arm_drift[arm].at(frame, k);
                }
                values[0] += side * (14.0 * ahead - STRIDE_SWING * stride);
                values[1] += 10.0 * ahead.abs() + RISE_LIFT * rise;
                values[3] += 0.5 * RISE_LIFT * rise.abs();
                rotations[ARMS[arm]..ARMS[arm] + 4]
                    .copy_from_slice(&ArmPose::from_values(values).rotations(side));
            }
            Pose {
                translations,
                rotations,
            }
        })
        .collect()
}

/// What carries the arms along: how far the left foot is ahead of the right (cm), and how far the
/// pelvis is above its usual height (cm), in every frame.
fn carried(score: &Score, feet: &[Vec<FootPose>; 2], pelvis: &[Pelvis]) -> Vec<[f64; 2]> {
    let usual = STANDING - score.style.bend - 0.3 * score.style.depth;
    let raw: Vec<[f64; 2]> = pelvis
        .iter()
        .enumerate()
        .map(|(frame, pelvis)| {
            let apart = feet[0][frame].ball - feet[1][frame].ball;
            let stride = DVec2::new(apart.x, apart.z).dot(Score::floor(pelvis.yaw, 1.0, 0.0));
            let rise = pelvis.position.y - usual;
            [60.0 * (stride / 60.0).tanh(), 15.0 * (rise / 15.0).tanh()]
        })
        .collect();
    smooth(&raw, 2.5)
}

/// A bend forward, to the left and a turn to the left, in degrees.
fn bent(forward: f64, left: f64, turn: f64) -> DQuat {
    let [forward, left, turn] = [forward, left, turn].map(f64::to_radians);
    DQuat::from_euler(EulerRot::YXZ, turn, forward, -left)
}

/// Local rotations of UpLeg, Leg and Foot that bring the ankle where the foot has it, the knee
/// forward.
fn leg_rotations(pelvis: &Pelvis, foot: &FootPose, side: f64) -> [DQuat; 3] {
    let hip = pelvis.hip(side);
    let ankle = hip + within_reach(foot.ankle() - hip);
    let down = (ankle - hip).try_normalize().unwrap_or(DVec3::NEG_Y);
    // The knee looks half way between the pelvis and the foot.
    let yaw = 0.5 * (pelvis.yaw + foot.yaw);
    let ahead = DVec3::new(yaw.sin(), 0.0, yaw.cos());
    let pole = DQuat::from_rotation_arc(DVec3::NEG_Y, down) * ahead;
    let limb = two_bone(hip, ankle, THIGH, SHIN, pole);
    let thigh = aim(DVec3::NEG_Y, DVec3::Z, limb.middle - hip, pole);
    let shin = aim(DVec3::NEG_Y, DVec3::Z, limb.end - limb.middle, pole);
    [
        (pelvis.rotation.inverse() * thigh).normalize(),
        (thigh.inverse() * shin).normalize(),
        (shin.inverse() * foot.rotation()).normalize(),
    ]
}

/// A leg's reach from hip to ankle: as wished up to the stretch of a planted leg, beyond it less
/// and less.
fn within_reach(wish: DVec3) -> DVec3 {
    let (soft, hard) = (STRETCH * (THIGH + SHIN), SWING_STRETCH * (THIGH + SHIN));
    let length = wish.length();
    if length <= soft + 1e-9 {
        return wish;
    }
    let room = hard - soft;
    let length_held = soft + room * ((length - soft) / room).tanh();
    wish * (length_held / length)
}
