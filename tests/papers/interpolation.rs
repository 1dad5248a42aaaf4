//! The interpolation baseline: its ends, its middle, and its scores on real clips.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use keydance::data::{DataConfig, DataPart, Dataset};
use keydance::evaluation::Protocol as _;
use keydance::evaluation::equations::Equations;
use keydance::evaluation::transitions::TransitionScoring;
use keydance::models::ModelError;
use keydance::models::baselines::interpolation::Interpolation;
use keydance::models::transition::{KeyframePose, Transition, TransitionModel, TransitionRequest};
use keydance::motion::features::{
    BODY_POSITIONS, BODY_VELOCITIES, CONTACTS, FACING, FRAME, ROOT_POSITION, ROOT_VELOCITY,
};
use keydance::motion::{
    Clip, DANCE_JOINTS, DANCE_PARENTS, FeatureConfig, Joint, Pose, Skeleton, features,
};
use ndarray::{Array2, s};
use proptest::prelude::*;

/// A dancer whose left arm bones lie along X and all other bones along Y.
fn skeleton() -> Skeleton {
    let joints = DANCE_JOINTS
        .iter()
        .zip(DANCE_PARENTS)
        .map(|(name, parent)| Joint {
            name: name.to_string(),
            parent,
            offset: match *name {
                "LeftUpLeg" | "LeftArm" | "LeftForeArm" | "LeftHand" => DVec3::X * 20.0,
                "RightUpLeg" | "RightArm" => DVec3::X * -20.0,
                _ if name.contains("Leg") || name.contains("Foot") => DVec3::Y * -40.0,
                _ => DVec3::Y * 12.0,
            },
            end_sites: Vec::new(),
        })
        .collect();
    Skeleton { joints }
}

fn pose(root: DVec3, rotations: Vec<DQuat>) -> Pose {
    let mut translations: Vec<DVec3> = skeleton().joints.iter().map(|joint| joint.offset).collect();
    translations[0] = root;
    Pose {
        translations,
        rotations,
    }
}

/// The request between two poses, its features measured on each pose by itself.
fn request(start: Pose, target: Pose, trajectory: Array2<f64>) -> TransitionRequest {
    let keyframe = |pose: Pose| {
        let clip = Clip {
            name: "one frame".into(),
            skeleton: skeleton(),
            frame_time: 1.0 / 30.0,
            poses: vec![pose.clone()],
        };
        let features = features(&clip, &FeatureConfig::default()).unwrap();
        KeyframePose {
            features: features.row(0).to_owned(),
            pose,
        }
    };
    TransitionRequest {
        skeleton: skeleton(),
        start: keyframe(start),
        target: keyframe(target),
        velocity_factors: Array2::zeros((trajectory.nrows(), 5)),
        root_trajectory: trajectory,
    }
}

fn straight(from: DVec3, to: DVec3, length: usize) -> Array2<f64> {
    Array2::from_shape_fn((length + 1, 3), |(row, axis)| {
        from.lerp(to, row as f64 / length as f64)[axis]
    })
}

fn interpolate(request: &TransitionRequest) -> Array2<f64> {
    let mut transitions = Interpolation::default()
        .transitions(std::slice::from_ref(request))
        .unwrap();
    assert_eq!(transitions.len(), 1);
    transitions.remove(0).frames
}

fn joint(frames: &Array2<f64>, step: usize, joint: usize) -> DVec3 {
    let at = BODY_POSITIONS.start + 3 * (joint - 1);
    DVec3::new(
        frames[[step, at]],
        frames[[step, at + 1]],
        frames[[step, at + 2]],
    )
}

fn rotation() -> impl Strategy<Value = DQuat> {
    prop::array::uniform4(-1.0..1.0f64)
        .prop_filter("a direction", |q| {
            q.iter().map(|x| x * x).sum::<f64>() > 0.01
        })
        .prop_map(|q| DQuat::from_array(q).normalize())
}

fn any_pose() -> impl Strategy<Value = Pose> {
    let root = prop::array::uniform3(-200.0..200.0f64).prop_map(DVec3::from);
    (root, prop::collection::vec(rotation(), 24))
        .prop_map(|(root, rotations)| pose(root, rotations))
}

