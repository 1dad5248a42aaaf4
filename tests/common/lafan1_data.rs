//! Where the clips of LaFAN1 lie.

use std::path::PathBuf;

use crate::real_data::dance_folder;

/// The folder `lafan1` beside the dance clips.
pub fn lafan1_folder() -> Option<PathBuf> {
    let folder = dance_folder()?.join("../lafan1");
    if folder.is_dir() {
        Some(folder)
    } else {
        eprintln!("skipped: no clips of LaFAN1 in {}", folder.display());
        None
    }
}
