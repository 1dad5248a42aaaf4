//! Where a knee points while its leg is bent more than it was: as it did, but steadied over time as
//! far as the bend is new. The direction of an almost straight leg is noise.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::leg::Leg;

/// A knee that stands out less than this from its leg has no direction, cm.
const BENT: f64 = 1.5;
/// Standard deviation over which directions are steadied, frames.
const SIGMA: f64 = 5.0;

/// The knee of one frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knee {
    /// From hip to ankle, length 1.
    axis: DVec3,
    /// Across it; carried from frame to frame without turning about the leg.
    reference: DVec3,
    /// About the axis from the reference to where the knee points, rad.
    angle: f64,
    /// The same, steadied.
    steadied: f64,
}

impl Knee {
    /// A leg's knee in every frame, `[F]`; `world`: positions, `[F][joints]`, cm.
    pub fn of_frames(leg: &Leg, world: &[Vec<DVec3>]) -> Vec<Self> {
        let axis = |frame: &Vec<DVec3>| {
            let axis = frame[leg.ankle] - frame[leg.hip];
            axis.normalize_or(DVec3::NEG_Y)
        };
        let mut carried: Option<(DVec3, DVec3)> = None;
        let frames = world.iter().map(|frame| {
            let axis = axis(frame);
            let reference = match carried {
                None => axis.any_orthonormal_vector(),
                Some((before, reference)) => DQuat::from_rotation_arc(before, axis) * reference,
            };
            carried = Some((axis, reference));
            let bend = frame[leg.knee] - frame[leg.hip];
            let [along, beside] = [reference, axis.cross(reference)].map(|it| bend.dot(it));
            (axis, reference, beside.atan2(along), along.hypot(beside))
        });
        let frames: Vec<(DVec3, DVec3, f64, f64)> = frames.collect();
        let angles = followed(&frames.iter().map(|it| (it.2, it.3)).collect::<Vec<_>>());
        let weights: Vec<f64> = frames.iter().map(|it| weight(it.3)).collect();
        let of_frame = |(index, (axis, reference, ..)): (usize, (DVec3, DVec3, f64, f64))| Self {
            axis,
            reference,
            angle: angles[index],
            steadied: steadied(&angles, &weights, index),
        };
        frames.into_iter().enumerate().map(of_frame).collect()
    }

    /// Where the knee points when the ankle is at `target` from the hip, and it stands `out` cm out
    /// from the leg where it stood out `before`.
    pub fn pole(&self, target: DVec3, before: f64, out: f64) -> DVec3 {
        let new = match out > before {
            true => 1.0 - before / out,
            false => 0.0,
        };
        let angle = self.angle + new * (self.steadied - self.angle);
        let axis = target.normalize_or(self.axis);
        let reference = DQuat::from_rotation_arc(self.axis, axis) * self.reference;
        angle.cos() * reference + angle.sin() * axis.cross(reference)
    }
}

/// How much a direction counts, by how far the knee stands out.
fn weight(out: f64) -> f64 {
    match out > BENT {
        true => out,
        false => 1e-3,
    }
}

/// Angles followed without jumps over the frames in which they tell something, evenly between
/// these. `measured`: angle, rad, and how far the knee stands out, cm.
fn followed(measured: &[(f64, f64)]) -> Vec<f64> {
    let mut told: Vec<(usize, f64)> = Vec::new();
    for (frame, &(angle, out)) in measured.iter().enumerate() {
        if out > BENT {
            let before = told.last().map_or(angle, |&(_, before)| before);
            told.push((frame, angle + ((before - angle) / TAU).round() * TAU));
        }
    }
    let at = |frame: usize| {
        let next = told.partition_point(|&(told, _)| told < frame);
        match (next.checked_sub(1).map(|last| told[last]), told.get(next)) {
            (Some((from, a)), Some(&(to, b))) => {
                a + (b - a) * (frame - from) as f64 / (to - from) as f64
            }
            (Some((_, angle)), None) | (None, Some(&(_, angle))) => angle,
            (None, None) => measured[frame].0,
        }
    };
    (0..measured.len()).map(at).collect()
}

/// The mean of the angles around a frame.
fn steadied(angles: &[f64], weights: &[f64], frame: usize) -> f64 {
    let reach = (4.0 * SIGMA) as usize;
    let around = frame.saturating_sub(reach)..(frame + reach + 1).min(angles.len());
    let (sum, all) = around.fold((0.0, 0.0), |(sum, all), other| {
        let apart = other.abs_diff(frame) as f64 / SIGMA;
        let weight = weights[other] * (-0.5 * apart * apart).exp();
        (sum + weight * angles[other], all + weight)
    });
    sum / all
}
