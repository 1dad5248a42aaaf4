//! Controls from CSV files with a row of numbers for every frame.

use std::path::{Path, PathBuf};

use csv::{Position, ReaderBuilder, Trim};
use ndarray::Array2;

use crate::counted::counted;
use crate::motion::PART_NAMES;

/// Numbers beyond this are mistakes.
const LARGEST: f64 = 1e6;

/// Why a CSV file is no control.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    #[error("{file} cannot be read")]
    Read {
        file: PathBuf,
        source: std::io::Error,
    },
    #[error("{file}, line 1: {}", needed(columns))]
    Header {
        file: PathBuf,
        columns: Vec<String>,
        source: csv::Error,
    },
    #[error("{file}, line 1: there is no column {column:?}; {}", needed(columns))]
    NoColumn {
        file: PathBuf,
        column: String,
        columns: Vec<String>,
    },
    #[error("{file} is no table")]
    NoTable { file: PathBuf, source: csv::Error },
    #[error(
        "{file}, line {line}: {column} is {text:?}; expected a number between -1000000 and 1000000"
    )]
    Number {
        file: PathBuf,
        line: usize,
        column: String,
        text: String,
    },
    #[error(
        "{file}, line {line}: expected frame {expected}, found frame {found}; every frame needs a row, from frame 0 on"
    )]
    Frame {
        file: PathBuf,
        line: usize,
        expected: usize,
        found: f64,
    },
    #[error("{file} has rows for {}; the result has {frames} (0 to {})", counted(*found, "frame"), frames - 1)]
    TooShort {
        file: PathBuf,
        found: usize,
        frames: usize,
    },
    #[error("{file}: {part} is {factor} in frame {frame}; a velocity factor is 0 or more")]
    Negative {
        file: PathBuf,
        part: &'static str,
        factor: f64,
        frame: usize,
    },
}

fn needed(columns: &[String]) -> String {
    format!(
        "expected the columns frame,{}, named in the first line",
        columns.join(",")
    )
}

/// A root trajectory of `frames` frames from the columns x, y and z, `[frames, 3]`, cm.
///
/// # Errors
/// The file cannot be read, lacks columns or frames, or holds something else than numbers; with the
/// line.
pub fn read_trajectory(path: &Path, frames: usize) -> Result<Array2<f64>, TableError> {
    read(path, &["x", "y", "z"], frames)
}

/// Velocity factors of `frames` frames from a column for each part of the body, `[frames, 5]`,
/// cm/frame.
///
/// # Errors
/// As [`read_trajectory`], and a number below 0.
pub fn read_velocity_factors(path: &Path, frames: usize) -> Result<Array2<f64>, TableError> {
    let factors = read(path, &PART_NAMES, frames)?;
    if let Some((at, &factor)) = factors.indexed_iter().find(|(_, factor)| **factor < 0.0) {
        return Err(TableError::Negative {
            file: path.into(),
            part: PART_NAMES[at.1],
            factor,
            frame: at.0,
        });
    }
    Ok(factors)
}

/// Rows of `frames` frames from a CSV file with the columns `frame` and `columns`, in any order,
/// `[frames, columns]`.
///
/// The first row is frame 0 and every frame has a row. Rows beyond the last frame are not read.
fn read(path: &Path, columns: &[&str], frames: usize) -> Result<Array2<f64>, TableError> {
    let file = || PathBuf::from(path);
    let all_columns = || columns.iter().map(|&column| column.into()).collect();
    let text = std::fs::read_to_string(path).map_err(|source| TableError::Read {
        file: file(),
        source,
    })?;
    let mut reader = ReaderBuilder::new()
        .trim(Trim::All)
        .from_reader(text.as_bytes());
    let header = reader
        .headers()
        .map_err(|source| TableError::Header {
            file: file(),
            columns: all_columns(),
            source,
        })?
        .clone();
    let place = |column: &str| {
        header
            .iter()
            .position(|title| title.eq_ignore_ascii_case(column))
            .ok_or_else(|| TableError::NoColumn {
                file: file(),
                column: column.into(),
                columns: all_columns(),
            })
    };
    let frame_place = place("frame")?;
    let places: Vec<usize> = columns
        .iter()
        .map(|column| place(column))
        .collect::<Result<_, _>>()?;
    let mut rows = Array2::zeros((frames, columns.len()));
    let mut expected = 0;
    for record in reader.records() {
        if expected == frames {
            break;
        }
        let record = record.map_err(|source| TableError::NoTable {
            file: file(),
            source,
        })?;
        let line = line_of(&text, record.position().map_or(0, Position::byte) as usize);
        let number = |place: usize, column: &str| {
            let text = record.get(place).unwrap_or_default();
            match text.parse::<f64>() {
                Ok(value) if value.abs() <= LARGEST => Ok(value),
                _ => Err(TableError::Number {
                    file: file(),
                    line,
                    column: column.into(),
                    text: text.into(),
                }),
            }
        };
        let found = number(frame_place, "frame")?;
        if found != expected as f64 {
            return Err(TableError::Frame {
                file: file(),
                line,
                expected,
                found,
            });
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
        return Err(TableError::TooShort {
            file: file(),
            found: expected,
            frames,
        });
    }
    Ok(rows)
}

/// The line, from 1 on, of the row that is read from a byte of the text on: the reader steps over
/// empty lines before it.
fn line_of(text: &str, start: usize) -> usize {
    let row = start
        + text[start..]
            .find(|letter| letter != '\n' && letter != '\r')
            .unwrap_or(0);
    1 + text[..row].matches('\n').count()
}
