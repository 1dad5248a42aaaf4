//! Prepared sets: the motions of a data folder in one file, read as windows are asked for.
//!
//! ```text
//! magic "KDPOSES\0" | format version, u32 | clips one after the other | contents, bincode |
//! contents' SHA-256 | where the contents begin, u64
//! ```
//!
//! A clip is its frames one after the other, f64: the root's translation (cm) or, where other
//! joints are translated too, those of all joints, then the rotations of all joints as x, y, z, w.
//! All numbers are little-endian, so that poses are those of the folder to the bit.

mod contents;
mod stored;
mod write;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;

use self::contents::{Contents, Preparation};
use self::stored::{PreparedFile, stored};
pub use self::stored::{Stored, StoredClip};
pub use self::write::{Prepared, prepare};
use super::config::{DataConfig, Split};
use super::dataset::{DataError, Dataset, ReadClip, Recording};

const MAGIC: &[u8; 8] = b"KDPOSES\0";
const VERSION: u32 = 1;
/// Bytes of the digest and the place of the contents at the end of the file.
const END: usize = 40;

/// Reads a prepared set as the folder that it was made of: with `stays` the training clips stay in
/// the file, and those that test are left out.
///
/// # Errors
/// The file cannot be read, is none or damaged, or was prepared otherwise than the config says.
pub(super) fn load(path: &Path, config: &DataConfig, stays: bool) -> Result<Dataset, DataError> {
    check_motions_alone(config, path, "give the folder")?;
    let (contents, clips) = open(path)?;
    contents.preparation.check(&Preparation::of(config), path)?;
    let origin = format!("the prepared set {}", path.display());
    let mut dataset = match stays {
        true => Dataset::assemble_stored(&clips, &origin, config)?,
        false => {
            let names: Vec<String> = clips.keys().cloned().collect();
            let mut dataset = Dataset::assemble(&names, &origin, config, None, |name, _| {
                let clip = &clips[name];
                Ok(ReadClip {
                    recording: Recording::of(clip.whole()?),
                    digest: clip.source_digest().into(),
                    notices: Vec::new(),
                })
            })?;
            dataset.warnings.extend(dataset.twins()?);
            dataset
        }
    };
    dataset.warnings.splice(0..0, contents.warnings);
    Ok(dataset)
}

/// What a prepared set says of itself, and its clips by name.
fn open(path: &Path) -> Result<(Contents, BTreeMap<String, StoredClip>), DataError> {
    let file = Arc::new(PreparedFile::open(path)?);
    let mut contents = file.contents()?;
    let entries = std::mem::take(&mut contents.clips).into_iter();
    let clips = entries.map(|entry| {
        let clip = stored(entry, &file)?;
        Ok((clip.name().to_string(), clip))
    });
    let clips = clips.collect::<Result<_, DataError>>()?;
    Ok((contents, clips))
}

/// Whether a file begins as a prepared set does.
pub fn is_prepared(path: &Path) -> bool {
    let mut start = [0; MAGIC.len()];
    let file = path.is_file().then(|| File::open(path));
    let read = file.and_then(|file| file.ok()?.read_exact(&mut start).ok());
    read.is_some() && start == *MAGIC
}

/// Refuses data of which a prepared set holds less: it has no music, and no lists of a data set's
/// own. `advice` says what to do.
fn check_motions_alone(config: &DataConfig, path: &Path, advice: &str) -> Result<(), DataError> {
    let refused = |what: &str| {
        Err(DataError::Prepared {
            path: path.into(),
            problem: format!(
                "prepared sets hold motions alone, and the config says {what}: {advice}"
            ),
        })
    };
    match config.split {
        _ if config.music => refused("data.music = true"),
        Split::MusicDance => refused("data.split = \"music_dance\""),
        Split::Motorica => refused("data.split = \"motorica\""),
        Split::Mixed => refused("data.split = \"mixed\""),
        _ => Ok(()),
    }
}
