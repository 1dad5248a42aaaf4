//! The BVH files of a data folder.

use std::collections::BTreeMap;
use std::fs::DirEntry;
use std::path::{Path, PathBuf};

use super::dataset::DataError;

/// How deep clips are looked for that are not read.
const DEEPEST: usize = 6;

/// Folder of the dances in a data folder that keeps their music beside it.
const DANCES: &str = "motion";

/// The folder whose files are the clips: the data folder, or its `motion` where it has none itself.
fn dances(folder: &Path) -> Result<PathBuf, DataError> {
    let below = folder.join(DANCES);
    let has_clips =
        |folder: &Path| entries(folder).map(|it| it.iter().any(|it| is_clip(&it.path())));
    Ok(
        match !has_clips(folder)? && below.is_dir() && has_clips(&below)? {
            true => below,
            false => folder.into(),
        },
    )
}

/// The BVH files in a folder, or in its `motion`, by their names, sorted bytewise. A name that is
/// not UTF-8 has U+FFFD in place of what is not.
pub(crate) fn clip_files(folder: &Path) -> Result<BTreeMap<String, PathBuf>, DataError> {
    let folder = &dances(folder)?;
    let mut files = BTreeMap::new();
    for path in entries(folder)?.iter().map(DirEntry::path) {
        if !is_clip(&path) {
            continue;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if files.insert(name.to_string(), path.clone()).is_some() {
            let name = name.into_owned();
            return Err(DataError::SameName { name });
        }
    }
    if !files.is_empty() {
        return Ok(files);
    }
    let below = clips_below(folder, DEEPEST);
    Err(match below.first() {
        Some(first) => DataError::ClipsBelow {
            folder: folder.into(),
            clips: below.len(),
            first: first.clone(),
        },
        None => DataError::NoClips {
            folder: folder.into(),
        },
    })
}

/// A warning about BVH files in folders inside a folder.
pub(super) fn left_out(folder: &Path) -> Option<String> {
    let folder = &dances(folder).ok()?;
    let below = clips_below(folder, DEEPEST);
    let first = below.first()?;
    Some(format!(
        "{} .bvh files in folders inside {} are left out, the first is {}",
        below.len(),
        folder.display(),
        first.display()
    ))
}

/// The BVH files in folders inside a folder, by path. What cannot be read has none.
fn clips_below(folder: &Path, depth: usize) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let inside = entries(folder).unwrap_or_default();
    // A link is not followed, so there is no way round in circles.
    let is_folder = |entry: &&DirEntry| entry.file_type().is_ok_and(|kind| kind.is_dir());
    for entry in inside.iter().filter(is_folder) {
        let clips = entries(&entry.path()).unwrap_or_default();
        found.extend(
            clips
                .iter()
                .map(DirEntry::path)
                .filter(|path| is_clip(path)),
        );
        if depth > 1 {
            found.extend(clips_below(&entry.path(), depth - 1));
        }
    }
    found.sort_unstable();
    found
}

/// Whether a data folder reads a file as a clip.
pub(crate) fn is_clip(path: &Path) -> bool {
    let hidden = path.file_name().unwrap_or_default().to_string_lossy();
    let is_bvh = |end: &std::ffi::OsStr| end.eq_ignore_ascii_case("bvh");
    path.extension().is_some_and(is_bvh) && !hidden.starts_with('.') && !path.is_dir()
}

pub(super) fn entries(folder: &Path) -> Result<Vec<DirEntry>, DataError> {
    let unreadable = |source| DataError::Folder {
        folder: folder.into(),
        source,
    };
    let entries = std::fs::read_dir(folder).map_err(unreadable)?;
    entries.collect::<Result<_, _>>().map_err(unreadable)
}
