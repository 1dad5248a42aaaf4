//! From joint positions to joint rotations, bone lengths held: what a BVH file needs of a predicted
//! motion.

use glam::{DQuat, DVec3};

use super::rotation_fit::best_rotation;
use super::{Pose, Skeleton};

/// Joint rotations for a motion that was given by positions.
#[derive(Debug, Clone, PartialEq)]
pub struct RotationFit {
    /// One pose a frame: the root where it was asked for, all other translations as in the start
    /// pose.
    pub poses: Vec<Pose>,
    /// Mean over frames and joints of the distance from the asked position to the one the pose has,
    /// cm.
    pub mean_error: f64,
    /// The largest of these distances, cm.
    pub max_error: f64,
}

/// Why positions cannot be turned into rotations.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RotationFitError {
    #[error("{what} has {found} joints, the skeleton has {expected}")]
    Joints {
        what: String,
        found: usize,
        expected: usize,
    },
    #[error("frame {frame}, joint {joint}: the position is not a finite number")]
    NotFinite { frame: usize, joint: String },
    #[error("there are no frames to fit rotations to")]
    NoFrames,
}

/// Finds rotations whose forward kinematics come near the given world positions,
/// `positions[frame][joint]`, cm.
///
/// `start` is the pose of the frame before the first (the keyframe k1), `end`, where it is known,
/// that of the last frame (the keyframe k2). Bone lengths are those of `start`, so positions whose
/// bones are longer or shorter cannot be met; the fit's errors say by how much. From the root
/// outwards each joint is turned from its local rotation in the frame before, under its parent's
/// new rotation:
///
/// - with several children, so that the sum of squared distances to their positions is least;
/// - with one child, by the shortest arc that points it at the child, and then about the bone by
///   the twist below;
/// - without children, on the way from its rotation in `start` to that in `end`; it keeps the
///   former without an end.
///
/// Positions do not tell the twist about a bone; neighbours and the two keyframes do:
///
/// - above an elbow or an ankle, the plane of the bend stays where it is in the frame before and in
///   the keyframes, the more the limb is bent (the knee's plane is of no use: most of the time the
///   leg is too straight to have one);
/// - in a chain that leads to a joint of several children (the spine), each joint takes its share
///   of what that joint is turned;
/// - elsewhere, and above elbows and ankles too, the twist comes nearer from frame to frame to the
///   one on the way between the keyframes', and not at all where the bone points the other way from
///   there.
///
/// # Errors
///
/// [`RotationFitError`]: no frames, a wrong number of joints, a NaN or infinity.
pub fn fit_rotations(
    skeleton: &Skeleton,
    positions: &[impl AsRef<[DVec3]>],
    start: &Pose,
    end: Option<&Pose>,
) -> Result<RotationFit, RotationFitError> {
    check(skeleton, positions, start, end)?;
    let fitter = Fitter::new(skeleton, start, end);
    let mut poses: Vec<Pose> = Vec::with_capacity(positions.len());
    let (mut sum, mut max_error) = (0.0, 0.0f64);
    for (frame, wanted) in positions.iter().enumerate() {
        let wanted = wanted.as_ref();
        let share = (frame + 1) as f64 / positions.len() as f64;
        let pose = fitter.frame(wanted, poses.last().unwrap_or(start), share);
        for (found, wanted) in pose.world_positions(skeleton).iter().zip(wanted) {
            let error = found.distance(*wanted);
            sum += error;
            max_error = max_error.max(error);
        }
        poses.push(pose);
    }
    Ok(RotationFit {
        mean_error: sum / (positions.len() * skeleton.len()) as f64,
        max_error,
        poses,
    })
}

fn check(
    skeleton: &Skeleton,
    positions: &[impl AsRef<[DVec3]>],
    start: &Pose,
    end: Option<&Pose>,
) -> Result<(), RotationFitError> {
    if positions.is_empty() {
        return Err(RotationFitError::NoFrames);
    }
    let expected = skeleton.len();
    let mut counts = Vec::new();
    for (which, pose) in [("start", Some(start)), ("end", end)] {
        let Some(pose) = pose else { continue };
        for (part, count) in [
            ("translations", pose.translations.len()),
            ("rotations", pose.rotations.len()),
        ] {
            counts.push((format!("the {which} pose's {part}"), count));
        }
    }
    let frames = positions.iter().enumerate();
    counts.extend(frames.map(|(at, joints)| (format!("frame {at}"), joints.as_ref().len())));
    for (what, found) in counts {
        if found != expected {
            return Err(RotationFitError::Joints {
                what,
                found,
                expected,
            });
        }
    }
    for (frame, joints) in positions.iter().enumerate() {
        for (position, joint) in joints.as_ref().iter().zip(&skeleton.joints) {
            if !position.is_finite() {
                return Err(RotationFitError::NotFinite {
                    frame,
                    joint: joint.name.clone(),
                });
            }
        }
    }
    Ok(())
}

