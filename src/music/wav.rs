//! Sounds written as wav files.

use std::io::{self, Cursor};
use std::path::Path;

use super::sound::RATE;
use crate::run::{FileError, replace_file};

/// Writes samples in -1..1 at 22,050 Hz as one channel of 16 bits.
///
/// # Errors
/// The file cannot be written, or would be larger than such a file can be.
pub fn write_wav(path: &Path, samples: &[f32]) -> Result<(), FileError> {
    let content = encoded(samples).map_err(io::Error::other);
    replace_file(path, content.map_err(FileError::at(path, "written"))?)
}

fn encoded(samples: &[f32]) -> Result<Vec<u8>, hound::Error> {
    let spec = hound::WavSpec {
        channels: 1,
        sample_rate: RATE,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut content = Cursor::new(Vec::new());
    let mut writer = hound::WavWriter::new(&mut content, spec)?;
    for &sample in samples {
        let sample = (sample.clamp(-1.0, 1.0) * f32::from(i16::MAX)).round() as i16;
        writer.write_sample(sample)?;
    }
    writer.finalize()?;
    Ok(content.into_inner())
}
