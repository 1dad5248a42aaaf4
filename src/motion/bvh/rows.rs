//! The MOTION section: the number of frames, the frame time and one row of numbers a frame.

use ndarray::Array2;

use super::document::LONGEST_FRAME;
use super::error::BvhError;
use super::scanner::{Scanner, quoted};
use crate::counted::counted;

/// Reads what follows the word MOTION: the frame time in seconds and the rows,
/// `[frames, channels]`.
pub(super) fn motion(
    scanner: &mut Scanner,
    channels: usize,
) -> Result<(f64, Array2<f64>), BvhError> {
    if let Some(word) = scanner.word_on_line() {
        return Err(scanner.unexpected("nothing after MOTION on its line", Some(word)));
    }
    let frames = field(
        scanner,
        "Frames:",
        "a whole number of frames above 0",
        |text| text.parse::<usize>().ok().filter(|&frames| frames > 0),
    )?;
    let expected = format!("seconds above 0 and at most {LONGEST_FRAME}");
    let frame_time = field(scanner, "Frame Time:", &expected, |text| {
        text.parse::<f64>()
            .ok()
            .filter(|&seconds| seconds > 0.0 && seconds <= LONGEST_FRAME)
    })?;
    Ok((frame_time, rows(scanner, frames, channels)?))
}

/// Reads a line such as `Frames: 885`.
fn field<T>(
    scanner: &mut Scanner,
    key: &str,
    expected: &str,
    read: impl Fn(&str) -> Option<T>,
) -> Result<T, BvhError> {
    let expected = format!("\"{key}\" and {expected}");
    let line = scanner.full_line();
    line.and_then(|line| line.split_once(':'))
        .filter(|(name, _)| {
            let words = key.trim_end_matches(':').split(' ');
            name.split_whitespace()
                .map(str::to_ascii_lowercase)
                .eq(words.map(str::to_ascii_lowercase))
        })
        .and_then(|(_, value)| read(value.trim()))
        .ok_or_else(|| scanner.unexpected(&expected, line))
}

/// Reads the rows. Grows with what is there, whatever number of frames the file claims.
fn rows(scanner: &mut Scanner, frames: usize, channels: usize) -> Result<Array2<f64>, BvhError> {
    let mut values = Vec::new();
    let mut read = 0;
    while let Some(line) = scanner.full_line() {
        if read == frames {
            let expected = format!(
                "the end of the file after the {} that \"Frames:\" announces",
                counted(frames, "row")
            );
            return Err(scanner.error(expected, quoted(line)));
        }
        let found = line.split_whitespace().count();
        if found != channels {
            return Err(scanner.error(
                format!("{} in a row, one a channel", counted(channels, "value")),
                found.to_string(),
            ));
        }
        for (column, word) in line.split_whitespace().enumerate() {
            values.push(scanner.number(Some(word), || format!("value {} of the row", column + 1))?);
        }
        read += 1;
    }
    let ended = || {
        scanner.error(
            format!("{}, as \"Frames:\" announces", counted(frames, "row")),
            format!("the end of the file after {read}"),
        )
    };
    if read < frames {
        return Err(ended());
    }
    Array2::from_shape_vec((read, channels), values).map_err(|_| ended())
}
