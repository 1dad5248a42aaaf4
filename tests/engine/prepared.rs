//! Prepared sets: a folder's motions in one file.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use glam::DVec3;
use keydance::data::choreography::{ChoreographyConfig, write_clips};
use keydance::data::{ClipSource, DataConfig, DataError, DataPart, Dataset, Split, prepare};
use keydance::motion::bvh::{self, Axis, Bvh, channel_layout};
use proptest::prelude::*;
use tempfile::TempDir;

use crate::dance_clip::turning_clip;

fn go_on(_done: usize, _all: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn config() -> DataConfig {
    DataConfig {
        split: Split::Share(0.8),
        validation_share: 0.3,
        ..DataConfig::default()
    }
}

/// Dances, one at another rate and one with a joint that is translated, and a file of them.
fn folder() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let dances = folder.path().join("dances");
    std::fs::create_dir(&dances).unwrap();
    let choreography = ChoreographyConfig {
        clips: 5,
        frames_per_clip: 40,
        seed: 3,
    };
    write_clips(&choreography, false, &dances)
        .unwrap()
        .for_each(|file| drop(file.unwrap()));
    let mut moved = turning_clip("moved.bvh", 30, |frame| {
        (DVec3::new(frame as f64, 90.0, 0.0), 0.05 * frame as f64)
    });
    moved.frame_time = 1.0 / 60.0;
    for (frame, pose) in moved.poses.iter_mut().enumerate() {
        pose.translations[4].y += 0.1 * frame as f64;
    }
    let layout = channel_layout(&moved, [Axis::Z, Axis::X, Axis::Y]);
    let document = Bvh::from_clip(&moved, layout).unwrap();
    bvh::write(&dances.join("moved.bvh"), &document).unwrap();
    let file = folder.path().join("dances.prepared");
    let prepared = prepare(&dances, &config(), &file, &mut go_on);
    let prepared = prepared.unwrap().unwrap();
    assert_eq!((prepared.clips, prepared.frames), (6, 5 * 40 + 15));
    assert_eq!(prepared.bytes, std::fs::metadata(&file).unwrap().len());
    (folder, file)
}

fn dances(folder: &TempDir) -> PathBuf {
    folder.path().join("dances")
}

fn problem(path: &Path, config: &DataConfig) -> String {
    let read = Dataset::load(path, config);
    let read = read.and_then(|_| Dataset::load_to_train(path, config));
    match read {
        Err(error) => error.to_string(),
        Ok(_) => "none".into(),
    }
}

#[test]
fn a_prepared_set_is_the_folder_to_the_bit() {
    let (folder, file) = folder();
    let [read, prepared] = [dances(&folder), file].map(|it| Dataset::load(&it, &config()).unwrap());
    assert_eq!(read, prepared);
    assert_eq!((read.train.len(), read.validation.len()), (3, 1));
}

#[test]
fn the_same_motion_twice_is_told_where_it_is_prepared() {
    let (folder, file) = folder();
    let dances = dances(&folder);
    std::fs::copy(dances.join("moved.bvh"), dances.join("again.bvh")).unwrap();
    let again = prepare(&dances, &config(), &file, &mut go_on);
    let warnings = again.unwrap().unwrap().warnings;
    let said = "again.bvh and moved.bvh are the same motion";
    assert!(
        warnings.iter().any(|warning| warning == said),
        "{warnings:?}"
    );
}

#[test]
fn clips_that_stay_in_the_file_have_the_folders_poses_and_sizes() {
    let (folder, file) = folder();
    let read = Dataset::load(&dances(&folder), &config()).unwrap();
    let stays = Dataset::load_to_train(&file, &config()).unwrap();
    assert!(stays.train.is_empty() && stays.test.is_empty());
    assert_eq!(stays.digest, read.digest);
    assert_eq!(stays.warnings, read.warnings);
    assert_eq!(stays.validation, read.validation);
    for part in [DataPart::Train, DataPart::Validation, DataPart::Test] {
        assert_eq!(stays.size(part), read.size(part), "{part}");
    }
    let pairs = read
        .training_clips()
        .into_iter()
        .zip(stays.training_clips());
    for (held, stored) in pairs {
        assert!(matches!(stored, ClipSource::Stored(_)));
        assert_eq!(held.name(), stored.name());
        assert_eq!(held.skeleton(), stored.skeleton());
        assert_eq!(held.frame_time().to_bits(), stored.frame_time().to_bits());
        assert_eq!(held.frames(), stored.frames());
        assert_eq!(held.whole().unwrap(), stored.whole().unwrap());
        for frames in [0..0, 0..1, 3..9, held.frames() - 1..held.frames()] {
            let [held, stored] = [&held, &stored].map(|it| it.poses(frames.clone()).unwrap());
            assert_eq!(held, stored);
        }
    }
}

