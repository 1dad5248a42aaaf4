//! JSON files for people and scripts.

use std::path::Path;

use serde::Serialize;

use super::durable::{self, FileError};

/// Writes JSON with a final line end, there whole or not at all.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write_json(path: &Path, content: &impl Serialize) -> Result<(), FileError> {
    let mut text = serde_json::to_vec_pretty(content)
        .map_err(std::io::Error::from)
        .map_err(FileError::at(path, "written"))?;
    text.push(b'\n');
    durable::replace(path, &text)
}
