//! What a training needs beside the weights to go on to the bit: `state.bin`.
//!
//! ```text
//! magic "KDSTATE\0" | format version, u32 | header, bincode | moments of Adam, bincode | SHA-256 of all before
//! ```
//!
//! The random streams need nothing saved, see [`super::Streams`].

use std::path::{Path, PathBuf};

use bincode::config::{Configuration, Limit, LittleEndian, Varint};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use thiserror::Error;

use super::durable::FileError;

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

/// A state file that cannot be used.
#[derive(Debug, Error)]
pub enum StateError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error("{path} is no training state of keydance: it does not begin with its mark")]
    Foreign { path: PathBuf },
    #[error("{path} has format {found}, this version of keydance reads format {VERSION}")]
    Version { path: PathBuf, found: u32 },
    #[error("{path} has {found} bytes, a training state of this model has at most {most}")]
    TooLarge {
        path: PathBuf,
        found: u64,
        most: u64,
    },
    #[error("{path} is damaged: {problem}")]
    Damaged { path: PathBuf, problem: String },
    #[error("the training state cannot be written")]
    Encode(#[from] bincode::error::EncodeError),
}

/// The content of a state file.
pub(crate) fn encode(header: &Header, moments: [&[Vec<f32>]; 2]) -> Result<Vec<u8>, StateError> {
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
) -> Result<(Header, Moments), StateError> {
    let most = 8 * weights as u64 + 32 * parameters as u64 + HEADER as u64 + 1024;
    let found = std::fs::metadata(path)
        .map_err(FileError::at(path, "read"))?
        .len();
    if found > most {
        return Err(StateError::TooLarge {
            path: path.into(),
            found,
            most,
        });
    }
    let content = std::fs::read(path).map_err(FileError::at(path, "read"))?;
    decode(&content, path)
}

/// The state that a file's content holds; `path` is what errors call it.
///
/// # Errors
/// Anything but the content of a whole state file of this format.
pub fn decode(content: &[u8], path: &Path) -> Result<(Header, Moments), StateError> {
    let damaged = |problem: String| StateError::Damaged {
        path: path.into(),
        problem,
    };
    let rest = content
        .strip_prefix(MAGIC)
        .ok_or_else(|| StateError::Foreign { path: path.into() })?;
    let (version, rest) = rest
        .split_first_chunk::<4>()
        .ok_or_else(|| damaged(format!("it ends after {} bytes", content.len())))?;
    let version = u32::from_le_bytes(*version);
    if version != VERSION {
        return Err(StateError::Version {
            path: path.into(),
            found: version,
        });
    }
    let (payload, checksum) = rest
        .split_last_chunk::<CHECKSUM>()
        .ok_or_else(|| damaged(format!("it ends after {} bytes", content.len())))?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn header() -> Header {
        Header {
            steps: 12,
            epoch: 3,
            position: 2,
            frame_steps: 4000,
            config_digest: "c".into(),
            data_digest: "d".into(),
            weights_file_digest: "w".into(),
        }
    }

    /// Content with a checksum that fits, whatever it holds.
    fn sealed(payload: &[u8]) -> Vec<u8> {
        let mut content = [MAGIC.as_slice(), &VERSION.to_le_bytes(), payload].concat();
        let checksum = Sha256::digest(&content);
        content.extend_from_slice(&checksum);
        content
    }

    fn problem(content: &[u8]) -> String {
        decode(content, Path::new("state.bin"))
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn a_state_reads_back_to_the_bit() {
        let moments = [
            vec![vec![1.5f32, -0.0], vec![]],
            vec![vec![f32::MIN_POSITIVE, 2.0], vec![]],
        ];
        let content = encode(&header(), [&moments[0], &moments[1]]).unwrap();
        assert_eq!(
            decode(&content, Path::new("x")).unwrap(),
            (header(), moments)
        );
    }

    #[test]
    fn lengths_beyond_the_file_are_an_error_at_once_even_with_a_checksum_that_fits() {
        let head = bincode::serde::encode_to_vec(header(), HEADER_FORMAT).unwrap();
        // 253 begins a u64: a list of 2^60 lists.
        let huge = [[253u8].as_slice(), &(1u64 << 60).to_le_bytes()].concat();
        assert!(problem(&sealed(&[head.as_slice(), &huge].concat())).contains("moments"));
        assert!(problem(&sealed(&[head.as_slice(), &[1], &huge].concat())).contains("moments"));
        let text = problem(&sealed(&[&[1u8, 1, 1, 1][..], &huge].concat()));
        assert!(text.contains("header"), "{text}");
    }

    #[test]
    fn other_files_and_versions_are_named() {
        assert!(problem(b"PK\x03\x04").contains("no training state"));
        assert!(problem(b"").contains("no training state"));
        let mut content = encode(&header(), [&[], &[]]).unwrap();
        content[8] = 9;
        assert!(problem(&content).contains("format 9"));
    }

    proptest! {
        #[test]
        fn a_changed_or_cut_state_is_an_error(at in 0usize..200, change in 1u8..255, cut in 0usize..200) {
            let moments = vec![vec![0.25f32; 20]];
            let content = encode(&header(), [&moments, &moments]).unwrap();
            let mut changed = content.clone();
            let at = at % content.len();
            changed[at] ^= change;
            prop_assert!(decode(&changed, Path::new("x")).is_err());
            prop_assert!(decode(&content[..cut % content.len()], Path::new("x")).is_err());
        }
    }
}
