//! A figure on the dance skeleton that stands with stretched arms and looks along +Z.

use glam::{DQuat, DVec3};
use keydance::motion::{Clip, DANCE_JOINTS, DANCE_PARENTS, Joint, Pose, Skeleton};

/// Offsets of the 24 joints, cm.
const OFFSETS: [[f64; 3]; 24] = [
    [0.0, 90.0, 0.0],
    [9.0, 0.0, 0.0],
    [0.0, -43.0, 0.0],
    [0.0, -41.0, 0.0],
    [0.0, -4.0, 13.0],
    [-9.0, 0.0, 0.0],
    [0.0, -43.0, 0.0],
    [0.0, -41.0, 0.0],
    [0.0, -4.0, 13.0],
    [0.0, 7.0, 0.0],
    [0.0, 7.0, 0.0],
    [0.0, 12.0, 0.0],
    [0.0, 14.0, 0.0],
    [0.0, 11.0, 0.0],
    [-3.0, 3.0, 0.0],
    [-13.0, 0.0, 0.0],
    [-28.0, 0.0, 0.0],
    [-26.0, 0.0, 0.0],
    [3.0, 3.0, 0.0],
    [13.0, 0.0, 0.0],
    [28.0, 0.0, 0.0],
    [26.0, 0.0, 0.0],
    [0.0, 5.0, 0.0],
    [0.0, 7.0, 1.0],
];

/// A clip at 30 fps in which the figure's root is where `root` says for each frame, turned about Y
/// by the angle.
pub fn turning_clip(name: &str, frames: usize, root: impl Fn(usize) -> (DVec3, f64)) -> Clip {
    let joints: Vec<Joint> = (0..24)
        .map(|index| Joint {
            name: DANCE_JOINTS[index].into(),
            parent: DANCE_PARENTS[index],
            offset: DVec3::from_array(OFFSETS[index]),
            end_sites: if DANCE_PARENTS.contains(&Some(index)) {
                Vec::new()
            } else {
                vec![DVec3::ZERO]
            },
        })
        .collect();
    let pose = |frame| {
        let (position, angle) = root(frame);
        let mut translations: Vec<DVec3> = joints.iter().map(|joint| joint.offset).collect();
        translations[0] = position;
        let mut rotations = vec![DQuat::IDENTITY; 24];
        rotations[0] = DQuat::from_rotation_y(angle);
        Pose {
            translations,
            rotations,
        }
    };
    let poses = (0..frames).map(pose).collect();
    Clip {
        name: name.into(),
        skeleton: Skeleton {
            joints: joints.clone(),
        },
        frame_time: 0.0333333,
        poses,
    }
}
