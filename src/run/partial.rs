//! A file that is being written, until it is whole.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Ends the name of a file that is not whole.
const ENDING: &str = ".partial";
/// Letters of the whole file's name in its name, which may be no longer than names can be.
const LETTERS: usize = 60;

/// Beside the file that it becomes, under a name of its own, and locked while its process lives.
pub(crate) struct Partial {
    path: PathBuf,
    _lock: File,
}

impl Partial {
    /// Makes one, and takes those away that a process which was killed left of the same file.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn of(whole: &Path) -> io::Result<(Self, File)> {
        static MADE: AtomicU64 = AtomicU64::new(0);
        let name = whole.file_name().unwrap_or_default().to_string_lossy();
        let start: String = name.chars().take(LETTERS).collect();
        let start = format!(".{start}.");
        let folder = match whole.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let number = name.strip_prefix(&start);
            let number = number.and_then(|it| it.strip_suffix(ENDING));
            let of_number = |byte: u8| byte.is_ascii_digit() || byte == b'-';
            if number.is_some_and(|it| it.bytes().all(of_number)) {
                take_away(&entry.path());
            }
        }
        let (process, number) = (std::process::id(), MADE.fetch_add(1, Ordering::Relaxed));
        let path = folder.join(format!("{start}{process}-{number}{ENDING}"));
        let file = File::create_new(&path)?;
        // Where a file system has no locks, nothing is taken away either.
        let _ = file.try_lock();
        let partial = Self {
            path,
            _lock: file.try_clone()?,
        };
        Ok((partial, file))
    }

    /// Whether this is the name of one.
    pub fn is_name(name: &str) -> bool {
        name.starts_with('.') && name.ends_with(ENDING)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// It cannot be renamed.
    pub fn become_whole(self, whole: &Path) -> io::Result<()> {
        fs::rename(&self.path, whole)
    }
}

impl Drop for Partial {
    /// What is left of it takes room on a full disk.
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// Removes a file that no process has locked.
fn take_away(path: &Path) {
    if File::open(path).is_ok_and(|file| file.try_lock().is_ok()) {
        let _ = fs::remove_file(path);
    }
}
