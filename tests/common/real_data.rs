//! Where the real clips lie, for tests that use them where they are there.

use std::path::{Path, PathBuf};

/// The folder of the dance clips: `KEYDANCE_DATA`, or `../shared/data/dance`. Says so when there is
/// neither.
pub fn dance_folder() -> Option<PathBuf> {
    let folder = match std::env::var_os("KEYDANCE_DATA") {
        Some(folder) => PathBuf::from(folder),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/dance"),
    };
    if folder.is_dir() {
        Some(folder)
    } else {
        eprintln!(
            "skipped: no dance clips in {}; set KEYDANCE_DATA to their folder",
            folder.display()
        );
        None
    }
}
