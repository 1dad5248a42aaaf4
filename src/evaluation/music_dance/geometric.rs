//! Geometric features of a dance: in which share of its frames relations between joints hold.

use glam::DVec3;

use super::FRAMES_PER_SECOND;
use super::relations::{COUNT, Length, Place, RELATIONS, Relation};
use crate::motion::contact_foot::joint_called;
use crate::motion::{MissingJoint, Skeleton};

/// The 32 relations on a skeleton.
#[derive(Debug, Clone, PartialEq)]
pub struct GeometricFeatures {
    relations: Vec<OnSkeleton>,
}

/// A relation with joints by their indices and its threshold as a length.
#[derive(Debug, Clone, PartialEq)]
struct OnSkeleton {
    relation: Relation,
    places: Vec<Point>,
    /// 0 of an angle.
    threshold: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Point {
    Joint(usize),
    Fixed(DVec3),
    Floor,
}

impl GeometricFeatures {
    /// On a skeleton whose joints have the dance skeleton's names.
    ///
    /// # Errors
    /// One is missing.
    pub fn of(skeleton: &Skeleton) -> Result<Self, MissingJoint> {
        let rest = at_rest(skeleton);
        let joint = |name| joint_called(skeleton, &[name]);
        let between = |[a, b]: [&'static str; 2]| -> Result<f64, MissingJoint> {
            Ok(rest[joint(a)?].distance(rest[joint(b)?]))
        };
        let upper_arm = between(["LeftArm", "LeftForeArm"])?;
        let shoulders = between(["LeftArm", "RightArm"])?;
        let hips = between(["LeftUpLeg", "RightUpLeg"])?;
        let length = |length: Length| match length {
            Length::UpperArm => upper_arm,
            Length::Shoulders => shoulders,
            Length::Hips => hips,
        };
        let point = |place: &Place| -> Result<Point, MissingJoint> {
            Ok(match *place {
                Place::Joint(name) => Point::Joint(joint(name)?),
                Place::Origin => Point::Fixed(DVec3::ZERO),
                Place::Up => Point::Fixed(DVec3::Y),
                Place::Down => Point::Fixed(-DVec3::Y),
                Place::Floor => Point::Floor,
            })
        };
        let on_skeleton = |relation: &Relation| {
            let (places, threshold) = relation.parts();
            Ok(OnSkeleton {
                relation: *relation,
                places: places.iter().map(point).collect::<Result<_, _>>()?,
                threshold: threshold.map_or(0.0, |(times, of)| times * length(of)),
            })
        };
        let relations = RELATIONS.iter().map(on_skeleton);
        Ok(Self {
            relations: relations.collect::<Result<_, MissingJoint>>()?,
        })
    }

