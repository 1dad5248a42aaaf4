//! Dances as columns of motion and music: the Motorica subset, fitting, saving, requests, windows.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use glam::DQuat;
use keydance::autograd::Parameters;
use keydance::data::choreography::{ChoreographyConfig, generate, write_clips};
use keydance::data::motorica::Motorica;
use keydance::data::{DataConfig, DataPart, Dataset, GivenMusic, Recording, Split};
use keydance::evaluation::frechet::frechet_distance;
use keydance::models::Statistics;
use keydance::models::dance_features::{
    Audio, Contexts, DanceData, DanceFeatures, FeaturesConfig, heard,
};
use keydance::models::generator::{Given, Request};
use keydance::models::weights::{SavedWeights, to_safetensors};
use keydance::motion::{GroundPlace, mirror_image};
use keydance::music::{Analysis, RATE, Sound};
use ndarray::{Array2, ArrayView2, Axis, concatenate, s};
use ndarray_npy::WriteNpyExt as _;

use crate::motorica_data::motorica_folder;
use crate::music_dance_data::music_dance_folder;

fn motorica_config() -> DataConfig {
    DataConfig {
        split: Split::Motorica,
        fps: 20.0,
        ..DataConfig::default()
    }
}

fn as_given() -> FeaturesConfig {
    FeaturesConfig {
        audio: Audio::AsGiven,
        centre_rotations: false,
    }
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    let list = value.as_array().unwrap().iter();
    list.map(|it| it.as_f64().unwrap()).collect()
}

fn check_json(folder: &Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(folder.join("check.json")).unwrap()).unwrap()
}

/// The rows of a part's pieces, `[pieces][frames, 61]`.
fn rows(
    motorica: &Motorica,
    part: DataPart,
    dances: impl Fn(&str) -> bool,
) -> Vec<ArrayView2<'_, f64>> {
    let own = motorica.pieces.iter();
    let own = own.filter(|piece| piece.part == part && dances(&piece.dance));
    own.map(|piece| {
        let motion = &motorica.dances[&piece.dance].motion;
        motion.slice(s![piece.frames.clone(), ..])
    })
    .collect()
}

fn assert_close(ours: impl IntoIterator<Item = f64>, theirs: &[f64], bound: f64, what: &str) {
    let ours: Vec<f64> = ours.into_iter().collect();
    assert_eq!(ours.len(), theirs.len(), "{what}");
    for (at, (a, b)) in ours.iter().zip(theirs).enumerate() {
        assert!((a - b).abs() <= bound, "{what} {at}: {a} for {b}");
    }
}

#[test]
fn positions_and_paths_of_motorica_are_those_of_its_maker() {
    let Some(folder) = motorica_folder() else {
        return;
    };
    let motorica = Motorica::read(&folder).unwrap();
    let (skeleton, bones) = (&motorica.skeleton, motorica.skeleton.rest_pose());
    let check = check_json(&folder);
    let joints = check["joints"].as_array().unwrap().iter();
    let joints: Vec<usize> = joints
        .map(|name| skeleton.index_of(name.as_str().unwrap()).unwrap())
        .collect();
    let poses = |dance: &str| {
        let motion = motorica.dances[dance].motion.view();
        let start = GroundPlace::default();
        let poses = motorica.columns.poses(motion, skeleton, &bones, start);
        poses.unwrap()
    };
    for frame in check["frames"].as_array().unwrap() {
        let at = frame["frame_20fps"].as_u64().unwrap() as usize;
        let motion = &motorica.dances[frame["dance"].as_str().unwrap()].motion;
        let row = motion.slice(s![at..=at, ..]);
        let pose = motorica
            .columns
            .poses(row, skeleton, &bones, GroundPlace::default());
        let world = pose.unwrap()[0].world_positions(skeleton);
        let expected = frame["positions_cm"].as_array().unwrap();
        for (joint, expected) in joints.iter().zip(expected) {
            assert_close(
                world[*joint].to_array(),
                &numbers(expected),
                6e-5,
                "position",
            );
        }
    }
    let path = &check["path"];
    let poses = poses(path["dance"].as_str().unwrap());
    let frames = numbers(&path["frames"]).into_iter();
    for (frame, expected) in frames.zip(path["x_z_heading"].as_array().unwrap()) {
        let place = GroundPlace::of(&poses[frame as usize]);
        let expected = numbers(expected);
        assert_close([place.x, place.z], &expected[..2], 6e-4, "place");
        assert_close([place.heading], &expected[2..], 6e-6, "heading");
    }
}

