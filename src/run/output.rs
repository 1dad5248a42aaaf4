//! Files and folders that a user names to be written: none that the command reads, none that a run
//! consists of, and none that is there already unless the user insists.

use std::fs;
use std::path::{Path, PathBuf};

use same_file::Handle;

use super::error::RunError;
use super::folder::RunFolder;
use crate::counted::counted;
use crate::data::{clip_files, is_clip};

/// Refuses files that a command must not write, before it writes any. `inputs` are the files that
/// it reads, and the folders of clips; `force` allows to replace other files.
///
/// # Errors
/// A file is an input by whatever name or link, would be a clip of a folder that is read, belongs
/// to a run, is a folder or in one that is not there, is named twice, or is there already without
/// `force`.
pub fn check_outputs<'a>(
    files: impl IntoIterator<Item = &'a PathBuf>,
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    force: bool,
) -> Result<(), RunError> {
    check_outputs_beside(None, files, inputs, force)
}

/// The same of a command that makes a folder, `made`, before it writes the files.
///
/// # Errors
/// As [`check_outputs`].
pub fn check_outputs_beside<'a>(
    made: Option<&Path>,
    files: impl IntoIterator<Item = &'a PathBuf>,
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    force: bool,
) -> Result<(), RunError> {
    let inputs: Vec<&PathBuf> = inputs.into_iter().collect();
    let mut names: Vec<String> = Vec::new();
    for file in files {
        let place = place(file);
        let refused = |problem: String| {
            let file = file.display();
            Err(RunError::Refused(format!("{file} {problem}")))
        };
        let names_a_folder = file.to_string_lossy().ends_with(std::path::is_separator);
        if place.is_dir() || names_a_folder {
            return refused("is a folder; name a file in it".into());
        }
        if let Some(folder) = missing_folder(file, made) {
            let folder = folder.display();
            return refused(format!(
                "cannot be written: there is no folder {folder}; make it, or give another file"
            ));
        }
        // What is there and no file is a pipe or a device: nothing is lost.
        if place.exists() && !place.is_file() {
            continue;
        }
        let mut folders = place.ancestors().skip(1);
        if let Some(run) = folders.find(|folder| RunFolder::has_part(folder, &place)) {
            return refused(format!(
                "is a part of the run in {}; give another file to write",
                run.display()
            ));
        }
        if let Some(input) = inputs.iter().find(|input| is_same(&place, input)) {
            return refused(format!(
                "is what the command reads ({}); give another file to write",
                input.display()
            ));
        }
        let gains =
            |input: &&&PathBuf| is_clip(&place) && place.parent() == Some(&self::place(input));
        if let Some(data) = inputs.iter().find(gains) {
            return refused(format!(
                "would be one of the clips in {} from now on; give a file elsewhere",
                data.display()
            ));
        }
        // Where the case is all that differs, some file systems have one file.
        let name = place.to_string_lossy().to_lowercase();
        if names.contains(&name) {
            return refused("is to be written twice; give each output a file of its own".into());
        }
        names.push(name);
        if place.symlink_metadata().is_ok() && !force {
            return refused("is there already; --force replaces it".into());
        }
    }
    Ok(())
}

/// The folder of a file where it is not there and is not on the way to `made`.
fn missing_folder<'a>(file: &'a Path, made: Option<&Path>) -> Option<&'a Path> {
    let folder = file.parent().filter(|folder| *folder != Path::new(""))?;
    let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.into());
    let is_made = made.is_some_and(|made| whole(made).starts_with(whole(folder)));
    (!folder.is_dir() && !is_made).then_some(folder)
}

/// Refuses a folder to write to that holds anything, unless `force`.
///
/// # Errors
/// It is a file, or is not empty without `force`.
pub fn check_output_folder(folder: &Path, force: bool) -> Result<(), RunError> {
    let problem = match fs::read_dir(folder).map(|mut entries| entries.next()) {
        Ok(Some(_)) if !force => "holds files already; --force replaces those of the same names",
        Err(_) if folder.exists() => "is not a folder that can be read; give another one",
        _ => return Ok(()),
    };
    let folder = folder.display();
    Err(RunError::Refused(format!("{folder} {problem}")))
}

/// A warning about a BVH file that is written beside clips which `inputs`, one of them there, leave
/// out: such a folder may be data.
pub fn beside_clips(file: &Path, inputs: &[&PathBuf]) -> Option<String> {
    let place_of_it = place(file);
    let folder = place_of_it.parent().filter(|_| is_clip(file))?;
    let inputs: Vec<PathBuf> = inputs.iter().map(|input| place(input)).collect();
    let others = clip_files(folder)
        .ok()?
        .into_values()
        .map(|clip| place(&clip));
    let others = others
        .filter(|clip| *clip != place_of_it && !inputs.contains(clip))
        .count();
    let beside_input = inputs.iter().any(|input| input.parent() == Some(folder));
    (others > 0 && beside_input).then(|| {
        format!(
            "{} lies beside {}: where their folder is given as --data, it is one of them",
            file.display(),
            counted(others, "other clip")
        )
    })
}

/// Where a path leads, links followed, by a name that all paths to it have in common.
pub(super) fn place(path: &Path) -> PathBuf {
    let new = || {
        let folder = path.parent().filter(|folder| *folder != Path::new(""));
        let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
        Some(folder.join(path.file_name()?))
    };
    let found = path.canonicalize().ok();
    found.or_else(new).unwrap_or_else(|| path.into())
}

/// Whether a file is an input, or a clip in an input that is a folder.
fn is_same(file: &Path, input: &Path) -> bool {
    // Opening a pipe would wait, or take from it.
    let handle = |path: &Path| {
        path.is_file()
            .then(|| Handle::from_path(path).ok())
            .flatten()
    };
    let Some(ours) = handle(file) else {
        return false;
    };
    let is_ours = |path: &Path| handle(path).is_some_and(|theirs| theirs == ours);
    match fs::read_dir(input) {
        Ok(entries) => {
            let mut clips = entries
                .flatten()
                .map(|entry| entry.path())
                .filter(|it| is_clip(it));
            clips.any(|clip| is_ours(&clip))
        }
        Err(_) => is_ours(input),
    }
}
