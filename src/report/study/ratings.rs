//! Ratings as participants' pages save them.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use csv::{Position, ReaderBuilder, StringRecord, Trim};

use super::{Question, StudyError, StudyKey};
use crate::run::FileError;

/// The columns that an analysis needs; a page writes more.
const COLUMNS: [&str; 4] = ["participant", "clip", "question", "rating"];

/// One answer of one participant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rating {
    pub participant: String,
    /// Identity of the clip.
    pub clip: String,
    pub question: Question,
    /// 1 to 5.
    pub rating: u8,
}

/// Reads CSV files of ratings of a study.
///
/// # Errors
/// A file cannot be read, lacks a column, or holds a line that is no rating of this study; a
/// participant has rated a clip twice; there is no rating at all. The message has file and line.
pub fn read_ratings(files: &[PathBuf], key: &StudyKey) -> Result<Vec<Rating>, StudyError> {
    let mut ratings = Vec::new();
    let mut places: BTreeMap<(String, Question, String), String> = BTreeMap::new();
    for file in files {
        for (line, rating) in read(file, key)? {
            let place = format!("{}, line {line}", file.display());
            let (participant, clip) = (rating.participant.clone(), rating.clip.clone());
            if let Some(first) = places.insert((participant, rating.question, clip), place.clone())
            {
                return Err(StudyError::Refused(format!(
                    "{place}: participant {:?} has rated the {} of clip {} already ({first}); keep \
                     one of the two",
                    rating.participant,
                    rating.question.name(),
                    rating.clip
                )));
            }
            ratings.push(rating);
        }
    }
    match ratings.is_empty() {
        true => Err(StudyError::Refused(
            "the files hold no ratings: there is nothing to analyse".into(),
        )),
        false => Ok(ratings),
    }
}

/// The ratings of one file with their lines, from 1 on.
fn read(file: &Path, key: &StudyKey) -> Result<Vec<(u64, Rating)>, StudyError> {
    let text = fs::read_to_string(file).map_err(FileError::at(file, "read"))?;
    let no_table = |source| StudyError::Table {
        file: file.into(),
        source,
    };
    let mut reader = ReaderBuilder::new()
        .trim(Trim::All)
        .from_reader(text.as_bytes());
    let header = reader.headers().map_err(no_table)?.clone();
    let place = |column: &str| {
        let found = header.iter().position(|title| title == column);
        found.ok_or_else(|| {
            StudyError::Refused(format!(
                "{}, line 1: there is no column {column:?}; expected {}, named in the first line \
                 and parted by commas",
                file.display(),
                COLUMNS.join(", ")
            ))
        })
    };
    let columns = [
        place(COLUMNS[0])?,
        place(COLUMNS[1])?,
        place(COLUMNS[2])?,
        place(COLUMNS[3])?,
    ];
    let rating = |record: Result<StringRecord, csv::Error>| {
        let record = record.map_err(no_table)?;
        let line = record.position().map_or(0, |start| line_of(&text, start));
        let cells = columns.map(|column| record.get(column).unwrap_or_default());
        let rating = rating_of(cells, key).map_err(|problem| {
            StudyError::Refused(format!("{}, line {line}: {problem}", file.display()))
        })?;
        Ok((line, rating))
    };
    reader.records().map(rating).collect()
}

/// The line of a row that begins at a place or behind empty lines there.
fn line_of(text: &str, start: &Position) -> u64 {
    let rest = text.as_bytes().iter().skip(start.byte() as usize);
    let empty = rest.take_while(|byte| b"\r\n".contains(byte));
    start.line() + empty.filter(|byte| **byte == b'\n').count() as u64
}

/// The rating in a line's cells; what is wrong with them.
fn rating_of(cells: [&str; 4], key: &StudyKey) -> Result<Rating, String> {
    let [participant, clip, question, rating] = cells;
    if participant.is_empty() {
        return Err("there is no participant; every rating is somebody's".into());
    }
    if !key.clips.contains_key(clip) {
        return Err(format!(
            "clip {clip:?} is none of the study {}; give the key.json of the page that was rated",
            key.study
        ));
    }
    let asked = |question: &Question| key.questions.contains(question);
    let Some(question) = Question::named(question).filter(asked) else {
        let names: Vec<_> = key.questions.iter().map(|it| it.name()).collect();
        return Err(format!(
            "the question is {question:?}; the study asks {}",
            names.join(", ")
        ));
    };
    let number = rating
        .parse()
        .ok()
        .filter(|number| (1..=5).contains(number));
    let Some(rating) = number else {
        return Err(format!(
            "the rating is {rating:?}; expected a whole number from 1 to 5"
        ));
    };
    Ok(Rating {
        participant: participant.into(),
        clip: clip.into(),
        question,
        rating,
    })
}
