//! One dancer of a motion figure.

use glam::{DQuat, DVec3};

use super::svg::{Stroke, Svg};
use crate::motion::{DANCE_JOINTS, DANCE_PARENTS, PART_WEIGHTS, PARTS, Skeleton};

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

/// What is drawn of a skeleton.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnBody {
    bones: Vec<Bone>,
    /// The joint that the head is drawn at.
    head: Option<usize>,
}

#[derive(Debug, Clone, PartialEq)]
struct Bone {
    joint: usize,
    parent: usize,
    /// Pixels.
    width: f64,
    /// The body part that it belongs to.
    part: usize,
}

impl DrawnBody {
    /// That of the dance skeleton.
    pub fn dance() -> Self {
        Self::named(DANCE_JOINTS.into_iter().zip(DANCE_PARENTS))
    }

    /// That of any skeleton, its widths and its head by the joints' names.
    pub fn of(skeleton: &Skeleton) -> Self {
        let joints = skeleton.joints.iter();
        Self::named(joints.map(|joint| (joint.name.as_str(), joint.parent)))
    }

    fn named<'n>(joints: impl Iterator<Item = (&'n str, Option<usize>)> + Clone) -> Self {
        let bone = |(joint, (name, parent)): (usize, (&str, Option<usize>))| {
            Some(Bone {
                joint,
                parent: parent?,
                width: SCALE * bone_thickness(name),
                part: part_of(name),
            })
        };
        Self {
            head: joints.clone().position(|(name, _)| name == "Head"),
            bones: joints.enumerate().filter_map(bone).collect(),
        }
    }
}

/// One dancer as seen by the camera, in pixels from the place on the floor under the path.
pub(super) struct Drawn<'b> {
    body: &'b DrawnBody,
    joints: Vec<([f64; 2], f64)>,
    pub left: f64,
    pub right: f64,
    pub above: f64,
    pub below: f64,
}

impl<'b> Drawn<'b> {
    /// `frame`: world positions of the body's joints, cm; `path`: the place in the world that the
    /// dancer is drawn from.
    pub fn new(body: &'b DrawnBody, frame: &[DVec3], path: DVec3) -> Self {
        let joints: Vec<_> = frame.iter().map(|&joint| seen(joint - path)).collect();
        let reach = |measure: &dyn Fn([f64; 2]) -> f64| {
            let measured = joints.iter().map(|joint| measure(joint.0));
            measured.fold(0.0, f64::max)
        };
        Self {
            body,
            left: reach(&|[x, _]| -x),
            right: reach(&|[x, _]| x),
            above: reach(&|[_, y]| -y) + HEAD,
            below: reach(&|[_, y]| y),
            joints,
        }
    }

    /// Draws the bones from the farthest to the nearest, each outlined, then the head where it
    /// belongs among them. `marked` parts have their own colour.
    pub fn draw(&self, svg: &mut Svg, origin: [f64; 2], palette: Palette, marked: [bool; PARTS]) {
        let at = |joint: usize| {
            let [x, y] = self.joints[joint].0;
            [origin[0] + x, origin[1] + y]
        };
        let nearness = |bone: &&Bone| self.joints[bone.joint].1 + self.joints[bone.parent].1;
        let mut bones: Vec<&Bone> = self.body.bones.iter().collect();
        bones.sort_by(|a, b| nearness(a).total_cmp(&nearness(b)));
        for bone in bones {
            let palette = match marked[bone.part] {
                true => MARKED,
                false => palette,
            };
            let ends = [at(bone.parent), at(bone.joint)];
            svg.line(&ends, Stroke::solid(palette.outline, bone.width + 1.8));
            svg.line(&ends, Stroke::solid(palette.fill, bone.width));
            if Some(bone.joint) == self.body.head {
                let outline = Stroke::solid(palette.outline, 1.0);
                svg.circle(at(bone.joint), HEAD, palette.fill, outline);
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

/// Radius of the head, pixels.
const HEAD: f64 = 8.0;

/// Thickness of the bone that ends at a joint of this name, cm: the spine is thicker than the
/// limbs, the ends of limbs thinner.
pub(super) fn bone_thickness(joint: &str) -> f64 {
    match joint {
        _ if joint.starts_with("Spine") => 9.0,
        _ if joint.ends_with("Leg") => 7.6,
        _ if joint.contains("Toe") || joint.ends_with("Hand") => 5.0,
        _ => 6.4,
    }
}

/// The body part that a joint of this name belongs to; the trunk where none has it.
fn part_of(joint: &str) -> usize {
    let index = DANCE_JOINTS.iter().position(|name| name.starts_with(joint));
    let has_joint = |part: &&[(usize, f64)]| part.iter().any(|&(it, _)| Some(it) == index);
    PART_WEIGHTS.iter().position(has_joint).unwrap_or(0)
}
