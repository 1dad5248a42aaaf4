//! The page of any clips, to look at and to choose keyframes from.

use std::path::PathBuf;

use super::{MotionKind, Viewer, ViewerBody, ViewerMotion};
use crate::data::{DataConfig, DataError, FileReading, at_its_rate};
use crate::models::transition::DanceClip;
use crate::motion::{Clip, Mapping, bvh};
use crate::report::ReportError;

/// Rates within this of each other, as a share, are the same.
const SAME_RATE: f64 = 1e-4;

/// The page of clips from files, HTML, and what is to be known of the files. All are shown at the
/// first one's rate; where all are rigs of persons on the dance skeleton's joints, else on their
/// own, which is one for all then. A clip that ends earlier than others stands still.
///
/// # Errors
/// A file cannot be read; skeletons that cannot be shown together.
pub fn clips_page(
    files: &[PathBuf],
    data: &DataConfig,
) -> Result<(String, Vec<String>), ReportError> {
    let mut notices = Vec::new();
    let mut note = |clip: &Clip, odd: Vec<String>| {
        notices.extend(odd.iter().map(|notice| format!("{}: {notice}", clip.name)));
    };
    let mut clips: Vec<Clip> = Vec::new();
    for file in files {
        let (clip, odd) = at_its_rate(bvh::read(file)?.to_clip(), data)?;
        note(&clip, odd);
        clips.push(clip);
    }
    let nothing = || ReportError::Refused("there is no clip to show".into());
    let frame_time = clips.first().ok_or_else(nothing)?.frame_time;
    let at_rate = DataConfig {
        fps: 1.0 / frame_time,
        source_fps: None,
        skip_frames: 0,
        ..data.clone()
    };
    let mappings = mappings(&clips, data.mapping.as_ref())?;
    let title: Vec<String> = clips.iter().map(|clip| clip.name.clone()).collect();
    let mut shown: Vec<Clip> = Vec::new();
    for (number, clip) in clips.into_iter().enumerate() {
        let mapping = mappings.as_ref().and_then(|all| all[number].as_ref());
        let FileReading {
            recording, notices, ..
        } = FileReading::of(clip, mapping, &at_rate)?;
        note(&recording.clip, notices);
        shown.push(recording.clip);
    }
    let longest = shown.iter().map(|clip| clip.poses.len()).max().unwrap_or(0);
    let body = match &mappings {
        Some(_) => ViewerBody::dance(),
        None => ViewerBody::of(&shown[0].skeleton),
    };
    let mut motions = Vec::new();
    for mut clip in shown {
        let kind = match motions.len() {
            0 => MotionKind::Recorded,
            _ => MotionKind::Other,
        };
        if let Some(last) = clip.poses.last().cloned() {
            clip.poses.resize(longest, last);
        }
        let name = clip.name.clone();
        motions.push(match &mappings {
            Some(_) => {
                let measured = DanceClip::measure(clip, &at_rate.features());
                let measured = measured.map_err(DataError::from)?;
                ViewerMotion::from_features(name, kind, measured.features.view())
            }
            None => ViewerMotion::from_clip(name, kind, &clip, vec![[false; 4]; longest]),
        });
    }
    let counts_alike = (data.fps * frame_time - 1.0).abs() < SAME_RATE;
    let viewer = Viewer {
        title: title.join(", "),
        frame_time,
        body,
        motions,
        keyframes: Vec::new(),
        asked: None,
        music: None,
        picks: Some(match counts_alike {
            true => "--keyframes",
            false => "--own-frames --keyframes",
        }),
    };
    Ok((viewer.html()?, notices))
}

/// What brings each clip onto the dance skeleton, none for one that is on it; none at all where a
/// clip cannot be brought there and all are on one skeleton.
fn mappings(
    clips: &[Clip],
    given: Option<&Mapping>,
) -> Result<Option<Vec<Option<Mapping>>>, ReportError> {
    let onto = |clip| Ok(Mapping::onto_dance_skeleton(clip, given)?.map(|it| it.into_owned()));
    let found: Result<_, DataError> = clips.iter().map(onto).collect();
    let is_one = clips
        .windows(2)
        .all(|pair| pair[0].skeleton == pair[1].skeleton);
    match found {
        Ok(mappings) => Ok(Some(mappings)),
        Err(_) if is_one => Ok(None),
        Err(unknown) => Err(ReportError::Refused(format!(
            "clips on several skeletons are not shown together: {unknown}"
        ))),
    }
}