#[test]
fn statistics_and_distances_of_motorica_are_those_of_its_maker() {
    let Some(folder) = motorica_folder() else {
        return;
    };
    let motorica = Motorica::read(&folder).unwrap();
    let check = check_json(&folder);
    let part = &check["training_part_20fps"];
    let train = rows(&motorica, DataPart::Train, |_| true);
    let motion = concatenate(Axis(0), &train).unwrap();
    assert_eq!(motion.nrows() as u64, part["frames"].as_u64().unwrap());
    let mean = |it: &Array2<f64>| it.mean_axis(Axis(0)).unwrap();
    assert_close(mean(&motion), &numbers(&part["motion_mean"]), 1e-6, "mean");
    let deviation = motion.std_axis(Axis(0), 0.0);
    assert_close(deviation, &numbers(&part["motion_sd"]), 1e-6, "deviation");
    let pieces = motorica
        .pieces
        .iter()
        .filter(|it| it.part == DataPart::Train);
    let audio: Vec<Array2<f64>> = pieces
        .map(|piece| {
            let audio = &motorica.dances[&piece.dance].music.columns;
            audio.slice(s![piece.frames.clone(), ..]).mapv(f64::from)
        })
        .collect();
    let views: Vec<ArrayView2<f64>> = audio.iter().map(|it| it.view()).collect();
    let audio = concatenate(Axis(0), &views).unwrap();
    assert_close(
        mean(&audio),
        &numbers(&part["audio_mean"]),
        1e-5,
        "mean of audio",
    );
    let deviation = audio.std_axis(Axis(0), 0.0);
    assert_close(
        deviation,
        &numbers(&part["audio_sd"]),
        1e-5,
        "deviation of audio",
    );

    let triples = |pieces: &[ArrayView2<f64>]| {
        let of_piece = |piece: &ArrayView2<f64>| {
            let shape = (piece.nrows() - 2, 3 * piece.ncols());
            let width = piece.ncols();
            Array2::from_shape_fn(shape, |(row, at)| piece[[row + at / width, at % width]])
        };
        let all: Vec<Array2<f64>> = pieces.iter().map(of_piece).collect();
        let views: Vec<ArrayView2<f64>> = all.iter().map(|it| it.view()).collect();
        concatenate(Axis(0), &views).unwrap()
    };
    type Chosen = fn(&str) -> bool;
    let parts: [(&str, DataPart, Chosen); 4] = [
        ("validation", DataPart::Validation, |_| true),
        ("test", DataPart::Test, |_| true),
        ("test_pieces_of_trained_dances", DataPart::Test, |it| {
            it != "lo_rocksteady"
        }),
        ("lo_rocksteady", DataPart::Test, |it| it == "lo_rocksteady"),
    ];
    for (name, part, dances) in parts {
        let expected = &check["frechet_of_parts"][name];
        let own = rows(&motorica, part, dances);
        let frames = concatenate(Axis(0), &own).unwrap();
        let fpd = frechet_distance(motion.view(), frames.view()).unwrap();
        let fmd = frechet_distance(triples(&train).view(), triples(&own).view()).unwrap();
        assert_close([fpd], &[expected["fpd"].as_f64().unwrap()], 6e-5, name);
        assert_close([fmd], &[expected["fmd"].as_f64().unwrap()], 6e-5, name);
    }
}

