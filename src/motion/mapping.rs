//! Mapping files: which joints of another skeleton stand for the 24 of the dance skeleton.
//!
//! ```toml
//! scale = 2.54                                            # cm per unit; or unit = "in"
//! up = "z"                                                # or "y"; recognised where left out
//! [joints]
//! Hips = "hip"                                            # a joint
//! LeftToeBase = "lFoot/End Site"                          # an End Site, or "lFoot/End Site 2"
//! Spine1 = { between = ["abdomen", "chest"], at = 0.5 }   # a point on the way from one to another
//! ```

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::clip::{Clip, Pose};
use super::rig::Recognised;
use super::skeleton::{DANCE_JOINTS, DANCE_PARENTS, Joint, Skeleton};
use super::units::{Unit, Up, turn_z_up};

/// Why a mapping cannot be used.
#[derive(Debug, Error)]
pub enum MappingError {
    #[error("{path} cannot be read")]
    Read {
        path: PathBuf,
        #[source]
        source: std::io::Error,
    },
    #[error("{file} is not a mapping file")]
    Syntax {
        file: String,
        #[source]
        source: Box<toml::de::Error>,
    },
    #[error("{file}: [joints] names {joint}, which is not a joint of the dance skeleton ({})", DANCE_JOINTS.join(", "))]
    UnknownJoint { file: String, joint: String },
    #[error("{file}: [joints] lacks {joints}; all 24 joints of the dance skeleton need an entry")]
    Incomplete { file: String, joints: String },
    #[error(
        "{clip}: joint {} is {}, the dance skeleton has {} there, and as a rig it was not \
         recognised: no {}; keydance rig {clip} --out mapping.toml begins a mapping file to edit",
        difference.0, difference.2, difference.1,
        missing.join(", ")
    )]
    Unrecognised {
        clip: String,
        /// The first joint that is another, what the dance skeleton has there, what the rig has.
        difference: (usize, String, String),
        missing: Vec<&'static str>,
    },
    #[error("{file}: {left} and {right} are mapped to one place; each side has its own")]
    BothSides {
        file: String,
        left: &'static str,
        right: &'static str,
    },
    #[error("{file}: {key} = {value}: expected {expected}")]
    Value {
        file: String,
        key: String,
        value: f64,
        expected: &'static str,
    },
    #[error("{file} gives both scale and unit; keep one")]
    ScaleAndUnit { file: String },
    #[error(
        "{file}: no joint of the dance skeleton stands for {joint}, so there is no way back to the \
         skeleton that has it"
    )]
    NoCounterpart { file: String, joint: String },
    #[error(
        "{file}: {joint} is mapped to {source_name:?}, which {clip} does not have ({available})"
    )]
    NotInClip {
        file: String,
        joint: String,
        source_name: String,
        clip: String,
        available: String,
    },
}

/// What errors call a mapping that a config holds.
const IN_CONFIG: &str = "the mapping of the config";

