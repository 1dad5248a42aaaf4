//! What a data folder says of its own clips: `split.json`, and `novel.json` with frames that have a
//! name.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::dataset::{DataError, NamedFrames};
use super::split::Parts;

/// Largest file of this kind, bytes.
const LARGEST: u64 = 1 << 24;

/// Frames a second that `novel.json` counts by.
const FRAME_RATE: f64 = 30.0;

/// Names without ending.
#[derive(Deserialize)]
struct Listed {
    train: Vec<String>,
    validation: Vec<String>,
    test: Vec<String>,
}

fn read<T: DeserializeOwned>(path: &Path) -> Result<T, DataError> {
    let unreadable = |source| DataError::File {
        path: path.into(),
        source,
    };
    let problem = |problem: String| DataError::Listed {
        path: path.into(),
        problem,
    };
    if std::fs::metadata(path).map_err(unreadable)?.len() > LARGEST {
        return Err(problem(format!("it has more than {LARGEST} bytes")));
    }
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    serde_json::from_str(&text).map_err(|error| problem(error.to_string()))
}

/// The parts that `split.json` lists, as names of BVH files.
///
/// # Errors
/// The file cannot be read, or lists no such parts.
pub(super) fn parts(folder: &Path) -> Result<Parts, DataError> {
    let path = folder.join("split.json");
    if !path.is_file() {
        return Err(DataError::Split {
            config: "split = \"music_dance\"".into(),
            origin: format!("the data folder {}", folder.display()),
            found: "has no split.json; give the folder that holds motion and audio, or for other \
                    data set data.split = { share = 0.8 }"
                .into(),
        });
    }
    let listed: Listed = read(&path)?;
    let files = |names: Vec<String>| names.iter().map(|name| format!("{name}.bvh")).collect();
    Ok(Parts {
        train: files(listed.train),
        validation: files(listed.validation),
        test: files(listed.test),
    })
}

/// The same where every clip is there.
///
/// # Errors
/// One is not.
pub(super) fn among(parts: Parts, names: &[String], origin: &str) -> Result<Parts, DataError> {
    let all = [&parts.train, &parts.validation, &parts.test];
    let missing = |name: &&String| names.binary_search(name).is_err();
    let missing = all.into_iter().flatten().find(missing).cloned();
    if let Some(name) = missing {
        return Err(DataError::Split {
            config: "split = \"music_dance\"".into(),
            origin: origin.into(),
            found: format!("has no {name}, which its split.json lists"),
        });
    }
    Ok(parts)
}

/// Frames by name and clip, at `fps` frames a second: "novel", of `novel.json`, are those of poses
/// that no training clip has.
///
/// # Errors
/// The file is there and is none.
pub(super) fn named_frames(
    folder: &Path,
    fps: f64,
) -> Result<BTreeMap<String, NamedFrames>, DataError> {
    let path = folder.join("novel.json");
    if !path.is_file() {
        return Ok(BTreeMap::new());
    }
    let novel: BTreeMap<String, Vec<[usize; 2]>> = read(&path)?;
    let novel = novel.into_iter().map(|(name, ranges)| {
        // The first frame that is not before the file's.
        let frame = |frame: usize| (frame as f64 * (fps / FRAME_RATE) - 1e-9).ceil() as usize;
        let ranges = ranges
            .into_iter()
            .map(|[first, end]| frame(first)..frame(end));
        (format!("{name}.bvh"), ranges.collect())
    });
    Ok(BTreeMap::from([("novel".into(), novel.collect())]))
}
