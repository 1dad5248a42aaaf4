//! Units and axes of clips from other programs: recognised by the body, converted to centimetres
//! with Y up.

use std::f64::consts::FRAC_PI_2;
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::clip::{Clip, Pose};
use super::skeleton::Skeleton;

/// Frames that are looked at, spread evenly over a clip.
const SAMPLES: usize = 256;
/// A body from sole to crown by the way along its bones from an ankle to the head joint.
const WHOLE_BODY: f64 = 1.12;
/// How tall a grown-up is, m, with some room for skeletons that are no exact measure.
const GROWN_UP: RangeInclusive<f64> = 1.15..=2.3;
/// Bodies that are taken as they are, cm: no other unit makes one of them.
const IN_CM: RangeInclusive<f64> = 95.0..=300.0;
/// A body stands along an axis with which the way from its feet to its head has at least this
/// cosine.
const STANDS: f64 = 0.8;
/// Its feet are on the floor within this share of its height.
const FLOOR: f64 = 0.2;
/// Who goes about has places with more than this deviation, as a share of the height,
const FAR: f64 = 0.12;
/// and heights with less than this share of it.
const STAYS: f64 = 0.25;
/// Where the lowest joint of somebody is who lies on the floor, and below what the highest, as
/// shares of the height.
const LYING: RangeInclusive<f64> = -0.15..=0.15;
const LIES: f64 = 0.35;

/// The unit of a file's lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Recognised by the height of the body.
    #[default]
    Auto,
    Cm,
    M,
    Mm,
    In,
}

/// The axis that points up in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Up {
    /// Recognised by the rest pose and by how the body stands in most frames.
    #[default]
    Auto,
    Y,
    Z,
}

impl Unit {
    const ALL: [(&'static str, Self); 5] = [
        ("auto", Self::Auto),
        ("cm", Self::Cm),
        ("m", Self::M),
        ("mm", Self::Mm),
        ("in", Self::In),
    ];

    /// cm in one of it; 1 where it is not declared.
    pub fn cm(self) -> f64 {
        match self {
            Self::Auto | Self::Cm => 1.0,
            Self::M => 100.0,
            Self::Mm => 0.1,
            Self::In => 2.54,
        }
    }
}

impl Up {
    const ALL: [(&'static str, Self); 3] = [("auto", Self::Auto), ("y", Self::Y), ("z", Self::Z)];
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = Self::ALL.iter().find(|(_, unit)| unit == self);
        f.write_str(name.map_or("", |(name, _)| name))
    }
}

impl fmt::Display for Up {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = Self::ALL.iter().find(|(_, up)| up == self);
        f.write_str(name.map_or("", |(name, _)| name))
    }
}

impl FromStr for Unit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unit = Self::ALL.into_iter().find(|(name, _)| *name == text);
        let expected = || "expected auto, cm, m, mm or in".to_string();
        unit.map(|(_, unit)| unit).ok_or_else(expected)
    }
}

impl FromStr for Up {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let up = Self::ALL.into_iter().find(|(name, _)| *name == text);
        let expected = || "expected auto, y or z".to_string();
        up.map(|(_, up)| up).ok_or_else(expected)
    }
}

/// What a clip's body says of its unit and axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Measured {
    /// Height of the body, in the clip's own unit; none for a skeleton without a head and feet that
    /// are called so.
    pub height: Option<f64>,
    /// The unit in which that is a person's height, if one.
    pub unit: Option<Unit>,
    /// The axis along which it stands, where it can be told.
    pub up: Option<Up>,
    /// The axis along which it is in most frames, where that is another one.
    pub along: Option<Along>,
}

impl Measured {
    /// Measures the body of a clip.
    pub fn of(clip: &Clip) -> Self {
        let Some(body) = Body::of(&clip.skeleton) else {
            return Self::default();
        };
        let rest = clip.skeleton.rest_pose();
        let step = clip.poses.len().div_ceil(SAMPLES).max(1);
        let sampled: Vec<&Pose> = clip.poses.iter().step_by(step).collect();
        let moved = median(sampled.iter().map(|pose| body.length(pose)));
        // A body whose joints have all collapsed into one has its offsets left.
        let length = Some(moved).filter(|&length| length > 0.0);
        let height = WHOLE_BODY * length.unwrap_or_else(|| body.length(&rest));
        if height == 0.0 {
            return Self::default();
        }
        let (up, along) = body.up(&clip.skeleton, &rest, &sampled, height);
        Self {
            height: Some(height),
            unit: unit_of(height),
            up,
            along,
        }
    }
}

/// How a clip is brought to cm and Y up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conversion {
    /// cm in one of its units.
    pub cm: f64,
    turn: Turn,
}

