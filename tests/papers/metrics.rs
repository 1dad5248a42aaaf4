//! The metrics of eq. 12 to 16 on cases worked out by hand, and the protocol around them.

use glam::{DQuat, DVec3};
use keydance::evaluation::equations::{Equations, WindowScores, foot_skate, means, window_scores};
use keydance::evaluation::transitions::{TransitionProtocol as _, TransitionScoring};
use keydance::evaluation::{EvaluationError, ScoreRow, Scores};
use keydance::models::ModelError;
use keydance::models::baselines::interpolation::Interpolation;
use keydance::models::transition::DanceClip;
use keydance::models::transition::{Transition, TransitionModel, TransitionRequest};
use keydance::motion::features::{BODY_VELOCITIES, CONTACTS, FEATURES, FRAME, ROOT_POSITION};
use keydance::motion::{
    Clip, DANCE_JOINTS, DANCE_PARENTS, FeatureConfig, Joint, Pose, Skeleton, features,
};
use ndarray::{Array2, s};
use proptest::prelude::*;

/// A window at rest at the origin: all 154 numbers 0.
fn still(length: usize) -> Array2<f64> {
    Array2::zeros((length + 1, FEATURES))
}

/// The recorded frames k1 + 1 .. k2 as a prediction.
fn perfect(recorded: &Array2<f64>) -> Transition {
    Transition {
        frames: recorded.slice(s![1.., ..FRAME]).to_owned(),
    }
}

#[test]
fn lrp_is_the_norm_over_all_69_numbers_averaged_over_frames() {
    let recorded = still(4);
    let mut predicted = perfect(&recorded);
    // Frame 1 is off by 3 and 4 cm at two joints: norm 5. Frame 3 by 7 cm at one joint. Frames 2
    // and 4 are right.
    predicted.frames[[0, 0]] = 3.0;
    predicted.frames[[0, 68]] = 4.0;
    predicted.frames[[2, 30]] = -7.0;
    let scores = window_scores(recorded.view(), predicted.frames.view()).unwrap();
    assert_eq!(scores.body_position, (5.0 + 7.0) / 4.0);
    assert_eq!(scores.root, 0.0);
}

#[test]
fn root_deviation_is_the_mean_distance_in_space() {
    let recorded = still(2);
    let mut predicted = perfect(&recorded);
    let offset = ndarray::arr1(&[2.0, 3.0, 6.0]);
    predicted
        .frames
        .slice_mut(s![1, ROOT_POSITION])
        .assign(&offset);
    let scores = window_scores(recorded.view(), predicted.frames.view()).unwrap();
    assert_eq!(scores.root, 7.0 / 2.0);
    assert_eq!(scores.body_position, 0.0);
}

#[test]
fn velocity_factors_come_from_predicted_positions_and_start_at_the_true_keyframe() {
    // The recorded right hand (joint 17, weight 4 of 10) stands 6 cm out at k1 and never moves. The
    // prediction has it at 0 in both frames: a jump of 6 cm in the first, 0 in the second. Right
    // arm: 4 / 10 * 6 = 2.4 in the first frame.
    let mut recorded = still(2);
    let hand = 3 * (17 - 1);
    recorded.column_mut(hand).fill(6.0);
    let mut predicted = perfect(&recorded);
    predicted.frames.column_mut(hand).fill(0.0);
    // What the model says of velocities has no say.
    predicted
        .frames
        .slice_mut(s![.., BODY_VELOCITIES])
        .fill(100.0);
    let scores = window_scores(recorded.view(), predicted.frames.view()).unwrap();
    assert!((scores.velocity_factor - 2.4 / (2.0 * 5.0)).abs() < 1e-12);
}

#[test]
fn foot_skate_counts_where_the_recorded_feet_stand_whatever_the_model_says_of_its_own() {
    // Recorded: the left ankle stands in frames 1 and 2 of 3. Predicted: it goes 2, 4 and 8 cm a
    // frame.
    let mut recorded = still(3);
    recorded[[1, CONTACTS.start]] = 1.0;
    recorded[[2, CONTACTS.start]] = 1.0;
    let mut predicted = perfect(&recorded);
    let ankle = 3 * (3 - 1);
    for (step, place) in [2.0, 6.0, 14.0].into_iter().enumerate() {
        predicted.frames[[step, ankle]] = place;
    }
    predicted.frames.slice_mut(s![.., CONTACTS]).fill(0.0);
    let scores = window_scores(recorded.view(), predicted.frames.view()).unwrap();
    assert_eq!((scores.foot_travel, scores.foot_contacts), (6.0, 2));
    let lifted = window_scores(still(3).view(), predicted.frames.view()).unwrap();
    assert_eq!(foot_skate(&[scores, lifted]), Some(3.0));
    assert_eq!(foot_skate(&[lifted]), None);
}

