//! Where the martial-arts clips lie.

use std::path::PathBuf;

use crate::real_data::dance_folder;

/// The folder `martial` beside the dance clips.
pub fn martial_folder() -> Option<PathBuf> {
    let folder = dance_folder()?.join("../martial");
    if folder.is_dir() {
        Some(folder)
    } else {
        eprintln!("skipped: no martial-arts clips in {}", folder.display());
        None
    }
}
