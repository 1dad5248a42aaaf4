//! The built-in data set through the public API: repeatable, within what a body can do, with
//! contacts that are true.

use glam::DVec3;
use keydance::data::BeatExtrema;
use keydance::data::choreography::{
    ChoreographyConfig, ChoreographyError, GeneratedClip, generate, generate_with_music,
};
use keydance::evaluation::music_dance::beats::{joint_speed, motion_beats};
use keydance::motion::skeleton::JOINTS;
use keydance::music::{Analysis, Sound};
use proptest::prelude::*;

const FEET: [usize; 4] = [3, 4, 7, 8];
/// Squared speed (cm/frame)^2 below which a foot joint counts as in contact.
const CONTACT: f64 = 0.2;

fn clips(clips: usize, frames_per_clip: usize, seed: u64) -> Vec<GeneratedClip> {
    generate(&ChoreographyConfig {
        clips,
        frames_per_clip,
        seed,
    })
    .expect("a valid configuration")
}

/// World positions `[frames][joints]`, cm.
fn positions(generated: &GeneratedClip) -> Vec<Vec<DVec3>> {
    let clip = &generated.clip;
    clip.skeleton.world_positions(&clip.poses)
}

/// Every number of a clip, to the bit.
fn bits(generated: &GeneratedClip) -> Vec<u64> {
    let poses = generated.clip.poses.iter();
    poses
        .flat_map(|pose| {
            let translations = pose.translations.iter().flat_map(|t| t.to_array());
            translations.chain(pose.rotations.iter().flat_map(|r| r.to_array()))
        })
        .map(f64::to_bits)
        .collect()
}

