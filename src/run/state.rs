//! What a training needs beside the weights to go on to the bit: `state.bin`.
//!
//! ```text
//! magic "KDSTATE\0" | format version, u32 | header, bincode | moments of Adam, bincode
//! | SHA-256 of all before
//! ```
//!
//! The random streams need nothing saved, see [`crate::models::streams::Streams`].

use std::path::Path;

use bincode::config::{Configuration, Limit, LittleEndian, Varint};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::durable::FileError;
use super::error::RunError;

const MAGIC: &[u8; 8] = b"KDSTATE\0";
const VERSION: u32 = 1;
const CHECKSUM: usize = 32;
/// Bytes that the header may have: strings are allocated before they are read.
const HEADER: usize = 1 << 16;
/// Bytes that the moments may have; lists grow as they are read, so this is no allocation.
const MOMENTS: usize = 1 << 33;

const HEADER_FORMAT: Configuration<LittleEndian, Varint, Limit<HEADER>> =
    bincode::config::standard().with_limit::<HEADER>();
const MOMENTS_FORMAT: Configuration<LittleEndian, Varint, Limit<MOMENTS>> =
    bincode::config::standard().with_limit::<MOMENTS>();

/// Where a training stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Optimiser steps done.
    pub steps: u64,
    /// Epoch of the next step, and how many of its batches are done.
    pub epoch: u64,
    pub position: u64,
    /// Frames predicted so far.
    pub frame_steps: u64,
    /// SHA-256 of the resolved config, hexadecimal.
    pub config_digest: String,
    pub data_digest: String,
    /// SHA-256 of the weights file that belongs to this state, hexadecimal.
    pub weights_file_digest: String,
}

/// Adam's m and v, a list for each parameter.
pub type Moments = [Vec<Vec<f32>>; 2];

/// The content of a state file.
///
/// # Errors
/// More numbers than the format has room for.
pub fn encode(header: &Header, moments: [&[Vec<f32>]; 2]) -> Result<Vec<u8>, RunError> {
    let mut content = MAGIC.to_vec();
    content.extend(VERSION.to_le_bytes());
    content.extend(bincode::serde::encode_to_vec(header, HEADER_FORMAT)?);
    content.extend(bincode::serde::encode_to_vec(moments, MOMENTS_FORMAT)?);
    let checksum = Sha256::digest(&content);
    content.extend_from_slice(&checksum);
    Ok(content)
}

/// Reads a state file of a model with `weights` weights in `parameters` parameters.
pub(crate) fn read(
    path: &Path,
    weights: usize,
    parameters: usize,
) -> Result<(Header, Moments), RunError> {
    let most = 8 * weights as u64 + 32 * parameters as u64 + HEADER as u64 + 1024;
    let file = std::fs::metadata(path).map_err(FileError::at(path, "read"))?;
    if file.len() > most {
        return Err(RunError::Refused(format!(
            "{} has {} bytes, a training state of this model has at most {most}",
            path.display(),
            file.len()
        )));
    }
    let content = std::fs::read(path).map_err(FileError::at(path, "read"))?;
    decode(&content, path)
}

/// The state that a file's content holds; `path` is what errors call it.
///
/// # Errors
/// Anything but the content of a whole state file of this format.
pub fn decode(content: &[u8], path: &Path) -> Result<(Header, Moments), RunError> {
    let bad = |problem: String| RunError::Refused(format!("{} {problem}", path.display()));
    let damaged = |problem: String| bad(format!("is damaged: {problem}"));
    let cut = || damaged(format!("it ends after {} bytes", content.len()));
    let rest = content.strip_prefix(MAGIC).ok_or_else(|| {
        bad("is no training state of keydance: it does not begin with its mark".into())
    })?;
    let (version, rest) = rest.split_first_chunk::<4>().ok_or_else(cut)?;
    let version = u32::from_le_bytes(*version);
    if version != VERSION {
        return Err(bad(format!(
            "has format {version}, this version of keydance reads format {VERSION}"
        )));
    }
    let (payload, checksum) = rest.split_last_chunk::<CHECKSUM>().ok_or_else(cut)?;
    if Sha256::digest(&content[..content.len() - CHECKSUM]).as_slice() != checksum {
        return Err(damaged("its checksum does not fit its content".into()));
    }
    let (header, used) = bincode::serde::decode_from_slice::<Header, _>(payload, HEADER_FORMAT)
        .map_err(|error| damaged(format!("its header: {error}")))?;
    let (moments, more) =
        bincode::serde::decode_from_slice::<Moments, _>(&payload[used..], MOMENTS_FORMAT)
            .map_err(|error| damaged(format!("its moments: {error}")))?;
    match payload.len() - used - more {
        0 => Ok((header, moments)),
        left => Err(damaged(format!("{left} bytes follow its content"))),
    }
}