/// Where each of the 24 joints lies on another skeleton. A config holds what a mapping file says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "MappingFile", into = "MappingFile")]
pub struct Mapping {
    /// Name of the file, for errors.
    file: String,
    /// cm per unit of the other skeleton; 1 where the file does not say.
    scale: f64,
    /// Whether the file says it.
    has_unit: bool,
    up: Up,
    /// In the order of the dance skeleton, `[24]`.
    sources: Vec<Source>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MappingFile {
    #[serde(skip_serializing_if = "Option::is_none")]
    scale: Option<f64>,
    #[serde(default, skip_serializing)]
    unit: Unit,
    #[serde(default, skip_serializing_if = "is_undeclared")]
    up: Up,
    joints: BTreeMap<String, Source>,
}

fn is_undeclared(up: &Up) -> bool {
    *up == Up::Auto
}

/// What stands for a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a joint's name in quotes, or { between = [name, name], at = share }"
)]
enum Source {
    At(String),
    Between(Between),
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Between {
    between: [String; 2],
    at: f64,
}

impl Source {
    /// How near a joint is to it: 2 at it, up to 1 where it lies between this and another, else 0.
    fn share_of(&self, joint: &Joint) -> f64 {
        match self {
            Self::At(name) if *name == joint.name => 2.0,
            Self::Between(Between { between, at }) if between[0] == joint.name => 1.0 - at,
            Self::Between(Between { between, at }) if between[1] == joint.name => *at,
            _ => 0.0,
        }
    }
}

/// A place on a skeleton that moves with one of its joints.
#[derive(Clone, Copy)]
struct Anchor {
    joint: usize,
    /// In the joint's frame.
    offset: DVec3,
}

/// A source whose names have been found.
enum Place {
    At(Anchor),
    Between(Anchor, Anchor, f64),
}

impl Mapping {
    /// Reads a mapping file.
    ///
    /// # Errors
    /// The file cannot be read; it has unknown keys, joints that the dance skeleton lacks, or lacks
    /// one of its joints.
    pub fn read(path: &Path) -> Result<Self, MappingError> {
        let text = std::fs::read_to_string(path).map_err(|source| MappingError::Read {
            path: path.into(),
            source,
        })?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Reads the text of a mapping file; `file` names it in errors.
    ///
    /// # Errors
    /// As [`Mapping::read`].
    pub fn parse(text: &str, file: &str) -> Result<Self, MappingError> {
        let parsed = toml::from_str(text).map_err(|source| MappingError::Syntax {
            file: file.into(),
            source: Box::new(source),
        })?;
        Self::of(parsed, file)
    }

    fn of(parsed: MappingFile, file: &str) -> Result<Self, MappingError> {
        let MappingFile {
            scale,
            unit,
            up,
            mut joints,
        } = parsed;
        if scale.is_some() && unit != Unit::Auto {
            return Err(MappingError::ScaleAndUnit { file: file.into() });
        }
        let has_unit = scale.is_some() || unit != Unit::Auto;
        let scale = scale.unwrap_or(unit.cm());
        let fault = |key: String, value: f64, expected| MappingError::Value {
            file: file.into(),
            key,
            value,
            expected,
        };
        if !(scale.is_finite() && scale > 0.0) {
            return Err(fault("scale".into(), scale, "a positive number of cm"));
        }
        for (joint, source) in &joints {
            if let Source::Between(Between { at, .. }) = source
                && !(0.0..=1.0).contains(at)
            {
                return Err(fault(format!("{joint}.at"), *at, "a share between 0 and 1"));
            }
        }
        let found: Vec<Option<Source>> = DANCE_JOINTS
            .iter()
            .map(|name| joints.remove(*name))
            .collect();
        if let Some((joint, _)) = joints.pop_first() {
            return Err(MappingError::UnknownJoint {
                file: file.into(),
                joint,
            });
        }
        let joints = DANCE_JOINTS.into_iter().zip(&found);
        let lacking = joints.filter_map(|(name, source)| source.is_none().then_some(name));
        let lacking: Vec<&str> = lacking.collect();
        if !lacking.is_empty() {
            return Err(MappingError::Incomplete {
                file: file.into(),
                joints: lacking.join(", "),
            });
        }
        let places = || DANCE_JOINTS.into_iter().zip(&found);
        for (left, place) in places() {
            let name = left.strip_prefix("Left");
            let is_other_side = |joint: &str| joint.strip_prefix("Right") == name;
            let same = places().find(|(it, other)| is_other_side(it) && *other == place);
            if let Some((right, _)) = same.filter(|_| name.is_some()) {
                let file = file.into();
                return Err(MappingError::BothSides { file, left, right });
            }
        }
        Ok(Self {
            file: file.into(),
            scale,
            has_unit,
            up,
            sources: found.into_iter().flatten().collect(),
        })
    }

    /// What brings a clip onto the dance skeleton: the mapping that is given, unless the clip is on
    /// that skeleton and has not the joints that the mapping names; else nothing where it is on it;
    /// else what is recognised.
    ///
    /// # Errors
    /// As [`Mapping::recognised`].
    pub fn onto_dance_skeleton<'m>(
        clip: &Clip,
        given: Option<&'m Self>,
    ) -> Result<Option<Cow<'m, Self>>, MappingError> {
        Ok(match given {
            Some(mapping) if !clip.skeleton.is_dance_skeleton() || mapping.is_of(clip) => {
                Some(Cow::Borrowed(mapping))
            }
            _ if clip.skeleton.is_dance_skeleton() => None,
            _ => Some(Cow::Owned(Self::recognised(clip)?)),
        })
    }

    /// The mapping of a rig whose joints are recognised by their names and places; unit and axis
    /// are not declared.
    ///
    /// # Errors
    /// A joint of the dance skeleton was not found on it.
    pub fn recognised(clip: &Clip) -> Result<Self, MappingError> {
        let found = Recognised::of(&clip.skeleton);
        let missing = found.missing();
        if let Some(difference) = clip.skeleton.difference_from_dance()
            && !missing.is_empty()
        {
            return Err(MappingError::Unrecognised {
                clip: clip.name.clone(),
                difference,
                missing,
            });
        }
        let sources = found.sources.into_iter().flatten();
        Ok(Self {
            file: format!("what was recognised of {}", clip.name),
            scale: 1.0,
            has_unit: false,
            up: Up::Auto,
            sources: sources.map(Source::At).collect(),
        })
    }

