//! Generated dances as files: BVH, and wav beside it where they have music.

use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{ChoreographyConfig, ChoreographyError, GeneratedClip, clips, clips_with_music};
use crate::motion::bvh::{self, Axis, Bvh, BvhError, channel_layout};
use crate::music::write_wav;
use crate::run::FileError;

/// Why a generated dance cannot be written.
#[derive(Debug, Error)]
pub enum DanceFileError {
    #[error(transparent)]
    Choreography(#[from] ChoreographyError),
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    Bvh(#[from] BvhError),
}

/// Writes the clips of a configuration into a folder, made where there is none, as they are asked
/// of the iterator, and gives the path of each; with `music` a wav of its name lies beside it.
///
/// # Errors
/// As [`super::generate`]; the folder cannot be made; of a clip: a file cannot be written.
pub fn write_clips(
    config: &ChoreographyConfig,
    music: bool,
    folder: &Path,
) -> Result<impl Iterator<Item = Result<PathBuf, DanceFileError>> + use<>, DanceFileError> {
    let dances: Box<dyn Iterator<Item = (GeneratedClip, Option<Vec<f32>>)>> = match music {
        true => Box::new(clips_with_music(config)?.map(|it| (it.dance, Some(it.samples)))),
        false => Box::new(clips(config)?.map(|clip| (clip, None))),
    };
    std::fs::create_dir_all(folder).map_err(FileError::at(folder, "created"))?;
    let folder = folder.to_path_buf();
    Ok(dances.map(move |(GeneratedClip { clip, .. }, samples)| {
        let channels = channel_layout(&clip, [Axis::Z, Axis::X, Axis::Y]);
        let path = folder.join(&clip.name);
        bvh::write(&path, &Bvh::from_clip(&clip, channels)?)?;
        if let Some(samples) = samples {
            write_wav(&path.with_extension("wav"), &samples)?;
        }
        Ok(path)
    }))
}