#[test]
fn motorica_is_a_data_set_of_pieces_whose_columns_are_the_files() {
    let Some(folder) = motorica_folder() else {
        return;
    };
    let motorica = Motorica::read(&folder).unwrap();
    let data = Dataset::load(&folder, &motorica_config()).unwrap();
    assert_eq!(data.digest, motorica.digest);
    let names = |part: &[Recording]| {
        part.iter()
            .map(|it| it.name().to_string())
            .collect::<Vec<_>>()
    };
    assert_eq!(names(&data.train)[0], "kr_charged@200-1600");
    assert_eq!(names(&data.test)[2], "lo_rocksteady@200-2253");
    let mirrored = [false, true];
    for mirror in mirrored {
        let made = DanceData::of(&data, &as_given(), mirror).unwrap();
        let DanceFeatures {
            columns, motion, ..
        } = &made.features;
        assert_eq!(made.features.widths(), (61, 29));
        assert_eq!(columns.names(), motorica.columns.names());
        assert_eq!(made.warnings, Vec::<String>::new());
        assert_eq!(made.train.len(), if mirror { 8 } else { 4 });
        for (piece, of) in made.train.iter().zip(&data.train) {
            let split = motorica
                .pieces
                .iter()
                .filter(|it| it.part == DataPart::Train);
            let split = split
                .zip(&data.train)
                .find(|(_, it)| it.name() == of.name())
                .unwrap()
                .0;
            let file = motorica.dances[&split.dance]
                .motion
                .slice(s![split.frames.clone(), ..]);
            let ours = columns.measure(&of.clip).unwrap();
            // The first frame's differences repeat the second's.
            let difference = &ours.slice(s![1.., ..]) - &file.slice(s![1.., ..]);
            let worst = difference
                .iter()
                .fold(0.0, |most: f64, x| most.max(x.abs()));
            // The file's numbers are single: what is without heading there is so to their rounding.
            assert!(worst < 1e-6, "{}: {worst}", of.name());
            assert_eq!(ours[[0, 0]], ours[[1, 0]]);
            let restored = motion.restore(piece.motion.view());
            assert!((restored - &ours).iter().all(|x| x.abs() < 2e-5));
        }
        let all: Vec<ArrayView2<f32>> = made.train.iter().map(|it| it.motion.view()).collect();
        let all = concatenate(Axis(0), &all).unwrap().mapv(f64::from);
        for column in all.columns() {
            let (mean, deviation) = (column.mean().unwrap(), column.std(0.0));
            // A knee's other axes deviate by less than the floor.
            assert!(
                mean.abs() < 1e-4 && deviation < 1.0 + 1e-4,
                "{mean} {deviation}"
            );
        }
        let name = columns
            .names()
            .iter()
            .position(|(name, _)| name == "LeftLeg_y")
            .unwrap();
        assert_eq!(motion.deviation[name], f64::from(0.01_f32));
        assert!(all.column(name).std(0.0) < 0.5);
    }
    let small = Contexts {
        motion: 60,
        audio_past: 60,
        audio_future: 20,
        predicted: 3,
    };
    let frames: Vec<usize> = data.validation.iter().map(Recording::frames).collect();
    assert_eq!(small.cut(2).windows(&frames).len(), 444);
}

#[test]
fn music_dance_at_20_frames_a_second_has_85_numbers_of_music_and_49_of_motion() {
    let Some(folder) = music_dance_folder() else {
        return;
    };
    let config = DataConfig {
        split: Split::MusicDance,
        fps: 20.0,
        music: true,
        ..DataConfig::default()
    };
    let data = Dataset::load(&folder, &config).unwrap();
    let made = DanceData::of(&data, &FeaturesConfig::default(), true).unwrap();
    assert_eq!(made.features.widths(), (49, 85));
    let frames = made.train.iter().map(|it| it.frames()).sum::<usize>();
    assert_eq!((made.train.len(), frames), (64, 2 * 40_500));
    let novel = &data.named_frames["novel"];
    for (name, ranges) in novel {
        let all = data.test.iter().chain(&data.validation);
        let clip = all.into_iter().find(|it| it.name() == name).unwrap();
        assert!(
            ranges.iter().all(|range| range.end <= clip.frames() + 1),
            "{name}"
        );
    }
    for column in 0..85 {
        let of =
            |piece: &keydance::models::dance_features::Piece| piece.audio.column(column).to_vec();
        let all: Vec<f64> = made.train.iter().flat_map(of).map(f64::from).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / all.len() as f64;
        assert!(
            mean.abs() < 1e-3 && (variance - 1.0).abs() < 1e-3,
            "{column}: {mean} {variance}"
        );
    }
}

/// Clicks, two a second, of a song of some frames of 1/30 s.
fn song(frames: usize) -> Arc<Analysis> {
    let click = |n: usize| {
        if n % 11_025 < 300 {
            0.5 * (n as f32 * 0.31).sin()
        } else {
            0.0
        }
    };
    let samples: Vec<f32> = (0..frames * 735).map(click).collect();
    Arc::new(Analysis::of(&Sound::new("clicks", &samples, RATE).unwrap()).unwrap())
}

