//! Folders as data sets: split, digest, windows, standardisation.

use std::f64::consts::PI;
use std::path::Path;

use glam::DVec3;
use keydance::data::{DataConfig, Dataset, Recording, Split};
use keydance::models::transition::{DanceClip, Standardisation, window_features, windows};
use keydance::motion::FeatureConfig;
use keydance::motion::bvh::{self, Axis, Bvh, channel_layout};
use keydance::motion::features::{BODY_POSITIONS, BODY_VELOCITIES, FACING};
use ndarray::{Array2, s};
use sha2::{Digest as _, Sha256};

use crate::dance_clip::turning_clip;
use crate::real_data;

fn write_clip(folder: &Path, name: &str, frames: usize) {
    let clip = turning_clip(name, frames, |frame| {
        (DVec3::new(frame as f64, 90.0, 0.0), 0.05 * frame as f64)
    });
    let document =
        Bvh::from_clip(&clip, channel_layout(&clip, [Axis::Z, Axis::X, Axis::Y])).unwrap();
    bvh::write(&folder.join(name), &document).unwrap();
}

fn names(clips: &[Recording]) -> Vec<&str> {
    clips.iter().map(Recording::name).collect()
}

fn config(split: Split) -> DataConfig {
    DataConfig {
        split,
        ..DataConfig::default()
    }
}

#[test]
fn a_folder_is_split_and_its_digest_depends_on_names_and_bytes_only() {
    let folder = tempfile::tempdir().unwrap();
    for (name, frames) in [("b.bvh", 20), ("a.bvh", 10), ("c.BVH", 30)] {
        write_clip(folder.path(), name, frames);
    }
    std::fs::write(folder.path().join("notes.txt"), "no clip").unwrap();
    let by_share = Dataset::load(folder.path(), &config(Split::Share(0.7))).unwrap();
    assert_eq!(
        (names(&by_share.train), names(&by_share.test)),
        (vec!["a.bvh", "b.bvh"], vec!["c.BVH"])
    );
    assert_eq!(by_share.train[1].clip.poses.len(), 20);
    let list = Split::List {
        train: vec!["c.BVH".into()],
        validation: vec!["a.bvh".into()],
        test: vec!["b.bvh".into()],
    };
    let by_list = Dataset::load(folder.path(), &config(list)).unwrap();
    assert_eq!(
        [&by_list.train, &by_list.validation, &by_list.test].map(|part| names(part)),
        [["c.BVH"], ["a.bvh"], ["b.bvh"]]
    );
    assert_eq!(by_list.digest, by_share.digest);
    let hexadecimal = |bytes: &[u8]| {
        Sha256::digest(bytes)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect::<String>()
    };
    let line = |name: &&str| {
        format!(
            "{}  {name}\n",
            hexadecimal(&std::fs::read(folder.path().join(name)).unwrap())
        )
    };
    let lines: String = ["a.bvh", "b.bvh", "c.BVH"].iter().map(line).collect();
    assert_eq!(by_share.digest, hexadecimal(lines.as_bytes()));
    write_clip(folder.path(), "c.BVH", 31);
    assert_ne!(
        Dataset::load(folder.path(), &config(Split::Share(0.7)))
            .unwrap()
            .digest,
        by_share.digest
    );
}

#[test]
fn clips_in_memory_are_split_like_files_and_digested_by_their_poses() {
    let clip = |name: &str, step: f64| {
        turning_clip(name, 20, move |frame| {
            (DVec3::new(step * frame as f64, 90.0, 0.0), 0.0)
        })
    };
    let clips = |step: f64| vec![clip("c", step), clip("a", 1.0), clip("b", 1.0)];
    let config = config(Split::Share(0.7));
    let of = |clips| Dataset::from_clips(clips, &config);
    let dataset = of(clips(1.0)).unwrap();
    assert_eq!(
        (names(&dataset.train), names(&dataset.test)),
        (vec!["a", "b"], vec!["c"])
    );
    assert_eq!(dataset.test[0].frames(), 20);
    let mut reversed = clips(1.0);
    reversed.reverse();
    assert_eq!(of(reversed).unwrap(), dataset);
    assert_ne!(of(clips(1.5)).unwrap().digest, dataset.digest);
    let twice = vec![clip("a", 1.0), clip("b", 1.0), clip("a", 2.0)];
    assert!(of(twice).unwrap_err().to_string().contains("called a;"));
}

#[test]
fn a_folder_that_is_no_data_set_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let message = |split: Split| {
        let error = Dataset::load(folder.path(), &config(split)).unwrap_err();
        format!("{:#}", anyhow::Error::from(error))
    };
    let empty = message(Split::Dance);
    assert!(
        empty.contains("no .bvh file")
            && empty.contains("github.com/wslh852")
            && empty.contains("DanceDB"),
        "{empty}"
    );
    write_clip(folder.path(), "a.bvh", 10);
    assert!(message(Split::Dance).contains("123 clips"));
    std::fs::write(folder.path().join("b.bvh"), "HIERARCHY\nROOT\n").unwrap();
    assert!(message(Split::Share(0.5)).contains("b.bvh, line 2: expected a joint name"));
    let missing = Dataset::load(&folder.path().join("none"), &DataConfig::default())
        .unwrap_err()
        .to_string();
    assert!(missing.contains("none cannot be read"), "{missing}");
}