    /// Whether a clip has all joints that it names.
    fn is_of(&self, clip: &Clip) -> bool {
        let mut sources = self.sources.iter().zip(DANCE_JOINTS);
        sources.all(|(source, joint)| self.place(source, joint, clip).is_ok())
    }

    /// Whether the file declares the clips' unit, by `scale` or `unit`.
    pub fn has_unit(&self) -> bool {
        self.has_unit
    }

    /// Whether the file declares the clips' upward axis.
    pub fn has_up(&self) -> bool {
        self.up != Up::Auto
    }

    /// Name of the file.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Whether the file declares nothing about clips but their joints.
    pub fn keeps_units(&self) -> bool {
        !self.has_unit && !self.has_up()
    }

    /// cm per unit of the other skeleton, where the file declares it.
    pub fn scale(&self) -> Option<f64> {
        self.has_unit.then_some(self.scale)
    }

    /// The upward axis that the file declares.
    pub fn up(&self) -> Up {
        self.up
    }

    /// The same joints without what the file declares of unit and axis.
    pub fn without_units(&self) -> Self {
        Self {
            scale: 1.0,
            has_unit: false,
            up: Up::Auto,
            ..self.clone()
        }
    }

    /// For each joint of a rig the joint of the dance skeleton whose rotation it has, `[joints]`:
    /// of several at its place the last, which carries what hangs on them; for a joint that points
    /// lie between, the nearest of these; none for a joint that the mapping does not name.
    pub fn turned_as(&self, rig: &Skeleton) -> Vec<Option<usize>> {
        let sources = self.sources.iter();
        let turned_as = |joint| nearest(sources.clone().map(|source| source.share_of(joint)));
        rig.joints.iter().map(turned_as).collect()
    }

    /// The joint of a rig that stands for the hips, or is next to them.
    pub fn hips(&self, rig: &Skeleton) -> Option<usize> {
        let hips = self.sources.first()?;
        nearest(rig.joints.iter().map(|joint| hips.share_of(joint)))
    }

    /// For each joint of another skeleton the joint of the dance skeleton that stands at its place,
    /// `[joints]`: the first where there are several.
    ///
    /// # Errors
    /// A joint of it that no joint of the dance skeleton stands for.
    pub fn counterparts(&self, skeleton: &Skeleton) -> Result<Vec<usize>, MappingError> {
        let counterpart = |joint: &Joint| {
            let stands_for =
                |source: &Source| matches!(source, Source::At(name) if *name == joint.name);
            let found = self.sources.iter().position(stands_for);
            found.ok_or_else(|| MappingError::NoCounterpart {
                file: self.file.clone(),
                joint: joint.name.clone(),
            })
        };
        skeleton.joints.iter().map(counterpart).collect()
    }

    /// The clip on the dance skeleton, in cm and with Y up where the file declares unit and axis.
    ///
    /// Every joint has the world position and world rotation of what stands for it, in every frame;
    /// so a point between two joints moves in its parent's frame, and the skeleton's offsets are
    /// those of the rest pose only.
    ///
    /// # Errors
    /// The clip lacks a joint or End Site that the mapping names.
    pub fn apply(&self, clip: &Clip) -> Result<Clip, MappingError> {
        let places: Vec<Place> = self
            .sources
            .iter()
            .zip(DANCE_JOINTS)
            .map(|(source, joint)| self.place(source, joint, clip))
            .collect::<Result<_, _>>()?;
        let joints = clip.skeleton.joints.iter();
        let rest = Pose {
            translations: joints.map(|joint| joint.offset).collect(),
            rotations: vec![DQuat::IDENTITY; clip.skeleton.len()],
        };
        let offsets = self.pose(&places, &rest, &clip.skeleton).translations;
        let joints = (0..DANCE_JOINTS.len())
            .map(|index| Joint {
                name: DANCE_JOINTS[index].into(),
                parent: DANCE_PARENTS[index],
                offset: offsets[index],
                end_sites: self.end_sites(index, &places[index], &clip.skeleton),
            })
            .collect();
        let mut mapped = Clip {
            name: clip.name.clone(),
            skeleton: Skeleton { joints },
            frame_time: clip.frame_time,
            poses: clip
                .poses
                .iter()
                .map(|pose| self.pose(&places, pose, &clip.skeleton))
                .collect(),
        };
        if self.up == Up::Z {
            turn_z_up(&mut mapped);
        }
        Ok(mapped)
    }

