//! Which clips train, validate and test.

use std::collections::HashSet;

use super::config::{DataConfig, Split};
use super::dataset::{DataError, Dataset};
use super::part::DataPart;
use crate::counted::counted;

/// What the paper's split must hold: clips and frames for training, clips and frames for testing.
const DANCE_TRAIN: (usize, usize) = (98, 93_347);
const DANCE_TEST: (usize, usize) = (25, 20_879);

/// The subject whose clips test.
const LAFAN1_TEST: &str = "subject5";
/// LaFAN1 in full: files that train, files that test, frames of all.
const LAFAN1: (usize, usize, usize) = (64, 13, 496_672);

/// Names of the files of each part.
#[derive(Debug, PartialEq)]
pub(super) struct Parts {
    pub train: Vec<String>,
    pub validation: Vec<String>,
    pub test: Vec<String>,
}

/// Splits clips, given by name and sorted bytewise; `origin` is what errors call where they come
/// from.
pub(super) fn split(
    names: &[String],
    origin: &str,
    config: &DataConfig,
) -> Result<Parts, DataError> {
    let misfit = |config: String, found: String| DataError::Split {
        config,
        origin: origin.into(),
        found,
    };
    let fault = |key, value: String, expected| DataError::Config {
        key,
        value,
        expected,
    };
    if !(0.0..1.0).contains(&config.validation_share) {
        let (value, expected) = (config.validation_share, "a share of at least 0 and below 1");
        return Err(fault("validation_share", value.to_string(), expected));
    }
    let mut listed = Vec::new();
    let (train, test) = match &config.split {
        Split::Dance | Split::UnseenDancers(_) if names.len() != DANCE_TRAIN.0 + DANCE_TEST.0 => {
            let clips = DANCE_TRAIN.0 + DANCE_TEST.0;
            let found = format!(
                "holds {}; for other data, set data.split = {{ share = 0.8 }}",
                names.len()
            );
            return Err(misfit(
                format!("the dance split, which has {clips} clips"),
                found,
            ));
        }
        Split::Dance => cut(names, DANCE_TRAIN.0),
        Split::UnseenDancers(dancers) => {
            let (train, _) = cut(names, DANCE_TRAIN.0);
            for dancer in dancers {
                if !train.iter().any(|name| dancer_of(name) == dancer) {
                    let found = "has no such clip among the dance split's training clips";
                    return Err(misfit(format!("that clips show {dancer}"), found.into()));
                }
            }
            let (test, train): (Vec<_>, Vec<_>) = train
                .into_iter()
                .partition(|name| dancers.iter().any(|dancer| dancer_of(name) == dancer));
            if train.is_empty() || test.is_empty() {
                let (value, expected) = (
                    format!("{dancers:?}"),
                    "at least one dancer, and not all of them",
                );
                return Err(fault("split.unseen_dancers", value, expected));
            }
            (train, test)
        }
        Split::Lafan1 => {
            let is_test = |name: &String| subject_of(name) == Some(LAFAN1_TEST);
            let (test, train): (Vec<_>, Vec<_>) = names.iter().cloned().partition(is_test);
            if train.is_empty() || test.is_empty() {
                let found = format!(
                    "has {} of {LAFAN1_TEST} and {} of others by their names",
                    counted(test.len(), "clip"),
                    train.len()
                );
                let config = "split = \"lafan1\", which trains on theme_subject1.bvh to \
                              theme_subject4.bvh and tests on theme_subject5.bvh";
                return Err(misfit(config.into(), found));
            }
            (train, test)
        }
        // Only a data folder has the file that lists them.
        Split::MusicDance => {
            let found = "is no folder with a split.json".to_string();
            return Err(misfit("split = \"music_dance\"".into(), found));
        }
        Split::Motorica => {
            let found = "is no folder with a split.csv".to_string();
            return Err(misfit("split = \"motorica\"".into(), found));
        }
        Split::Mixed => {
            let found = "is no folder of folders".to_string();
            return Err(misfit("split = \"mixed\"".into(), found));
        }
        Split::Share(share) => {
            if !(*share > 0.0 && *share < 1.0) {
                let expected = "a share above 0 and below 1";
                return Err(fault("split.share", share.to_string(), expected));
            }
            let count = floor(names.len() as f64 * share);
            if count == 0 {
                let found = format!("holds {}, which leaves none for training", names.len());
                return Err(misfit(format!("split = {{ share = {share} }}"), found));
            }
            cut(names, count)
        }
        Split::List {
            train,
            validation,
            test,
        } => {
            let mut seen = HashSet::new();
            for name in train.iter().chain(validation).chain(test) {
                if !seen.insert(name) {
                    let expected = "file names that are each in one list, once";
                    return Err(fault("split.list", name.clone(), expected));
                }
                if !names.contains(name) {
                    let found = format!(
                        "does not have it among its {}",
                        counted(names.len(), "clip")
                    );
                    return Err(misfit(format!("that {name} is in the split"), found));
                }
            }
            listed = validation.clone();
            (train.clone(), test.clone())
        }
    };
    let (train, mut validation) = set_aside(train, config.validation_share);
    validation.append(&mut listed);
    Ok(Parts {
        train,
        validation,
        test,
    })
}

