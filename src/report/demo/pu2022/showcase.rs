//! A test dance made again by the model: the recorded beginning and its song as files, the dance to
//! it, and the page that plays it.

use std::path::Path;

use super::{DANCE, RECORDED, SONG, VIEWER};
use crate::data::choreography::DanceWithMusic;
use crate::evaluation::EvaluationOptions;
use crate::evaluation::music_dance::MusicDance;
use crate::experiment::ExperimentConfig;
use crate::models::Generator;
use crate::motion::bvh::{self, Axis, Bvh, channel_layout};
use crate::music::{Cache, write_wav};
use crate::report::ReportError;
use crate::report::viewer::{Sound, song_page};
use crate::run::replace_file;
use crate::synthesis::keyframes::FileKeyframe;
use crate::synthesis::song::{Seed, Song, SongChoice};

/// Writes what `keydance generate` would of the same files, the key poses where the protocol has
/// them. In a line, what it is.
///
/// # Errors
/// The model fails, or a file cannot be written.
pub(super) fn write(
    recorded: &DanceWithMusic,
    model: &dyn Generator,
    config: &ExperimentConfig,
    folder: &Path,
) -> Result<String, ReportError> {
    let [recorded_file, song_file] = [RECORDED, SONG].map(|name| folder.join(name));
    let clip = &recorded.dance.clip;
    let channels = channel_layout(clip, [Axis::Z, Axis::X, Axis::Y]);
    bvh::write(&recorded_file, &Bvh::from_clip(clip, channels)?)?;
    write_wav(&song_file, &recorded.samples)?;
    let protocol = MusicDance::new(&EvaluationOptions::default());
    let keys = protocol.key_frames(clip.poses.len());
    let choice = SongChoice {
        music: song_file,
        seed: Seed::Motion(recorded_file.clone(), Some(0)),
        key_poses: keys
            .map(|frame| FileKeyframe {
                file: recorded_file.clone(),
                frame,
                time: frame,
            })
            .collect(),
        frames: None,
        mapping: None,
    };
    let song = Song::read(&choice, model, &config.data, &Cache::none()).map_err(Box::new)?;
    let (dance, summary) = song.dance(model, DANCE).map_err(Box::new)?;
    let document = song.document(&dance).map_err(Box::new)?;
    bvh::write(&folder.join(DANCE), &document)?;
    let viewer = folder.join(VIEWER);
    let sound = Sound::Beside(&viewer);
    let page = song_page(&config.name, &song, &[&dance], &config.data, sound)?;
    replace_file(&viewer, page)?;
    Ok(format!(
        "{DANCE}: a dance to {SONG} of {} after the first 2 s of {RECORDED} ({}), {}",
        seconds(dance.poses.len()),
        clip.name,
        summary.about_key_poses()
    ))
}

fn seconds(frames: usize) -> String {
    format!("{:.0} s", frames as f64 / crate::music::FRAME_RATE)
}