/// What is turned from Z up to Y up: the axes become (x, z, -y).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Turn {
    Nothing,
    /// Where the rest pose stands along Y already, it is the root that carries the motion's axes,
    /// and it alone is turned.
    Root,
    /// Offsets, translations and rotations, so that the rest pose stands, too.
    Whole,
}

impl Conversion {
    /// What the unit and axis that are declared, or else recognised, ask for; and what was
    /// recognised and is done: nothing of a clip that is in cm and Y up, which stays as it is.
    pub fn of(clip: &Clip, unit: Unit, up: Up) -> (Self, Vec<String>) {
        let mut notices = Vec::new();
        let measured = match (unit, up) {
            (Unit::Auto, _) | (_, Up::Auto) => Measured::of(clip),
            _ => Measured::default(),
        };
        if unit == Unit::Auto
            && let Some(height) = measured.height
            && measured.unit != Some(Unit::Cm)
        {
            notices.push(match measured.unit {
                Some(unit) => format!(
                    "the body is {} units tall: taken as {unit} and converted to cm; another unit can be declared",
                    rounded(height)
                ),
                None => format!(
                    "the body is {} units tall, which is a grown-up in none of cm, m, mm and in: taken as cm; the unit can be declared",
                    rounded(height)
                ),
            });
        }
        if up == Up::Auto && measured.up == Some(Up::Z) {
            let done =
                "the body stands along Z: turned so that Y is up; another axis can be declared";
            notices.push(done.into());
        }
        if up == Up::Auto
            && let Some(along) = measured.along
        {
            notices.push(format!(
                "the body lies along {along} in most frames, or that is up: taken with {} up{}",
                match measured.up {
                    Some(Up::Z) => "Z",
                    _ => "Y",
                },
                match along {
                    Along {
                        axis: Y | Z,
                        downwards: false,
                    } => "; another axis can be declared",
                    _ => "",
                }
            ));
        }
        let unit = match unit {
            Unit::Auto => measured.unit.unwrap_or_default(),
            declared => declared,
        };
        let turn = if up == Up::Z || up == Up::Auto && measured.up == Some(Up::Z) {
            Turn::of(&clip.skeleton)
        } else {
            Turn::Nothing
        };
        let cm = unit.cm();
        (Self { cm, turn }, notices)
    }

    /// Whether there is nothing to do.
    pub fn is_none(self) -> bool {
        self.cm == 1.0 && self.turn == Turn::Nothing
    }

    /// Brings a clip to cm and Y up.
    pub fn apply(self, clip: &mut Clip) {
        scale(clip, self.cm);
        self.turn.apply(clip, &TO_Y_UP);
    }

    /// Brings a clip that is in cm with Y up back.
    pub fn undo(self, clip: &mut Clip) {
        self.turn.apply(clip, &TO_Z_UP);
        scale(clip, 1.0 / self.cm);
    }
}

/// A height with two digits, so that many dancers have one notice.
fn rounded(height: f64) -> f64 {
    let digits = 1 - height.max(f64::MIN_POSITIVE).log10().floor() as i32;
    (height * 10f64.powi(digits)).round() / 10f64.powi(digits)
}

/// Multiplies every length of a clip.
fn scale(clip: &mut Clip, factor: f64) {
    if factor == 1.0 {
        return;
    }
    for joint in &mut clip.skeleton.joints {
        joint.offset *= factor;
        joint.end_sites.iter_mut().for_each(|end| *end *= factor);
    }
    for pose in &mut clip.poses {
        pose.translations
            .iter_mut()
            .for_each(|place| *place *= factor);
    }
}

/// Turns a clip from Z up to Y up.
pub(super) fn turn_z_up(clip: &mut Clip) {
    Turn::of(&clip.skeleton).apply(clip, &TO_Y_UP);
}

impl Turn {
    /// What a skeleton of a clip with Z up asks for.
    fn of(skeleton: &Skeleton) -> Self {
        let rest = skeleton.rest_pose();
        let stands = |body: Body| body.rises(skeleton, &rest).y > STANDS;
        match Body::of(skeleton).is_some_and(stands) {
            true => Self::Root,
            false => Self::Whole,
        }
    }

    fn apply(self, clip: &mut Clip, way: &Quarter) {
        match self {
            Self::Nothing => {}
            Self::Root => turn_roots(clip, way),
            Self::Whole => turn_whole(clip, way),
        }
    }
}

/// A quarter of a turn about X.
struct Quarter {
    /// rad.
    angle: f64,
    /// The same without rounding.
    turned: fn(DVec3) -> DVec3,
}

// 0 - y, for no -0 where y is 0.
const TO_Y_UP: Quarter = Quarter {
    angle: -FRAC_PI_2,
    turned: |vector| DVec3::new(vector.x, vector.z, 0.0 - vector.y),
};
const TO_Z_UP: Quarter = Quarter {
    angle: FRAC_PI_2,
    turned: |vector| DVec3::new(vector.x, 0.0 - vector.z, vector.y),
};

