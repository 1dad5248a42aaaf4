//! What was heard in a file, remembered by the file's content.
//!
//! ```text
//! magic "KDMUSIC\0" | format version, u32 | the sound file's SHA-256, warnings, analysis, bincode |
//! SHA-256 of all before
//! ```

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use bincode::config::{Configuration, Limit, LittleEndian, Varint};
use sha2::{Digest, Sha256};

use super::analysis::Analysis;
use super::chroma::PITCH_CLASSES;
use super::decode::read;
use super::error::MusicError;
use super::mel::BANDS;
use super::mfcc::COEFFICIENTS;
use super::sound::HOP;
use super::twentieths::{FLUX_BANDS, MEL_BANDS, Twentieths, twentieths};
use crate::data::hexadecimal;
use crate::run::{FileError, replace_file};

const MAGIC: &[u8; 8] = b"KDMUSIC\0";
/// To be raised whenever what is heard changes.
const VERSION: u32 = 3;
const CHECKSUM: usize = 32;
/// Bytes of an hour's analysis, with room: lists grow as they are read.
const LARGEST: usize = 1 << 28;
const FORMAT: Configuration<LittleEndian, Varint, Limit<LARGEST>> =
    bincode::config::standard().with_limit::<LARGEST>();

/// What was heard in a file, and what is odd about the file, a sentence each.
#[derive(Debug, Clone, PartialEq)]
pub struct Heard {
    pub analysis: Analysis,
    pub warnings: Vec<String>,
}

/// A folder that remembers analyses, or none.
#[derive(Debug, Clone, Default)]
pub struct Cache {
    folder: Option<PathBuf>,
}

impl Cache {
    /// In a folder, which is made where it is missing.
    #[must_use]
    pub fn at(folder: &Path) -> Self {
        Self {
            folder: Some(folder.into()),
        }
    }

    /// Remembers nothing.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// In the user's folder for such things: `$XDG_CACHE_HOME/keydance/music`, else
    /// `~/.cache/keydance/music`; none where neither variable is set.
    #[must_use]
    pub fn of_user() -> Self {
        let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
        // The specification has relative paths ignored.
        let named = set("XDG_CACHE_HOME")
            .map(PathBuf::from)
            .filter(|path| path.is_absolute());
        let home = || Some(Path::new(&set("HOME")?).join(".cache"));
        let folder = named.or_else(home);
        Self {
            folder: folder.map(|folder| folder.join("keydance").join("music")),
        }
    }

    /// What is heard in a sound file: remembered where a file of the same content was heard before,
    /// else heard now. An entry that is damaged, or another file's, is made again.
    ///
    /// # Errors
    /// The file cannot be read or heard. That the cache cannot be written is a warning.
    pub fn analysis(&self, path: &Path) -> Result<Heard, MusicError> {
        let Some(folder) = self.folder.as_ref().filter(|_| path.is_file()) else {
            return heard(path);
        };
        let digest = digest(path).map_err(|source| MusicError::Read {
            path: path.into(),
            source,
        })?;
        let entry = folder.join(format!("{digest}.heard"));
        if let Some(known) = known(&entry, &digest) {
            return Ok(known);
        }
        let mut heard = heard(path)?;
        if let Err(error) = remember(folder, &entry, &digest, &heard) {
            let warning = format!("is heard again next time: {error}");
            heard.warnings.push(warning);
        }
        Ok(heard)
    }
}

fn heard(path: &Path) -> Result<Heard, MusicError> {
    let sound = read(path)?;
    Ok(Heard {
        analysis: Analysis::of(&sound)?,
        warnings: sound.warnings().to_vec(),
    })
}

/// SHA-256 of a file of any size, hexadecimal.
fn digest(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let (mut hash, mut buffer) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(hexadecimal(&hash.finalize())),
            count => hash.update(&buffer[..count]),
        }
    }
}

fn remember(folder: &Path, entry: &Path, digest: &str, heard: &Heard) -> Result<(), FileError> {
    fs::create_dir_all(folder).map_err(FileError::at(folder, "created"))?;
    let payload = (digest, &heard.warnings, &heard.analysis);
    let payload = bincode::serde::encode_to_vec(payload, FORMAT)
        .map_err(io::Error::other)
        .map_err(FileError::at(entry, "written"))?;
    let mut content = MAGIC.to_vec();
    content.extend(VERSION.to_le_bytes());
    content.extend(payload);
    let checksum = Sha256::digest(&content);
    content.extend_from_slice(&checksum);
    replace_file(entry, content)
}

/// What an entry holds; none where it is not there, damaged, of another version or of a sound file
/// with another digest.
fn known(entry: &Path, digest: &str) -> Option<Heard> {
    let length = entry.metadata().ok()?.len();
    if length > (LARGEST + 1024) as u64 {
        return None;
    }
    let content = fs::read(entry).ok()?;
    let (checked, checksum) = content.split_last_chunk::<CHECKSUM>()?;
    if Sha256::digest(checked).as_slice() != checksum {
        return None;
    }
    let (version, payload) = checked.strip_prefix(MAGIC)?.split_first_chunk::<4>()?;
    if u32::from_le_bytes(*version) != VERSION {
        return None;
    }
    let decoded: ((String, Vec<String>, Analysis), usize) =
        bincode::serde::decode_from_slice(payload, FORMAT).ok()?;
    let ((of, warnings, analysis), used) = decoded;
    (used == payload.len() && of == digest && fits(&analysis))
        .then_some(Heard { analysis, warnings })
}

/// Whether all parts have the frames of the samples.
fn fits(analysis: &Analysis) -> bool {
    let frames = analysis.frames();
    let sizes = [
        (analysis.mel.dim(), BANDS),
        (analysis.mfcc.dim(), COEFFICIENTS),
        (analysis.chroma.dim(), PITCH_CLASSES),
    ];
    let Twentieths { mel, flux } = &analysis.twentieths;
    let twentieths = twentieths(analysis.samples);
    frames == analysis.samples / HOP
        && sizes.iter().all(|&(dim, numbers)| dim == (frames, numbers))
        && mel.dim() == (twentieths, MEL_BANDS)
        && flux.dim() == (twentieths, FLUX_BANDS)
}
