//! A dance as columns of numbers: how the root moves over the ground, its height, and every joint's
//! rotation as an exponential map (Valle-Pérez et al. 2021, section 3; spec, section 2).
//!
//! ```text
//! dx, dz     root's step on the ground, seen in the heading of its own frame, cm/frame
//! y          root's height, cm
//! e_0        root's rotation without its heading, rad
//! dh         change of the heading, rad/frame
//! e_j ..     local rotations of the other joints, rad
//! ```

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};
use ndarray::{Array2, ArrayView1, ArrayView2, Axis, s};
use thiserror::Error;

use super::clip::{Clip, Pose};
use super::exponential_map::{exponential_map, from_exponential_map};
use super::mirror::other_side;
use super::skeleton::Skeleton;

/// Columns before those of the joints below the root.
const OF_ROOT: usize = 7;
const DX: usize = 0;
const DZ: usize = 1;
const Y: usize = 2;
const ROOT_ROTATION: usize = 3;
const DH: usize = 6;

/// A joint and a rotation of it.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedRotation {
    pub joint: String,
    pub rotation: DQuat,
}

/// Which numbers stand in the columns of a frame: D = 7 + 3 for each joint below the root whose
/// rotation is in.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionColumns {
    /// The joints whose rotations are in, the root first, with the rotation M that each is measured
    /// from: the columns hold the map of `M^-1 R`.
    turning: Vec<NamedRotation>,
    /// Joints that are left out, with the rotation that they always have.
    fixed: Vec<NamedRotation>,
}

/// Where a root stands on the ground and which way it is turned.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GroundPlace {
    /// cm.
    pub x: f64,
    /// cm.
    pub z: f64,
    /// Angle about Y of the horizontal direction at right angles to the root's own X axis, rad: 0
    /// looks along +Z, pi/2 along +X.
    pub heading: f64,
}

/// Why motion cannot be brought into columns, or back.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ColumnsError {
    #[error("{what} has no joint {joint}, whose rotation is one of the motion's columns")]
    MissingJoint { what: String, joint: String },
    #[error("{what} has {found} columns, the motion has {expected}")]
    Width {
        what: String,
        expected: usize,
        found: usize,
    },
    #[error("{what} has a skeleton without joints")]
    NoJoint { what: String },
}

impl GroundPlace {
    /// That of a pose, whose first joint is the root. Panics on a pose without joints.
    pub fn of(pose: &Pose) -> Self {
        let (place, rotation) = (pose.translations[0], pose.rotations[0]);
        Self {
            x: place.x,
            z: place.z,
            heading: heading(rotation),
        }
    }

    /// The place after a row of columns.
    fn moved(self, row: ArrayView1<f64>) -> Self {
        let heading = self.heading + row[DH];
        let step = DQuat::from_rotation_y(heading) * DVec3::new(row[DX], 0.0, row[DZ]);
        Self {
            x: self.x + step.x,
            z: self.z + step.z,
            heading,
        }
    }
}

impl MotionColumns {
    /// With the rotations of `turning`, the root first, each measured from the one given; `fixed`
    /// joints are put back as they are given. Rotations of other joints are kept of the bones that
    /// a motion is rebuilt on.
    ///
    /// # Errors
    /// `turning` is empty; `what` is what the error calls it.
    pub fn new(
        what: &str,
        turning: Vec<NamedRotation>,
        fixed: Vec<NamedRotation>,
    ) -> Result<Self, ColumnsError> {
        match turning.is_empty() {
            true => Err(ColumnsError::NoJoint { what: what.into() }),
            false => Ok(Self { turning, fixed }),
        }
    }

    /// Those of all joints of a skeleton.
    ///
    /// # Errors
    /// It has none; `what` is what the error calls it.
    pub fn of_all(what: &str, skeleton: &Skeleton) -> Result<Self, ColumnsError> {
        let joints = skeleton.joints.iter().map(|joint| NamedRotation {
            joint: joint.name.clone(),
            rotation: DQuat::IDENTITY,
        });
        Self::new(what, joints.collect(), Vec::new())
    }

    /// D.
    pub fn width(&self) -> usize {
        OF_ROOT + 3 * (self.turning.len() - 1)
    }

    /// The joints whose rotations are in, the root first, with what they are measured from.
    pub fn turning(&self) -> &[NamedRotation] {
        &self.turning
    }

