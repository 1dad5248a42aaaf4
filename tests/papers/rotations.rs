//! What Li et al. and Duan et al. share: windows, schedule, training, gradients, answers.

use std::ops::ControlFlow;

use glam::{DQuat, DVec3};
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::data::{DataPart, Dataset, Window};
use keydance::experiment::ExperimentConfig;
use keydance::models::generator::{Given, NeededPoses, Request};
use keydance::models::rotations::{LengthConfig, Schedule, ScheduleConfig};
use keydance::models::settings::GradientCheckOptions;
use keydance::models::{ModelError, Streams};
use keydance::run::RunFolder;
use keydance::training::{Outcome, Trainer};
use ndarray::Array2;

use crate::lafan1_data::lafan1_folder;
use crate::real_data::dance_folder;

const LI: &str = "name = 'li'\ndata.split = { share = 0.7 }\n\
    [model]\nkind = 'li2023'\nwidth = 4\nheads = 2\nlayers = 2\n\
    [schedule]\nfraction = 0.002\nbatch_size = 5\nshards = 3\n\
    [augmentation]\nmirror = true\ntempi = [1.25]\n[checkpoint]\nevery_steps = 3\n";
const DUAN: &str = "name = 'duan'\ndata.split = { share = 0.7 }\n\
    [model]\nkind = 'duan2022'\nwidth = 8\nheads = 2\nlayers = 1\nfeed_forward = 8\n\
    [schedule]\nfraction = 0.002\nbatch_size = 5\n[checkpoint]\nevery_steps = 3\n";
/// With critics, and a past before the first keyframe.
const HARVEY: &str = "name = 'harvey'\ndata.split = { share = 0.7 }\n\
    [model]\nkind = 'harvey2020_rotations'\npast = 3\nhidden = 8\ncode = 8\nrecurrent = 8\n\
    [schedule]\nfraction = 0.002\nbatch_size = 5\nshards = 2\n[checkpoint]\nevery_steps = 3\n";

fn dataset(config: &ExperimentConfig) -> Dataset {
    let choreography = ChoreographyConfig {
        clips: 4,
        frames_per_clip: 120,
        seed: 2,
    };
    let clips = generate(&choreography).unwrap().into_iter();
    Dataset::from_clips(clips.map(|it| it.clip).collect(), &config.data).unwrap()
}

fn train(trainer: &mut Trainer<'_>, run: Option<&RunFolder>, stop: u64) -> Outcome {
    let outcome = trainer.run(run, &mut |report| match report.step == stop {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    });
    outcome.unwrap()
}

#[test]
fn a_training_that_was_stopped_ends_at_the_same_bits_on_any_number_of_threads() {
    for text in [LI, DUAN, HARVEY] {
        let config = ExperimentConfig::parse(text, "test").unwrap();
        let data = dataset(&config);
        let mut whole = Trainer::new(config.clone(), &data, 1).unwrap();
        assert_eq!(train(&mut whole, None, u64::MAX), Outcome::Finished);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        let run = RunFolder::create(&path, &config).unwrap();
        let mut first = Trainer::new(config.clone(), &data, 2).unwrap();
        assert_eq!(train(&mut first, Some(&run), 2), Outcome::Stopped);
        drop((first, run));
        let run = RunFolder::resume(&path, &config).unwrap();
        let mut second = Trainer::new(config, &data, 3).unwrap();
        assert_eq!(second.resume(&run).unwrap().steps, 2);
        assert_eq!(train(&mut second, Some(&run), u64::MAX), Outcome::Finished);
        assert_eq!(second.weights_digest(), whole.weights_digest());
    }
}

#[test]
fn gradients_are_those_of_central_differences_in_every_row() {
    let options = GradientCheckOptions {
        frames: Some(6),
        windows: 2,
        per_parameter: 2,
        seed: 3,
        full_size: false,
    };
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/li2023");
    let mut checked = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.file_name().is_some_and(|name| name == "paper.toml") {
            continue;
        }
        // Once a row, and the open points of the whole model.
        let whole = path.ends_with("ours.toml");
        let points = ["loss.reconstruction=norm", "model.state_decoder=conv3"];
        let points = points.into_iter().filter(|_| whole);
        for set in ["seed=1"].into_iter().chain(points) {
            let Ok(config) = ExperimentConfig::load(&path, &[set.into()]) else {
                continue;
            };
            let Ok(reports) = config.model.check_gradients(&options) else {
                assert!(config.model.untrained(&config.data).is_some(), "{path:?}");
                continue;
            };
            for (title, report) in reports {
                assert!(
                    report.error() < 1e-5,
                    "{path:?} {set} {title}: {}",
                    report.error()
                );
                checked += report.compared();
            }
        }
    }
    assert!(checked > 1000, "{checked}");
}