    fn place(&self, source: &Source, joint: &str, clip: &Clip) -> Result<Place, MappingError> {
        let joints = clip.skeleton.joints.iter();
        let names: Vec<&str> = joints.map(|joint| joint.name.as_str()).collect();
        let anchor = |name: &String| {
            anchor(&clip.skeleton, name).ok_or_else(|| MappingError::NotInClip {
                file: self.file.clone(),
                joint: joint.into(),
                source_name: name.clone(),
                clip: clip.name.clone(),
                available: names.join(", "),
            })
        };
        Ok(match source {
            Source::At(name) => Place::At(anchor(name)?),
            Source::Between(Between {
                between: [from, to],
                at,
            }) => Place::Between(anchor(from)?, anchor(to)?, *at),
        })
    }

    /// One frame's local transforms on the dance skeleton.
    fn pose(&self, places: &[Place], pose: &Pose, skeleton: &Skeleton) -> Pose {
        let (positions, rotations) = pose.world(skeleton);
        let at = |anchor: &Anchor| {
            let rotation = rotations[anchor.joint];
            (
                (positions[anchor.joint] + rotation * anchor.offset) * self.scale,
                rotation,
            )
        };
        let world: Vec<(DVec3, DQuat)> = places
            .iter()
            .map(|place| match place {
                Place::At(anchor) => at(anchor),
                Place::Between(from, to, share) => {
                    let ((from, turned_from), (to, turned_to)) = (at(from), at(to));
                    (
                        from.lerp(to, *share),
                        turned_from.slerp(turned_to, *share).normalize(),
                    )
                }
            })
            .collect();
        let local = world
            .iter()
            .zip(DANCE_PARENTS)
            .map(|(&(position, rotation), parent)| match parent {
                None => (position, rotation),
                Some(parent) => {
                    let (origin, turned) = world[parent];
                    let back = turned.inverse();
                    (back * (position - origin), (back * rotation).normalize())
                }
            });
        let (translations, rotations) = local.unzip();
        Pose {
            translations,
            rotations,
        }
    }

    /// End Sites of a joint that ends a limb: those of the joint that stands for it, or one at the
    /// joint itself.
    fn end_sites(&self, joint: usize, place: &Place, skeleton: &Skeleton) -> Vec<DVec3> {
        if DANCE_PARENTS.contains(&Some(joint)) {
            return Vec::new();
        }
        let ends = match place {
            Place::At(anchor) if anchor.offset == DVec3::ZERO => {
                skeleton.joints[anchor.joint].end_sites.as_slice()
            }
            _ => &[],
        };
        if ends.is_empty() {
            vec![DVec3::ZERO]
        } else {
            ends.iter().map(|end| *end * self.scale).collect()
        }
    }
}

impl TryFrom<MappingFile> for Mapping {
    type Error = MappingError;

    fn try_from(content: MappingFile) -> Result<Self, MappingError> {
        Self::of(content, IN_CONFIG)
    }
}

impl From<Mapping> for MappingFile {
    fn from(mapping: Mapping) -> Self {
        Self {
            scale: mapping.has_unit.then_some(mapping.scale),
            unit: Unit::Auto,
            up: mapping.up,
            joints: DANCE_JOINTS
                .into_iter()
                .map(String::from)
                .zip(mapping.sources)
                .collect(),
        }
    }
}

/// The place of the largest share, the last of several; none where there is no share.
fn nearest(shares: impl Iterator<Item = f64>) -> Option<usize> {
    let largest = shares.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    let (at, share) = largest?;
    (share > 0.0).then_some(at)
}

/// Finds `joint`, `joint/End Site` or `joint/End Site 2`.
fn anchor(skeleton: &Skeleton, name: &str) -> Option<Anchor> {
    if let Some(joint) = skeleton.index_of(name) {
        return Some(Anchor {
            joint,
            offset: DVec3::ZERO,
        });
    }
    let (joint, end) = name.rsplit_once("/End Site")?;
    let number = match end {
        "" => 1,
        end => end.strip_prefix(' ')?.parse::<usize>().ok()?,
    };
    let joint = skeleton.index_of(joint)?;
    let offset = *skeleton.joints[joint]
        .end_sites
        .get(number.checked_sub(1)?)?;
    Some(Anchor { joint, offset })
}
