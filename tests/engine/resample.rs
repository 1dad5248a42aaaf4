//! Clips at another frame rate.

use glam::{DQuat, DVec3};
use keydance::motion::{Clip, Pose, ResampleError, resample};
use keydance::motion::{Joint, Skeleton};

/// One joint that moves and turns evenly: 1 cm and 0.1 rad a frame.
fn even(frames: usize, frame_time: f64) -> Clip {
    let joint = Joint {
        name: "Hips".into(),
        parent: None,
        offset: DVec3::ZERO,
        end_sites: Vec::new(),
    };
    let pose = |frame: usize| Pose {
        translations: vec![DVec3::X * frame as f64],
        rotations: vec![DQuat::from_rotation_y(0.1 * frame as f64)],
    };
    let skeleton = Skeleton {
        joints: vec![joint],
    };
    Clip {
        name: "even".into(),
        skeleton,
        frame_time,
        poses: (0..frames).map(pose).collect(),
    }
}

#[test]
fn a_rounded_frame_time_counts_as_its_rate() {
    assert_eq!(resample(even(5, 0.0333333), 30.0), Ok(even(5, 0.0333333)));
    let quarter = resample(even(2750, 0.00833333), 30.0).unwrap();
    assert_eq!(quarter.poses.len(), 688);
    assert_eq!(quarter.frame_time, 1.0 / 30.0);
    assert_eq!(quarter.poses[687], even(2749, 0.1).poses[2748]);
}

#[test]
fn a_rounded_frame_time_costs_no_frame_where_the_ratio_is_not_whole() {
    let clip = resample(even(3001, 0.0333333), 20.0).unwrap();
    assert_eq!(clip.poses.len(), 2001);
    let last = clip.poses[2000].translations[0].x;
    assert!((last - 3000.0).abs() < 1e-9, "{last}");
}

#[test]
fn any_ratio_keeps_an_even_motion_even() {
    for (frame_time, step, frames) in [
        (1.0 / 24.0, 0.8, 12),
        (1.0 / 50.0, 50.0 / 30.0, 6),
        (0.1, 1.0 / 3.0, 28),
    ] {
        let new = resample(even(10, frame_time), 30.0).unwrap();
        assert_eq!(new.poses.len(), frames, "{frame_time}");
        for (frame, pose) in new.poses.iter().enumerate() {
            let time = frame as f64 * step;
            assert!((pose.translations[0].x - time).abs() < 1e-9);
            assert!(pose.rotations[0].angle_between(DQuat::from_rotation_y(0.1 * time)) < 1e-6);
        }
    }
}

#[test]
fn a_rate_that_would_blow_up_a_clip_is_refused() {
    assert!(matches!(
        resample(even(5, 3600.0), 30.0),
        Err(ResampleError::TooCoarse { .. })
    ));
    assert!(matches!(
        resample(even(3000, 3.9), 30.0),
        Err(ResampleError::TooLong {
            frames: 350_884,
            ..
        })
    ));
    assert!(matches!(
        resample(even(5, 0.1), f64::NAN),
        Err(ResampleError::Rate { .. })
    ));
}
