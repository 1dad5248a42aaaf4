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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const GOOD: &str = "frame,x,y\n0,1.5,90\n1,-2,91\n2,3e1,92\n";

    proptest! {
        #[test]
        fn a_damaged_table_is_an_error_that_names_it_or_rows_of_sound_numbers(
            flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
            cut in any::<prop::sample::Index>(), doubled in 0usize..5, dropped in 0usize..5,
        ) {
            let mut lines: Vec<&str> = GOOD.split_inclusive('\n').collect();
            lines.insert(doubled.min(3), lines[doubled.min(3)]);
            if dropped < lines.len() {
                lines.remove(dropped);
            }
            let mut bytes = lines.concat().into_bytes();
            for (place, byte) in flips {
                let place = place.index(bytes.len());
                bytes[place] ^= byte;
            }
            bytes.truncate(cut.index(2 * bytes.len()).max(1));
            let file = tempfile::NamedTempFile::new().unwrap();
            std::fs::write(file.path(), bytes).unwrap();
            match read(file.path(), &["x", "y"], 3) {
                Err(error) => prop_assert!(error.to_string().contains(&file.path().display().to_string())),
                Ok(rows) => {
                    prop_assert_eq!(rows.dim(), (3, 2));
                    prop_assert!(rows.iter().all(|number| number.abs() <= LARGEST));
                }
            }
        }
    }
}
