//! The page of a dance to a song.

use glam::DVec3;

use super::{MotionKind, Viewer, ViewerKeyframe, ViewerMotion, ViewerMusic};
use crate::data::DataConfig;
use crate::models::ModelError;
use crate::models::transition::DanceClip;
use crate::motion::{Clip, JOINTS};
use crate::report::ReportError;
use crate::synthesis::song::Song;

/// The page of what a model made of a song, HTML: key poses stand where the dance has its root.
///
/// # Errors
/// A dance on another skeleton than the dance skeleton.
pub fn song_page(
    model: &str,
    song: &Song,
    dance: &Clip,
    data: &DataConfig,
    music: ViewerMusic,
) -> Result<String, ReportError> {
    let measured = DanceClip::measure(dance.clone(), &data.features());
    let measured = measured.map_err(|error| ModelError::data(&error))?;
    let keys = song.request.given.iter();
    let keys = keys.filter(|given| given.frame >= song.seed as i64);
    let keyframes = keys.map(|given| {
        let frame = given.frame as usize;
        let world = given.pose.world_positions(&dance.skeleton);
        let there = dance.poses[frame].translations[0] - world[0];
        let mut positions = [DVec3::ZERO; JOINTS];
        let placed = positions.iter_mut().zip(&world);
        placed.for_each(|(into, joint)| *into = *joint + there);
        ViewerKeyframe { frame, positions }
    });
    let features = measured.features.view();
    let viewer = Viewer {
        title: format!("{} to {}", dance.name, music.name),
        frame_time: dance.frame_time,
        motions: vec![ViewerMotion::from_features(
            model,
            MotionKind::Model,
            features,
        )],
        keyframes: keyframes.collect(),
        asked: None,
        music: Some(music),
    };
    Ok(viewer.html()?)
}