fn turn_roots(clip: &mut Clip, way: &Quarter) {
    let (turn, turned) = (DQuat::from_rotation_x(way.angle), way.turned);
    for (index, joint) in clip.skeleton.joints.iter().enumerate() {
        if joint.parent.is_some() {
            continue;
        }
        for pose in &mut clip.poses {
            pose.translations[index] = turned(pose.translations[index]);
            pose.rotations[index] = (turn * pose.rotations[index]).normalize();
        }
    }
}

fn turn_whole(clip: &mut Clip, way: &Quarter) {
    let turned = way.turned;
    for joint in &mut clip.skeleton.joints {
        joint.offset = turned(joint.offset);
        for end in &mut joint.end_sites {
            *end = turned(*end);
        }
    }
    for pose in &mut clip.poses {
        for place in &mut pose.translations {
            *place = turned(*place);
        }
        for rotation in &mut pose.rotations {
            let axis = turned(DVec3::new(rotation.x, rotation.y, rotation.z));
            *rotation = DQuat::from_xyzw(axis.x, axis.y, axis.z, rotation.w);
        }
    }
}

fn unit_of(height: f64) -> Option<Unit> {
    if IN_CM.contains(&height) {
        return Some(Unit::Cm);
    }
    [Unit::M, Unit::In, Unit::Mm]
        .into_iter()
        .find(|unit| GROWN_UP.contains(&(height * unit.cm() / 100.0)))
}

/// Where a skeleton has its head and its feet.
struct Body {
    head: usize,
    /// At least one.
    feet: Vec<usize>,
    /// The joints on the way from each foot to the head, without the one where it turns upwards.
    ways: Vec<Vec<usize>>,
}

impl Body {
    fn of(skeleton: &Skeleton) -> Option<Self> {
        let called = |index: usize, words: &[&str]| {
            let name = skeleton.joints[index].name.to_lowercase();
            words.iter().any(|word| name.contains(word))
        };
        let ancestors = |joint: usize| {
            let parent = |&joint: &usize| skeleton.joints[joint].parent;
            std::iter::successors(Some(joint), parent)
        };
        let head = (0..skeleton.len()).find(|&joint| called(joint, &["head"]))?;
        let foot = |joint: usize| called(joint, &["foot", "ankle"]);
        let feet: Vec<usize> = (0..skeleton.len())
            .filter(|&joint| foot(joint) && !ancestors(joint).skip(1).any(foot))
            .collect();
        let above: Vec<usize> = ancestors(head).collect();
        let way = |&foot: &usize| {
            let fork = ancestors(foot).find(|joint| above.contains(joint))?;
            let legs = ancestors(foot).take_while(|&joint| joint != fork);
            let spine = ancestors(head).take_while(|&joint| joint != fork);
            Some(legs.chain(spine).collect())
        };
        let ways: Vec<Vec<usize>> = feet.iter().map(way).collect::<Option<_>>()?;
        (!feet.is_empty()).then_some(Self { head, feet, ways })
    }

    /// The way along the bones from the feet to the head.
    fn length(&self, pose: &Pose) -> f64 {
        let lengths = self.ways.iter().map(|way| -> f64 {
            let bones = way.iter().map(|&joint| pose.translations[joint].length());
            bones.sum()
        });
        lengths.fold(0.0, f64::max)
    }

    /// The direction from the feet to the head; zero where they are at one place.
    fn rises(&self, skeleton: &Skeleton, pose: &Pose) -> DVec3 {
        let positions = pose.world_positions(skeleton);
        let feet: DVec3 = self.feet.iter().map(|&foot| positions[foot]).sum();
        (positions[self.head] - feet / self.feet.len() as f64).normalize_or_zero()
    }

    /// The upward axis, and the axis along which the body is in most frames where that is another
    /// one, which may be a dancer who lies.
    ///
    /// Who goes about says it at once: the floor is at one height. Else a rest pose that stands
    /// along Y says so, whatever its dancer does; one that stands along Z, unless the frames stand
    /// along Y. One that does not stand (many have all bones along X) leaves it to the frames.
    fn up(
        &self,
        skeleton: &Skeleton,
        rest: &Pose,
        sampled: &[&Pose],
        height: f64,
    ) -> (Option<Up>, Option<Along>) {
        let at_rest = self.rises(skeleton, rest);
        let seen = Seen::of(self, skeleton, sampled, height);
        let goes_on_y = seen.goes_about_on(Y) && (at_rest.z <= STANDS || seen.rises(Y));
        let goes_on_z = seen.goes_about_on(Z) && (at_rest.y <= STANDS || seen.rises(Z));
        let stands_on_y = at_rest.y > STANDS
            || seen.rises(Y) && (at_rest.z <= STANDS || seen.has_feet_at(Y) || !seen.is_low_on(Z));
        let stands_on_z =
            at_rest.z > STANDS || seen.rises(Z) && (seen.has_feet_at(Z) || !seen.lies_on(Y));
        let up = if goes_on_y || !goes_on_z && stands_on_y {
            Some(Up::Y)
        } else if goes_on_z || stands_on_z {
            Some(Up::Z)
        } else {
            None
        };
        let (axis, rests) = match up {
            Some(Up::Z) => (Z, at_rest.z),
            _ => (Y, at_rest.y),
        };
        // Whoever stands at rest lies in the frames, unless with the feet on the other's floor.
        let lies = |along: &Along| rests <= STANDS || along.axis == Z && seen.has_feet_at(Z);
        let other = |along: &Along| along.axis != axis || along.downwards;
        (up, seen.along().filter(other).filter(lies))
    }
}

