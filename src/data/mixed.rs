//! Several data sets as one: every folder inside a data folder, read as what it is.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use super::config::{DataConfig, Split};
use super::dataset::{DataError, Dataset, Recording, digest};
use super::folder::entries;

/// Share that trains of a set which lists no parts of its own.
const SHARE: f64 = 0.8;

/// The parts of all sets, one after another by their folders' names. A folder with a `split.json`
/// is read as `music_dance`, one with a `split.csv` as `motorica`; of others 0.8 of the clips train.
///
/// # Errors
/// There is no folder; one is no data set; two recordings have one name.
pub(super) fn load(folder: &Path, config: &DataConfig) -> Result<Dataset, DataError> {
    let paths = entries(folder)?.into_iter().map(|entry| entry.path());
    let mut folders: Vec<PathBuf> = paths.filter(|path| path.is_dir()).collect();
    folders.sort_unstable();
    if folders.is_empty() {
        return Err(DataError::Split {
            config: "split = \"mixed\"".into(),
            origin: format!("the data folder {}", folder.display()),
            found: "holds no folder, each of which would be a data set".into(),
        });
    }
    let mut mixed = Dataset::default();
    let mut digests = BTreeMap::new();
    for path in folders {
        let mut set = Dataset::load(&path, &own_config(&path, config))?;
        mixed.train.append(&mut set.train);
        mixed.validation.append(&mut set.validation);
        mixed.test.append(&mut set.test);
        for (name, mut frames) in set.named_frames {
            mixed
                .named_frames
                .entry(name)
                .or_default()
                .append(&mut frames);
        }
        mixed.warnings.append(&mut set.warnings);
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        digests.insert(name.into_owned(), set.digest);
    }
    let all = mixed
        .train
        .iter()
        .chain(&mixed.validation)
        .chain(&mixed.test);
    let mut seen = HashSet::new();
    if let Some(twice) = all.map(Recording::name).find(|name| !seen.insert(*name)) {
        return Err(DataError::SameName { name: twice.into() });
    }
    mixed.digest = digest(digests.iter().map(|(name, it)| (&**name, &**it)));
    Ok(mixed)
}

/// The config that a set is read by.
fn own_config(folder: &Path, config: &DataConfig) -> DataConfig {
    let has = |name: &str| folder.join(name).is_file();
    let (split, music) = if has("split.csv") {
        (Split::Motorica, false)
    } else if has("split.json") {
        (Split::MusicDance, config.music)
    } else {
        (Split::Share(SHARE), config.music)
    };
    DataConfig {
        split,
        music,
        ..config.clone()
    }
}