#[test]
fn a_split_of_the_right_clips_with_other_frames_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    for clip in 0..123 {
        write_clip(folder.path(), &format!("{clip}.bvh"), 2);
    }
    let message = Dataset::load(folder.path(), &DataConfig::default())
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("93347 training and 20879 test frames"),
        "{message}"
    );
    assert!(message.contains("gives 196 and 50"), "{message}");
}

#[test]
fn an_unknown_key_is_named() {
    let error = toml::from_str::<DataConfig>("fps = 30.0\ncontact_treshold = 0.2")
        .unwrap_err()
        .to_string();
    assert!(error.contains("contact_treshold"), "{error}");
    let read: DataConfig =
        toml::from_str("split = { list = { train = [\"a\"], test = [\"b\"] } }").unwrap();
    assert_eq!(
        read.split,
        Split::List {
            train: vec!["a".into()],
            validation: Vec::new(),
            test: vec!["b".into()]
        }
    );
    for config in [DataConfig::default(), config(Split::Share(0.8)), read] {
        assert_eq!(
            toml::from_str::<DataConfig>(&toml::to_string(&config).unwrap()).unwrap(),
            config
        );
    }
}

#[test]
fn standardised_training_frames_have_mean_0_and_deviation_1() {
    // Two clips of different lengths: every frame counts the same.
    let clip = |frames: usize, slope: f64| {
        Array2::from_shape_fn((frames, 154), |(t, c)| {
            if c == 5 {
                7.0
            } else {
                ((t * (c + 3)) as f64 * slope).sin() * (1.0 + c as f64)
            }
        })
    };
    let clips = [clip(40, 0.37), clip(13, 0.73)];
    let standardisation = Standardisation::fit(clips.iter().map(|clip| clip.view()));
    let all = ndarray::concatenate(ndarray::Axis(0), &[clips[0].view(), clips[1].view()]).unwrap();
    let standard = standardisation.standardise(all.view());
    for column in (0..154).filter(|&column| column != FACING.start) {
        let values = standard.column(column);
        let (mean, deviation) = (values.mean().unwrap(), values.std(0.0));
        assert!(mean.abs() < 1e-9, "{column}: {mean}");
        assert!(
            (deviation - if column == 5 { 0.0 } else { 1.0 }).abs() < 1e-9,
            "{column}: {deviation}"
        );
    }
    assert_eq!(standardisation.std[5], 1.0);
    let again = standardisation.restore(standard.view());
    assert!(again.iter().zip(&all).all(|(a, b)| (a - b).abs() < 1e-9));
    let scale = |std: &[f64]| (std.iter().map(|s| s * s).sum::<f64>() / 69.0).sqrt();
    assert!(
        (standardisation.position_scale - scale(&standardisation.std[BODY_POSITIONS])).abs()
            < 1e-12
    );
    assert!(
        (standardisation.velocity_scale - scale(&standardisation.std[BODY_VELOCITIES])).abs()
            < 1e-12
    );
}

#[test]
fn the_facing_angle_is_standardised_without_the_turns_made_before() {
    let turns =
        |angle: f64| Array2::from_shape_fn((2, 154), |(t, _)| if t == 0 { angle } else { -angle });
    let standardisation = Standardisation::fit([turns(1.0).view(), turns(1.0 + 6.0 * PI).view()]);
    assert!(standardisation.mean[FACING.start].abs() < 1e-12);
    assert!((standardisation.std[FACING.start] - 1.0).abs() < 1e-12);
}

#[test]
fn the_dance_set_has_the_papers_split_and_its_windows_turn_without_jumps() {
    let Some(folder) = real_data::dance_folder() else {
        return;
    };
    let dataset = Dataset::load(&folder, &DataConfig::default()).unwrap();
    let frames = |clips: &[Recording]| clips.iter().map(Recording::frames).sum::<usize>();
    assert_eq!((dataset.train.len(), frames(&dataset.train)), (98, 93_347));
    assert_eq!((dataset.test.len(), frames(&dataset.test)), (25, 20_879));
    for (recordings, transition) in [(&dataset.train, 50), (&dataset.test, 150)] {
        let clips = DanceClip::measure_all(recordings, &FeatureConfig::default()).unwrap();
        let lengths: Vec<usize> = clips.iter().map(DanceClip::frames).collect();
        for window in windows(&lengths, transition).windows {
            let features = window_features(&clips[window.clip].features, window.start, transition);
            let facing = features.slice(s![.., FACING.start]);
            assert!((-PI..PI).contains(&facing[0]));
            assert!(
                facing
                    .windows(2)
                    .into_iter()
                    .all(|pair| (pair[1] - pair[0]).abs() <= PI)
            );
        }
    }
}