/// An axis and a sense of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Along {
    axis: usize,
    downwards: bool,
}

impl fmt::Display for Along {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.downwards { "-" } else { "" };
        write!(f, "{sign}{}", ["X", "Y", "Z"][self.axis])
    }
}

const Y: usize = 1;
const Z: usize = 2;

/// How a body is in most frames of a clip, by axis; lengths as shares of its height.
struct Seen {
    /// Of the direction from its feet to its head, the median.
    rise: DVec3,
    /// How far the lowest joint moves: its deviation.
    moves: DVec3,
    /// Medians of the lower foot, the lowest and the highest joint.
    foot: DVec3,
    lowest: DVec3,
    highest: DVec3,
}

impl Seen {
    fn of(body: &Body, skeleton: &Skeleton, sampled: &[&Pose], height: f64) -> Self {
        let world: Vec<Vec<DVec3>> = sampled
            .iter()
            .map(|pose| pose.world_positions(skeleton))
            .collect();
        let lowest = |frame: &Vec<DVec3>| frame.iter().copied().reduce(DVec3::min);
        let lowest: Vec<DVec3> = world.iter().filter_map(lowest).collect();
        let highest = world
            .iter()
            .filter_map(|it| it.iter().copied().reduce(DVec3::max));
        let highest: Vec<DVec3> = highest.collect();
        let feet = |frame: &Vec<DVec3>| {
            let feet = body.feet.iter().map(|&foot| frame[foot]);
            feet.reduce(DVec3::min)
        };
        let feet: Vec<DVec3> = world.iter().filter_map(feet).collect();
        let rises: Vec<DVec3> = sampled
            .iter()
            .map(|pose| body.rises(skeleton, pose))
            .collect();
        let share = |of: DVec3| of / height.max(f64::MIN_POSITIVE);
        Self {
            rise: medians(&rises),
            moves: share(deviations(&lowest)),
            foot: share(medians(&feet)),
            lowest: share(medians(&lowest)),
            highest: share(medians(&highest)),
        }
    }

    /// Whether the body stands along an axis.
    fn rises(&self, axis: usize) -> bool {
        self.rise[axis] > STANDS
    }

    /// Whether it goes about while its lowest joint stays at one height on one of Y and Z.
    fn goes_about_on(&self, axis: usize) -> bool {
        let across = Y + Z - axis;
        let far = self.moves[across] > FAR && self.moves[axis] < STAYS * self.moves[across];
        far && !self.rises(across)
    }

    /// Whether the feet are at the plane through the origin: of somebody who lies along the axis
    /// they hardly are.
    fn has_feet_at(&self, axis: usize) -> bool {
        self.foot[axis].abs() < FLOOR
    }

    /// Whether it may lie on the plane through the origin, or on a floor near to it.
    fn is_low_on(&self, axis: usize) -> bool {
        self.lowest[axis].abs() < LIES
    }

    /// Whether all of it is low above the plane through the origin.
    fn lies_on(&self, axis: usize) -> bool {
        LYING.contains(&self.lowest[axis]) && self.highest[axis] < LIES
    }

    /// The axis along which the body is.
    fn along(&self) -> Option<Along> {
        let axis = (0..3).find(|&axis| self.rise[axis].abs() > STANDS)?;
        Some(Along {
            axis,
            downwards: self.rise[axis] < 0.0,
        })
    }
}

/// By axis.
fn medians(places: &[DVec3]) -> DVec3 {
    let of = |axis: usize| median(places.iter().map(|place| place[axis]));
    DVec3::new(of(0), of(1), of(2))
}

/// Standard deviations by axis.
fn deviations(places: &[DVec3]) -> DVec3 {
    let count = places.len().max(1) as f64;
    let mean = places.iter().sum::<DVec3>() / count;
    let squares: DVec3 = places.iter().map(|place| (place - mean).powf(2.0)).sum();
    (squares / count).powf(0.5)
}

/// 0 of none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
