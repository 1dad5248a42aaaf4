//! Pu and Shan 2022: windows in numbers, what is added to the tokens, the loss, the draws, the
//! training, and dances that go on over a song.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use keydance::autograd::{Parameters, Tape, Workspace};
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::data::{DataPart, Dataset};
use keydance::experiment::ExperimentConfig;
use keydance::models::Streams;
use keydance::models::generator::{Condition, Given, NeededPoses, Request};
use keydance::models::pu2022::{
    Batch, GivenWindow, LossConfig, MusicSpan, Norm, Pu2022, Pu2022Settings, ScheduleConfig,
    WindowConfig, WindowFrame, draw, draw_keys, frame_weights, pose_of,
};
use keydance::models::settings::{GradientCheckOptions, ModelSettings as _};
use keydance::motion::facing::FacingJoints;
use keydance::motion::{Clip, Pose};
use keydance::music::{Analysis, FeatureSet, Sound};
use keydance::nn::{Initialiser, sinusoidal_positions};
use keydance::run::RunFolder;
use keydance::training::{Outcome, Trainer};
use ndarray::{Array2, s};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

const SMALL: &str = "name = 'pu'\ndata.split = { share = 0.7 }\n\
    [model]\nkind = 'pu2022'\nwidth = 8\nheads = 2\nmotion_layers = 1\nmusic_layers = 1\n\
    cross_layers = 2\nfeed_forward = 12\n\
    [window]\nseed = 6\nlength = 30\n\
    [schedule]\nsteps = 7\nbatch_size = 5\nshards = 2\nkey_poses = 2\nkey_pose_distance = 5\n\
    [augmentation]\nmirror = true\n[checkpoint]\nevery_steps = 3\n";

const WINDOW: WindowConfig = WindowConfig {
    seed: 6,
    length: 30,
};

fn clips(frames: usize) -> Vec<Clip> {
    let choreography = ChoreographyConfig {
        clips: 4,
        frames_per_clip: frames,
        seed: 5,
    };
    let dances = generate(&choreography).unwrap().into_iter();
    dances.map(|dance| dance.clip).collect()
}

/// Two clicks a second, and a tone that is another one every second.
fn music(frames: usize) -> Arc<Analysis> {
    let sample = |n: usize| {
        let click = if n % 11_025 < 200 { 0.5 } else { 0.0 };
        let pitch = [220.0, 261.6, 329.6][n / 22_050 % 3];
        (click + 0.1 * (std::f64::consts::TAU * pitch * n as f64 / 22_050.0).sin()) as f32
    };
    let samples: Vec<f32> = (0..frames * 735).map(sample).collect();
    let sound = Sound::new("clicks", &samples, 22_050).unwrap();
    Arc::new(Analysis::of(&sound).unwrap())
}

fn dataset(config: &ExperimentConfig, frames: usize) -> Dataset {
    let mut data = Dataset::from_clips(clips(frames), &config.data).unwrap();
    let heard = music(frames);
    let all = data.train.iter_mut().chain(&mut data.test);
    all.for_each(|recording| recording.music = Some(heard.clone()));
    data
}

fn config() -> ExperimentConfig {
    ExperimentConfig::parse(SMALL, "test").unwrap()
}

fn train(trainer: &mut Trainer<'_>, run: Option<&RunFolder>, stop: u64) -> Outcome {
    let outcome = trainer.run(run, &mut |report| match report.step == stop {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    });
    outcome.unwrap()
}

#[test]
fn it_has_as_many_weights_as_the_specification_says_in_both_sizes() {
    let count = |settings: &Pu2022Settings| {
        let mut parameters = Parameters::<f32>::new();
        let rng = ChaCha8Rng::seed_from_u64(1);
        let mut init = Initialiser::new(&mut parameters, rng);
        Pu2022::new(&mut init, settings, 24, 15).unwrap();
        let weights = parameters.iter().map(|(_, value)| value.len());
        weights.sum::<usize>() as f64 / 1e6
    };
    let light = Pu2022Settings::default();
    let mut small = light.clone();
    small.model.width = 128;
    small.model.motion_layers = 2;
    small.model.music_layers = 2;
    small.model.cross_layers = 4;
    small.model.feed_forward = 512;
    assert!((count(&small) - 1.6).abs() < 0.06, "{}", count(&small));
    assert!((count(&light) - 12.8).abs() < 0.06, "{}", count(&light));
}