/// What settles the rotation of a joint.
#[derive(Debug, Clone, PartialEq)]
enum Guide {
    /// No child: the keyframes alone.
    Leaf,
    /// Several children: their places.
    Children(Vec<usize>),
    /// One child; the twist by `twist`.
    Child { child: usize, twist: Twist },
}

/// What settles the twist about a joint's only bone, apart from the keyframes.
#[derive(Debug, Clone, PartialEq)]
enum Twist {
    Free,
    /// The child bends in a plane; `end` is the child's child, `bend` where the keyframes bend it
    /// to, across the bone, in the joint's frame.
    Hinge {
        end: usize,
        bend: DVec3,
    },
    /// The joints from the child on to one with several children, that one included.
    Chain(Vec<usize>),
}

/// Joints of the dance skeleton that bend in a plane that is fixed in the bone above them.
const HINGES: [&str; 4] = ["LeftFoot", "RightFoot", "LeftForeArm", "RightForeArm"];

struct Fitter<'a> {
    skeleton: &'a Skeleton,
    start: &'a Pose,
    end: Option<&'a Pose>,
    children: Vec<Vec<usize>>,
    guides: Vec<Guide>,
}

impl<'a> Fitter<'a> {
    fn new(skeleton: &'a Skeleton, start: &'a Pose, end: Option<&'a Pose>) -> Self {
        let children = children(skeleton);
        let guide = |joint: usize| match children[joint][..] {
            [] => Guide::Leaf,
            [child] => Guide::Child {
                child,
                twist: twist(skeleton, &children, child, start, end),
            },
            _ => Guide::Children(children[joint].clone()),
        };
        let guides = (0..skeleton.len()).map(guide).collect();
        Self {
            skeleton,
            start,
            end,
            children,
            guides,
        }
    }

    /// The pose near `wanted` that goes on from the pose `before`; `share` of the way to the end
    /// pose.
    fn frame(&self, wanted: &[DVec3], before: &Pose, share: f64) -> Pose {
        let mut pose = before.clone();
        let mut positions = Vec::with_capacity(self.skeleton.len());
        let mut rotations: Vec<DQuat> = Vec::with_capacity(self.skeleton.len());
        for (index, joint) in self.skeleton.joints.iter().enumerate() {
            let parent = joint
                .parent
                .map_or(DQuat::IDENTITY, |parent| rotations[parent]);
            match joint.parent {
                Some(up) => positions.push(positions[up] + parent * pose.translations[index]),
                None => {
                    pose.translations[index] = wanted[index];
                    positions.push(wanted[index]);
                }
            }
            let propagated = parent * before.rotations[index];
            let between = self.end.map(|end| {
                let (from, to) = (self.start.rotations[index], end.rotations[index]);
                parent * from.slerp(to, share).normalize()
            });
            let turned = match &self.guides[index] {
                Guide::Leaf => between.unwrap_or(propagated),
                Guide::Children(children) => {
                    let pairs = pairs(propagated, &pose, children, positions[index], wanted);
                    best_rotation(&pairs) * propagated
                }
                Guide::Child { child, twist } => {
                    let bone = pose.translations[*child];
                    let direction = wanted[*child] - positions[index];
                    if bone.length() > SHORTEST && direction.length() > SHORTEST {
                        let direction = direction.normalize();
                        let swung = swing(propagated, bone, direction);
                        let turned = self.twisted(twist, swung, direction, wanted, before);
                        match (twist, between) {
                            (Twist::Chain(_), _) | (_, None) => turned,
                            (_, Some(between)) => drift(turned, between, bone, direction),
                        }
                    } else {
                        propagated
                    }
                }
            };
            let turned = turned.normalize();
            pose.rotations[index] = (parent.inverse() * turned).normalize();
            rotations.push(turned);
        }
        pose
    }