fn dances() -> Dataset {
    let choreography = ChoreographyConfig {
        clips: 4,
        frames_per_clip: 240,
        seed: 9,
    };
    let clips = generate(&choreography)
        .unwrap()
        .into_iter()
        .map(|it| it.clip);
    let config = DataConfig {
        split: Split::Share(0.75),
        fps: 20.0,
        ..DataConfig::default()
    };
    let mut data = Dataset::from_clips(clips.collect(), &config).unwrap();
    let music = song(240);
    let all = data.train.iter_mut().chain(&mut data.test);
    all.for_each(|recording| recording.music = Some(music.clone()));
    data
}

fn saved(statistics: &Statistics) -> SavedWeights {
    let bytes = to_safetensors(&Parameters::new(), statistics, "").unwrap();
    SavedWeights::parse(&bytes, Path::new("weights")).unwrap()
}

#[test]
fn what_is_saved_beside_weights_is_what_a_training_works_with() {
    let mut data = dances();
    for audio in [Audio::Transflower85, Audio::OnsetBeats, Audio::AsGiven] {
        for recording in &mut data.train {
            let columns = Array2::from_shape_fn((160, 3), |(t, k)| ((t * (k + 2)) % 17) as f32);
            let beats = (0..16).map(|beat| f64::from(beat) * 0.5);
            recording.given_music = Some(Arc::new(GivenMusic {
                columns,
                magnitudes: vec![1],
                onset: 1,
                beats: beats.collect(),
            }));
        }
        for centre_rotations in [false, true] {
            let config = FeaturesConfig {
                audio,
                centre_rotations,
            };
            let features = DanceFeatures::fit(&data.train, &config, true).unwrap();
            let weights = saved(&features.statistics(Statistics::default()));
            assert_eq!(DanceFeatures::saved(&weights, &config).unwrap(), features);
            let expected = [85, 2, 3][audio as usize];
            assert_eq!(features.widths().1, expected);
            assert_eq!(
                features.piece(&data.train[0]).unwrap().audio.dim(),
                (160, expected)
            );
            let other = FeaturesConfig {
                audio: if audio == Audio::AsGiven {
                    Audio::OnsetBeats
                } else {
                    Audio::Transflower85
                },
                ..config
            };
            if other.audio != audio {
                assert!(DanceFeatures::saved(&weights, &other).is_err());
            }
        }
    }
}

#[test]
fn mirror_images_are_those_of_the_recordings_wherever_rotations_are_measured_from() {
    let data = dances();
    for centre_rotations in [false, true] {
        let config = FeaturesConfig {
            centre_rotations,
            ..FeaturesConfig::default()
        };
        let made = DanceData::of(&data, &config, true).unwrap();
        let (recorded, images) = made.train.split_at(3);
        for ((image, recorded), of) in images.iter().zip(recorded).zip(&data.train) {
            assert!(image.mirrored && !recorded.mirrored && image.name == recorded.name);
            assert_eq!(image.audio, recorded.audio);
            let mirrored = Recording {
                clip: mirror_image(&of.clip),
                ..of.clone()
            };
            let expected = made.features.piece(&mirrored).unwrap().motion;
            let error = (&expected - &image.motion)
                .iter()
                .fold(0.0_f32, |a, b| a.max(b.abs()));
            assert!(error < 1e-4, "{error}");
        }
        let middle = |piece: &keydance::models::dance_features::Piece| {
            let arm = made.features.columns.names();
            let arm = arm
                .iter()
                .position(|(name, _)| name == "LeftArm_z")
                .unwrap();
            made.features
                .motion
                .restore(piece.motion.view())
                .column(arm)
                .mean()
                .unwrap()
        };
        let arms = made.train.iter().map(middle).sum::<f64>() / 6.0;
        assert_eq!(arms.abs() < 0.2, centre_rotations, "{arms}");
    }
}

