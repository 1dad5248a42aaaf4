//! The page of a dance to a song.

use std::path::Path;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use url::Url;

use super::{MotionKind, Viewer, ViewerBody, ViewerKeyframe, ViewerMotion, ViewerMusic};
use crate::data::DataConfig;
use crate::models::transition::DanceClip;
use crate::motion::Clip;
use crate::music::FRAME_RATE;
use crate::report::ReportError;
use crate::run::FileError;
use crate::synthesis::song::Song;

/// Where a page has the sound of its song.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sound<'p> {
    /// In itself.
    Embedded,
    /// Where the file is, seen from this path of the page.
    Beside(&'p Path),
}

impl Sound<'_> {
    /// What the page has of a file.
    ///
    /// # Errors
    /// It cannot be read, or has no address that the page could name.
    pub(in crate::report) fn source(self, file: &Path) -> Result<String, ReportError> {
        Ok(match self {
            Sound::Embedded => embedded(file)?,
            Sound::Beside(page) => address(file, page)?,
        })
    }
}

impl ViewerMusic {
    /// The song of a dance of so many frames.
    ///
    /// # Errors
    /// Its file cannot be read, or has no address that the page could name.
    fn of(song: &Song, frames: usize, sound: Sound<'_>) -> Result<Self, ReportError> {
        let name = song.file.file_name().unwrap_or_default();
        let a_frame = 1.0 / (FRAME_RATE * song.request.frame_time);
        let within = |beats: &[usize]| {
            let beats = beats.iter().map(|&beat| beat as f64 * a_frame);
            let beats = beats.map(|beat| beat.round() as usize);
            beats.filter(|&beat| beat < frames).collect()
        };
        Ok(Self {
            name: name.to_string_lossy().into(),
            source: sound.source(&song.file)?,
            beats: within(&song.music.beats),
            downbeats: within(&song.music.downbeats),
        })
    }
}

/// Where a page finds a file: relative to it, so that both may move together.
fn address(file: &Path, page: &Path) -> Result<String, ReportError> {
    let absolute = |path: &Path| {
        let path = std::path::absolute(path).ok()?;
        Url::from_file_path(path).ok()
    };
    let relative = || absolute(page)?.make_relative(&absolute(file)?);
    let file = file.display();
    relative().ok_or_else(|| {
        ReportError::Refused(format!("{file} has no address that a page could name"))
    })
}

/// A sound file as a data URL.
fn embedded(file: &Path) -> Result<String, FileError> {
    let content = std::fs::read(file).map_err(FileError::at(file, "read"))?;
    let kind = match content.get(..4) {
        Some(b"RIFF") => "wav",
        Some(b"fLaC") => "flac",
        Some(b"OggS") => "ogg",
        _ => "mpeg",
    };
    let content = BASE64_STANDARD.encode(content);
    Ok(format!("data:audio/{kind};base64,{content}"))
}

/// The page of what a model made of a song, one dance or several, HTML: key poses stand where the
/// first dance has its root.
///
/// # Errors
/// There is no dance; a sound that the page cannot have.
pub fn song_page(
    model: &str,
    song: &Song,
    dances: &[&Clip],
    data: &DataConfig,
    sound: Sound<'_>,
) -> Result<String, ReportError> {
    let nothing = || ReportError::Refused("there is no dance to show".into());
    let dance = *dances.first().ok_or_else(nothing)?;
    let music = ViewerMusic::of(song, dance.poses.len(), sound)?;
    let keys = song.request.given.iter();
    let keys = keys.filter(|given| given.frame >= song.seed as i64);
    let keyframes = keys.map(|given| {
        let frame = given.frame as usize;
        let world = given.pose.world_positions(&dance.skeleton);
        let there = dance.poses[frame].translations[0] - world[0];
        let positions = world.iter().map(|joint| *joint + there).collect();
        ViewerKeyframe { frame, positions }
    });
    let name = |number: usize| match dances.len() {
        1 => model.to_string(),
        _ => format!("{model} {}", number + 1),
    };
    let kind = |number| match number {
        0 => MotionKind::Model,
        _ => MotionKind::Other,
    };
    // Of another body than the dance skeleton there are no features to show.
    let measured: Result<Vec<DanceClip>, _> = dances
        .iter()
        .map(|dance| DanceClip::measure((*dance).clone(), &data.features()))
        .collect();
    let (body, motions) = match &measured {
        Ok(measured) => {
            let motions = measured.iter().enumerate().map(|(number, dance)| {
                let features = dance.features.view();
                ViewerMotion::from_features(name(number), kind(number), features)
            });
            (ViewerBody::dance(), motions.collect())
        }
        Err(_) => {
            let motions = dances.iter().enumerate().map(|(number, dance)| {
                let contacts = vec![[false; 4]; dance.poses.len()];
                ViewerMotion::from_clip(name(number), kind(number), dance, contacts)
            });
            (ViewerBody::of(&dance.skeleton), motions.collect())
        }
    };
    let viewer = Viewer {
        title: format!("{} to {}", dance.name, music.name),
        frame_time: dance.frame_time,
        body,
        motions,
        keyframes: keyframes.collect(),
        asked: None,
        music: Some(music),
        picks: None,
    };
    Ok(viewer.html()?)
}
