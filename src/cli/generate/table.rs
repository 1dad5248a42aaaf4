//! CSV files with a row of numbers for every frame.

use std::path::Path;

use anyhow::{Context as _, bail};
use ndarray::Array2;

/// Numbers beyond this are mistakes.
const LARGEST: f64 = 1e6;

/// Rows of `frames` frames from a CSV file with the columns `frame` and `columns`, in any order, `[frames, columns]`.
///
/// The first row is frame 0 and every frame has a row. Rows beyond the last frame are not read.
///
/// # Errors
/// The file cannot be read, lacks columns or frames, or holds something else than numbers; with the line.
pub fn read(path: &Path, columns: &[&str], frames: usize) -> anyhow::Result<Array2<f64>> {
    let name = path.display();
    let header_needed = || {
        format!(
            "expected the columns frame,{}, named in the first line",
            columns.join(",")
        )
    };
    let text = std::fs::read_to_string(path).with_context(|| format!("{name} cannot be read"))?;
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let header = reader
        .headers()
        .with_context(|| format!("{name}, line 1: {}", header_needed()))?
        .clone();
    let place = |column: &str| match header
        .iter()
        .position(|title| title.eq_ignore_ascii_case(column))
    {
        Some(place) => Ok(place),
        None => bail!(
            "{name}, line 1: there is no column {column:?}; {}",
            header_needed()
        ),
    };
    let frame_place = place("frame")?;
    let places: Vec<usize> = columns
        .iter()
        .map(|column| place(column))
        .collect::<anyhow::Result<_>>()?;
    let mut rows = Array2::zeros((frames, columns.len()));
    let mut expected = 0;
    for record in reader.records() {
        if expected == frames {
            break;
        }
        let record = record.with_context(|| format!("{name} is no table"))?;
        let line = line_of(
            &text,
            record.position().map_or(0, csv::Position::byte) as usize,
        );
        let number = |place: usize, column: &str| -> anyhow::Result<f64> {
            let text = record.get(place).unwrap_or_default();
            match text.parse::<f64>() {
                Ok(value) if value.abs() <= LARGEST => Ok(value),
                _ => bail!(
                    "{name}, line {line}: {column} is {text:?}; expected a number between -1000000 and 1000000"
                ),
            }
        };
        let frame = number(frame_place, "frame")?;
        if frame != expected as f64 {
            bail!(
                "{name}, line {line}: expected frame {expected}, found frame {frame}; every frame needs a row, from frame 0 on"
            );
        }
        for (slot, (&place, column)) in rows
            .row_mut(expected)
            .iter_mut()
            .zip(places.iter().zip(columns))
        {
            *slot = number(place, column)?;
        }
        expected += 1;
    }
    if expected < frames {
        bail!(
            "{name} has rows for {expected} frames; the result has {frames} (0 to {})",
            frames - 1
        );
    }
    Ok(rows)
}

/// The line, from 1 on, of the row that is read from a byte of the text on: the reader steps over empty lines before it.
fn line_of(text: &str, start: usize) -> usize {
    let row = start
        + text[start..]
            .find(|letter| letter != '\n' && letter != '\r')
            .unwrap_or(0);
    1 + text[..row].matches('\n').count()
}
