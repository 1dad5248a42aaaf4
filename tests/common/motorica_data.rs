//! Where the Motorica dances lie.

use std::path::PathBuf;

use crate::real_data::dance_folder;

/// The folder `motorica` beside the dance clips.
pub fn motorica_folder() -> Option<PathBuf> {
    let folder = dance_folder()?.join("../motorica");
    if folder.is_dir() {
        Some(folder)
    } else {
        eprintln!("skipped: no Motorica dances in {}", folder.display());
        None
    }
}
