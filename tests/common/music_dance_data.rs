//! Where the dances with music lie.

use std::path::PathBuf;

use crate::real_data::dance_folder;

/// The folder `music_dance` beside the dance clips.
pub fn music_dance_folder() -> Option<PathBuf> {
    let folder = dance_folder()?.join("../music_dance");
    if folder.is_dir() {
        Some(folder)
    } else {
        eprintln!("skipped: no dances with music in {}", folder.display());
        None
    }
}
