//! The page of any clips, to look at and to choose keyframes from.

use std::path::PathBuf;

use super::{MotionKind, Viewer, ViewerBody, ViewerMotion};
use crate::data::{DataConfig, FileReading, at_its_rate};
use crate::models::transition::DanceClip;
use crate::motion::{Clip, Mapping, bvh};
use crate::report::ReportError;

/// Rates within this of each other, as a share, are the same.
const SAME_RATE: f64 = 1e-4;

/// The page of clips from files, HTML, and what is to be known of the files. All are shown at the
/// first one's rate; where they are rigs of persons on the dance skeleton's joints, else on their
/// own, which is one for all then. A clip that ends earlier than others stands still.
///
/// # Errors
/// A file cannot be read; skeletons that cannot be shown together.
pub fn clips_page(
    files: &[PathBuf],
    data: &DataConfig,
) -> Result<(String, Vec<String>), ReportError> {
    let mut notices = Vec::new();
    let mut clips: Vec<Clip> = Vec::new();
    for file in files {
        let (clip, odd) = at_its_rate(bvh::read(file)?.to_clip(), data)?;
        notices.extend(odd.iter().map(|notice| format!("{}: {notice}", clip.name)));
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
    let mappings: Result<Vec<_>, _> = clips
        .iter()
        .map(|clip| Mapping::onto_dance_skeleton(clip, data.mapping.as_ref()))
        .collect();
    let mut read = |clip: Clip, mapping: Option<&Mapping>| -> Result<Clip, ReportError> {
        let reading = FileReading::of(clip, mapping, &at_rate)?;
        let clip = reading.recording.clip;
        let odd = reading.notices.iter();
        notices.extend(odd.map(|notice| format!("{}: {notice}", clip.name)));
        Ok(clip)
    };
    let mapped = mappings.is_ok();
    let shown: Vec<Clip> = match &mappings {
        Ok(mappings) => {
            let pairs = clips.iter().zip(mappings);
            let read = pairs.map(|(clip, mapping)| read(clip.clone(), mapping.as_deref()));
            read.collect::<Result<_, _>>()?
        }
        Err(unknown) => {
            let same = |clip: &Clip| clip.skeleton == clips[0].skeleton;
            if !clips.iter().all(same) {
                let problem =
                    format!("clips on several skeletons are not shown together: {unknown}");
                return Err(ReportError::Refused(problem));
            }
            let read = clips.iter().map(|clip| read(clip.clone(), None));
            read.collect::<Result<_, _>>()?
        }
    };
    let longest = shown.iter().map(|clip| clip.poses.len()).max().unwrap_or(0);
    let mut motions = Vec::new();
    for (number, mut clip) in shown.into_iter().enumerate() {
        let last = clip.poses.last().cloned();
        clip.poses.resize_with(longest, || {
            last.clone().unwrap_or_else(|| clip.skeleton.rest_pose())
        });
        let kind = match number {
            0 => MotionKind::Recorded,
            _ => MotionKind::Other,
        };
        motions.push(match mapped {
            true => {
                let name = clip.name.clone();
                let measured = DanceClip::measure(clip, &at_rate.features());
                let measured = measured.map_err(crate::data::DataError::from)?;
                ViewerMotion::from_features(name, kind, measured.features.view())
            }
            false => {
                let still = vec![[false; 4]; longest];
                ViewerMotion::from_clip(clip.name.clone(), kind, &clip, still)
            }
        });
    }
    let body = match mapped {
        true => ViewerBody::dance(),
        false => ViewerBody::of(&clips[0].skeleton),
    };
    let counts_alike = (data.fps * frame_time - 1.0).abs() < SAME_RATE;
    let names: Vec<&str> = clips.iter().map(|clip| clip.name.as_str()).collect();
    let viewer = Viewer {
        title: names.join(", "),
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