#[test]
fn what_splits_and_measures_may_change_and_what_makes_poses_may_not() {
    let (_folder, file) = folder();
    let other = DataConfig {
        split: Split::Share(0.5),
        contact_threshold: 0.3,
        facing_sigma: 5.0,
        ..DataConfig::default()
    };
    assert_eq!(problem(&file, &other), "none");
    let faster = DataConfig {
        fps: 60.0,
        ..config()
    };
    let says = problem(&file, &faster);
    assert!(
        says.contains("data.fps = 30.0, and the config has 60.0"),
        "{says}"
    );
    let cut = DataConfig {
        skip_frames: 2,
        ..config()
    };
    let says = problem(&file, &cut);
    assert!(
        says.contains("data.skip_frames = (default), and the config has 2"),
        "{says}"
    );
    let music = DataConfig {
        music: true,
        ..config()
    };
    let says = problem(&file, &music);
    assert!(
        says.contains("data.music = true: give the folder"),
        "{says}"
    );
}

#[test]
fn a_folder_of_music_is_not_prepared_without_it() {
    let (folder, _) = folder();
    let music = DataConfig {
        split: Split::MusicDance,
        ..config()
    };
    let file = folder.path().join("other");
    let refused = prepare(&dances(&folder), &music, &file, &mut go_on);
    assert!(matches!(refused, Err(DataError::Prepared { .. })));
    assert!(!file.exists());
}

#[test]
fn a_clip_that_cannot_be_read_leaves_no_file() {
    let (folder, _) = folder();
    std::fs::write(dances(&folder).join("zz.bvh"), "no BVH").unwrap();
    let file = folder.path().join("other");
    let refused = prepare(&dances(&folder), &config(), &file, &mut go_on);
    assert!(matches!(refused, Err(DataError::Bvh(_))));
    let mut left = std::fs::read_dir(folder.path()).unwrap();
    assert!(left.all(|it| !it.unwrap().file_name().to_string_lossy().contains("other")));
}

#[test]
fn one_that_is_stopped_leaves_no_file() {
    let (folder, _) = folder();
    let file = folder.path().join("other");
    let mut stop = |done: usize, all: usize| {
        assert!(done > 0 && all == 6);
        ControlFlow::Break(())
    };
    let stopped = prepare(&dances(&folder), &config(), &file, &mut stop).unwrap();
    assert_eq!(stopped, None);
    let mut left = std::fs::read_dir(folder.path()).unwrap();
    assert!(left.all(|it| !it.unwrap().file_name().to_string_lossy().contains("other")));
}

#[test]
fn what_a_killed_process_left_is_taken_away_and_what_a_living_one_writes_stays() {
    let (folder, file) = folder();
    let beside = |name: &str| folder.path().join(name);
    let (left, other) = (
        beside(".dances.prepared.1.partial"),
        beside(".other.1.partial"),
    );
    let living = beside(".dances.prepared.2.partial");
    for path in [&left, &living, &other] {
        std::fs::write(path, "frames").unwrap();
    }
    let lock = std::fs::File::open(&living).unwrap();
    lock.try_lock().unwrap();
    let prepared = prepare(&dances(&folder), &config(), &file, &mut go_on);
    assert!(prepared.unwrap().is_some());
    let there = [&left, &living, &other].map(|path| path.exists());
    assert_eq!(there, [false, true, true]);
}

#[test]
fn a_prepared_set_is_not_prepared_again() {
    let (folder, file) = folder();
    let again = prepare(&file, &config(), &folder.path().join("again"), &mut go_on);
    let says = again.err().unwrap().to_string();
    assert!(says.contains("it is prepared already"), "{says}");
}

#[test]
fn a_file_that_is_written_to_after_it_was_opened_is_read_no_further() {
    let (_folder, file) = folder();
    let read = Dataset::load_to_train(&file, &config()).unwrap();
    let clips = read.training_clips();
    assert!(clips[0].poses(0..2).is_ok());
    let mut bytes = std::fs::read(&file).unwrap();
    bytes.push(0);
    std::fs::write(&file, bytes).unwrap();
    let says = clips[0].poses(0..2).err().unwrap().to_string();
    assert!(
        says.contains("it was written to since it was opened"),
        "{says}"
    );
}

#[test]
fn a_file_that_is_no_prepared_set_says_what_to_give() {
    let (folder, _) = folder();
    for content in ["", "HIERARCHY\n", &"x".repeat(500)] {
        let file = folder.path().join("text");
        std::fs::write(&file, content).unwrap();
        let says = problem(&file, &config());
        assert!(says.contains("it is no prepared set"), "{says}");
    }
}

#[test]
fn a_damaged_clip_is_named_and_other_clips_still_are_read() {
    let (_folder, file) = folder();
    let mut bytes = std::fs::read(&file).unwrap();
    bytes[100] ^= 1;
    std::fs::write(&file, bytes).unwrap();
    let says = problem(&file, &config());
    assert!(says.contains("choreography_000"), "{says}");
    assert!(says.contains("is damaged: prepare it again"), "{says}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn no_damage_is_taken_for_poses(place: prop::sample::Index, bit in 0u8..8, cut: bool) {
        let (_folder, file) = folder();
        let mut bytes = std::fs::read(&file).unwrap();
        let place = place.index(bytes.len());
        match cut {
            true => bytes.truncate(place),
            false => bytes[place] ^= 1 << bit,
        }
        std::fs::write(&file, bytes).unwrap();
        prop_assert_ne!(problem(&file, &config()), "none");
    }
}