#[test]
fn every_epoch_trains_each_window_once_at_a_length_drawn_for_the_batch() {
    let config = ScheduleConfig {
        window: 20,
        offset: 5,
        lengths: LengthConfig { min: 5, max: 20 },
        epochs: 3,
        batch_size: 4,
        ..ScheduleConfig::default()
    };
    let schedule = Schedule::new(&[40, 19, 33], 0, &config, Streams::new(1));
    // 0, 5, .. 20 of the first clip, 0, 5, 10 of the last.
    assert_eq!(schedule.windows().len(), 8);
    assert_eq!((schedule.steps(), schedule.whole_steps()), (6, 6));
    let mut frames = 0;
    for epoch in 0..3 {
        let windows = schedule.epoch(epoch);
        let mut sorted = windows.clone();
        sorted.sort_by_key(|window| (window.clip, window.start));
        assert_eq!(sorted, schedule.windows());
        for batch in 0..2 {
            let plan = schedule.plan(2 * epoch + batch, &windows);
            assert!((5..=20).contains(&plan.frames));
            let own = &windows[4 * batch as usize..4 * batch as usize + 4];
            for (window, Window { clip, start }) in plan.windows.iter().zip(own) {
                assert_eq!(window.clip, *clip);
                assert!((*start..=start + 20 - plan.frames).contains(&window.start));
            }
            frames += (4 * plan.frames) as u64;
        }
    }
    assert_eq!(schedule.frame_steps(), frames);
}

#[test]
fn training_windows_are_counted_as_the_papers_are() {
    for (folder, experiment, windows) in [
        (dance_folder(), "li2023", 8906),
        (lafan1_folder(), "li2023_lafan1", 2353),
    ] {
        let Some(folder) = folder else { continue };
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
        let path = path.join(experiment).join("ours.toml");
        let sets = ["schedule.frame_steps=1".into(), "model.layers=1".into()];
        let config = ExperimentConfig::load(&path, &sets).unwrap();
        let data = Dataset::load(&folder, &config.data).unwrap();
        let trainer = Trainer::new(config, &data, 1).unwrap();
        assert_eq!(trainer.task().facts()["training_windows"], windows);
    }
}

/// The first test clip's frames at these places as keyframes.
fn request(data: &Dataset, frames: &[usize]) -> Request {
    let clip = &DataPart::Test.of(data).unwrap()[0].clip;
    let first = frames[0];
    let last = frames[frames.len() - 1] - first + 1;
    let given = frames.iter().map(|&frame| Given {
        frame: (frame - first) as i64,
        pose: clip.poses[frame].clone(),
        features: None,
    });
    Request {
        given: given.collect(),
        contacts: Some(Array2::from_elem((last, 2), 0.5)),
        ..Request::new(clip.skeleton.clone(), clip.frame_time, last)
    }
}

#[test]
fn a_dance_longer_than_a_window_goes_on_where_the_piece_before_ends() {
    let config = ExperimentConfig::parse(LI, "test").unwrap();
    let data = dataset(&config);
    let trainer = Trainer::new(config, &data, 1).unwrap();
    let model = trainer.model();
    let long = request(&data, &[0, 30, 60, 90]);
    let short = request(&data, &[30, 60]);
    let motions = model.generate(&[long, short]).unwrap();
    let poses: Vec<_> = motions
        .iter()
        .map(|it| it.poses.as_ref().unwrap())
        .collect();
    assert_eq!((poses[0].len(), poses[1].len()), (91, 31));
    let clip = &DataPart::Test.of(&data).unwrap()[0].clip;
    for frame in [0, 30, 60, 90] {
        assert_eq!(poses[0][frame].rotations, clip.poses[frame].rotations);
    }
    // 0 to 30 is a window of its own, and so is 30 to 60: the same dance elsewhere.
    let moved = poses[0][30].translations[0] - poses[1][0].translations[0];
    for frame in 0..=30 {
        let (a, b) = (&poses[0][30 + frame], &poses[1][frame]);
        assert!((a.translations[0] - b.translations[0]).distance(moved) < 1e-9);
        assert!(
            a.rotations
                .iter()
                .zip(&b.rotations)
                .all(|(a, b)| a.abs_diff_eq(*b, 1e-12))
        );
    }
}

#[test]
fn answers_do_not_depend_on_what_else_is_asked() {
    let config = ExperimentConfig::parse(LI, "test").unwrap();
    let data = dataset(&config);
    let trainer = Trainer::new(config, &data, 1).unwrap();
    let model = trainer.model();
    let requests = [[0, 30], [10, 40], [5, 17]].map(|frames| request(&data, &frames));
    let together = model.generate(&requests).unwrap();
    for (request, motion) in requests.iter().zip(&together) {
        let alone = model.generate(std::slice::from_ref(request)).unwrap();
        assert_eq!(alone[0], *motion);
    }
}