#[test]
fn the_root_moves_the_trunk_factor() {
    // The root walks 8 cm a frame where it should stand: trunk 1 / 9 * 8.
    let recorded = still(3);
    let mut predicted = perfect(&recorded);
    for step in 0..3 {
        predicted.frames[[step, ROOT_POSITION.start]] = 8.0 * (step + 1) as f64;
    }
    let scores = window_scores(recorded.view(), predicted.frames.view()).unwrap();
    assert!((scores.velocity_factor - 8.0 / 9.0 / 5.0).abs() < 1e-12);
}

#[test]
fn a_window_exactly_at_a_threshold_does_not_count() {
    let window = |velocity_factor, root| WindowScores {
        foot_travel: 0.0,
        foot_contacts: 0,
        body_position: 2.0,
        velocity_factor,
        root,
    };
    let below = |threshold: f64| f64::from_bits(threshold.to_bits() - 1);
    let windows = [
        window(1.0, 7.0),
        window(below(1.0), 7.0),
        window(1.0, below(7.0)),
        window(below(1.0), below(7.0)),
        window(0.0, 8.0),
    ];
    assert_eq!(means(&windows, 1.0, 7.0), [2.0, 3.0 / 5.0, 2.0 / 5.0]);
}

#[test]
fn predictions_that_do_not_fit_are_errors_that_name_both_shapes() {
    let recorded = still(3);
    let short = Transition {
        frames: Array2::zeros((2, FRAME)),
    };
    let error = window_scores(recorded.view(), short.frames.view()).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("[2, 149]") && text.contains("[3, 149]"),
        "{text}"
    );

    let mut wild = perfect(&recorded);
    wild.frames[[1, 4]] = f64::NAN;
    assert!(matches!(
        window_scores(recorded.view(), wild.frames.view()),
        Err(ModelError::NotFinite { .. })
    ));
}

proptest! {
    #[test]
    fn a_perfect_prediction_has_no_error(clip in moving_clip(12)) {
        let window = keydance::models::transition::window_features(&clip.features, 0, 11);
        let scores = window_scores(window.view(), perfect(&window).frames.view()).unwrap();
        prop_assert_eq!(scores.body_position, 0.0);
        prop_assert_eq!(scores.root, 0.0);
        prop_assert!(scores.velocity_factor < 1e-12);
    }

    #[test]
    fn errors_are_those_of_the_norms(shift in prop::array::uniform3(-50.0..50.0f64), clip in moving_clip(6)) {
        let window = keydance::models::transition::window_features(&clip.features, 0, 5);
        let mut predicted = perfect(&window);
        for mut row in predicted.frames.rows_mut() {
            for (axis, by) in shift.iter().enumerate() {
                row[ROOT_POSITION.start + axis] += by;
            }
        }
        let scores = window_scores(window.view(), predicted.frames.view()).unwrap();
        let norm = shift.iter().map(|by| by * by).sum::<f64>().sqrt();
        prop_assert!((scores.root - norm).abs() < 1e-9);
        prop_assert_eq!(scores.body_position, 0.0);
    }
}

/// A dancer that turns, walks and waves with the drawn speeds.
fn moving_clip(frames: usize) -> impl Strategy<Value = DanceClip> {
    (-0.2..0.2f64, -3.0..3.0f64, -0.3..0.3f64)
        .prop_map(move |(turn, walk, wave)| clip("drawn", frames, turn, walk, wave))
}

