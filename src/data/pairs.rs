//! Dances with their music: pairs of files of one name.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::dataset::{DataError, Recording};
use super::folder::entries;
use crate::counted::counted;
use crate::music::{Analysis, Cache, FRAME_RATE, HOP};

/// Folder of the sound files in a data folder; where it is not there they lie beside the dances.
const SOUNDS: &str = "audio";
const ENDINGS: [&str; 4] = ["wav", "flac", "mp3", "ogg"];

/// The sound files of a data folder by what stands before their ending.
///
/// # Errors
/// The folder cannot be read; two files of one name.
pub(crate) fn sound_files(folder: &Path) -> Result<BTreeMap<String, PathBuf>, DataError> {
    let own = folder.join(SOUNDS);
    let folder = if own.is_dir() { &own } else { folder };
    let mut files: BTreeMap<String, PathBuf> = BTreeMap::new();
    for path in entries(folder)?.iter().map(std::fs::DirEntry::path) {
        let ending = path.extension().unwrap_or_default().to_string_lossy();
        if !ENDINGS.iter().any(|it| ending.eq_ignore_ascii_case(it)) || path.is_dir() {
            continue;
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        if let Some(first) = files.get(&*name) {
            return Err(DataError::TwoSounds {
                first: first.clone(),
                second: path,
            });
        }
        files.insert(name.to_string(), path);
    }
    Ok(files)
}

/// The sound file of a dance's name beside it, or in the folder of sounds beside its own.
pub fn music_beside(dance: &Path) -> Option<PathBuf> {
    let (folder, stem) = (dance.parent()?, dance.file_stem()?);
    let folders = [folder.to_path_buf(), folder.join("..").join(SOUNDS)];
    let files = folders.iter().flat_map(|folder| {
        ENDINGS.iter().map(move |ending| {
            let mut name = stem.to_os_string();
            name.push(".");
            name.push(ending);
            folder.join(name)
        })
    });
    files.into_iter().find(|file| file.is_file())
}

/// What is heard in the sound file of a dance; `None` where there is none of its name.
pub(crate) fn sound_of<'f>(
    dance: &str,
    sounds: &'f BTreeMap<String, PathBuf>,
) -> Option<&'f PathBuf> {
    let stem = Path::new(dance).file_stem()?.to_string_lossy();
    sounds.get(&*stem)
}

/// A recording with the music that is heard in a file, and what is odd about the file.
///
/// # Errors
/// The file is no sound, or shorter than the dance by more than a frame.
pub(super) fn with_music(
    recording: Recording,
    sound: &Path,
    cache: &Cache,
) -> Result<(Recording, Vec<String>), DataError> {
    let heard = cache.analysis(sound)?;
    let music = Arc::new(heard.analysis);
    check_length(&recording, &music, sound)?;
    let recording = Recording {
        music: Some(music),
        ..recording
    };
    Ok((recording, heard.warnings))
}

fn check_length(recording: &Recording, music: &Analysis, sound: &Path) -> Result<(), DataError> {
    let clip = &recording.clip;
    let frames = (clip.poses.len() as f64 * clip.frame_time * FRAME_RATE).round() as usize;
    match music.frames() + 1 < frames {
        false => Ok(()),
        true => Err(DataError::ShortMusic {
            dance: recording.name().into(),
            frames: counted(frames, "frame"),
            sound: sound.into(),
            heard: counted(music.samples / HOP, "frame"),
        }),
    }
}