/// The dancer of a clip of the paper's data set: what stands before the first "_" of its name.
fn dancer_of(name: &str) -> &str {
    name.split('_').next().unwrap_or(name)
}

/// The subject of a clip of LaFAN1: what stands after the last "_" of its name.
fn subject_of(name: &str) -> Option<&str> {
    let stem = name.strip_suffix(".bvh").unwrap_or(name);
    stem.rsplit_once('_').map(|(_, subject)| subject)
}

/// The rule that gives the paper's training frames: number the sorted names from 1, sort
/// `"{number}_{name}"` bytewise, the first `count` train.
fn cut(names: &[String], count: usize) -> (Vec<String>, Vec<String>) {
    let mut numbered: Vec<(String, &String)> = names
        .iter()
        .enumerate()
        .map(|(index, name)| (format!("{}_{name}", index + 1), name))
        .collect();
    numbered.sort_unstable();
    let mut train: Vec<String> = numbered.into_iter().map(|(_, name)| name.clone()).collect();
    let test = train.split_off(count);
    (train, test)
}

/// Takes a share of the training clips for validation, evenly spread over them: neighbours are
/// often the same dancer's.
fn set_aside(clips: Vec<String>, share: f64) -> (Vec<String>, Vec<String>) {
    let (validation, train): (Vec<_>, Vec<_>) = clips
        .into_iter()
        .enumerate()
        .partition(|(index, _)| floor((index + 1) as f64 * share) > floor(*index as f64 * share));
    let names = |part: Vec<(usize, String)>| part.into_iter().map(|(_, name)| name).collect();
    (names(train), names(validation))
}

/// Rounds down, but forgives what a share such as 0.29 lacks in binary.
fn floor(number: f64) -> usize {
    (number + 1e-9).floor() as usize
}

/// What is to be known of a part of LaFAN1: how much of it is there.
pub(super) fn lafan1_warning(dataset: &Dataset, config: &DataConfig) -> Option<String> {
    let (train, test, frames) = LAFAN1;
    let [(train_found, known), (test_found, tested)] = known_and_tested(dataset);
    let found = known + tested;
    let whole = (train_found, test_found, found) == (train, test, frames);
    (config.split == Split::Lafan1 && !whole).then(|| {
        format!(
            "LaFAN1 has {train} training and {test} test clips of {frames} frames, this folder \
             {train_found} and {test_found} of {found}: its scores are not the benchmark's"
        )
    })
}

/// Clips and frames that train, validate and test: of the 43 dances with music at 30 and at 20
/// frames a second, of the Motorica subset.
const MUSIC_DANCE: [(usize, usize); 3] = [(32, 60_749), (4, 9_160), (7, 14_341)];
const MUSIC_DANCE_20: [(usize, usize); 3] = [(32, 40_500), (4, 6_108), (7, 9_560)];
const MOTORICA: [(usize, usize); 3] = [(4, 6_720), (4, 1_200), (5, 3_653)];

/// Checks clips and frames of a split that a file of the data lists.
pub(super) fn check_frames(
    dataset: &Dataset,
    origin: &str,
    config: &DataConfig,
) -> Result<(), DataError> {
    let (name, expected) = match config.split {
        Split::MusicDance if config.fps == 20.0 => ("music_dance", MUSIC_DANCE_20),
        Split::MusicDance => ("music_dance", MUSIC_DANCE),
        Split::Motorica => ("motorica", MOTORICA),
        _ => return Ok(()),
    };
    let parts = [DataPart::Train, DataPart::Validation, DataPart::Test];
    let found = parts.map(|part| dataset.size(part));
    if found == expected {
        return Ok(());
    }
    let said = |parts: [(usize, usize); 3]| {
        let parts = parts.map(|(clips, frames)| format!("{clips} / {frames}"));
        format!(
            "{} clips / frames to train, validate and test",
            parts.join(", ")
        )
    };
    Err(DataError::Split {
        config: format!("split = \"{name}\", which has {}", said(expected)),
        origin: origin.into(),
        found: format!(
            "gives {}; for other data, set data.split = {{ share = 0.8 }}",
            said(found)
        ),
    })
}

/// Checks the frame counts of the paper's split.
pub(super) fn check_dance_frames(
    dataset: &Dataset,
    origin: &str,
    config: &DataConfig,
) -> Result<(), DataError> {
    let [(_, known), (_, tested)] = known_and_tested(dataset);
    let found = (known, tested);
    let expected = (DANCE_TRAIN.1, DANCE_TEST.1);
    if config.split == Split::Dance && found != expected {
        return Err(DataError::Split {
            config: format!(
                "split = \"dance\" at {} fps, which has {} training and {} test frames",
                config.fps, expected.0, expected.1
            ),
            origin: origin.into(),
            found: format!(
                "gives {} and {}; for other data, set data.split = {{ share = 0.8 }}",
                found.0, found.1
            ),
        });
    }
    Ok(())
}

/// Clips and frames that train or validate, and that test.
fn known_and_tested(dataset: &Dataset) -> [(usize, usize); 2] {
    let [train, validation, test] =
        [DataPart::Train, DataPart::Validation, DataPart::Test].map(|part| dataset.size(part));
    [(train.0 + validation.0, train.1 + validation.1), test]
}