/// Angle (degrees) of a knee: 0 straight, positive with the shin behind the thigh's line.
fn knee(rotation: glam::DQuat) -> f64 {
    (2.0 * (rotation.x * rotation.w.signum()).atan2(rotation.w.abs())).to_degrees()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn the_same_seed_gives_the_same_motion_and_another_seed_another(seed: u64) {
        let (first, again) = (clips(2, 200, seed), clips(2, 200, seed));
        prop_assert_eq!(&first, &again);
        for (one, other) in first.iter().zip(&again) {
            prop_assert_eq!(bits(one), bits(other));
        }
        let different = clips(2, 200, seed.wrapping_add(1));
        prop_assert_ne!(bits(&first[0]), bits(&different[0]));
        prop_assert_ne!(bits(&first[0]), bits(&first[1]));
    }

    #[test]
    fn a_clip_does_not_depend_on_how_many_are_made(seed: u64) {
        let (few, many) = (clips(2, 120, seed), clips(7, 120, seed));
        prop_assert_eq!(&few[..], &many[..2]);
    }

    #[test]
    fn bones_keep_their_lengths(seed: u64) {
        for generated in clips(6, 300, seed) {
            let skeleton = &generated.clip.skeleton;
            for frame in positions(&generated) {
                for (joint, rest) in skeleton.joints.iter().enumerate() {
                    if let Some(parent) = rest.parent {
                        let length = frame[joint].distance(frame[parent]);
                        prop_assert!((length - rest.offset.length()).abs() < 1e-9);
                    }
                }
            }
            for pose in &generated.clip.poses {
                prop_assert!(pose.rotations.iter().all(|r| (r.length() - 1.0).abs() < 1e-9));
                let offsets = skeleton.joints.iter().map(|joint| joint.offset);
                prop_assert!(pose.translations.iter().copied().zip(offsets).skip(1)
                    .all(|(translation, offset)| translation == offset));
            }
        }
    }

    #[test]
    fn planted_feet_stay_and_contacts_agree_with_the_speed_rule(seed: u64) {
        let (mut agreeing, mut labels, mut planted) = (0.0, 0.0, 0.0);
        for generated in clips(6, 600, seed) {
            let positions = positions(&generated);
            prop_assert_eq!(generated.contacts.len(), positions.len());
            prop_assert_eq!(generated.contacts[0], generated.contacts[1]);
            for frame in 1..positions.len() {
                for (label, joint) in FEET.into_iter().enumerate() {
                    let moved = positions[frame][joint].distance(positions[frame - 1][joint]);
                    let contact = generated.contacts[frame][label];
                    prop_assert!(
                        !contact || moved < 1e-4,
                        "{} slips {moved} cm at frame {frame}", generated.clip.name
                    );
                    labels += 1.0;
                    agreeing += f64::from(u8::from(contact == (moved * moved < CONTACT)));
                    planted += f64::from(u8::from(contact));
                }
            }
        }
        prop_assert!(agreeing / labels >= 0.97, "labels agree on {}", agreeing / labels);
        let share = planted / labels;
        prop_assert!((0.35..0.9).contains(&share), "planted for {share} of the time");
    }

    #[test]
    fn no_foot_goes_below_the_floor_and_no_knee_bends_forward(seed: u64) {
        for generated in clips(6, 600, seed) {
            for frame in positions(&generated) {
                prop_assert!(FEET.iter().all(|joint| frame[*joint].y > -0.1));
            }
            for pose in &generated.clip.poses {
                for shin in [2, 6] {
                    let bend = knee(pose.rotations[shin]);
                    prop_assert!((0.0..155.0).contains(&bend), "knee at {bend} degrees");
                }
            }
        }
    }

    #[test]
    fn speeds_and_accelerations_are_human(seed: u64) {
        for generated in clips(6, 600, seed) {
            let positions = positions(&generated);
            let name = &generated.clip.name;
            for joint in 0..JOINTS {
                let path: Vec<DVec3> = positions.iter().map(|frame| frame[joint]).collect();
                let speed = path.windows(2).map(|p| p[1].distance(p[0])).fold(0.0, f64::max);
                prop_assert!(speed < 40.0, "{name}: joint {joint} moves {speed} cm in a frame");
                let change = path
                    .windows(3)
                    .map(|p| (p[2] - 2.0 * p[1] + p[0]).length())
                    .fold(0.0, f64::max);
                prop_assert!(change < 30.0, "{name}: joint {joint} accelerates by {change}");
            }
        }
    }

    #[test]
    fn hips_and_head_are_as_high_as_a_dancers_and_the_dance_stays_on_the_floor(seed: u64) {
        for generated in clips(6, 900, seed) {
            let positions = positions(&generated);
            let mut heights: Vec<f64> = positions.iter().map(|frame| frame[0].y).collect();
            heights.sort_by(f64::total_cmp);
            let median = heights[heights.len() / 2];
            prop_assert!((82.0..97.0).contains(&median), "median root height {median}");
            prop_assert!(heights[0] > 45.0 && heights[heights.len() - 1] < 140.0);
            for frame in &positions {
                // The deepest bows are those of contemporary lunges: the head comes down, but not
                // to the hips.
                let (hips, head) = (frame[0].y, frame[23].y);
                prop_assert!(head > hips + 10.0, "head at {head}, hips at {hips}");
                prop_assert!(hips < 80.0 || head > 95.0, "head at {head}, hips at {hips}");
                prop_assert!(head < 210.0, "head at {head}");
                prop_assert!(frame[0].x.hypot(frame[0].z) < 350.0);
            }
        }
    }
}

#[test]
fn as_many_clips_as_asked_for_in_turning_styles_on_the_dance_skeleton() {
    let generated = clips(7, 40, 3);
    assert_eq!(generated.len(), 7);
    let names: Vec<&str> = generated.iter().map(|g| g.clip.name.as_str()).collect();
    assert_eq!(names[0], "choreography_000_waltz.bvh");
    assert_eq!(names[6], "choreography_006_waltz.bvh");
    let mut distinct = names.clone();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), 7);
    for clip in generated.iter().map(|g| &g.clip) {
        assert!(clip.skeleton.is_dance_skeleton());
        assert_eq!(clip.poses.len(), 40);
        assert!((clip.frame_time - 1.0 / 30.0).abs() < 1e-15);
    }
}

#[test]
fn hands_move_at_other_speeds_than_feet() {
    for generated in clips(6, 900, 11) {
        let positions = positions(&generated);
        let speeds = |joint: usize| -> Vec<f64> {
            positions
                .windows(2)
                .map(|p| p[1][joint].distance(p[0][joint]))
                .collect()
        };
        let (hand, foot) = (speeds(21), speeds(3));
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let (h, f) = (mean(&hand), mean(&foot));
        assert!(
            (1.5..9.0).contains(&h),
            "{}: hands at {h} cm/frame",
            generated.clip.name
        );
        let covariance: f64 = hand.iter().zip(&foot).map(|(a, b)| (a - h) * (b - f)).sum();
        let spread = |x: &[f64], m: f64| x.iter().map(|v| (v - m).powi(2)).sum::<f64>().sqrt();
        let correlation = covariance / (spread(&hand, h) * spread(&foot, f));
        assert!(
            correlation < 0.8,
            "{}: correlation {correlation}",
            generated.clip.name
        );
    }
}

