//! Bad files: an error that says where and what, no panic, nothing written.

use assert_cmd::cargo::cargo_bin_cmd;
use keydance::motion::bvh::{self, BvhError};
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use proptest::prelude::*;

use crate::damage::{damage, damages};

const GOOD: &str = "HIERARCHY
ROOT Hips
{
  OFFSET 0 90 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 5 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.0333333
0 90 0 1 2 3 4 5 6
1 91 0 1 2 3 4 5 6
2 92 0 1 2 3 4 5 6
";

/// Line and message of the error that a text gives.
fn error(text: &[u8]) -> (usize, String) {
    let error = bvh::parse(text, "bad.bvh").unwrap_err();
    let message = error.to_string();
    match error {
        BvhError::Syntax { line, .. } => {
            assert!(
                message.starts_with(&format!("bad.bvh, line {line}: expected ")),
                "{message}"
            );
            (line, message)
        }
        other => panic!("{other}"),
    }
}

#[test]
fn each_fault_is_named_with_its_line() {
    let cases = [
        // (what is replaced, with what, line, part of the message)
        (
            "2 92 0 1 2 3 4 5 6\n",
            "",
            20,
            "expected 3 rows, as \"Frames:\" announces, found the end of the file after 2",
        ),
        (
            "2 92 0 1",
            "2 92 0",
            21,
            "expected 9 values in a row, one a channel, found 8",
        ),
        ("1 91 0", "1 91 0 7", 20, "found 10"),
        (
            "1 91",
            "1 NaN",
            20,
            "value 2 of the row, a number between -1000000 and 1000000, found \"NaN\"",
        ),
        ("1 91", "inf 91", 20, "found \"inf\""),
        ("1 91", "1e300 91", 20, "found \"1e300\""),
        ("1 91", "1,5 91", 20, "found \"1,5\""),
        ("1 91", "-1.#IND 91", 20, "value 1 of the row"),
        (
            "Frames: 3",
            "Frames: 0",
            17,
            "a whole number of frames above 0, found \"Frames: 0\"",
        ),
        (
            "Frames: 3",
            "Frames: -3",
            17,
            "a whole number of frames above 0",
        ),
        (
            "Frames: 3",
            "Frames: 99999999999999999",
            21,
            "found the end of the file after 3",
        ),
        (
            "Frames: 3",
            "Frames: 2",
            21,
            "expected the end of the file after the 2 rows",
        ),
        ("Frames: 3\n", "", 17, "\"Frames:\""),
        ("Time: 0.0333333", "Time: -0.03", 18, "seconds above 0"),
        ("Time: 0.0333333", "Time: 0", 18, "seconds above 0"),
        ("Time: 0.0333333", "Time: NaN", 18, "seconds above 0"),
        ("Time: 0.0333333", "Time: 1e9", 18, "at most 3600"),
        (
            "HIERARCHY",
            "SOMETHING",
            1,
            "expected HIERARCHY, found \"SOMETHING\"",
        ),
        (
            "ROOT Hips",
            "ROOT",
            2,
            "a joint name without braces, found none",
        ),
        (
            "JOINT Spine",
            "JOINT Hips",
            6,
            "a joint name not given before (line 2 has it)",
        ),
        ("OFFSET 0 90 0", "OFFSET 0 90", 4, "the offset's Z"),
        (
            "OFFSET 0 90 0",
            "OFFSET 0 90 0 0",
            4,
            "expected } or CHANNELS or JOINT or End Site in joint Hips, found \"0\"",
        ),
        (
            "    OFFSET 0 10 0\n",
            "",
            13,
            "expected OFFSET or JOINT or End Site in joint Spine, found \"}\"",
        ),
        (
            "CHANNELS 3 Z",
            "CHANNELS 7 Z",
            9,
            "the number of channels, 0 to 6",
        ),
        ("CHANNELS 3 Z", "CHANNELS 4 Z", 9, "channel 4 of 4"),
        (
            "3 Zrotation X",
            "3 Xrotation X",
            9,
            "channel 2 of 3, each once",
        ),
        ("3 Zrotation", "3 Wrotation", 9, "found \"Wrotation\""),
        ("MOTION", "", 17, "expected MOTION, found \"Frames:\""),
        (
            "}\nMOTION",
            "MOTION",
            15,
            "} or JOINT or End Site in joint Hips, found \"MOTION\"",
        ),
        ("MOTION", "MOTION now", 16, "nothing after MOTION"),
        (
            "OFFSET 0 5 0",
            "OFFSET 0 5 0\nCHANNELS 1 Xrotation",
            13,
            "0 channels in an End Site, found \"1\"",
        ),
    ];
    for (old, new, line, part) in cases {
        assert!(GOOD.contains(old), "{old}");
        let (found_line, message) = error(GOOD.replacen(old, new, 1).as_bytes());
        assert!(
            found_line == line && message.contains(part),
            "{old:?} -> {new:?}: {message}"
        );
    }
}

#[test]
fn a_file_cut_anywhere_before_its_last_row_is_an_error() {
    for end in 0..GOOD.rfind("\n2 92").unwrap() + 1 {
        error(&GOOD.as_bytes()[..end]);
    }
}

#[test]
fn what_is_not_text_is_an_error() {
    assert!(error(b"").1.contains("found the end of the file"));
    assert!(
        error(b"HIERARCHY\nROOT \xff\xfe")
            .1
            .contains("line 2: expected text in UTF-8, found the byte 0xff")
    );
    let zeros = error(&[0; 5000]).1;
    assert!(
        zeros.contains("expected HIERARCHY") && zeros.len() < 300,
        "{zeros}"
    );
}

#[test]
fn nesting_is_limited_and_wide_skeletons_are_not() {
    let depth = 10_000;
    let mut text = String::from("HIERARCHY\nROOT j\n{\nOFFSET 0 0 0\nCHANNELS 1 Yrotation\n");
    for joint in 0..depth {
        text += &format!("JOINT j{joint}\n{{\nOFFSET 0 1 0\nCHANNELS 1 Yrotation\n");
    }
    text += &"}\n".repeat(depth + 1);
    text += "MOTION\nFrames: 1\nFrame Time: 1\n";
    text += &"0 ".repeat(depth + 1);
    let message = error(text.as_bytes()).1;
    assert!(
        message.contains("expected at most 512 joints inside one another, found joint \"j511\""),
        "{message}"
    );
    // The same joints side by side.
    let flat = text
        .replace(
            "CHANNELS 1 Yrotation\nJOINT",
            "CHANNELS 1 Yrotation\n}\nJOINT",
        )
        .replacen("\n}\nJOINT", "\nJOINT", 1);
    let flat = flat.replacen(&"}\n".repeat(depth + 1), "}\n}\n", 1);
    assert_eq!(
        bvh::parse(flat.as_bytes(), "flat.bvh")
            .unwrap()
            .skeleton()
            .len(),
        depth + 1
    );
}

#[test]
fn many_joints_without_channels_are_refused_before_they_fill_memory() {
    let mut text = String::from("HIERARCHY\nROOT j\n{\nOFFSET 0 0 0\nCHANNELS 1 Yrotation\n");
    for joint in 0..1000 {
        text += &format!("JOINT j{joint}\n{{\nOFFSET 0 0 0\n}}\n");
    }
    text += "}\nMOTION\nFrames: 1\nFrame Time: 1\n0\n";
    assert!(
        error(text.as_bytes())
            .1
            .contains("at least one channel for every 16 joints, found 1 channel for 1001")
    );
}

#[test]
fn the_binary_names_the_fault_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("bad.bvh"), folder.path().join("out.npy"));
    let run = || {
        let mut command = cargo_bin_cmd!("keydance");
        command
            .arg("features")
            .arg(&input)
            .arg("--npy")
            .arg(&output);
        command.assert().failure().code(1)
    };
    run().stderr(contains("bad.bvh cannot be read"));
    std::fs::write(&input, GOOD.replace("1 91", "1 NaN")).unwrap();
    run().stderr(
        contains("bad.bvh, line 20: expected value 2 of the row").and(contains("panicked").not()),
    );
    std::fs::write(&input, GOOD).unwrap();
    run().stderr(
        contains("joint 1 is Spine on Hips, the dance skeleton has LeftUpLeg on Hips")
            .and(contains("mapping")),
    );
    assert!(!output.exists());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn a_damaged_file_gives_an_error_or_a_sound_document(damage_list in prop::collection::vec(damages(), 1..5)) {
        let bytes = damage_list.iter().fold(GOOD.as_bytes().to_vec(), damage);
        match bvh::parse(&bytes, "bad.bvh") {
            Err(error) => prop_assert!(error.to_string().starts_with("bad.bvh, line ")),
            Ok(document) => {
                prop_assert!(document.motion().iter().all(|value| value.is_finite()));
                prop_assert_eq!(document.to_clip().poses.len(), document.frames());
                let written = document.to_text();
                prop_assert_eq!(bvh::parse(written.as_bytes(), "bad.bvh").unwrap().to_text(), written);
            }
        }
    }
}