    /// The rotation turned about `direction` as the neighbours say.
    fn twisted(
        &self,
        twist: &Twist,
        rotation: DQuat,
        direction: DVec3,
        wanted: &[DVec3],
        before: &Pose,
    ) -> DQuat {
        let angle = match twist {
            Twist::Free => 0.0,
            Twist::Hinge { end, bend } => {
                let Some(middle) = self.skeleton.joints[*end].parent else {
                    return rotation;
                };
                let bone = before.translations[middle];
                let last = bend_of(before, middle, *end);
                let reference = rotation * across(bend + last, bone);
                let now = wanted[*end] - wanted[middle];
                let now = across(now.normalize_or_zero(), direction);
                let weight = HINGE * reference.length() * now.length();
                let sine = direction.dot(reference.cross(now));
                weighted(weight, sine.atan2(reference.dot(now)))
            }
            Twist::Chain(chain) => {
                // Where the chain's last joint would be turned to if nothing but this joint turned.
                let carried = chain
                    .iter()
                    .fold(rotation, |turned, &joint| turned * before.rotations[joint]);
                let last = chain[chain.len() - 1];
                let origin = wanted[last];
                let pairs = pairs(carried, before, &self.children[last], origin, wanted);
                let turn = best_rotation(&pairs);
                let turn = if turn.w < 0.0 { -turn } else { turn };
                let about = turn.xyz().dot(direction);
                2.0 * about.atan2(turn.w) / (chain.len() + 1) as f64
            }
        };
        DQuat::from_axis_angle(direction, angle) * rotation
    }
}

/// Lengths below this have no direction, cm.
const SHORTEST: f64 = 1e-9;
/// Weight of a hinge's plane at a right angle, against 1 for the twist of the frame before.
const HINGE: f64 = 1.0;
/// Frames in which a twist comes e times nearer to the one between the keyframes'.
const DRIFT: f64 = 8.0;

/// The mean angle of a reading of `weight` and of no turn at all with weight 1.
fn weighted(weight: f64, angle: f64) -> f64 {
    (weight * angle.sin()).atan2(1.0 + weight * angle.cos())
}

/// A rotation that takes `bone` to `direction`, turned about it towards the rotation `between` the
/// keyframes.
fn drift(rotation: DQuat, between: DQuat, bone: DVec3, direction: DVec3) -> DQuat {
    let near = 0.5 * (1.0 + (between * bone.normalize()).dot(direction));
    let turn = swing(between, bone, direction) * rotation.inverse();
    let angle = 2.0 * turn.xyz().dot(direction).atan2(turn.w);
    let angle = weighted(near / DRIFT, angle);
    DQuat::from_axis_angle(direction, angle) * rotation
}

/// The rotation turned by the shortest arc so that it takes `bone` to `direction`.
fn swing(rotation: DQuat, bone: DVec3, direction: DVec3) -> DQuat {
    DQuat::from_rotation_arc((rotation * bone).normalize(), direction) * rotation
}

/// What is left of a vector across a direction of any length.
fn across(vector: DVec3, direction: DVec3) -> DVec3 {
    vector - vector.project_onto_normalized(direction.normalize())
}

/// Bones to children as `rotation` has them, and as they are wanted; those without a length are
/// left out.
fn pairs(
    rotation: DQuat,
    pose: &Pose,
    children: &[usize],
    origin: DVec3,
    wanted: &[DVec3],
) -> Vec<(DVec3, DVec3)> {
    children
        .iter()
        .map(|&child| (rotation * pose.translations[child], wanted[child] - origin))
        .filter(|(now, wanted)| now.length() > SHORTEST && wanted.length() > SHORTEST)
        .collect()
}

/// How a pose bends a limb at `middle`: the direction to `end` across the bone to `middle`, in the
/// frame of the joint above; as long as the sine of the bend.
fn bend_of(pose: &Pose, middle: usize, end: usize) -> DVec3 {
    let direction = (pose.rotations[middle] * pose.translations[end]).normalize_or_zero();
    across(direction, pose.translations[middle])
}

fn twist(
    skeleton: &Skeleton,
    children: &[Vec<usize>],
    child: usize,
    start: &Pose,
    end: Option<&Pose>,
) -> Twist {
    let mut chain = vec![child];
    while let [next] = children[chain[chain.len() - 1]][..] {
        chain.push(next);
    }
    if children[chain[chain.len() - 1]].len() > 1 {
        return Twist::Chain(chain);
    }
    let has_length = |joint: usize| start.translations[joint].length() > SHORTEST;
    match children[child][..] {
        [last]
            if HINGES.contains(&skeleton.joints[child].name.as_str())
                && has_length(child)
                && has_length(last) =>
        {
            let poses = [Some(start), end].into_iter().flatten();
            let bend = poses.map(|pose| bend_of(pose, child, last)).sum();
            Twist::Hinge { end: last, bend }
        }
        _ => Twist::Free,
    }
}

/// Children of each joint.
fn children(skeleton: &Skeleton) -> Vec<Vec<usize>> {
    let mut children = vec![Vec::new(); skeleton.len()];
    for (index, joint) in skeleton.joints.iter().enumerate() {
        if let Some(parent) = joint.parent {
            children[parent].push(index);
        }
    }
    children
}
