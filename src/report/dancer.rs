//! One dancer of a motion figure.

use glam::{DQuat, DVec3};

use super::svg::{Stroke, Svg};
use crate::motion::{DANCE_PARENTS, JOINTS, PART_WEIGHTS, PARTS};

/// Pixels a centimetre.
const SCALE: f64 = 0.85;

/// Colours of a dancer or of a part of its body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Palette {
    pub fill: &'static str,
    pub outline: &'static str,
}

impl Palette {
    const fn of(fill: &'static str, outline: &'static str) -> Self {
        Self { fill, outline }
    }
}

pub(super) const KEYFRAME: Palette = Palette::of("#e03c31", "#7d1410");
pub(super) const GENERATED: Palette = Palette::of("#ffc21a", "#8a5a00");
pub(super) const RECORDED: Palette = Palette::of("#93acc6", "#3d5570");
/// Parts of the body that were asked to move otherwise.
pub(super) const MARKED: Palette = Palette::of("#3f86e0", "#173f78");

/// One dancer as seen by the camera, in pixels from the place on the floor under the path.
pub(super) struct Drawn {
    joints: [([f64; 2], f64); JOINTS],
    pub left: f64,
    pub right: f64,
    pub above: f64,
    pub below: f64,
}

impl Drawn {
    /// `frame`: world positions, cm; `path`: the place in the world that the dancer is drawn from.
    pub fn new(frame: &[DVec3; JOINTS], path: DVec3) -> Self {
        let joints = frame.map(|joint| seen(joint - path));
        let reach = |measure: &dyn Fn([f64; 2]) -> f64| {
            let measured = joints.iter().map(|joint| measure(joint.0));
            measured.fold(0.0, f64::max)
        };
        Self {
            joints,
            left: reach(&|[x, _]| -x),
            right: reach(&|[x, _]| x),
            above: reach(&|[_, y]| -y) + HEAD,
            below: reach(&|[_, y]| y),
        }
    }

    /// Draws the bones from the farthest to the nearest, each outlined, then the head where it
    /// belongs among them. `marked` parts have their own colour.
    pub fn draw(&self, svg: &mut Svg, origin: [f64; 2], palette: Palette, marked: [bool; PARTS]) {
        let at = |joint: usize| {
            let [x, y] = self.joints[joint].0;
            [origin[0] + x, origin[1] + y]
        };
        let bone = |(joint, parent): (usize, &Option<usize>)| {
            let nearness = (self.joints[joint].1 + self.joints[(*parent)?].1) / 2.0;
            Some((nearness, joint, (*parent)?))
        };
        let mut bones: Vec<(f64, usize, usize)> =
            DANCE_PARENTS.iter().enumerate().filter_map(bone).collect();
        bones.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, joint, parent) in bones {
            let palette = match marked[part_of(joint)] {
                true => MARKED,
                false => palette,
            };
            let ends = [at(parent), at(joint)];
            let width = bone_width(joint);
            svg.line(&ends, Stroke::solid(palette.outline, width + 1.8));
            svg.line(&ends, Stroke::solid(palette.fill, width));
            if joint == HEAD_JOINT {
                let outline = Stroke::solid(palette.outline, 1.0);
                svg.circle(at(joint), HEAD, palette.fill, outline);
            }
        }
    }
}

/// Where a place (cm) appears in a fixed three-quarter view without perspective, from the front, a
/// little from the dancer's left and from above: pixels to the right and down from the origin, and
/// its nearness to the camera (cm; larger is nearer).
fn seen(place: DVec3) -> ([f64; 2], f64) {
    let aside = DQuat::from_rotation_y(-30f64.to_radians());
    let down = DQuat::from_rotation_x(10f64.to_radians());
    let seen = (down * aside) * place;
    ([SCALE * seen.x, -SCALE * seen.y], seen.z)
}

/// Index of the joint that the head is drawn at.
const HEAD_JOINT: usize = 23;
/// Radius of the head, pixels.
const HEAD: f64 = 8.0;

/// Width of the bone that ends at this joint, pixels: the spine is thicker than the limbs, the ends
/// of limbs thinner.
fn bone_width(joint: usize) -> f64 {
    match joint {
        9..=13 => 7.6,
        1 | 2 | 5 | 6 => 6.4,
        4 | 8 | 17 | 21 => 4.0,
        _ => 5.2,
    }
}

/// The body part that a joint belongs to.
fn part_of(joint: usize) -> usize {
    let has_joint = |part: &&[(usize, f64)]| part.iter().any(|&(member, _)| member == joint);
    PART_WEIGHTS.iter().position(has_joint).unwrap_or(0)
}
