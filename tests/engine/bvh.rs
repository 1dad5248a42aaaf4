//! BVH files: what is read, what is written, and that the motion stays the same.

use glam::{DQuat, DVec3};
use keydance::motion::bvh::{self, Axis, Bvh, Channel, channel_layout};
use keydance::motion::{Clip, Joint, Pose, Skeleton};
use ndarray::Array2;
use proptest::prelude::*;

use crate::real_data;

const TWO_JOINTS: &str = "HIERARCHY
ROOT Hips
{
  OFFSET 1 2 3
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Left Arm
  {
    OFFSET 1 0 0
    CHANNELS 4 Yrotation Yposition Xrotation Zrotation
    End Site
    {
      OFFSET 0 1 0
    }
    End Site
    {
      OFFSET 0 2e0 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.00833333
10 20 30 90 90 0 0 7 0 0
0 0 0 0 0 90 90 0 0 90
";

fn parse(text: &str) -> Bvh {
    bvh::parse(text.as_bytes(), "two.bvh").unwrap()
}

fn assert_near(found: DVec3, expected: [f64; 3]) {
    assert!(
        found.distance(DVec3::from_array(expected)) < 1e-12,
        "{found} is not {expected:?}"
    );
}

#[test]
fn rotations_compose_in_the_order_of_the_channels_and_positions_replace_the_offset() {
    let clip = parse(TWO_JOINTS).to_clip();
    let world = |frame: usize| clip.poses[frame].world(&clip.skeleton);
    // Rz(90) Rx(90) takes X to Y and Y to Z; the arm stands at (1, 7, 0) in the root's frame.
    assert_near(world(0).0[0], [10.0, 20.0, 30.0]);
    assert_near(world(0).0[1], [10.0, 21.0, 37.0]);
    // Ry(90) twice, then Rz(90): the arm's Y axis is the root's X axis turned by Ry(180).
    assert_near(world(1).0[1], [0.0, 0.0, -1.0]);
    assert_near(world(1).1[1] * DVec3::Y, [1.0, 0.0, 0.0]);
}

#[test]
fn names_end_sites_channels_and_frame_time_are_kept() {
    let document = parse(TWO_JOINTS);
    let arm = &document.skeleton().joints[1];
    assert_eq!(arm.name, "Left Arm");
    assert_eq!(arm.end_sites, [DVec3::Y, 2.0 * DVec3::Y]);
    let arm_channels = [
        Channel::Rotation(Axis::Y),
        Channel::Position(Axis::Y),
        Channel::Rotation(Axis::X),
        Channel::Rotation(Axis::Z),
    ];
    assert_eq!(document.channels()[1], arm_channels);
    assert_eq!(document.frame_time(), 0.00833333);
    assert!(document.to_text().contains("Frame Time: 0.00833333\n"));
}

#[test]
fn spelling_that_real_files_have_makes_no_difference() {
    let expected = parse(TWO_JOINTS);
    let spellings = [
        TWO_JOINTS.replace('\n', "\r\n"),
        TWO_JOINTS
            .replace("  ", "\t")
            .replace("Frames: ", "Frames:\t")
            .replace("Time: ", "Time:\t"),
        format!(
            "\u{feff}\n{}\n\n",
            TWO_JOINTS
                .replace("End Site", "END SITE")
                .replace("CHANNELS ", "Channels  ")
        ),
        TWO_JOINTS
            .replace("\n{", " {")
            .replace("10 20", "+1.0E+001 2.e1")
            .replace("Xposition", "XPOSITION"),
        TWO_JOINTS
            .trim_end()
            .replace("Frames: ", "frames:")
            .replace("10 20 30", " 10\t20   30 "),
        TWO_JOINTS.replace('\n', "\r"),
        TWO_JOINTS.replace("}\n", "}\r\n").replace("{\n", "{\r"),
        TWO_JOINTS.replace("End Site\n", "End Site left tip\n"),
        TWO_JOINTS.replace("End Site\n    {", "End Site tip {"),
        TWO_JOINTS.replacen("OFFSET 0 1 0\n", "OFFSET 0 1 0\nCHANNELS 0\n", 1),
        TWO_JOINTS
            .to_ascii_lowercase()
            .replace("hips", "Hips")
            .replace("left arm", "Left Arm"),
        TWO_JOINTS.to_string() + "\u{1a}",
        TWO_JOINTS.trim_end().to_string() + "\u{1a}",
        TWO_JOINTS.replace('\n', "\r") + "\u{1a}\0\0\0",
    ];
    for text in spellings {
        assert_eq!(parse(&text), expected, "{text}");
    }
}

#[test]
fn a_joint_may_have_no_channels_and_a_file_several_roots() {
    let text = TWO_JOINTS
        .replace(
            "    CHANNELS 4 Yrotation Yposition Xrotation Zrotation\n",
            "",
        )
        .replace(" 0 7 0 0\n", "\n")
        .replace(" 90 0 0 90\n", "\n")
        .replace(
            "MOTION",
            "ROOT Prop\n{\nOFFSET 5 5 5\nCHANNELS 0\n}\nMOTION",
        );
    let clip = parse(&text).to_clip();
    assert_near(
        clip.poses[0].world_positions(&clip.skeleton)[2],
        [5.0, 5.0, 5.0],
    );
    assert_eq!(parse(&parse(&text).to_text()), parse(&text));
}

#[test]
fn inspect_prints_what_the_file_holds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.bvh");
    std::fs::write(&path, TWO_JOINTS).unwrap();
    let run = assert_cmd::cargo::cargo_bin_cmd!("keydance")
        .args(["bvh", "inspect"])
        .arg(&path)
        .assert()
        .success();
    insta::assert_snapshot!(String::from_utf8_lossy(&run.get_output().stdout), @r"
    two.bvh
    frames       2
    frame time   0.00833333 s (120.000 fps)
    duration     0.017 s
    joints       2 and 2 End Sites
    channels     10
    unit         not recognised, taken as cm (no head and feet by name)
    up           not recognised, taken as Y
    root height  0.000 to 20.000
    hierarchy
      Hips  offset 1 2 3  [Xposition Yposition Zposition Zrotation Xrotation Yrotation]
        Left Arm  offset 1 0 0  [Yrotation Yposition Xrotation Zrotation]
          End Site  offset 0 1 0
          End Site  offset 0 2 0
    ");
}

#[test]
fn joints_that_are_not_stored_depth_first_are_written_with_their_own_values() {
    let joint = |name: &str, parent, x| Joint {
        name: name.into(),
        parent,
        offset: DVec3::X * x,
        end_sites: Vec::new(),
    };
    let joints = vec![
        joint("root", None, 0.0),
        joint("a", Some(0), 1.0),
        joint("b", Some(0), 2.0),
        joint("under a", Some(1), 3.0),
    ];
    let poses = vec![Pose {
        translations: joints.iter().map(|joint| joint.offset).collect(),
        rotations: (0..4)
            .map(|index| DQuat::from_rotation_z(f64::from(index)))
            .collect(),
    }];
    let clip = Clip {
        name: "x".into(),
        skeleton: Skeleton { joints },
        frame_time: 0.1,
        poses,
    };
    let document =
        Bvh::from_clip(&clip, channel_layout(&clip, [Axis::Z, Axis::X, Axis::Y])).unwrap();
    let again = parse(&document.to_text()).to_clip();
    let (before, after) = (
        clip.poses[0].world_positions(&clip.skeleton),
        again.poses[0].world_positions(&again.skeleton),
    );
    for (index, joint) in clip.skeleton.joints.iter().enumerate() {
        let place = again.skeleton.index_of(&joint.name).unwrap();
        assert!(
            before[index].distance(after[place]) < 1e-9,
            "{}",
            joint.name
        );
    }
}

#[test]
fn channels_that_cannot_hold_a_motion_are_refused_by_joint() {
    let clip = parse(TWO_JOINTS).to_clip();
    let layout = channel_layout(&clip, [Axis::X, Axis::Y, Axis::Z]);
    let with = |root: Vec<Channel>, arm: Vec<Channel>| {
        Bvh::from_clip(&clip, vec![root, arm])
            .unwrap_err()
            .to_string()
    };
    let (root, arm) = (layout[0].clone(), layout[1].clone());
    assert!(
        with(root[3..].to_vec(), arm.clone()).contains("joint Hips leaves its offset in frame 0")
    );
    assert!(with(root.clone(), arm[..3].to_vec()).contains("joint Left Arm turns in frame 1"));
    assert!(
        with(root.clone(), arm[..5].to_vec()).contains("joint Left Arm needs no rotation channel")
    );
    assert!(Bvh::from_clip(&clip, layout).is_ok());
}

/// What a document is made of.
struct Parts {
    skeleton: Skeleton,
    channels: Vec<Vec<Channel>>,
    frame_time: f64,
    motion: Array2<f64>,
}

#[test]
fn a_document_of_parts_that_no_file_could_hold_is_refused_with_the_fault() {
    let whole = parse(TWO_JOINTS);
    type Change = fn(&mut Parts);
    let with = |change: Change| {
        let mut parts = Parts {
            skeleton: whole.skeleton().clone(),
            channels: whole.channels().to_vec(),
            frame_time: whole.frame_time(),
            motion: whole.motion().clone(),
        };
        change(&mut parts);
        let Parts {
            skeleton,
            channels,
            frame_time,
            motion,
        } = parts;
        Bvh::new("x.bvh".into(), skeleton, channels, frame_time, motion)
    };
    assert_eq!(with(|_| ()).unwrap().skeleton(), whole.skeleton());
    let cases: [(&str, Change); 14] = [
        ("must begin with a root", |p| p.skeleton.joints.clear()),
        ("must begin with a root", |p| {
            p.skeleton.joints[0].parent = Some(0)
        }),
        ("no joint name", |p| {
            p.skeleton.joints[1].name = "a{b".into()
        }),
        ("two joints are named Hips", |p| {
            p.skeleton.joints[1].name = "Hips".into()
        }),
        ("Left Arm stands before its parent", |p| {
            p.skeleton.joints[1].parent = Some(1)
        }),
        ("Left Arm has an offset", |p| {
            p.skeleton.joints[1].end_sites[0].x = f64::NAN
        }),
        ("Hips has an offset beyond", |p| {
            p.skeleton.joints[0].offset.y = 1e7
        }),
        ("2 joints have 1 lists of channels", |p| {
            p.channels.truncate(1)
        }),
        ("Hips has a channel twice", |p| {
            p.channels[0][1] = p.channels[0][0]
        }),
        ("2 joints have 0 channels between", |p| {
            p.channels.iter_mut().for_each(Vec::clear)
        }),
        ("have 9 channels, the motion rows 10", |p| {
            p.channels[0].truncate(5)
        }),
        ("there are no frames", |p| p.motion = Array2::zeros((0, 10))),
        ("frame time 0 s", |p| p.frame_time = 0.0),
        ("frame 1 holds a number", |p| {
            p.motion[[1, 3]] = f64::INFINITY
        }),
    ];
    for (words, change) in cases {
        let text = with(change).unwrap_err().to_string();
        assert!(text.contains("x.bvh") && text.contains(words), "{text}");
    }

    let mut clip = whole.to_clip();
    let layout = channel_layout(&clip, [Axis::X, Axis::Y, Axis::Z]);
    let text = Bvh::from_clip(&clip, layout[..1].to_vec()).unwrap_err();
    assert!(text.to_string().contains("2 joints have 1 lists"), "{text}");
    clip.poses[1].rotations.pop();
    let text = Bvh::from_clip(&clip, layout).unwrap_err();
    assert!(
        text.to_string()
            .contains("frame 1 is not a pose of its 2 joints"),
        "{text}"
    );
}

#[test]
fn channels_do_not_jump_between_frames() {
    let joint = Joint {
        name: "root".into(),
        parent: None,
        offset: DVec3::ZERO,
        end_sites: Vec::new(),
    };
    // Turns through several circles while it nods past the upright, where two of the angles are not
    // determined.
    let rotation = |frame: usize| {
        let time = frame as f64;
        DQuat::from_rotation_y(0.07 * time) * DQuat::from_rotation_x(0.03 * time)
    };
    let pose = |frame| Pose {
        translations: vec![DVec3::ZERO],
        rotations: vec![rotation(frame)],
    };
    let skeleton = Skeleton {
        joints: vec![joint],
    };
    let clip = Clip {
        name: "x".into(),
        skeleton,
        frame_time: 0.1,
        poses: (0..400).map(pose).collect(),
    };
    let document =
        Bvh::from_clip(&clip, channel_layout(&clip, [Axis::Y, Axis::X, Axis::Z])).unwrap();
    for (before, after) in document
        .motion()
        .rows()
        .into_iter()
        .zip(document.motion().rows().into_iter().skip(1))
    {
        for (old, new) in before.iter().zip(after) {
            assert!((old - new).abs() < 10.0, "{old} is followed by {new}");
        }
    }
}

/// The largest distance between the world positions of two clips with the same joints.
fn largest_distance(a: &Clip, b: &Clip) -> f64 {
    assert_eq!(a.poses.len(), b.poses.len());
    a.poses
        .iter()
        .zip(&b.poses)
        .flat_map(|(a_pose, b_pose)| {
            let pairs = a_pose
                .world_positions(&a.skeleton)
                .into_iter()
                .zip(b_pose.world_positions(&b.skeleton));
            pairs.map(|(a, b)| a.distance(b)).collect::<Vec<_>>()
        })
        .fold(0.0, f64::max)
}

#[test]
fn real_clips_keep_their_motion_through_angles_of_another_order() {
    let Some(folder) = real_data::dance_folder() else {
        return;
    };
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    for path in files
        .iter()
        .filter(|path| path.extension().is_some_and(|end| end == "bvh"))
        .step_by(25)
    {
        let document = bvh::read(path).unwrap();
        let again = bvh::parse(document.to_text().as_bytes(), document.name()).unwrap();
        assert_near_in_every_number(&again, &document);
        let clip = document.to_clip();
        let other =
            Bvh::from_clip(&clip, channel_layout(&clip, [Axis::X, Axis::Y, Axis::Z])).unwrap();
        let read = bvh::parse(other.to_text().as_bytes(), document.name()).unwrap();
        let distance = largest_distance(&clip, &read.to_clip());
        assert!(distance < 1e-5, "{}: {distance} cm", path.display());
    }
}

/// A random hierarchy with its joints depth first: each joint hangs on one of the blocks that are
/// still open.
fn hierarchies() -> impl Strategy<Value = (Skeleton, Vec<Vec<Channel>>)> {
    let all: Vec<Channel> = [Axis::X, Axis::Y, Axis::Z]
        .into_iter()
        .flat_map(|axis| [Channel::Position(axis), Channel::Rotation(axis)])
        .collect();
    let vector = prop::array::uniform3(-1e3..1e3f64).prop_map(DVec3::from_array);
    let channels =
        (Just(all).prop_shuffle(), 0usize..=6).prop_map(|(all, count)| all[..count].to_vec());
    let joint = (
        any::<prop::sample::Index>(),
        vector.clone(),
        prop::collection::vec(vector, 0..3),
        channels,
    );
    prop::collection::vec(joint, 1..20).prop_map(|drawn| {
        let mut open: Vec<usize> = Vec::new();
        let mut joints = Vec::new();
        let mut all_channels = Vec::new();
        for (index, (parent, offset, end_sites, channels)) in drawn.into_iter().enumerate() {
            let parent = (!open.is_empty()).then(|| parent.index(open.len()));
            open.truncate(parent.map_or(0, |depth| depth + 1));
            joints.push(Joint {
                name: format!("joint {index}"),
                parent: open.last().copied(),
                offset,
                end_sites,
            });
            all_channels.push(channels);
            open.push(index);
        }
        if all_channels.iter().all(Vec::is_empty) {
            all_channels[0].push(Channel::Rotation(Axis::Y));
        }
        (Skeleton { joints }, all_channels)
    })
}

fn documents() -> impl Strategy<Value = Bvh> {
    let number = prop_oneof![-360.0..360.0f64, -1e-9..1e-9f64, -1e6..1e6f64, Just(0.0)];
    (hierarchies(), 1usize..5, 1e-6..10.0f64).prop_flat_map(
        move |((skeleton, channels), frames, frame_time)| {
            let columns: usize = channels.iter().map(Vec::len).sum();
            prop::collection::vec(number.clone(), frames * columns).prop_filter_map(
                "too few channels",
                move |values| {
                    let motion = Array2::from_shape_vec((frames, columns), values).unwrap();
                    Bvh::new(
                        "drawn.bvh".into(),
                        skeleton.clone(),
                        channels.clone(),
                        frame_time,
                        motion,
                    )
                    .ok()
                },
            )
        },
    )
}

/// Half of the ninth decimal, and what binary numbers of up to a million add to it.
const WRITTEN: f64 = 0.5e-9 + 1e-10;

/// Asserts that two documents differ by the rounding of written numbers only.
fn assert_near_in_every_number(found: &Bvh, expected: &Bvh) {
    assert_eq!(found.channels(), expected.channels());
    assert_eq!(found.frame_time(), expected.frame_time());
    let joints = |bvh: &Bvh| bvh.skeleton().joints.clone();
    for (found, expected) in joints(found).iter().zip(&joints(expected)) {
        assert_eq!(
            (&found.name, found.parent),
            (&expected.name, expected.parent)
        );
        assert!((found.offset - expected.offset).abs().max_element() <= WRITTEN);
        assert_eq!(found.end_sites.len(), expected.end_sites.len());
        for (found, expected) in found.end_sites.iter().zip(&expected.end_sites) {
            assert!((*found - *expected).abs().max_element() <= WRITTEN);
        }
    }
    assert_eq!(joints(found).len(), joints(expected).len());
    assert_eq!(found.motion().dim(), expected.motion().dim());
    for (found, expected) in found.motion().iter().zip(expected.motion()) {
        assert!(
            (found - expected).abs() <= WRITTEN,
            "{found} is not {expected}"
        );
    }
}

#[test]
fn written_numbers_have_nine_decimals_no_exponent_and_no_negative_zero() {
    let text = TWO_JOINTS
        .replace("OFFSET 1 0 0", "OFFSET -1e-15 -0.0 12.5")
        .replace("90 90 0 0 7", "-4e-10 1e-300 -5.3e-17 0 6e-10");
    let written = parse(&text).to_text();
    assert!(
        written.contains("    OFFSET 0.000000000 0.000000000 12.500000000\n"),
        "{written}"
    );
    let row = "10.000000000 20.000000000 30.000000000 0.000000000 0.000000000 0.000000000 \
               0.000000000 0.000000001 0.000000000 0.000000000\n";
    assert!(written.contains(row), "{written}");
    for frame_time in ["1e-9", "0.0083", "1e-300", "3600"] {
        let written = parse(&TWO_JOINTS.replace("0.00833333", frame_time)).to_text();
        let line = written
            .lines()
            .find(|line| line.starts_with("Frame Time"))
            .unwrap();
        assert!(!line[11..].contains(['e', 'E']), "{line}");
        assert_eq!(
            line[12..].parse::<f64>().unwrap(),
            frame_time.parse::<f64>().unwrap()
        );
    }
}

proptest! {
    #[test]
    fn what_is_written_reads_back_to_nine_decimals_and_is_written_the_same_again(document in documents(), tabs: bool, ends in 0..3usize) {
        let written = document.to_text();
        let mut text = written.replace('\n', ["\n", "\r\n", "\r"][ends]);
        if tabs { text = text.replace("  ", "\t"); }
        let again = bvh::parse(text.as_bytes(), "drawn.bvh").unwrap();
        assert_near_in_every_number(&again, &document);
        prop_assert_eq!(again.to_text(), written);
    }

    #[test]
    fn any_rotation_goes_through_angles_of_any_order(
        order in Just([Axis::X, Axis::Y, Axis::Z]).prop_shuffle(),
        // Multiples of 45 degrees hit the orientations where two of the angles are not determined.
        angles in prop::collection::vec(prop::array::uniform3(prop_oneof![-400.0..400.0f64, (-8i32..8).prop_map(|n| 45.0 * f64::from(n))]), 1..6),
    ) {
        let joint = Joint { name: "root".into(), parent: None, offset: DVec3::ZERO, end_sites: Vec::new() };
        let turn = |angles: &[f64; 3]| {
            angles.iter().zip(DVec3::AXES).fold(DQuat::IDENTITY, |turned, (angle, axis)| turned * DQuat::from_axis_angle(axis, angle.to_radians()))
        };
        let poses = angles.iter().map(|angles| Pose { translations: vec![DVec3::ONE], rotations: vec![turn(angles)] }).collect();
        let clip = Clip { name: "x".into(), skeleton: Skeleton { joints: vec![joint] }, frame_time: 0.1, poses };
        let again = Bvh::from_clip(&clip, channel_layout(&clip, order)).unwrap().to_clip();
        for (old, new) in clip.poses.iter().zip(&again.poses) {
            for axis in DVec3::AXES {
                prop_assert!((old.rotations[0] * axis).distance(new.rotations[0] * axis) < 1e-9);
            }
        }
    }
}
