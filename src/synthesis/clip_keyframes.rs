//! Keyframes from files on any skeleton, for models that make rotations.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::SynthesisError;
use super::completion::CompletionRequest;
use super::keyframes::{
    FileKeyframe, KeyframeChoice, KeyframeError, TimedKeyframes, kept_channels, lengthened,
};
use super::retarget::{check_rest, other_rests};
use crate::data::{DataConfig, FileReading};
use crate::motion::bvh::{self, Axis, Bvh, BvhError, Channel, channel_layout};
use crate::motion::{Clip, ContactRule, Conversion, Feet, Foot, Mapping, Pose};

/// A file that was read.
pub(super) struct Source {
    pub clip: Clip,
    /// The file's channels, where it was not mapped and every joint turns.
    pub channels: Option<Vec<Vec<Channel>>>,
    /// How it was brought to cm with Y up, where it was not mapped.
    conversion: Option<Conversion>,
}

/// The keyframes of a result with the files that they come from.
pub struct ClipKeyframes {
    sources: BTreeMap<PathBuf, Source>,
    timed: TimedKeyframes,
    notices: Vec<String>,
}

impl ClipKeyframes {
    /// Reads the files of a choice, in the unit, axis and rate of `data`; frames count from the
    /// first of a file, also where `data` leaves first frames out.
    ///
    /// # Errors
    /// No keyframes, keyframes out of order, a file that cannot be read.
    pub fn read(choice: &KeyframeChoice, data: &DataConfig) -> Result<Self, KeyframeError> {
        let timed = TimedKeyframes::of(choice)?;
        let mapping = match &choice.mapping {
            Some(path) => Some(Mapping::read(path)?),
            None => data.mapping.clone(),
        };
        let data = DataConfig {
            skip_frames: 0,
            ..data.clone()
        };
        let (mut sources, mut notices) = (BTreeMap::new(), Vec::new());
        for FileKeyframe { file, .. } in &timed.keyframes {
            if !sources.contains_key(file) {
                let (source, own) = read(file, mapping.as_ref(), &data)?;
                notices.extend(own);
                sources.insert(file.clone(), source);
            }
        }
        let clips = timed.keyframes.iter().map(|it| &sources[&it.file].clip);
        notices.extend(other_rests(clips));
        Ok(Self {
            sources,
            timed,
            notices,
        })
    }

    /// What is odd about the files, or was recognised and converted; no error.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// The request, on the bones of the first keyframe's dancer: every keyframe keeps its
    /// rotations and the place of its root. The feet of the dancer's clip are labelled by `rule`,
    /// where there is one; `threshold` as in [`ContactRule::labels`], `draw` as there.
    /// `lengths` as in [`Keyframes::request`](super::keyframes::Keyframes::request).
    ///
    /// # Errors
    /// Frames that a file does not have, skeletons with other joints, lengths that do not fit.
    pub fn request(
        &self,
        lengths: &[u32],
        rule: ContactRule,
        threshold: f64,
        draw: impl FnMut() -> Foot,
    ) -> Result<CompletionRequest, KeyframeError> {
        let mut keyframes: Vec<(usize, Pose)> = Vec::new();
        let first = &self.sources[&self.timed.keyframes[0].file].clip;
        for FileKeyframe { file, frame, time } in &self.timed.keyframes {
            let clip = &self.sources[file].clip;
            let pose = clip
                .poses
                .get(*frame)
                .ok_or_else(|| no_frame(clip, *frame))?;
            let mut pose = pose.clone();
            if clip.skeleton.len() != first.skeleton.len() {
                return Err(KeyframeError::OtherJoints {
                    files: [first.name.clone(), clip.name.clone()],
                    joints: [first.skeleton.len(), clip.skeleton.len()],
                });
            }
            check_rest(&clip.skeleton, &first.skeleton, &clip.name)?;
            if let Some((_, dancer)) = keyframes.first() {
                pose.translations[1..].clone_from_slice(&dancer.translations[1..]);
            }
            keyframes.push((*time, pose));
        }
        let mut times: Vec<usize> = keyframes.iter().map(|(time, _)| *time).collect();
        let mut contacts = None;
        if let Some((path, start)) = &self.timed.motion {
            let clip = &self.sources[path].clip;
            let end = times[times.len() - 1];
            if start + end >= clip.poses.len() {
                return Err(KeyframeError::MotionEnds {
                    file: path.clone(),
                    end,
                    last: clip.poses.len() - 1 - start,
                });
            }
            if let Ok(feet) = Feet::of(&clip.skeleton) {
                let world = clip.skeleton.world_positions(&clip.poses);
                let labels = rule.labels(&world, &feet, threshold, draw);
                contacts = Some(labels[*start..=start + end].to_vec());
            }
        }
        if let Some(stretched) = lengthened(lengths, times.len())? {
            contacts = contacts.map(|labels| stretch(&labels, &times, &stretched));
            times = stretched;
        }
        let keyframes = times.into_iter().zip(keyframes);
        Ok(CompletionRequest {
            skeleton: first.skeleton.clone(),
            frame_time: first.frame_time,
            keyframes: keyframes.map(|(time, (_, pose))| (time, pose)).collect(),
            contacts,
        })
    }

    /// A result as a file's content: with the channels of the first keyframe's file, or with Z X Y
    /// rotations where these cannot hold it, and in its unit and axis unless it was mapped.
    ///
    /// # Errors
    /// The clip is not one that a file could hold.
    pub fn document(&self, result: &Clip) -> Result<Bvh, BvhError> {
        let first = &self.sources[&self.timed.keyframes[0].file];
        let mut result = result.clone();
        first.conversion.iter().for_each(|it| it.undo(&mut result));
        let channels = first.channels.clone();
        let channels =
            channels.unwrap_or_else(|| channel_layout(&result, [Axis::Z, Axis::X, Axis::Y]));
        Bvh::from_clip(&result, channels)
    }
}

pub(super) fn read(
    path: &Path,
    mapping: Option<&Mapping>,
    data: &DataConfig,
) -> Result<(Source, Vec<String>), KeyframeError> {
    let document = bvh::read(path)?;
    let channels = kept_channels(&document).filter(|_| mapping.is_none());
    let read = FileReading::of(document.to_clip(), mapping, data);
    let FileReading {
        recording,
        conversion,
        notices,
    } = read.map_err(|source| KeyframeError::Clip {
        file: path.into(),
        source: source.into(),
    })?;
    let clip = recording.clip;
    let named = |notice| format!("{}: {notice}", clip.name);
    let notices = notices.into_iter().map(named).collect();
    let source = Source {
        clip,
        channels,
        conversion: mapping.is_none().then_some(conversion),
    };
    Ok((source, notices))
}

pub(super) fn no_frame(clip: &Clip, frame: usize) -> SynthesisError {
    SynthesisError::NoFrame {
        clip: clip.name.clone(),
        frame,
        last: clip.poses.len().saturating_sub(1),
        fps: 1.0 / clip.frame_time,
    }
}

/// Labels of keyframes at other times: between two keyframes each frame has the label of the frame
/// at the same share of the way.
fn stretch(labels: &[Foot], from: &[usize], to: &[usize]) -> Vec<Foot> {
    let mut stretched = Vec::new();
    for (from, to) in from.windows(2).zip(to.windows(2)) {
        for frame in to[0]..to[1] {
            let share = (frame - to[0]) * (from[1] - from[0]) / (to[1] - to[0]);
            stretched.push(labels[from[0] + share]);
        }
    }
    stretched.extend(labels.last());
    stretched
}