#[test]
fn gradients_are_those_of_central_differences_at_every_open_point() {
    let options = GradientCheckOptions {
        frames: None,
        windows: 2,
        per_parameter: 2,
        seed: 3,
        full_size: false,
    };
    let mut cases = vec![Pu2022Settings::default()];
    cases.push(cases[0].clone());
    cases[1].model.norm = Norm::Pre;
    cases.push(cases[1].clone());
    cases[2].model.music_span = MusicSpan::Whole;
    cases.push(cases[1].clone());
    cases[3].loss.root_weight = 3.0;
    cases[3].loss.velocity_weight = 20.0;
    for settings in cases {
        for (title, report) in settings.check_gradients(&options).unwrap() {
            let model = &settings.model;
            assert!(
                report.error() < 1e-6,
                "{model:?} {title}: {}",
                report.error()
            );
            assert!(report.compared() > 100);
        }
    }
}

#[test]
fn a_pose_survives_its_numbers_and_key_poses_do_not_say_where_they_are() {
    let clip = clips(40).remove(0);
    let facing = FacingJoints::of(&clip.skeleton).unwrap();
    let frame = WindowFrame::of(&clip.skeleton, &facing, &clip.poses[10]);
    for pose in &clip.poses {
        let numbers = frame.numbers(pose);
        assert_eq!(numbers.len(), 147);
        let back = pose_of(&frame.to_world(&numbers), &clip.poses[0]);
        assert!(back.translations[0].distance(pose.translations[0]) < 1e-9);
        for (a, b) in back.rotations.iter().zip(&pose.rotations) {
            assert!(a.dot(*b).abs() > 1.0 - 1e-12);
        }
        assert_eq!(frame.key_pose(pose), numbers[..144]);
    }
    // In its own frame the last pose of the seed stands at x = z = 0, in metres.
    let numbers = frame.numbers(&clip.poses[10]);
    assert!(numbers[144].abs() < 1e-12 && numbers[146].abs() < 1e-12);
    assert!((numbers[145] - clip.poses[10].translations[0].y / 100.0).abs() < 1e-12);
    let world = |pose: &Pose| pose.world_positions(&clip.skeleton);
    let turned = WindowFrame::of(&clip.skeleton, &facing, &clip.poses[10]);
    let angle = facing.angle(&world(&pose_of(&numbers, &clip.poses[0])));
    assert!(angle.abs() < 1e-9, "{angle}");
    assert_eq!(turned, frame);
}

fn given(keys: &[usize]) -> GivenWindow {
    let wave = |(row, column): (usize, usize)| (0.7 * (row * 13 + column) as f64).sin();
    GivenWindow {
        seed: Array2::from_shape_fn((WINDOW.seed, 147), wave),
        music: Array2::from_shape_fn((WINDOW.length, 15), wave),
        key_poses: keys.iter().map(|&key| (key, vec![0.5; 144])).collect(),
    }
}

#[test]
fn local_positions_are_distances_to_the_known_frames_around() {
    let batch = Batch::<f64>::of(&[given(&[10, 20])], &[], &WINDOW, &LossConfig::default());
    let positions = batch.local_positions(8);
    let table = sinusoidal_positions(WINDOW.length, 4);
    let mut known: Vec<usize> = (0..WINDOW.seed).collect();
    known.extend([10, 20]);
    for (frame, row) in positions.rows().into_iter().enumerate() {
        let before = known.iter().rev().find(|&&it| it <= frame).unwrap();
        assert_eq!(row.slice(s![..4]), table.row(frame - before));
        match known.iter().find(|&&it| it >= frame) {
            Some(after) => assert_eq!(row.slice(s![4..]), table.row(after - frame)),
            None => assert_eq!(row.slice(s![4..]).to_vec(), [0.0; 4]),
        }
    }
}

