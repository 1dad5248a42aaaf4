//! The rig of a file that keyframes come from, and a result on it.

use glam::DQuat;

use crate::counted::counted;
use crate::data::{DataConfig, DataError, RigReading};
use crate::motion::bvh::{Axis, Bvh, Channel};
use crate::motion::rig::{Rig, RigKeyframe, onto_rig};
use crate::motion::{Clip, Joint, Mapping, Pose};

/// How far a joint without rotation channels may turn, rad.
const UNTURNED: f64 = 1e-6;
/// Channels of a joint that has none of its own.
const ROTATIONS: [Axis; 3] = [Axis::Z, Axis::X, Axis::Y];
const POSITIONS: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

/// A file's own rig.
pub(super) struct OwnRig {
    rig: Rig,
    reading: RigReading,
    /// The file's, `[joints]`.
    channels: Vec<Vec<Channel>>,
}

impl OwnRig {
    /// The rig of a file, with the poses of `clip`.
    ///
    /// # Errors
    /// As [`RigReading::of`].
    pub fn read(
        document: &Bvh,
        clip: Clip,
        mapping: &Mapping,
        data: &DataConfig,
    ) -> Result<Self, DataError> {
        let reading = RigReading::of(clip, mapping, data)?;
        let skeleton = &reading.clip.skeleton;
        let channels = document.channels().to_vec();
        let positions =
            |channels: &Vec<Channel>| channels.iter().filter(|it| is_position(it)).count();
        let moves = channels.iter().map(|channels| positions(channels) == 3);
        let rig = Rig {
            turned_as: mapping.turned_as(skeleton),
            hips: mapping.hips(skeleton),
            moves: moves.collect(),
            skeleton: skeleton.clone(),
        };
        Ok(Self {
            rig,
            reading,
            channels,
        })
    }

    /// The pose of a frame, in cm with Y up.
    pub fn pose(&self, frame: usize) -> Pose {
        self.reading.clip.poses[frame].clone()
    }

    /// Whether another file is of the same rig.
    pub fn is_same(&self, other: &Self) -> bool {
        let [own, other] = [self, other].map(|rig| rig.rig.skeleton.joints.iter());
        let key = |joint: &Joint| (joint.name.clone(), joint.parent);
        own.map(key).eq(other.map(key))
    }

    /// What is to be known of a result on it.
    pub fn notice(&self) -> String {
        let turned = self.rig.turned_as.iter().flatten().count();
        format!(
            "a rig of {}, {turned} of which stand for the dance skeleton's; the result is on it",
            counted(self.rig.skeleton.len(), "joint")
        )
    }

    /// What is to be known of its channels: joints that turn about one or two axes only.
    pub fn stiff_joints(&self) -> Option<String> {
        let rotations =
            |channels: &[Channel]| channels.iter().filter(|it| !is_position(it)).count();
        let joints = self.rig.skeleton.joints.iter().zip(&self.channels);
        let stiff = joints.filter(|(_, channels)| [1, 2].contains(&rotations(channels)));
        let names: Vec<&str> = stiff.map(|(joint, _)| joint.name.as_str()).collect();
        let first = names.first()?;
        let others = match names.len() - 1 {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        Some(format!(
            "what turns about one or two axes in the file turns about three in the result: \
             {first}{others}"
        ))
    }

    /// A dance on it as its file has motions: in its unit and axis.
    pub fn motion(&self, dance: &Clip, keyframes: &[RigKeyframe]) -> Clip {
        let mut clip = onto_rig(dance, &self.rig, keyframes);
        self.reading.conversion.undo(&mut clip);
        clip
    }

    /// The file's channels for such a motion; a joint that has to turn or to move and has none for
    /// it gets them.
    pub fn channels(&self, clip: &Clip) -> Vec<Vec<Channel>> {
        let carrier = self.rig.carrier();
        let joints = self.channels.iter().enumerate();
        let layout = joints.map(|(joint, own)| {
            let (mut positions, mut rotations): (Vec<Channel>, Vec<Channel>) =
                own.iter().partition(|channel| is_position(channel));
            let turns =
                |pose: &Pose| pose.rotations[joint].angle_between(DQuat::IDENTITY) > UNTURNED;
            let is_held = rotations.is_empty() && !clip.poses.iter().any(turns);
            let has_turns = rotations.len() == 3 || is_held;
            let has_place = carrier != Some(joint) || positions.len() == 3;
            if has_turns && has_place {
                return own.clone();
            }
            if !has_place {
                positions = POSITIONS.map(Channel::Position).to_vec();
            }
            if !has_turns {
                rotations = ROTATIONS.map(Channel::Rotation).to_vec();
            }
            [positions, rotations].concat()
        });
        layout.collect()
    }
}

fn is_position(channel: &Channel) -> bool {
    matches!(channel, Channel::Position(_))
}