fn clip(name: &str, frames: usize, turn: f64, walk: f64, wave: f64) -> DanceClip {
    let joints = DANCE_JOINTS
        .iter()
        .zip(DANCE_PARENTS)
        .enumerate()
        .map(|(index, (name, parent))| Joint {
            name: name.to_string(),
            parent,
            offset: match *name {
                "LeftUpLeg" | "LeftArm" => DVec3::new(10.0, 0.0, 0.0),
                "RightUpLeg" | "RightArm" => DVec3::new(-10.0, 0.0, 0.0),
                _ => DVec3::new(0.0, if index < 9 { -20.0 } else { 15.0 }, 1.0),
            },
            end_sites: Vec::new(),
        })
        .collect();
    let skeleton = Skeleton { joints };
    let poses = (0..frames)
        .map(|time| {
            let time = time as f64;
            let mut translations: Vec<DVec3> =
                skeleton.joints.iter().map(|joint| joint.offset).collect();
            translations[0] = DVec3::new(walk * time, 90.0, 0.0);
            let mut rotations = vec![DQuat::IDENTITY; 24];
            rotations[0] = DQuat::from_rotation_y(turn * time);
            rotations[19] = DQuat::from_rotation_x(wave * time);
            Pose {
                translations,
                rotations,
            }
        })
        .collect();
    let clip = Clip {
        name: name.to_string(),
        skeleton,
        frame_time: 1.0 / 30.0,
        poses,
    };
    DanceClip {
        name: name.to_string(),
        features: features(&clip, &FeatureConfig::default()).unwrap(),
        clip,
    }
}

/// Answers every request from the clips themselves, found again by the root trajectory, which the
/// test makes unique.
struct Oracle {
    clips: Vec<DanceClip>,
    root_shift: f64,
}

fn oracle(clips: &[DanceClip], root_shift: f64) -> Oracle {
    let clips = clips.to_vec();
    Oracle { clips, root_shift }
}

impl TransitionModel for Oracle {
    fn name(&self) -> &str {
        "oracle"
    }

    fn transitions(&self, requests: &[TransitionRequest]) -> Result<Vec<Transition>, ModelError> {
        let answer = |request: &TransitionRequest| {
            let length = request.length();
            self.clips.iter().find_map(|clip| {
                let roots = clip.features.slice(s![.., ROOT_POSITION]);
                let start = (0..clip.features.nrows().checked_sub(length)?).find(|&start| {
                    roots.slice(s![start..=start + length, ..]) == request.root_trajectory
                })?;
                let mut transition = perfect(&keydance::models::transition::window_features(
                    &clip.features,
                    start,
                    length,
                ));
                let mut heights = transition.frames.column_mut(ROOT_POSITION.start + 1);
                heights += self.root_shift;
                Some(transition)
            })
        };
        Ok(requests
            .iter()
            .map(|request| answer(request).unwrap())
            .collect())
    }
}

fn clips() -> Vec<DanceClip> {
    vec![
        clip("walks", 61, 0.01, 1.0, 0.1),
        clip("strides", 40, -0.05, -2.5, 0.0),
        clip("brief", 8, 0.0, 0.5, 0.2),
    ]
}

#[test]
fn a_model_that_knows_the_answer_scores_0_1_1_and_a_shifted_one_misses_the_root() {
    let clips = clips();
    let protocol = Equations(TransitionScoring {
        lengths: vec![10, 30],
        chunk: 3,
        ..TransitionScoring::default()
    });
    for (root_shift, art) in [(0.0, 1.0), (6.9, 1.0), (7.0, 0.0), (-8.0, 0.0)] {
        let oracle = oracle(&clips, root_shift);
        let evaluation = protocol.evaluate_clips(&oracle, &clips).unwrap();
        let scores = evaluation.scores;
        let average = |metric: &str| scores.row(metric).unwrap().average();
        assert_eq!(average("lrp"), 0.0);
        assert_eq!(average("art"), art, "shifted by {root_shift}");
        assert_eq!(average("avf"), 1.0);
        // (61 - 11) / 2 + 1 and (40 - 11) / 2 + 1 windows of 11 frames; (61 - 31) / 4 + 1 and
        // (40 - 31) / 4 + 1 of 31.
        let counts = [("10".into(), 26 + 15), ("30".into(), 8 + 3)];
        assert_eq!(scores.windows(), counts);
        let warnings = evaluation.warnings;
        assert_eq!(warnings.len(), 2);
        assert!(warnings[0].contains("brief has 8 frames") && warnings[0].contains("N = 10"));
    }
}