#[test]
fn a_dance_goes_on_from_its_seed_and_its_own_columns_are_the_recorded_motion() {
    let data = dances();
    let made = DanceData::of(&data, &FeaturesConfig::default(), false).unwrap();
    let (features, recording) = (&made.features, &data.test[0]);
    let clip = &recording.clip;
    let given = |frame: usize| Given {
        frame: frame as i64,
        pose: clip.poses[frame].clone(),
        features: None,
    };
    let mut request = Request {
        given: (0..40).map(given).collect(),
        music: Some(heard(recording, Audio::Transflower85).unwrap()),
        ..Request::new(clip.skeleton.clone(), clip.frame_time, clip.poses.len())
    };
    let piece = features.piece(recording).unwrap();
    let dance = features.given(&request, 40).unwrap();
    assert_eq!(dance.motion, piece.motion.slice(s![..40, ..]));
    assert_eq!(dance.audio, piece.audio);
    let motion = features
        .motion(&dance, piece.motion.slice(s![40.., ..]))
        .unwrap();
    motion.check(&request).unwrap();
    let world = clip.skeleton.world_positions(&clip.poses);
    for (frame, joints) in world.iter().enumerate() {
        for (joint, place) in joints.iter().enumerate() {
            let ours = motion.positions.slice(s![frame, joint, ..]);
            let error = ours
                .iter()
                .zip(place.to_array())
                .map(|(a, b)| (a - b).abs());
            // Of joints that never turn in training the test clip's turn a little.
            assert!(
                error.fold(0.0, f64::max) < 1e-2,
                "{frame} {joint}: {ours} {place}"
            );
        }
    }
    let raw = motion.raw.unwrap();
    assert_eq!(raw.dim(), (clip.poses.len() - 40, features.widths().0));
    request.given.remove(20);
    let error = features.given(&request, 40).unwrap_err().to_string();
    assert!(error.contains("no pose at frame 20"), "{error}");
    request.frame_time = 1.0 / 30.0;
    let error = features.given(&request, 40).unwrap_err().to_string();
    assert!(error.contains("30.000 frames a second"), "{error}");
}

#[test]
fn skeletons_with_other_joints_are_trained_on_those_that_all_have() {
    let mut data = dances();
    let spare = data.train[1].clip.skeleton.index_of("RightHand").unwrap();
    let clip = &mut data.train[1].clip;
    clip.skeleton.joints.remove(spare);
    for joint in &mut clip.skeleton.joints {
        joint.parent = joint.parent.map(|at| at - usize::from(at > spare));
    }
    for pose in &mut clip.poses {
        pose.translations.remove(spare);
        pose.rotations.remove(spare);
    }
    let made = DanceData::of(&data, &FeaturesConfig::default(), true).unwrap();
    let turning = made.features.columns.turning();
    assert!(turning.iter().any(|it| it.joint == "LeftHand"));
    assert!(!turning.iter().any(|it| it.joint == "RightHand"));
    let pieces = made.train.iter().map(|piece| piece.motion.ncols());
    assert!(
        pieces
            .into_iter()
            .all(|columns| columns == 7 + 3 * (turning.len() - 1))
    );
}

#[test]
fn joints_that_never_turn_are_left_out_with_the_rotation_that_they_have() {
    let mut data = dances();
    let neck = data.train[0].clip.skeleton.index_of("Neck").unwrap();
    let bent = DQuat::from_rotation_x(0.2);
    for recording in &mut data.train {
        recording
            .clip
            .poses
            .iter_mut()
            .for_each(|pose| pose.rotations[neck] = bent);
    }
    let features = DanceFeatures::fit(&data.train, &FeaturesConfig::default(), true).unwrap();
    let columns = &features.columns;
    assert!(columns.turning().iter().all(|it| it.joint != "Neck"));
    let fixed = columns
        .fixed()
        .iter()
        .find(|it| it.joint == "Neck")
        .unwrap();
    assert!(fixed.rotation.dot(bent).abs() > 1.0 - 1e-12);
}

#[test]
fn windows_begin_where_all_that_they_read_lies_in_the_piece() {
    let paper = Contexts {
        motion: 120,
        audio_past: 120,
        audio_future: 20,
        predicted: 3,
    };
    assert_eq!(paper.starts(140), 120..121);
    assert_eq!(paper.starts(139).len(), 0);
    assert_eq!(paper.starts(300), 120..281);
    assert_eq!(paper.cut(1).windows(&[139, 140, 300]).len(), 1 + 161);
    let last = paper.starts(300).end - 1;
    assert_eq!(paper.audio_rows(last), 160..300);
    assert_eq!(paper.motion_rows(last), 160..280);
    assert_eq!(paper.target_rows(last), 280..283);
    let far = Contexts {
        predicted: 30,
        motion: 20,
        ..paper
    };
    assert_eq!(far.starts(300), 120..271);
}

