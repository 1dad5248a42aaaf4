//! Three dances to the song of a test dance, from its beginning: files, and the page that plays them.

use std::path::Path;

use super::{DANCES, RECORDED, SONG, VIEWER};
use crate::data::choreography::DanceWithMusic;
use crate::experiment::ExperimentConfig;
use crate::models::Generator;
use crate::motion::Clip;
use crate::motion::bvh::{self, Axis, Bvh, channel_layout};
use crate::music::{Cache, write_wav};
use crate::report::ReportError;
use crate::report::viewer::{Sound, song_page};
use crate::run::replace_file;
use crate::synthesis::song::{Seed, Song, SongChoice};

/// Writes what `keydance generate --count 3` would of the same files. In a line, what it is.
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
    let choice = SongChoice {
        music: song_file,
        seed: Seed::Motion(recorded_file, Some(0)),
        key_poses: Vec::new(),
        frames: None,
        mapping: None,
    };
    let mut song = Song::read(&choice, model, &config.data, &Cache::none()).map_err(Box::new)?;
    let mut dances: Vec<Clip> = Vec::new();
    for (seed, name) in (1..).zip(DANCES) {
        song.request.seed = seed;
        let (dance, _) = song.dance(model, name).map_err(Box::new)?;
        let document = song.document(&dance).map_err(Box::new)?;
        bvh::write(&folder.join(name), &document)?;
        dances.push(dance);
    }
    let viewer = folder.join(VIEWER);
    let all: Vec<&Clip> = dances.iter().collect();
    let page = song_page(
        &config.name,
        &song,
        &all,
        &config.data,
        Sound::Beside(&viewer),
    )?;
    replace_file(&viewer, page)?;
    Ok(format!(
        "{}: three dances to {SONG}, each goes on from the same {:.0} s of {RECORDED} ({}); after \
         them they lie {:.1} cm apart",
        DANCES.join(", "),
        song.seed as f64 * clip_seconds(&dances),
        clip.name,
        apart(&dances, song.seed)
    ))
}

fn clip_seconds(dances: &[Clip]) -> f64 {
    dances.first().map_or(0.0, |dance| dance.frame_time)
}

/// Mean distance of the joints of two of the dances about the root, over pairs and the frames behind
/// the seed, cm.
fn apart(dances: &[Clip], seed: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for (k, one) in dances.iter().enumerate() {
        for other in &dances[k + 1..] {
            for (a, b) in one.poses.iter().zip(&other.poses).skip(seed) {
                let [a, b] = [a, b].map(|pose| pose.world_positions(&one.skeleton));
                for (p, q) in a.iter().zip(&b) {
                    sum += (*p - a[0]).distance(*q - b[0]);
                    count += 1;
                }
            }
        }
    }
    sum / count.max(1) as f64
}