#[test]
fn configurations_that_ask_for_nothing_or_too_much_are_refused() {
    let none = ChoreographyConfig {
        clips: 0,
        ..ChoreographyConfig::default()
    };
    assert_eq!(generate(&none), Err(ChoreographyError::NoClips));
    for clips in [1001, usize::MAX] {
        let config = ChoreographyConfig {
            clips,
            ..Default::default()
        };
        let error = Err(ChoreographyError::TooManyClips { clips });
        assert_eq!(generate(&config), error);
    }
    for frames in [0, 1, usize::MAX] {
        let config = ChoreographyConfig {
            frames_per_clip: frames,
            ..Default::default()
        };
        assert_eq!(generate(&config), Err(ChoreographyError::Frames { frames }));
    }
}

#[test]
fn an_unknown_key_in_the_configuration_is_named() {
    let error = toml::from_str::<ChoreographyConfig>("clips = 3\ntempo = 90").unwrap_err();
    assert!(error.to_string().contains("tempo"));
    let config: ChoreographyConfig = toml::from_str("clips = 3").unwrap();
    assert_eq!(
        config,
        ChoreographyConfig {
            clips: 3,
            ..ChoreographyConfig::default()
        }
    );
}

#[test]
fn music_is_on_the_dances_beats_and_the_tracker_finds_95_of_100_within_a_frame() {
    let config = ChoreographyConfig {
        clips: 12,
        frames_per_clip: 900,
        seed: 3,
    };
    let dances = generate_with_music(&config).unwrap();
    let (mut found, mut all) = (0, 0);
    let mut metres = std::collections::BTreeSet::new();
    let mut phases = std::collections::BTreeSet::new();
    for dance in &dances {
        assert_eq!(dance.dance.clip.poses.len(), 900);
        assert_eq!(dance.samples.len(), 900 * 735);
        assert!(dance.samples.iter().all(|x| x.abs() < 1.0));
        let sound = Sound::new("made", &dance.samples, 22_050).unwrap();
        let heard = Analysis::of(&sound).unwrap();
        let near = |beat: &&usize| heard.beats.iter().any(|it| it.abs_diff(**beat) <= 1);
        // The tracker's trimming leaves out beats at the ends, where there is no music beyond.
        let inside = &dance.beats[1..dance.beats.len() - 1];
        found += inside.iter().filter(near).count();
        all += inside.len();
        metres.insert(dance.metre);
        phases.insert(dance.beats[0]);
    }
    assert!(found as f64 > 0.95 * all as f64, "{found} of {all}");
    assert_eq!(metres.into_iter().collect::<Vec<_>>(), [3, 4]);
    assert!(phases.len() > 4, "{phases:?}");
    assert_eq!(dances, generate_with_music(&config).unwrap());
}

#[test]
fn dances_to_music_come_to_rest_on_its_beats_to_the_end() {
    let config = ChoreographyConfig {
        clips: 24,
        frames_per_clip: 900,
        seed: 77,
    };
    let dances = generate_with_music(&config).unwrap();
    // The style that sways least between steps. Two of these four leap, which takes no whole beats
    // by itself.
    let folk = dances
        .iter()
        .filter(|it| it.dance.clip.name.contains("folk"));
    for dance in folk {
        let speed = joint_speed(&positions(&dance.dance));
        let rests = motion_beats(&speed, BeatExtrema::Minima);
        let (mut on, mut between) = (0, 0);
        for beats in dance.beats.windows(2) {
            let length = beats[1] - beats[0];
            for rest in rests.iter().filter(|at| (beats[0]..beats[1]).contains(at)) {
                // A body comes to rest a little after its feet.
                match 8 * (rest - beats[0]) / length {
                    0..=2 | 7 => on += 1,
                    _ => between += 1,
                }
            }
        }
        let name = &dance.dance.clip.name;
        assert!(
            on > 3 * between,
            "{name}: {on} on the beat, {between} between"
        );
    }
}