#[test]
fn the_loss_weighs_frames_by_equation_15_the_root_and_velocities_and_means_over_frames() {
    let loss = LossConfig {
        lambda: 3.0,
        sigma: 0.1,
        root_weight: 4.0,
        velocity_weight: 7.0,
    };
    let keys = [9, 21];
    let weights = frame_weights(&keys, &WINDOW, &loss);
    for (weight, frame) in weights.iter().zip(6_i32..30) {
        let near = keys.map(|key| {
            let distance = f64::from(frame - key as i32) / (0.1 * 24.0);
            (-distance * distance / 2.0).exp()
        });
        assert!((weight - (1.0 + 3.0 * near[0].max(near[1]))).abs() < 1e-12);
    }
    assert_eq!(frame_weights(&[], &WINDOW, &loss), [1.0; 24]);

    let settings = Pu2022Settings {
        window: WINDOW,
        loss: loss.clone(),
        ..config()
            .model
            .downcast_ref::<Pu2022Settings>()
            .unwrap()
            .clone()
    };
    let mut parameters = Parameters::<f64>::new();
    let rng = ChaCha8Rng::seed_from_u64(1);
    let mut init = Initialiser::new(&mut parameters, rng);
    let network = Pu2022::new(&mut init, &settings, 24, 15).unwrap();
    let truths = [0.3, -0.2].map(|x| Array2::from_elem((24, 147), x));
    let windows = [given(&keys), given(&[])];
    let batch = Batch::of(&windows, &truths, &WINDOW, &loss);
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&parameters, &mut workspace);
    let said = network.forward(&mut tape, &batch).unwrap();
    let said = tape.values(said).to_vec();
    let losses = network.losses(&mut tape, &batch).unwrap();
    let mut expected = 0.0;
    for (window, (truth, keys)) in truths.iter().zip([&keys[..], &[]]).enumerate() {
        let weights = frame_weights(keys, &WINDOW, &loss);
        let error = |frame: usize, number| {
            truth[[frame, number]] - said[(window * 24 + frame) * 147 + number]
        };
        for (frame, weight) in weights.iter().enumerate() {
            for number in 0..147 {
                let root = if number < 144 { 1.0 } else { 4.0 };
                let error_at = error(frame, number);
                // The frame before the first is the seed's, which is no error.
                let before = frame
                    .checked_sub(1)
                    .map_or(0.0, |before| error(before, number));
                let change = error_at - before;
                expected += root * weight * error_at.powi(2) / 48.0;
                expected += root * 7.0 * change.powi(2) / 48.0;
            }
        }
    }
    let total = tape.values(losses.total)[0];
    assert!(
        (total - expected).abs() < 1e-9 * expected,
        "{total}, {expected}"
    );
}

#[test]
fn key_frames_are_drawn_apart_and_as_many_as_may_be() {
    let (window, schedule) = (WindowConfig::default(), ScheduleConfig::default());
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut counts = [0; 7];
    let mut seen = [false; 180];
    for _ in 0..3000 {
        let keys = draw_keys(&mut rng, &window, &schedule);
        assert!(keys.iter().all(|key| (60..240).contains(key)));
        assert!(keys.windows(2).all(|pair| pair[1] >= pair[0] + 10));
        counts[keys.len()] += 1;
        keys.iter().for_each(|key| seen[key - 60] = true);
    }
    // 3000 / 7 each, within five deviations.
    assert!(
        counts.iter().all(|&count| (333..525).contains(&count)),
        "{counts:?}"
    );
    assert!(seen.iter().all(|&seen| seen));

    // Every start is as likely, and a clip that is too short is never drawn.
    let starts = [3, 0, 1];
    let mut places = [0; 4];
    for index in 0..2000 {
        let drawn = draw(
            Streams::new(1),
            [4, index],
            &starts,
            &window,
            &schedule,
            false,
        );
        assert!(drawn.start < starts[drawn.clip]);
        places[[0, 3, 3][drawn.clip] + drawn.start] += 1;
    }
    let [first, second, third, last] = places;
    assert_eq!(first + second + third + last, 2000);
    assert!(
        places.iter().all(|&count| (400..600).contains(&count)),
        "{places:?}"
    );
}

#[test]
fn a_training_that_was_stopped_ends_at_the_same_bits_on_any_number_of_threads() {
    let config = config();
    let data = dataset(&config, 80);
    let mut whole = Trainer::new(config.clone(), &data, 1).unwrap();
    assert_eq!(train(&mut whole, None, u64::MAX), Outcome::Finished);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let run = RunFolder::create(&path, &config).unwrap();
    let mut first = Trainer::new(config.clone(), &data, 2).unwrap();
    assert_eq!(train(&mut first, Some(&run), 4), Outcome::Stopped);
    drop((first, run));
    let run = RunFolder::resume(&path, &config).unwrap();
    let mut second = Trainer::new(config, &data, 3).unwrap();
    assert_eq!(second.resume(&run).unwrap().steps, 4);
    assert_eq!(train(&mut second, Some(&run), u64::MAX), Outcome::Finished);
    assert_eq!(second.weights_digest(), whole.weights_digest());
}

fn request(data: &Dataset, frames: usize, keys: &[usize]) -> Request {
    let recording = &DataPart::Test.of(data).unwrap()[0];
    let clip = &recording.clip;
    let features = recording
        .music
        .as_ref()
        .unwrap()
        .features(FeatureSet::Paper15);
    let known = (0..WINDOW.seed).chain(keys.iter().copied());
    let given = known.map(|frame| Given {
        frame: frame as i64,
        pose: clip.poses[frame].clone(),
        features: None,
    });
    Request {
        given: given.collect(),
        music: Some(features.slice(s![..frames, ..]).mapv(f64::from)),
        ..Request::new(clip.skeleton.clone(), clip.frame_time, frames)
    }
}

