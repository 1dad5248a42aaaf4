//! Controls and keyframes as a user writes them.

use std::path::PathBuf;
use std::str::FromStr;

use glam::DVec3;
use keydance::synthesis::controls::{Gains, Points, read_trajectory};
use keydance::synthesis::keyframes::TimedFrame;
use proptest::prelude::*;

#[test]
fn constants_hold_for_all_parts_or_for_named_ones() {
    assert_eq!(Gains::from_str("0.5"), Ok(Gains([0.5; 5])));
    assert_eq!(
        Gains::from_str("right_arm=1.5, left_leg=2"),
        Ok(Gains([1.0, 2.0, 1.0, 1.5, 1.0]))
    );
    assert_eq!(
        Gains::from_str("0.5,trunk=1"),
        Ok(Gains([1.0, 0.5, 0.5, 0.5, 0.5]))
    );
    for (bad, message) in [
        ("", "expected a number"),
        ("fast", "expected a number"),
        ("-1", "expected a number"),
        ("head=2", "\"head\" is no part of the body; parts: trunk"),
        ("trunk=x", "expected a number"),
        ("trunk=1,trunk=2", "twice"),
        ("1,2", "already"),
    ] {
        let error = Gains::from_str(bad).unwrap_err();
        assert!(error.contains(message), "{bad}: {error}");
    }
}

const GOOD: &str = "frame,x,y,z\n0,1.5,90,7\n1,-2,91,7\n2,3e1,92,7\n";

proptest! {
    #[test]
    fn a_damaged_table_is_an_error_that_names_it_or_rows_of_sound_numbers(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        cut in any::<prop::sample::Index>(), doubled in 0usize..5, dropped in 0usize..5,
    ) {
        let mut lines: Vec<&str> = GOOD.split_inclusive('\n').collect();
        lines.insert(doubled.min(3), lines[doubled.min(3)]);
        if dropped < lines.len() {
            lines.remove(dropped);
        }
        let mut bytes = lines.concat().into_bytes();
        for (place, byte) in flips {
            let place = place.index(bytes.len());
            bytes[place] ^= byte;
        }
        bytes.truncate(cut.index(2 * bytes.len()).max(1));
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        match read_trajectory(file.path(), 3) {
            Err(error) => prop_assert!(error.to_string().contains(&file.path().display().to_string())),
            Ok(rows) => {
                prop_assert_eq!(rows.dim(), (3, 3));
                prop_assert!(rows.iter().all(|number| number.abs() <= 1e6));
            }
        }
    }
}

#[test]
fn points_have_two_or_three_numbers_each() {
    let flat = Points::from_str("0,0; -10.5,20;30,40").unwrap();
    assert_eq!(flat.points[1], DVec3::new(-10.5, 0.0, 20.0));
    assert!(!flat.with_heights);
    assert!(Points::from_str("0,90,0;1,91,2").unwrap().with_heights);
    for (bad, message) in [
        ("", "\"\" is no number"),
        ("1,2", "two points"),
        ("1,2;3", "another count"),
        ("1;2", "expected x,z"),
        ("1,2;x,3", "point 2: \"x\""),
        ("1,2;nan,3", "point 2: nan"),
        ("1,2;1e9,3", "1000000"),
    ] {
        let error = Points::from_str(bad).unwrap_err();
        assert!(error.contains(message), "{bad}: {error}");
    }
}

#[test]
fn a_keyframe_is_taken_apart_from_its_end() {
    let keyframe = TimedFrame::from_str("a:b@c.bvh:75@60").unwrap().at(30.0);
    assert_eq!(keyframe.file, PathBuf::from("a:b@c.bvh"));
    assert_eq!((keyframe.frame, keyframe.time), (75, 60));
    let seconds = TimedFrame::from_str("c.bvh:75@12.5s").unwrap();
    assert_eq!((seconds.at(30.0).time, seconds.at(25.0).time), (375, 313));
    for bad in [
        "a.bvh",
        "a.bvh:1",
        "a.bvh@3",
        "a.bvh:-1@3",
        "a.bvh:1@x",
        ":1@2",
        "a.bvh:1@s",
        "a.bvh:1@-1s",
        "a.bvh:1@nans",
        "a.bvh:1@1e9s",
        "a.bvh:1@999999999",
        "a.bvh:1@18446744073709551615",
    ] {
        assert!(TimedFrame::from_str(bad).is_err(), "{bad}");
    }
}
