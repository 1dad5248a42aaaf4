//! Which joints turn in the training part, and the rotations that theirs are measured from.

use glam::{DMat3, DQuat, DVec3};

use crate::models::ModelError;
use crate::motion::columns::without_heading;
use crate::motion::exponential_map::{exponential_map, from_exponential_map};
use crate::motion::mirror::other_side;
use crate::motion::rotation_fit::best_rotation;
use crate::motion::{Clip, MotionColumns, NamedRotation};

/// A joint of which no number of the exponential map deviates by this much never turns, rad.
const STILL: f64 = 1e-5;

/// What a joint does in the training part.
struct Joint {
    name: String,
    turns: bool,
    /// Exponential map of its rotation, the mean over all frames, rad.
    mean_map: DVec3,
    /// Sum of its rotations' matrices.
    matrices: DMat3,
}

/// The columns of clips: rotations of the joints that all their skeletons have and that turn, in
/// the order of the first skeleton. A joint turns where its partner on the other side does.
///
/// `centre`: rotations are measured from their means (spec, section 2, `centre_rotations`), which
/// are those of the clips and their mirror images where these are trained (`mirror`).
///
/// # Errors
/// There is no clip, or none with a joint.
pub fn columns_of(
    clips: &[&Clip],
    centre: bool,
    mirror: bool,
) -> Result<MotionColumns, ModelError> {
    let none = || ModelError::Data {
        reason: "there is no clip to train on".into(),
    };
    let first = clips.first().ok_or_else(none)?;
    let names = first.skeleton.joints.iter().map(|joint| &joint.name);
    let names = names.enumerate().filter(|(at, name)| {
        *at == 0
            || clips
                .iter()
                .all(|clip| clip.skeleton.index_of(name).is_some())
    });
    let mut joints: Vec<Joint> = names.map(|(at, name)| joint(at, name, clips)).collect();
    let turning: Vec<String> = joints
        .iter()
        .filter(|it| it.turns)
        .map(|it| it.name.clone())
        .collect();
    for joint in &mut joints {
        joint.turns |= other_side(&joint.name).is_some_and(|other| turning.contains(&other));
    }
    let sums: Vec<(String, DMat3)> = joints
        .iter()
        .map(|joint| (joint.name.clone(), joint.matrices))
        .collect();
    let centre_of = |joint: &Joint| -> DQuat {
        let other = other_side(&joint.name).unwrap_or_else(|| joint.name.clone());
        let partner = sums.iter().find(|(name, _)| *name == other);
        let image = partner.map_or(joint.matrices, |(_, sum)| *sum);
        let sum = match mirror {
            true => joint.matrices + reflected(image),
            false => joint.matrices,
        };
        mean_rotation(sum)
    };
    let (mut turning, mut fixed) = (Vec::new(), Vec::new());
    for (at, joint) in joints.iter().enumerate() {
        let (list, rotation) = match (at == 0 || joint.turns, centre) {
            (true, true) => (&mut turning, centre_of(joint)),
            (true, false) => (&mut turning, DQuat::IDENTITY),
            (false, _) => (&mut fixed, from_exponential_map(joint.mean_map)),
        };
        list.push(NamedRotation {
            joint: joint.name.clone(),
            rotation: as_saved(rotation),
        });
    }
    MotionColumns::new(&first.name, turning, fixed).map_err(|error| ModelError::data(&error))
}

/// A rotation of numbers that a weights file holds exactly, in f32.
pub(super) fn as_saved(rotation: DQuat) -> DQuat {
    let numbers = rotation.to_array().map(|x| f64::from(x as f32));
    DQuat::from_array(numbers).normalize()
}

fn joint(at: usize, name: &str, clips: &[&Clip]) -> Joint {
    let (mut frames, mut sum, mut squares, mut matrices) =
        (0.0, DVec3::ZERO, DVec3::ZERO, DMat3::ZERO);
    // Counted from the first frame's, so that what never changes has deviation 0.
    let mut origin = None;
    for clip in clips {
        let Some(index) = (if at == 0 {
            Some(0)
        } else {
            clip.skeleton.index_of(name)
        }) else {
            continue;
        };
        for pose in &clip.poses {
            let rotation = match at {
                0 => without_heading(pose.rotations[0]),
                _ => pose.rotations[index],
            };
            let map = exponential_map(rotation);
            let change = map - *origin.get_or_insert(map);
            frames += 1.0;
            sum += change;
            squares += change * change;
            matrices += DMat3::from_quat(rotation);
        }
    }
    let count = f64::max(frames, 1.0);
    let mean = sum / count;
    let variance = squares / count - mean * mean;
    Joint {
        name: name.into(),
        turns: variance.max_element() >= STILL * STILL,
        mean_map: origin.unwrap_or_default() + mean,
        matrices,
    }
}

/// The rotation nearest to a mean of matrices.
fn mean_rotation(sum: DMat3) -> DQuat {
    best_rotation(&[
        (DVec3::X, sum.x_axis),
        (DVec3::Y, sum.y_axis),
        (DVec3::Z, sum.z_axis),
    ])
}

/// A sum of rotations' matrices as seen in a mirror in the plane X = 0.
fn reflected(sum: DMat3) -> DMat3 {
    let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    mirror * sum * mirror
}