#[test]
fn a_dance_goes_on_window_by_window_and_joins_at_late_key_poses() {
    let config = config();
    let data = dataset(&config, 120);
    let trainer = Trainer::new(config, &data, 1).unwrap();
    let model = trainer.model();
    assert_eq!(model.needs().poses, NeededPoses::Seed(6));
    assert!(model.needs().reads(Condition::Music));
    let whole = &model
        .generate(&[request(&data, 100, &[20, 26, 70])])
        .unwrap()[0];
    let poses = whole.poses.as_ref().unwrap();
    let raw = whole.raw.as_ref().unwrap();
    assert_eq!((poses.len(), raw.dim()), (100, (94, 147)));
    let recorded = &DataPart::Test.of(&data).unwrap()[0].clip.poses;
    assert_eq!(poses[..6], recorded[..6]);
    assert_eq!(whole.pieces, [6, 27, 51, 71, 95]);

    // What comes first does not depend on what is asked for after the window.
    let short = &model.generate(&[request(&data, 30, &[20, 26])]).unwrap()[0];
    assert_eq!(short.poses.as_ref().unwrap()[..27], poses[..27]);
    // The key pose at 26 lies in the window's last 6 frames, so the next begins there: at 27.
    let mut later = request(&data, 100, &[]);
    later.frames = 50;
    let shift = 21;
    later.given = (0..6)
        .map(|frame| Given {
            frame,
            pose: poses[shift + frame as usize].clone(),
            features: None,
        })
        .collect();
    let music = later.music.unwrap();
    later.music = Some(music.slice(s![shift..shift + 50, ..]).to_owned());
    let later = &model.generate(&[later]).unwrap()[0];
    let next = later.poses.as_ref().unwrap();
    for frame in 6..30 {
        let (a, b) = (&next[frame], &poses[shift + frame]);
        // The network computes in f32.
        assert!(
            a.translations[0].distance(b.translations[0]) < 1e-3,
            "{frame}"
        );
    }
    // A window has half of its frames before a key pose that the one before cannot see.
    let soon = &model
        .generate(&[request(&data, 100, &[20, 26, 60])])
        .unwrap()[0];
    assert_eq!(soon.pieces, [6, 27, 48, 72, 96]);
}

#[test]
fn a_turn_of_seed_and_key_poses_turns_the_dance() {
    let config = config();
    let data = dataset(&config, 120);
    let trainer = Trainer::new(config, &data, 1).unwrap();
    let asked = request(&data, 60, &[20, 50]);
    let turn = DQuat::from_rotation_y(-2.0);
    let mut turned = asked.clone();
    for given in &mut turned.given {
        given.pose.rotations[0] = turn * given.pose.rotations[0];
        given.pose.translations[0] = turn * given.pose.translations[0] + DVec3::Z;
    }
    let motions = trainer.model().generate(&[asked, turned]).unwrap();
    let [poses, turned] = [0, 1].map(|k| motions[k].poses.as_ref().unwrap());
    for (pose, turned) in poses.iter().zip(turned) {
        let place = turn * pose.translations[0] + DVec3::Z;
        assert!(place.distance(turned.translations[0]) < 1e-3);
        assert!((turn * pose.rotations[0]).dot(turned.rotations[0]).abs() > 1.0 - 1e-6);
    }
}

#[test]
fn what_a_request_lacks_is_named() {
    let config = config();
    let data = dataset(&config, 120);
    let trainer = Trainer::new(config.clone(), &data, 1).unwrap();
    let model = trainer.model();
    let text = |change: &dyn Fn(&mut Request)| {
        let mut asked = request(&data, 60, &[20, 50]);
        change(&mut asked);
        model.generate(&[asked]).unwrap_err().to_string()
    };
    assert_eq!(text(&|it| it.music = None), "pu needs the music");
    let lacking = text(&|it| {
        it.given.remove(2);
    });
    assert_eq!(lacking, "pu needs the poses of the first 6 frames");
    let other = text(&|it| it.music = Some(Array2::zeros((60, 35))));
    assert!(other.contains("[60, 35], expected [60, 15]"), "{other}");
    let short = text(&|it| it.music = Some(Array2::zeros((50, 15))));
    assert!(short.contains("music has shape [50, 15]"), "{short}");
    let beyond = text(&|it| it.given[7].frame = 60);
    assert!(beyond.contains("a key pose at frame 60"), "{beyond}");
    let twice = text(&|it| it.given[7].frame = 20);
    assert!(twice.contains("two key poses at frame 20"), "{twice}");
    let mut deaf = dataset(&config, 120);
    deaf.train[0].music = None;
    let error = Trainer::new(config, &deaf, 1).err().unwrap();
    let error = format!("{:#}", anyhow::Error::from(error));
    assert!(error.contains("comes without music"), "{error}");
}
