//! What trainings logged as event files, which TensorBoard shows.
//!
//! A file is a row of records: the length of the content (u64), its masked CRC-32C, the content,
//! its masked CRC-32C, all little-endian. A content is TensorFlow's protobuf message `Event`.

use std::path::{Path, PathBuf};

use prost::Message;

use super::ReproduceError;
use super::curves::Curves;
use crate::run::{FileError, LogLine, replace_file};

const FILE: &str = "events.out.tfevents.0.keydance";
/// What every file begins with.
const VERSION: &str = "brain.Event:2";

#[derive(Clone, PartialEq, Message)]
struct Event {
    /// s.
    #[prost(double, tag = "1")]
    wall_time: f64,
    #[prost(int64, tag = "2")]
    step: i64,
    #[prost(string, optional, tag = "3")]
    file_version: Option<String>,
    #[prost(message, optional, tag = "5")]
    summary: Option<Summary>,
}

#[derive(Clone, PartialEq, Message)]
struct Summary {
    #[prost(message, repeated, tag = "1")]
    values: Vec<Value>,
}

#[derive(Clone, PartialEq, Message)]
struct Value {
    #[prost(string, tag = "1")]
    tag: String,
    #[prost(float, optional, tag = "2")]
    simple_value: Option<f32>,
}

impl Curves {
    /// Writes an event file for each training into a folder of its name inside `folder`: losses,
    /// learning rate, norm of the gradient and validation scores of every logged step, at the time
    /// that the training had taken. Says which.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write_event_files(&self, folder: &Path) -> Result<Vec<PathBuf>, ReproduceError> {
        let mut files: Vec<PathBuf> = Vec::new();
        for (name, log) in self.logs() {
            let of_run = folder.join(name);
            let file = of_run.join(FILE);
            std::fs::create_dir_all(&of_run).map_err(FileError::at(&of_run, "created"))?;
            replace_file(&file, content(log))?;
            files.push(file);
        }
        Ok(files)
    }
}

fn content(log: &[LogLine]) -> Vec<u8> {
    let version = Event {
        file_version: Some(VERSION.into()),
        ..Event::default()
    };
    let mut content = record(&version);
    let mut wall_time = 0.0;
    for line in log {
        wall_time += line.seconds;
        let event = Event {
            wall_time,
            step: i64::try_from(line.step).unwrap_or(i64::MAX),
            file_version: None,
            summary: Some(Summary {
                values: values(line),
            }),
        };
        content.extend(record(&event));
    }
    content
}

fn values(line: &LogLine) -> Vec<Value> {
    let mut values = vec![
        ("loss/total".to_string(), line.total),
        ("learning_rate".into(), line.learning_rate),
        ("gradient_norm".into(), line.gradient_norm),
    ];
    let losses = line.losses.iter();
    values.extend(losses.map(|(name, loss)| (format!("loss/{name}"), *loss)));
    for (metric, row) in line.validation.iter().flat_map(|scores| scores.rows()) {
        for column in row.columns() {
            let score = row.at(column).unwrap_or(f64::NAN);
            values.push((format!("validation/{metric}/{column}"), score));
        }
    }
    let value = |(tag, value): (String, f64)| Value {
        tag,
        simple_value: Some(value as f32),
    };
    values.into_iter().map(value).collect()
}

fn record(event: &Event) -> Vec<u8> {
    let content = event.encode_to_vec();
    let length = (content.len() as u64).to_le_bytes();
    let mut record = length.to_vec();
    record.extend(masked(&length));
    record.extend(&content);
    record.extend(masked(&content));
    record
}

/// A checksum of bytes that may themselves hold checksums.
fn masked(bytes: &[u8]) -> [u8; 4] {
    let sum = crc32c::crc32c(bytes);
    sum.rotate_right(15).wrapping_add(0xa282_ead8).to_le_bytes()
}