#[test]
fn music_at_another_rate_or_none_is_refused_with_the_key_that_helps() {
    let mut data = dances();
    let message = |data: &Dataset, audio| {
        let config = FeaturesConfig {
            audio,
            ..FeaturesConfig::default()
        };
        DanceFeatures::fit(&data.train, &config, false)
            .unwrap_err()
            .to_string()
    };
    assert!(message(&data, Audio::AsGiven).contains("split = \"motorica\""));
    data.train
        .iter_mut()
        .for_each(|it| it.clip.frame_time = 1.0 / 30.0);
    assert!(message(&data, Audio::Transflower85).contains("data.fps = 20"));
    data.train[1].music = None;
    data.train
        .iter_mut()
        .for_each(|it| it.clip.frame_time = 0.05);
    assert!(message(&data, Audio::OnsetBeats).contains("data.music = true"));
    data.train.clear();
    assert!(message(&data, Audio::Transflower85).contains("no clip"));
}

#[test]
fn folders_inside_a_folder_are_mixed_on_the_joints_and_the_music_that_all_have() {
    let Some(motorica) = motorica_folder() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let config = DataConfig {
        split: Split::Mixed,
        fps: 20.0,
        music: true,
        ..DataConfig::default()
    };
    let empty = Dataset::load(folder.path(), &config)
        .unwrap_err()
        .to_string();
    assert!(empty.contains("holds no folder"), "{empty}");
    let street = fs::canonicalize(motorica).unwrap();
    std::os::unix::fs::symlink(street, folder.path().join("motorica")).unwrap();
    let choreography = ChoreographyConfig {
        clips: 5,
        frames_per_clip: 300,
        seed: 3,
    };
    let own = folder.path().join("choreography");
    write_clips(&choreography, true, &own)
        .unwrap()
        .for_each(|path| drop(path.unwrap()));
    let data = Dataset::load(folder.path(), &config).unwrap();
    assert_eq!(
        (data.train.len(), data.validation.len(), data.test.len()),
        (8, 4, 6)
    );
    let config = FeaturesConfig {
        audio: Audio::OnsetBeats,
        ..FeaturesConfig::default()
    };
    let made = DanceData::of(&data, &config, true).unwrap();
    let turning = made.features.columns.turning();
    assert!(turning.iter().any(|it| it.joint == "LeftHand"));
    // Only the dance skeleton has it.
    assert!(!turning.iter().any(|it| it.joint == "Spine4"));
    assert_eq!(made.features.widths(), (7 + 3 * (turning.len() - 1), 2));
    // Beats of a given music and of a heard one reach the same height.
    for piece in &made.train {
        let beats = piece
            .audio
            .column(1)
            .iter()
            .copied()
            .fold(f32::MIN, f32::max);
        assert!((1.5..5.0).contains(&beats), "{}: {beats}", piece.name);
    }
}

/// A folder like Motorica's with one dance of 30 frames.
fn small_motorica(folder: &Path) {
    let mut names: Vec<String> = ["root_dx", "root_dz", "root_y"].map(String::from).into();
    let of = |joint: &str| ["x", "y", "z"].map(|axis| format!("{joint}_{axis}"));
    names.extend(of("Hips"));
    names.push("root_dheading".into());
    names.extend(of("Spine"));
    let table = |names: &[String]| {
        let rows = names
            .iter()
            .enumerate()
            .map(|(at, name)| format!("{at},{name}\n"));
        format!("index,name\n{}", rows.collect::<String>())
    };
    let bvh = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation \
               Xrotation Yrotation\nJOINT Spine\n{\nOFFSET 0 20 0\nCHANNELS 3 Zrotation Xrotation \
               Yrotation\nEnd Site\n{\nOFFSET 0 20 0\n}\n}\n}\nMOTION\nFrames: 1\nFrame Time: 0.05\n0 90 0 \
               0 0 0 0 0 0\n";
    let array = |numbers: usize| {
        let at = |(t, k): (usize, usize)| ((t + 3 * k) as f32 * 0.37).sin() * 0.5;
        let mut bytes = Vec::new();
        Array2::from_shape_fn((30, numbers), at)
            .write_npy(&mut bytes)
            .unwrap();
        bytes
    };
    let files: BTreeMap<&str, Vec<u8>> = BTreeMap::from([
        ("skeleton.bvh", bvh.into()),
        ("features_motion.csv", table(&names).into()),
        (
            "features_audio.csv",
            table(&["MFCC_0".into(), "Spectralflux_0".into()]).into(),
        ),
        (
            "beats.csv",
            "dance,frame_60fps,time_s\na,6,0.1\na,36,0.6\n".into(),
        ),
        (
            "split.csv",
            "dance,part,first_frame,end_frame\na,train,0,20\na,test,20,30\n".into(),
        ),
        ("20fps/a.motion.npy", array(10)),
        ("20fps/a.audio.npy", array(2)),
    ]);
    fs::create_dir(folder.join("20fps")).unwrap();
    files
        .iter()
        .for_each(|(name, bytes)| fs::write(folder.join(name), bytes).unwrap());
}

