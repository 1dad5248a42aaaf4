//! The baseline that looks motion up in the training clips.

use std::path::Path;

use glam::{DQuat, DVec3};
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::data::{DataConfig, Recording};
use keydance::experiment::ExperimentConfig;
use keydance::models::generator::Given;
use keydance::models::{Generator, ModelError, Request};
use keydance::motion::{Clip, Pose};

/// Generated dances of so many frames.
fn clips(frames: usize) -> Vec<Clip> {
    let config = ChoreographyConfig {
        clips: 3,
        frames_per_clip: frames,
        seed: 8,
    };
    let clips = generate(&config).unwrap().into_iter();
    clips.map(|generated| generated.clip).collect()
}

/// The row of the tables.
fn retrieval() -> Box<dyn Generator> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = root.join("experiments/pu2022/retrieval.toml");
    let config = ExperimentConfig::load(&file, &[]).unwrap();
    config.model.untrained(&DataConfig::default()).unwrap()
}

fn looking_in(clips: &[Clip]) -> Box<dyn Generator> {
    let recordings: Vec<Recording> = clips.iter().cloned().map(Recording::of).collect();
    let mut model = retrieval();
    model.look_up_in(&recordings).unwrap();
    model
}

/// Asks for as many frames as a dance has: given are 60 of seed and these key poses.
fn asked(like: &Clip, dance: &[Pose], keys: &[usize]) -> Request {
    let mut request = Request::new(like.skeleton.clone(), like.frame_time, dance.len());
    let frames = (0..60).chain(keys.iter().copied());
    let given = frames.map(|frame| Given {
        frame: frame as i64,
        pose: dance[frame].clone(),
        features: None,
    });
    request.given = given.collect();
    request
}

fn dance(model: &dyn Generator, request: Request) -> Result<Vec<Pose>, ModelError> {
    let motion = model.generate(&[request])?.remove(0);
    Ok(motion.poses.unwrap())
}

#[test]
fn a_dance_made_of_a_training_stretch_is_found_again_wherever_it_stands() {
    let clips = clips(400);
    let (turn, by) = (DQuat::from_rotation_y(1.3), DVec3::new(210.0, 0.0, -70.0));
    let mut there = clips[1].poses[130..310].to_vec();
    for pose in &mut there {
        pose.rotations[0] = turn * pose.rotations[0];
        pose.translations[0] = turn * pose.translations[0] + by;
    }
    // The last 30 frames have no key pose after them.
    let request = asked(&clips[1], &there, &[104, 149]);
    let found = dance(&*looking_in(&clips), request).unwrap();
    assert_eq!(found.len(), 180);
    for (found, there) in found.iter().zip(&there) {
        let [found, there] = [found, there].map(|it| it.world_positions(&clips[1].skeleton));
        let distances = found.iter().zip(&there).map(|(a, b)| a.distance(*b));
        assert!(distances.fold(0.0, f64::max) < 1e-6);
    }
}

#[test]
fn what_is_not_among_the_training_clips_meets_its_key_poses_without_a_jump() {
    let clips = clips(400);
    let (others, unknown) = (&clips[..2], &clips[2]);
    let keys = [75, 104, 149];
    let request = asked(unknown, &unknown.poses[..180], &keys);
    let model = looking_in(others);
    let made = dance(&*model, request.clone()).unwrap();
    assert_eq!(made[..60], unknown.poses[..60]);
    for key in keys {
        let pairs = made[key]
            .rotations
            .iter()
            .zip(&unknown.poses[key].rotations);
        assert!(pairs.fold(0.0, |most: f64, (a, b)| most.max(a.angle_between(*b))) < 1e-6);
    }
    // Another dance all the same.
    let apart = made[120]
        .rotations
        .iter()
        .zip(&unknown.poses[120].rotations);
    assert!(apart.fold(0.0, |most: f64, (a, b)| most.max(a.angle_between(*b))) > 0.1);
    let steps = |poses: &[Pose]| {
        let step = |pair: &[Pose]| pair[0].translations[0].distance(pair[1].translations[0]);
        poses.windows(2).map(step).fold(0.0, f64::max)
    };
    let recorded = clips
        .iter()
        .map(|clip| steps(&clip.poses))
        .fold(0.0, f64::max);
    assert!(steps(&made) < 1.5 * recorded);
    // Where a key pose has its root is not asked.
    let mut elsewhere = request;
    for given in &mut elsewhere.given[60..] {
        given.pose.translations[0] += DVec3::new(300.0, 20.0, 100.0);
    }
    for (pose, made) in dance(&*model, elsewhere).unwrap().iter().zip(&made) {
        assert!(pose.translations[0].distance(made.translations[0]) < 1e-6);
    }
}

#[test]
fn after_the_last_key_pose_it_goes_on_as_what_is_nearest_to_that_one_did() {
    let clips = clips(400);
    let request = asked(&clips[0], &clips[0].poses[100..300], &[]);
    let made = dance(&*looking_in(&clips[..1]), request).unwrap();
    for (made, recorded) in made.iter().zip(&clips[0].poses[100..]) {
        assert!(made.translations[0].distance(recorded.translations[0]) < 1e-6);
    }
}

#[test]
fn clips_that_it_lacks_or_that_are_too_short_are_named_with_what_to_do() {
    let clips = clips(150);
    let request = || asked(&clips[0], &clips[0].poses[..120], &[]);
    let error = dance(&*retrieval(), request()).unwrap_err().to_string();
    assert!(
        error.contains("training clips") && error.contains("--data"),
        "{error}"
    );
    let mut long = request();
    long.frames = 400;
    let error = dance(&*looking_in(&clips), long).unwrap_err().to_string();
    assert!(
        error.contains("the 341 frames from frame 59 to frame 399") && error.contains("has 150"),
        "{error}"
    );
    let mut other = clips[0].clone();
    other.skeleton.joints[3].name = "Ankle".into();
    let both = [clips[0].clone(), other].map(Recording::of);
    assert!(retrieval().look_up_in(&both).is_err());
    assert!(retrieval().look_up_in(&[]).is_err());
}