#[test]
fn scores_are_the_same_bits_on_any_number_of_threads() {
    let clips = clips();
    let protocol = Equations(TransitionScoring {
        lengths: vec![10],
        chunk: 4,
        ..TransitionScoring::default()
    });
    let scores = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let model = Interpolation::default();
        let evaluation = pool.install(|| protocol.evaluate_clips(&model, &clips));
        serde_json::to_string(&evaluation.unwrap().scores).unwrap()
    };
    let one = scores(1);
    assert!(
        !one.contains("\"lrp\":{\"10\":0.0,"),
        "nothing to compare: {one}"
    );
    for threads in [2, 3, 7] {
        assert_eq!(scores(threads), one);
    }
}

#[test]
fn a_length_without_windows_is_an_error_that_names_the_longest_clip() {
    let clips = clips();
    let error = Equations::default().evaluate_clips(&oracle(&clips, 0.0), &clips);
    let EvaluationError::NoWindows {
        length,
        needed,
        clips,
        longest,
    } = error.unwrap_err()
    else {
        panic!("another error");
    };
    assert_eq!((length, needed, clips, longest), (100, 101, 3, 61));
}

/// A model that does not do what was asked.
struct Wrong(fn(&[TransitionRequest]) -> Result<Vec<Transition>, ModelError>);

impl TransitionModel for Wrong {
    fn name(&self) -> &str {
        "wrong"
    }

    fn transitions(&self, requests: &[TransitionRequest]) -> Result<Vec<Transition>, ModelError> {
        (self.0)(requests)
    }
}

#[test]
fn a_length_of_0_and_a_model_that_fails_are_errors_that_say_where() {
    let clips = clips();
    let lengths = |lengths: &[usize]| {
        Equations(TransitionScoring {
            lengths: lengths.to_vec(),
            ..TransitionScoring::default()
        })
    };
    let fails = Wrong(|_| {
        Err(ModelError::NotFinite {
            what: "a weight".into(),
        })
    });
    let text = |protocol: Equations, model: &Wrong, clips: &[DanceClip]| {
        let error = protocol.evaluate_clips(model, clips).unwrap_err();
        format!("{:#}", anyhow::Error::from(error))
    };
    assert!(text(lengths(&[0]), &fails, &clips).contains("length 0"));
    let found = text(lengths(&[5]), &fails, &clips);
    let of_a_clip = clips.iter().any(|clip| found.contains(&clip.name));
    assert!(
        found.contains("wrong") && of_a_clip && found.contains("a weight"),
        "{found}"
    );
    let silent = Wrong(|_| Ok(Vec::new()));
    let found = text(lengths(&[5]), &silent, &clips);
    assert!(found.contains("wrong") && found.contains('0'), "{found}");
    let mut short = clips.clone();
    short[0].clip.poses.truncate(7);
    // A model that works: whichever chunk fails first, it is one of this clip's.
    let interpolation = Interpolation::default();
    let error = lengths(&[5]).evaluate_clips(&interpolation, &short);
    let found = format!("{:#}", anyhow::Error::from(error.unwrap_err()));
    assert!(
        found.contains(&short[0].name) && found.contains('7'),
        "{found}"
    );
}

#[test]
fn the_json_has_lengths_as_keys_and_avg_and_reads_back() {
    let row = |values: [f64; 2]| ScoreRow::new([10, 150].into_iter().zip(values)).with_average();
    let rows = [
        ("lrp", row([13.5, 124.5])),
        ("avf", row([0.5, 0.25])),
        ("art", row([1.0, 1.0])),
    ];
    let windows = [(10, 7), (150, 3)];
    let scores = Scores::new(rows.clone(), windows);
    let json = serde_json::to_string(&scores).unwrap();
    assert_eq!(
        json,
        r#"{"lrp":{"10":13.5,"150":124.5,"avg":69.0},"avf":{"10":0.5,"150":0.25,"avg":0.375},"art":{"10":1.0,"150":1.0,"avg":1.0},"windows":{"10":7,"150":3}}"#
    );
    assert_eq!(serde_json::from_str::<Scores>(&json).unwrap(), scores);
    // Scores of a version that did not measure foot skate are read as above; those of this one keep
    // it.
    let skate = [("foot_skate", row([0.5, 1.5]))];
    let with_skate = Scores::new(rows.into_iter().chain(skate), windows);
    let text = serde_json::to_string(&with_skate).unwrap();
    assert_eq!(serde_json::from_str::<Scores>(&text).unwrap(), with_skate);
    let error = serde_json::from_str::<Scores>(&json.replace("\"10\":13.5", "\"10\":\"x\""));
    assert!(error.is_err());
}