proptest! {
    #[test]
    fn the_last_frame_is_the_target_keyframe(start in any_pose(), target in any_pose(), length in 1usize..9) {
        let trajectory = straight(start.translations[0], target.translations[0], length);
        let request = request(start, target, trajectory.clone());
        let frames = interpolate(&request);
        prop_assert_eq!(frames.dim(), (length, FRAME));
        for column in BODY_POSITIONS {
            prop_assert!((frames[[length - 1, column]] - request.target.features[column]).abs() < 1e-9);
        }
        prop_assert_eq!(frames.slice(s![.., ROOT_POSITION]), trajectory.slice(s![1.., ..]));
        let turn = frames[[length - 1, FACING.start]] - request.target.features[FACING.start];
        prop_assert!((turn.rem_euclid(2.0 * PI) - PI).abs() > PI - 1e-9, "off by {turn}");
    }

    #[test]
    fn bones_keep_their_length(start in any_pose(), target in any_pose()) {
        let request = request(start, target, Array2::zeros((6, 3)));
        let frames = interpolate(&request);
        for step in 0..5 {
            for (index, parent) in DANCE_PARENTS.iter().enumerate().skip(1) {
                let parent = match parent {
                    Some(parent) if *parent > 0 => joint(&frames, step, *parent),
                    _ => DVec3::ZERO,
                };
                let length = joint(&frames, step, index).distance(parent);
                prop_assert!((length - skeleton().joints[index].offset.length()).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn velocities_are_the_differences_of_positions(start in any_pose(), target in any_pose()) {
        let request = request(start, target, straight(DVec3::ZERO, DVec3::ONE, 4));
        let frames = interpolate(&request);
        let mut before = request.start.features.slice(s![..FRAME]).to_owned();
        for frame in frames.rows() {
            for (velocity, position) in BODY_VELOCITIES.zip(BODY_POSITIONS).chain(ROOT_VELOCITY.zip(ROOT_POSITION)) {
                prop_assert!((frame[velocity] - (frame[position] - before[position])).abs() < 1e-9);
            }
            before = frame.to_owned();
        }
    }

    #[test]
    fn the_pose_does_not_depend_on_where_the_dancer_faces(start in any_pose(), target in any_pose(), turn in -3.0..3.0f64) {
        let turned = |pose: &Pose| {
            let mut pose = pose.clone();
            pose.rotations[0] = DQuat::from_rotation_y(turn) * pose.rotations[0];
            pose
        };
        let straight_on = interpolate(&request(start.clone(), target.clone(), Array2::zeros((5, 3))));
        let turned = interpolate(&request(start.clone(), turned(&target), Array2::zeros((5, 3))));
        for (a, b) in straight_on.slice(s![.., BODY_POSITIONS]).iter().zip(turned.slice(s![.., BODY_POSITIONS])) {
            prop_assert!((a - b).abs() < 1e-6, "{a} and {b}");
        }
    }
}

/// Joint 20 (LeftForeArm) bends by `angle` about Z; the hand hangs 20 cm along X from it.
fn bent(angle: f64) -> Pose {
    let mut rotations = vec![DQuat::IDENTITY; 24];
    rotations[20] = DQuat::from_rotation_z(angle);
    pose(DVec3::Y * 90.0, rotations)
}

#[test]
fn halfway_a_single_joint_has_turned_half_the_angle() {
    let request = request(bent(0.0), bent(FRAC_PI_2), Array2::zeros((3, 3)));
    let frames = interpolate(&request);
    let hand = joint(&frames, 0, 21) - joint(&frames, 0, 20);
    let half = DVec3::new(FRAC_PI_4.cos(), FRAC_PI_4.sin(), 0.0) * 20.0;
    assert!(hand.distance(half) < 1e-9, "{hand}");
}

#[test]
fn rotations_go_the_shorter_way_whatever_the_sign_of_the_quaternion() {
    let mut target = bent(FRAC_PI_2);
    target.rotations[20] = -target.rotations[20];
    let frames = interpolate(&request(bent(0.0), target, Array2::zeros((3, 3))));
    let hand = joint(&frames, 0, 21) - joint(&frames, 0, 20);
    let half = DVec3::new(FRAC_PI_4.cos(), FRAC_PI_4.sin(), 0.0) * 20.0;
    assert!(hand.distance(half) < 1e-9, "{hand}");
}

#[test]
fn the_facing_angle_goes_the_shorter_way_round() {
    let facing = |angle: f64| {
        let mut rotations = vec![DQuat::IDENTITY; 24];
        rotations[0] = DQuat::from_rotation_y(angle);
        pose(DVec3::Y * 90.0, rotations)
    };
    let frames = interpolate(&request(facing(3.0), facing(-3.0), Array2::zeros((3, 3))));
    let angles = frames.column(FACING.start);
    assert!((angles[0] - PI).abs() < 1e-9, "{angles}");
    assert!((angles[1] - (2.0 * PI - 3.0)).abs() < 1e-9, "{angles}");
}

#[test]
fn feet_that_slide_with_the_root_are_not_in_contact() {
    let slow = DVec3::new(0.44, 0.0, 0.0);
    let fast = DVec3::new(0.45, 0.0, 0.0);
    for (step, label) in [(slow, 1.0), (fast, 0.0)] {
        let trajectory = straight(DVec3::Y * 90.0, DVec3::Y * 90.0 + 4.0 * step, 4);
        let frames = interpolate(&request(bent(0.0), bent(0.0), trajectory));
        assert!(
            frames.slice(s![.., CONTACTS]).iter().all(|&c| c == label),
            "{step}"
        );
    }
}

#[test]
fn requests_that_do_not_fit_are_errors_not_panics() {
    let good = request(bent(0.0), bent(1.0), Array2::zeros((4, 3)));
    let attempt = |change: &dyn Fn(&mut TransitionRequest)| {
        let mut request = good.clone();
        change(&mut request);
        Interpolation::default().transitions(&[good.clone(), request])
    };
    let rejected: [Result<Vec<Transition>, ModelError>; 5] = [
        attempt(&|request| request.root_trajectory = Array2::zeros((1, 3))),
        attempt(&|request| request.velocity_factors = Array2::zeros((4, 4))),
        attempt(&|request| request.root_trajectory[[2, 1]] = f64::INFINITY),
        attempt(&|request| request.target.features = ndarray::Array1::zeros(149)),
        attempt(&|request| {
            request.start.pose.rotations.pop();
        }),
    ];
    for (index, result) in rejected.iter().enumerate() {
        assert!(result.is_err(), "case {index}");
    }
    assert!(attempt(&|_| {}).is_ok());
}

/// The folder with the dance clips: `KEYDANCE_DATA`, else `../shared/data/dance` beside the
/// repository.
fn dance_data() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/dance");
    let folder = std::env::var_os("KEYDANCE_DATA").map_or_else(beside, PathBuf::from);
    folder.is_dir().then_some(folder)
}

/// The expected numbers come from another implementation of the features and of the protocol, on
/// SciPy's rotations.
#[test]
fn scores_on_the_dance_test_clips_are_those_of_an_independent_implementation() {
    let Some(folder) = dance_data() else {
        println!("skipped: no dance clips; set KEYDANCE_DATA to their folder");
        return;
    };
    let data = Dataset::load(&folder, &DataConfig::default()).unwrap();
    let protocol = Equations(TransitionScoring {
        lengths: vec![10, 50],
        ..TransitionScoring::default()
    });
    let model = Interpolation::default();
    let evaluation = protocol.evaluate(&model, &data, DataPart::Test).unwrap();
    let scores = evaluation.scores;
    println!("{}", serde_json::to_string(&scores).unwrap());
    let counts = [("10".into(), 10316), ("50".into(), 3280)];
    assert_eq!(scores.windows(), counts);
    for (length, lrp, avf) in [(10, 22.8508470, 0.5643660), (50, 95.8120951, 0.1097561)] {
        let at = |metric: &str| scores.row(metric).unwrap().at(length).unwrap();
        let found = at("lrp");
        assert!((found / lrp - 1.0).abs() < 1e-4, "LRP at {length}: {found}");
        let found = at("avf");
        assert!((found - avf).abs() < 1e-3, "AVF at {length}: {found}");
        assert_eq!(at("art"), 1.0);
    }
    assert!(evaluation.warnings.is_empty());
}