    /// The share of frames 1..T of a window in which each relation holds, `[32]`; speeds are
    /// those from the frame before. Zeros of fewer than two frames.
    ///
    /// `world`: positions of the skeleton's joints, `[T][joints]`, in the unit of its offsets, 30
    /// frames a second. Where a direction has no length its relation does not hold.
    #[must_use]
    pub fn shares(&self, world: &[Vec<DVec3>]) -> [f64; COUNT] {
        let mut shares = [0.0; COUNT];
        for pair in world.windows(2) {
            let [before, now] = pair else { continue };
            for (share, relation) in shares.iter_mut().zip(&self.relations) {
                *share += f64::from(u8::from(relation.holds(before, now)));
            }
        }
        let steps = world.len().saturating_sub(1).max(1) as f64;
        shares.map(|count| count / steps)
    }
}

impl Relation {
    fn parts(&self) -> (&[Place], Option<(f64, Length)>) {
        match self {
            Self::Move(places, threshold) => (places, Some(*threshold)),
            Self::NormalMove(places, threshold)
            | Self::Plane(places, threshold)
            | Self::NormalPlane(places, threshold) => (places, Some(*threshold)),
            Self::Angle(places, _) => (places, None),
            Self::Fast(place, threshold) => (std::slice::from_ref(place), Some(*threshold)),
        }
    }
}

impl OnSkeleton {
    fn holds(&self, before: &[DVec3], now: &[DVec3]) -> bool {
        let place = |index: usize, frame: &[DVec3]| match self.places.get(index) {
            Some(Point::Joint(joint)) => frame.get(*joint).copied().unwrap_or_default(),
            Some(Point::Floor) => {
                let lowest = frame
                    .iter()
                    .map(|joint| joint.y)
                    .fold(f64::INFINITY, f64::min);
                DVec3::Y * lowest
            }
            Some(Point::Fixed(point)) => *point,
            None => DVec3::ZERO,
        };
        let at = |index: usize| place(index, now);
        let relative = |of: usize| {
            let moved = (at(of) - at(0)) - (place(of, before) - place(0, before));
            moved * FRAMES_PER_SECOND
        };
        let normal = || (at(2) - at(0)).cross(at(1) - at(0));
        // A direction without a length gives NaN, and NaN exceeds nothing.
        let along = |direction: DVec3, vector: DVec3| vector.dot(direction) / direction.length();
        let measured = match self.relation {
            Relation::Move(..) => along(at(1) - at(0), relative(2)),
            Relation::NormalMove(..) => along(normal(), relative(3)),
            Relation::Plane(..) => along(normal(), at(3) - at(0)),
            Relation::NormalPlane(..) => along(at(1) - at(0), at(3) - at(2)),
            Relation::Fast(..) => (at(0) - place(0, before)).length() * FRAMES_PER_SECOND,
            Relation::Angle(_, [least, most]) => {
                let (a, b) = (at(1) - at(0), at(3) - at(2));
                let angle = (a.dot(b) / (a.length() * b.length())).acos().to_degrees();
                return angle > least && angle < most;
            }
        };
        measured > self.threshold
    }
}

/// Positions of the joints at rest, `[joints]`, the root at 0.
fn at_rest(skeleton: &Skeleton) -> Vec<DVec3> {
    let mut rest: Vec<DVec3> = Vec::with_capacity(skeleton.len());
    for joint in &skeleton.joints {
        let at = match joint.parent.and_then(|parent| rest.get(parent)) {
            Some(parent) => *parent + joint.offset,
            None => DVec3::ZERO,
        };
        rest.push(at);
    }
    rest
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::relations::COUNT;
    use super::{GeometricFeatures, at_rest};
    use crate::motion::{DANCE_JOINTS, DANCE_PARENTS, Joint, Skeleton};

    /// A body of straight bones, cm: upper arms of 30, shoulders 40 and hips 20 wide, T-pose.
    fn skeleton() -> Skeleton {
        let offset = |name: &str| match name {
            "Hips" => [0.0, 0.0, 0.0],
            "LeftUpLeg" => [10.0, 0.0, 0.0],
            "RightUpLeg" => [-10.0, 0.0, 0.0],
            "LeftLeg" | "RightLeg" | "LeftFoot" | "RightFoot" => [0.0, -40.0, 0.0],
            "LeftToeBase" | "RightToeBase" => [0.0, 0.0, 15.0],
            "LeftShoulder" => [5.0, 0.0, 0.0],
            "RightShoulder" => [-5.0, 0.0, 0.0],
            "LeftArm" => [15.0, 0.0, 0.0],
            "RightArm" => [-15.0, 0.0, 0.0],
            "LeftForeArm" | "LeftHand" => [30.0, 0.0, 0.0],
            "RightForeArm" | "RightHand" => [-30.0, 0.0, 0.0],
            _ => [0.0, 10.0, 0.0],
        };
        let joints = DANCE_JOINTS.iter().zip(DANCE_PARENTS);
        let joints = joints.map(|(name, parent)| Joint {
            name: (*name).into(),
            parent,
            offset: offset(name).into(),
            end_sites: Vec::new(),
        });
        Skeleton {
            joints: joints.collect(),
        }
    }

    fn joint(name: &str) -> usize {
        skeleton().index_of(name).unwrap()
    }

    /// Which relations hold in the second of two frames, each at rest with these joints elsewhere.
    fn holding(before: &[(&str, DVec3)], now: &[(&str, DVec3)]) -> Vec<usize> {
        let skeleton = skeleton();
        let frame = |moved: &[(&str, DVec3)]| {
            let mut world = at_rest(&skeleton);
            for (name, by) in moved {
                world[joint(name)] += *by;
            }
            world
        };
        let shares = GeometricFeatures::of(&skeleton).unwrap();
        let shares = shares.shares(&[frame(before), frame(now)]);
        (0..COUNT).filter(|index| shares[*index] == 1.0).collect()
    }

    /// What holds at rest: hands 160 apart, more than 2.5 x 40; the left ankle 14.7 in front of
    /// the plane through root, right hip and right toes, more than 0.38 x 30; arms at right angles
    /// to the trunk.
    const AT_REST: [usize; 4] = [8, 15, 23, 24];

    #[test]
    fn at_rest_the_hands_are_wide_apart_and_the_arms_away_from_the_body() {
        assert_eq!(holding(&[], &[]), AT_REST);
    }

    #[test]
    fn each_kind_of_relation_holds_where_it_should() {
        let with = |moved: &[(&str, DVec3)]| -> Vec<usize> {
            let found = holding(moved, moved).into_iter();
            found.filter(|index| !AT_REST.contains(index)).collect()
        };
        // Above the neck by more than 0.2 x 30: the wrist is 10 below it at rest.
        assert_eq!(with(&[("RightHand", DVec3::Y * 16.5)]), [2]);
        assert_eq!(with(&[("RightHand", DVec3::Y * 15.5)]), Vec::<usize>::new());
        // The elbow bent to less than 110 degrees: the hand above it.
        assert_eq!(with(&[("LeftHand", DVec3::new(-30.0, 9.0, 0.0))]), [7]);
        // An ankle 37 above the floor, the toes of the other foot.
        assert_eq!(with(&[("LeftFoot", DVec3::Y * 37.0)]), [17]);
        // A wrist below 36: from 130 down to 35.
        let low = holding(&[], &[("LeftHand", DVec3::Y * -95.0)]);
        assert!(low.contains(&30) && !low.contains(&29));
        // Ankles apart by more than 42.
        assert!(with(&[("LeftFoot", DVec3::X * 23.0)]).contains(&18));
        assert!(!with(&[("LeftFoot", DVec3::X * 21.0)]).contains(&18));
        // The right ankle in front of the plane through root, left hip and left toes: towards the
        // side of (toes - root) x (hip - root).
        let [hip, toes] = [DVec3::X * 10.0, DVec3::new(10.0, -80.0, 15.0)];
        let side = toes.cross(hip).normalize();
        let ankle = DVec3::new(-10.0, -80.0, 0.0);
        let missing = 0.38 * 30.0 - ankle.dot(side);
        assert!(with(&[("RightFoot", side * (missing + 0.1))]).contains(&14));
        assert!(!with(&[("RightFoot", side * (missing - 0.1))]).contains(&14));
        // A trunk that lies: 90 degrees to up.
        assert!(with(&[("Neck", DVec3::new(0.0, -60.0, 60.0))]).contains(&28));
    }

    #[test]
    fn speeds_are_per_second_and_along_their_direction() {
        let step = |name: &'static str, by: DVec3| -> Vec<usize> {
            let found = holding(&[], &[(name, by)]).into_iter();
            found.filter(|index| !AT_REST.contains(index)).collect()
        };
        // 2.5 x 30 a second are 2.5 a frame, 1.4 x 30 are 1.4. Hands that part count three times:
        // each from the other, and each past the root.
        let out = DVec3::X;
        assert_eq!(step("RightHand", out * -2.6), [9, 10, 11, 12]);
        assert_eq!(step("RightHand", out * -2.4), [9, 10, 11]);
        assert_eq!(step("RightHand", out * -1.5), [9]);
        assert_eq!(step("RightHand", out * -1.3), Vec::<usize>::new());
        assert_eq!(step("RightHand", out * 2.4), Vec::<usize>::new());
        // The plane of neck and hips is upright; a wrist that crosses it counts on its own side.
        let [neck, right, left] = ["Neck", "RightUpLeg", "LeftUpLeg"].map(joint);
        let rest = at_rest(&skeleton());
        let normal = (rest[left] - rest[neck])
            .cross(rest[right] - rest[neck])
            .normalize();
        assert!((normal.z.abs() - 1.0).abs() < 1e-12);
        assert_eq!(step("RightHand", normal * 1.9), [0]);
        assert_eq!(step("LeftHand", normal * -1.9), [1]);
        // The root moved by itself: 2.3 a frame; what is measured from it moves as well.
        assert!(step("Hips", DVec3::Z * 2.35).contains(&31));
        assert!(!step("Hips", DVec3::Z * 2.25).contains(&31));
    }

    #[test]
    fn shares_are_over_the_frames_after_the_first() {
        let skeleton = skeleton();
        let features = GeometricFeatures::of(&skeleton).unwrap();
        let rest = at_rest(&skeleton);
        let mut risen = rest.clone();
        risen[joint("RightHand")].y += 17.0;
        let shares = features.shares(&[rest.clone(), rest.clone(), risen.clone(), risen, rest]);
        assert_eq!(shares[2], 0.5);
        assert_eq!(shares[8], 1.0);
        assert_eq!(features.shares(&[]), [0.0; COUNT]);
    }

    #[test]
    fn a_skeleton_without_a_joint_of_the_list_is_named() {
        let mut skeleton = skeleton();
        skeleton.joints[joint("Spine3")].name = "Chest".into();
        let missing = GeometricFeatures::of(&skeleton).unwrap_err();
        assert!(missing.to_string().contains("Spine3"), "{missing}");
    }
}