#[test]
fn a_damaged_motorica_folder_is_refused_with_the_file_and_its_fault() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    small_motorica(folder);
    let message = || match Motorica::read(folder) {
        Ok(_) => String::new(),
        Err(error) => format!("{:#}", anyhow::Error::from(error)),
    };
    assert_eq!(message(), "");
    let piece = Motorica::read(folder).unwrap();
    let recording = piece.recording(&piece.pieces[1]).unwrap();
    assert_eq!((recording.name(), recording.frames()), ("a@20-30", 10));
    assert_eq!(recording.given_music.unwrap().beats.len(), 0);
    let npy = |shape: (usize, usize), value: f32| {
        let mut bytes = Vec::new();
        Array2::from_elem(shape, value)
            .write_npy(&mut bytes)
            .unwrap();
        bytes
    };
    let motion = fs::read(folder.join("20fps/a.motion.npy")).unwrap();
    // A header of the same length that claims more than any memory.
    let header =
        String::from_utf8_lossy(&motion[10..128]).replace("(30, 10)", "(3000000000000, 10)");
    let header = format!("{:117}\n", header.trim_end());
    let huge = [&motion[..10], header.as_bytes(), &motion[128..]].concat();
    let mut doubles = Vec::new();
    Array2::<f64>::zeros((30, 10))
        .write_npy(&mut doubles)
        .unwrap();
    let damages: [(&str, Vec<u8>, &str); 11] = [
        ("20fps/a.motion.npy", npy((30, 9), 0.0), "expected [30, 10]"),
        ("20fps/a.audio.npy", npy((29, 2), 0.0), "expected [30, 2]"),
        ("20fps/a.motion.npy", npy((30, 10), f32::NAN), "NaN"),
        (
            "20fps/a.motion.npy",
            motion[..700].to_vec(),
            "a.motion.npy is not",
        ),
        ("20fps/a.motion.npy", huge, "a.motion.npy is not"),
        (
            "20fps/a.motion.npy",
            b"no array".to_vec(),
            "a.motion.npy is not",
        ),
        ("20fps/a.motion.npy", doubles, "a.motion.npy is not"),
        (
            "split.csv",
            b"dance,part,first_frame,end_frame\na,train,0,31\n".to_vec(),
            "which has 30",
        ),
        (
            "split.csv",
            b"dance,part,first_frame,end_frame\na,practice,0,3\n".to_vec(),
            "practice",
        ),
        (
            "features_motion.csv",
            b"index,name\n0,root_dx\n".to_vec(),
            "names the rotation of no joint",
        ),
        (
            "features_audio.csv",
            b"index,name\n0,MFCC_0\n1,MFCC_1\n".to_vec(),
            "Spectralflux_0",
        ),
    ];
    for (name, bytes, expected) in damages {
        let path = folder.join(name);
        let whole = fs::read(&path).unwrap();
        fs::write(&path, bytes).unwrap();
        let found = message();
        assert!(found.contains(expected), "{name}: {found}");
        fs::remove_file(&path).unwrap();
        assert!(message().contains("cannot be read"), "{name}");
        fs::write(&path, whole).unwrap();
    }
    let load = |config: DataConfig| {
        let error = Dataset::load(folder, &config).unwrap_err();
        format!("{:#}", anyhow::Error::from(error))
    };
    let few = load(motorica_config());
    assert!(few.contains("4 / 6720, 4 / 1200, 5 / 3653") && few.contains("1 / 20, 0 / 0, 1 / 10"));
    let with_music = DataConfig {
        music: true,
        ..motorica_config()
    };
    assert!(load(with_music).contains("data.music"));
    let fast = DataConfig {
        fps: 30.0,
        ..motorica_config()
    };
    assert!(load(fast).contains("data.fps = 30"));
}