#[test]
fn what_a_request_lacks_is_named() {
    let config = ExperimentConfig::parse(LI, "test").unwrap();
    let data = dataset(&config);
    let trainer = Trainer::new(config, &data, 1).unwrap();
    let model = trainer.model();
    let ask = |change: &dyn Fn(&mut Request)| -> ModelError {
        let mut asked = request(&data, &[0, 30]);
        change(&mut asked);
        model.generate(&[asked]).unwrap_err()
    };
    let text = |change: &dyn Fn(&mut Request)| ask(change).to_string();
    assert_eq!(text(&|it| it.contacts = None), "li needs the contacts");
    let wrong = text(&|it| it.contacts = Some(Array2::zeros((30, 2))));
    assert!(
        wrong.contains("contacts has shape [30, 2], expected [31, 2]"),
        "{wrong}"
    );
    let wrong = text(&|it| it.contacts = Some(Array2::zeros((31, 4))));
    assert!(wrong.contains("[31, 4], expected [31, 2]"), "{wrong}");
    let wrong = text(&|it| it.skeleton.joints.truncate(23));
    assert!(wrong.contains("23 joints"), "{wrong}");
    let wrong = text(&|it| it.given[1].pose.rotations.truncate(23));
    assert!(wrong.contains("the pose at frame 30"), "{wrong}");
}

/// The request for two keyframes of a test clip with the three frames before the first.
fn request_with_past(data: &Dataset, start: usize, end: usize) -> Request {
    let clip = &DataPart::Test.of(data).unwrap()[0].clip;
    let mut request = request(data, &[start, end]);
    let past = (1..=3).rev().map(|before| Given {
        frame: -(before as i64),
        pose: clip.poses[start - before].clone(),
        features: None,
    });
    request.given.splice(0..0, past);
    request
}

#[test]
fn a_model_with_a_past_heeds_it_and_goes_to_one_keyframe() {
    let config = ExperimentConfig::parse(HARVEY, "test").unwrap();
    let data = dataset(&config);
    let trainer = Trainer::new(config, &data, 1).unwrap();
    let model = trainer.model();
    let past = NeededPoses::Keyframes { past: 3 };
    assert_eq!(model.needs().poses, past);
    let asked = request_with_past(&data, 20, 40);
    let refused = |request: Request| model.generate(&[request]).unwrap_err().to_string();
    let bare = refused(request(&data, &[20, 40]));
    assert_eq!(bare, "harvey needs the 3 poses before frame 0");
    let mut two = asked.clone();
    let mut middle = two.given[3].clone();
    middle.frame = 10;
    two.given.insert(4, middle);
    let text = refused(two);
    assert!(
        text.contains("goes on from 3 poses to one keyframe"),
        "{text}"
    );
    let mut short = asked.clone();
    short.given[0].pose.rotations.pop();
    let text = refused(short);
    assert!(text.contains("the pose at frame -3"), "{text}");

    let mut still = asked.clone();
    let start = still.given[3].pose.clone();
    still.given[..3]
        .iter_mut()
        .for_each(|it| it.pose = start.clone());
    let motions = model.generate(&[asked.clone(), still]).unwrap();
    let poses = |k: usize| motions[k].poses.clone().unwrap();
    assert_ne!(poses(0)[10].rotations, poses(1)[10].rotations);
    for (frame, given) in [(0, &asked.given[3]), (20, &asked.given[4])] {
        assert_eq!(poses(0)[frame].rotations, given.pose.rotations);
        assert_eq!(poses(0)[frame].translations[0], given.pose.translations[0]);
    }
}

#[test]
fn windows_whose_past_would_lie_before_their_clip_are_not_trained() {
    let config = ScheduleConfig::default();
    let windows = |past: usize| {
        let schedule = Schedule::new(&[90, 59, 50], past, &config, Streams::new(1));
        let windows = schedule.windows().iter();
        windows.map(|it| (it.clip, it.start)).collect::<Vec<_>>()
    };
    let all: Vec<_> = [0, 10, 20, 30, 40].map(|start| (0, start)).into();
    assert_eq!(windows(0), [all.clone(), vec![(1, 0), (2, 0)]].concat());
    assert_eq!(windows(9), all[1..]);
}

#[test]
fn a_turn_of_the_dance_turns_what_a_model_that_faces_the_keyframe_makes() {
    let config = ExperimentConfig::parse(HARVEY, "test").unwrap();
    let data = dataset(&config);
    let trainer = Trainer::new(config, &data, 1).unwrap();
    let asked = request_with_past(&data, 20, 40);
    let turn = DQuat::from_rotation_y(1.1);
    let mut turned = asked.clone();
    for given in &mut turned.given {
        given.pose.rotations[0] = turn * given.pose.rotations[0];
        given.pose.translations[0] = turn * given.pose.translations[0] + DVec3::X;
    }
    let motions = trainer.model().generate(&[asked, turned]).unwrap();
    let [poses, turned] = [0, 1].map(|k| motions[k].poses.as_ref().unwrap());
    for (pose, turned) in poses.iter().zip(turned) {
        let place = turn * pose.translations[0] + DVec3::X;
        // The network computes in f32, with roots of some 100 cm.
        assert!(place.distance(turned.translations[0]) < 1e-3);
        assert!((turn * pose.rotations[0]).dot(turned.rotations[0]).abs() > 1.0 - 1e-6);
    }
}