    /// The joints that are left out, with the rotation that they always have.
    pub fn fixed(&self) -> &[NamedRotation] {
        &self.fixed
    }

    /// Name and unit of every column, `[D]`.
    pub fn names(&self) -> Vec<(String, &'static str)> {
        let rotation = |joint: &NamedRotation| {
            ["x", "y", "z"].map(|axis| (format!("{}_{axis}", joint.joint), "rad"))
        };
        let mut names: Vec<(String, &'static str)> = vec![
            ("root_dx".into(), "cm/frame"),
            ("root_dz".into(), "cm/frame"),
            ("root_y".into(), "cm"),
        ];
        names.extend(rotation(&self.turning[0]));
        names.push(("root_dheading".into(), "rad/frame"));
        names.extend(self.turning[1..].iter().flat_map(rotation));
        names
    }

    /// The columns of every frame of a clip, `[frames, D]`. The first frame's differences repeat
    /// the second's; of one frame alone they are 0.
    ///
    /// # Errors
    /// The clip lacks a joint that turns.
    pub fn measure(&self, clip: &Clip) -> Result<Array2<f64>, ColumnsError> {
        self.measure_poses(&clip.name, &clip.skeleton, &clip.poses)
    }

    /// The same of poses on a skeleton; `what` is what errors call them.
    ///
    /// # Errors
    /// As [`MotionColumns::measure`].
    pub fn measure_poses(
        &self,
        what: &str,
        skeleton: &Skeleton,
        poses: &[Pose],
    ) -> Result<Array2<f64>, ColumnsError> {
        let joints = self.indices(what, skeleton)?;
        let mut columns = Array2::zeros((poses.len(), self.width()));
        for (time, pose) in poses.iter().enumerate() {
            let place = GroundPlace::of(pose);
            let mut row = columns.row_mut(time);
            row[Y] = pose.translations[0].y;
            for (number, (&joint, from)) in joints.iter().zip(&self.turning).enumerate() {
                let local = match number {
                    0 => without_heading(pose.rotations[0]),
                    _ => pose.rotations[joint],
                };
                let map = exponential_map(from.rotation.inverse() * local).to_array();
                let at = rotation_column(number);
                (at..).zip(map).for_each(|(at, value)| row[at] = value);
            }
            let Some(before) = time.checked_sub(1) else {
                continue;
            };
            let before = GroundPlace::of(&poses[before]);
            let step = DVec3::new(place.x - before.x, 0.0, place.z - before.z);
            let step = DQuat::from_rotation_y(-place.heading) * step;
            (row[DX], row[DZ]) = (step.x, step.z);
            row[DH] = wrapped(place.heading - before.heading);
        }
        if poses.len() > 1 {
            for column in [DX, DZ, DH] {
                columns[[0, column]] = columns[[1, column]];
            }
        }
        Ok(columns)
    }

    /// The poses of columns `[frames, D]` on the bones of a pose: the first frame stands at
    /// `start`, whatever its differences are.
    ///
    /// # Errors
    /// The skeleton lacks a joint that turns, or there are other columns than D.
    pub fn poses(
        &self,
        columns: ArrayView2<f64>,
        skeleton: &Skeleton,
        bones: &Pose,
        start: GroundPlace,
    ) -> Result<Vec<Pose>, ColumnsError> {
        self.check_width("the motion to rebuild", columns)?;
        let mut columns = columns.to_owned();
        for column in [DX, DZ, DH] {
            let first = columns.column_mut(column).into_iter().next();
            first.into_iter().for_each(|first| *first = 0.0);
        }
        self.poses_after(columns.view(), skeleton, bones, start)
    }

