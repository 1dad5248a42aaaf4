//! Generated dances as files: BVH, and wav beside it where they have music.

use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{ChoreographyConfig, ChoreographyError, GeneratedClip, clips, clips_with_music};
use crate::motion::bvh::{self, Axis, Bvh, BvhError, channel_layout};
use crate::music::RATE;
use crate::run::FileError;

/// Why a generated dance cannot be written.
#[derive(Debug, Error)]
pub enum DanceFileError {
    #[error(transparent)]
    Choreography(#[from] ChoreographyError),
    #[error(transparent)]
    Folder(#[from] FileError),
    #[error(transparent)]
    Bvh(#[from] BvhError),
    #[error("{path} cannot be written")]
    Sound { path: PathBuf, source: hound::Error },
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
            let path = path.with_extension("wav");
            write_wav(&path, &samples).map_err(|source| DanceFileError::Sound { path, source })?;
        }
        Ok(path)
    }))
}

/// One channel of 16 bits at 22,050 Hz.
fn write_wav(path: &Path, samples: &[f32]) -> Result<(), hound::Error> {
    let spec = hound::WavSpec {
        channels: 1,
        sample_rate: RATE,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut writer = hound::WavWriter::create(path, spec)?;
    for &sample in samples {
        let sample = (sample.clamp(-1.0, 1.0) * f32::from(i16::MAX)).round() as i16;
        writer.write_sample(sample)?;
    }
    writer.finalize()
}