    /// The poses of columns `[frames, D]` on the bones of a pose: the first frame goes on from
    /// `before`.
    ///
    /// # Errors
    /// As [`MotionColumns::poses`].
    pub fn poses_after(
        &self,
        columns: ArrayView2<f64>,
        skeleton: &Skeleton,
        bones: &Pose,
        before: GroundPlace,
    ) -> Result<Vec<Pose>, ColumnsError> {
        let joints = self.indices("the skeleton", skeleton)?;
        self.check_width("the motion to rebuild", columns)?;
        let mut bones = bones.clone();
        for NamedRotation { joint, rotation } in &self.fixed {
            if let Some(at) = skeleton.index_of(joint) {
                bones.rotations[at] = *rotation;
            }
        }
        let mut place = before;
        let rows = columns.rows().into_iter();
        let poses = rows.map(|row| {
            place = place.moved(row);
            let mut pose = bones.clone();
            pose.translations[0] = DVec3::new(place.x, row[Y], place.z);
            for (number, (&joint, from)) in joints.iter().zip(&self.turning).enumerate() {
                let at = rotation_column(number);
                let map = DVec3::new(row[at], row[at + 1], row[at + 2]);
                let local = from.rotation * from_exponential_map(map);
                pose.rotations[joint] = match number {
                    0 => DQuat::from_rotation_y(place.heading) * local,
                    _ => local,
                }
                .normalize();
            }
            pose
        });
        Ok(poses.collect())
    }

    /// Columns `[frames, D]` as seen in a mirror: left and right change places.
    ///
    /// It is the mirror image of the motion where the rotations that joints are measured from are
    /// symmetric themselves.
    ///
    /// # Errors
    /// There are other columns than D.
    pub fn mirrored(&self, columns: ArrayView2<f64>) -> Result<Array2<f64>, ColumnsError> {
        self.check_width("the motion to mirror", columns)?;
        let mut mirrored = columns.to_owned();
        for number in 0..self.turning.len() {
            let (to, from) = (
                rotation_column(number),
                rotation_column(self.partner(number)),
            );
            let partner = columns.slice(s![.., from..from + 3]);
            mirrored.slice_mut(s![.., to..to + 3]).assign(&partner);
            mirrored
                .slice_mut(s![.., to + 1..to + 3])
                .mapv_inplace(|x| -x);
        }
        for column in [DX, DH] {
            mirrored.column_mut(column).mapv_inplace(|x| -x);
        }
        Ok(mirrored)
    }

    /// How often a number of a rotation changes by more than pi from one frame to the next: where a
    /// rotation's angle passes pi, its map turns round.
    pub fn flips(&self, columns: ArrayView2<f64>) -> usize {
        let rows = columns.axis_windows(Axis(0), 2).into_iter();
        let flips = rows.map(|pair| {
            let changes = pair.row(0).to_owned() - pair.row(1);
            let numbers = changes.iter().enumerate();
            numbers
                .filter(|(column, change)| {
                    *column >= ROOT_ROTATION && *column != DH && change.abs() > PI
                })
                .count()
        });
        flips.sum()
    }

    /// The turning joint on the body's other side; one in the middle is its own partner.
    fn partner(&self, number: usize) -> usize {
        let other = other_side(&self.turning[number].joint);
        let partner =
            other.and_then(|name| self.turning.iter().position(|joint| joint.joint == name));
        partner.unwrap_or(number)
    }

    /// Where the turning joints stand in a skeleton.
    fn indices(&self, what: &str, skeleton: &Skeleton) -> Result<Vec<usize>, ColumnsError> {
        let index = |(number, joint): (usize, &NamedRotation)| match number {
            0 if !skeleton.is_empty() => Ok(0),
            _ => skeleton
                .index_of(&joint.joint)
                .ok_or_else(|| ColumnsError::MissingJoint {
                    what: what.into(),
                    joint: joint.joint.clone(),
                }),
        };
        self.turning.iter().enumerate().map(index).collect()
    }

    fn check_width(&self, what: &str, columns: ArrayView2<f64>) -> Result<(), ColumnsError> {
        match columns.ncols() == self.width() {
            true => Ok(()),
            false => Err(ColumnsError::Width {
                what: what.into(),
                expected: self.width(),
                found: columns.ncols(),
            }),
        }
    }
}

/// The first column of the rotation of a joint, the root being the 0th.
fn rotation_column(number: usize) -> usize {
    match number {
        0 => ROOT_ROTATION,
        _ => OF_ROOT + 3 * (number - 1),
    }
}

/// The heading of a root with this rotation, rad.
fn heading(rotation: DQuat) -> f64 {
    let across = rotation * DVec3::X;
    let forward = across.cross(DVec3::Y);
    forward.x.atan2(forward.z)
}

/// A root's rotation without its heading.
#[must_use]
pub fn without_heading(rotation: DQuat) -> DQuat {
    DQuat::from_rotation_y(-heading(rotation)) * rotation
}

/// An angle in [-pi, pi).
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}
