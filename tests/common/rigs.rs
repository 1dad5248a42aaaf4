//! Small bodies in a T-pose with the joints of other programs' rigs.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use keydance::motion::{Clip, DANCE_JOINTS, Joint, Skeleton};

/// A rig: its name, what it calls left and right, and its joints: name, parent and the dance
/// skeleton's joints that it stands for, "-" for none. "%" is the side; `Toe@End` says that its End
/// Site stands for the toe.
pub struct Rig {
    pub name: &'static str,
    sides: [&'static str; 2],
    joints: &'static str,
}

pub const RIGS: [Rig; 12] = [
    Rig {
        name: "mixamo",
        sides: ["Left", "Right"],
        joints: "
            mixamorig:Hips . Hips
            mixamorig:Spine mixamorig:Hips Spine
            mixamorig:Spine1 mixamorig:Spine Spine1
            mixamorig:Spine2 mixamorig:Spine1 Spine2,Spine3,Spine4
            mixamorig:Neck mixamorig:Spine2 Neck
            mixamorig:Head mixamorig:Neck Head
            mixamorig:HeadTop_End mixamorig:Head -
            mixamorig:%Shoulder mixamorig:Spine2 %Shoulder
            mixamorig:%Arm mixamorig:%Shoulder %Arm
            mixamorig:%ForeArm mixamorig:%Arm %ForeArm
            mixamorig:%Hand mixamorig:%ForeArm %Hand
            mixamorig:%HandThumb1 mixamorig:%Hand -
            mixamorig:%HandIndex1 mixamorig:%Hand -
            mixamorig:%HandIndex2 mixamorig:%HandIndex1 -
            mixamorig:%UpLeg mixamorig:Hips %UpLeg
            mixamorig:%Leg mixamorig:%UpLeg %Leg
            mixamorig:%Foot mixamorig:%Leg %Foot
            mixamorig:%ToeBase mixamorig:%Foot %ToeBase
            mixamorig:%Toe_End mixamorig:%ToeBase -",
    },
    Rig {
        name: "rokoko",
        sides: ["Left", "Right"],
        joints: "
            Hips . Hips
            Spine Hips Spine
            Spine2 Spine Spine1
            Spine3 Spine2 Spine2
            Spine4 Spine3 Spine3,Spine4
            Neck Spine4 Neck
            Head Neck Head
            %Shoulder Spine4 %Shoulder
            %Arm %Shoulder %Arm
            %ForeArm %Arm %ForeArm
            %Hand %ForeArm %Hand
            %HandMiddle1 %Hand -
            %Thigh Hips %UpLeg
            %Shin %Thigh %Leg
            %Foot %Shin %Foot
            %Toe %Foot %ToeBase",
    },
    Rig {
        name: "xsens",
        sides: ["Left", "Right"],
        joints: "
            Hips . Hips
            Chest Hips Spine
            Chest2 Chest Spine1
            Chest3 Chest2 Spine2
            Chest4 Chest3 Spine3,Spine4
            Neck Chest4 Neck
            Head Neck Head
            %Collar Chest4 %Shoulder
            %Shoulder %Collar %Arm
            %Elbow %Shoulder %ForeArm
            %Wrist %Elbow %Hand
            %Hip Hips %UpLeg
            %Knee %Hip %Leg
            %Ankle %Knee %Foot
            %Toe %Ankle %ToeBase",
    },
    Rig {
        name: "perception_neuron",
        sides: ["Left", "Right"],
        joints: "
            Hips . Hips
            %UpLeg Hips %UpLeg
            %Leg %UpLeg %Leg
            %Foot %Leg %Foot,%ToeBase@End
            Spine Hips Spine
            Spine1 Spine Spine1
            Spine2 Spine1 Spine2
            Spine3 Spine2 Spine3,Spine4
            Neck Spine3 Neck
            Head Neck Head
            %Shoulder Spine3 %Shoulder
            %Arm %Shoulder %Arm
            %ForeArm %Arm %ForeArm
            %Hand %ForeArm %Hand
            %HandThumb1 %Hand -
            %InHandIndex %Hand -
            %HandIndex1 %InHandIndex -",
    },
    Rig {
        name: "cmu_43",
        sides: ["l", "r"],
        joints: "
            hip . Hips
            abdomen hip Spine
            chest abdomen Spine1,Spine2,Spine3,Spine4
            neck chest Neck
            head neck Head
            leftEye head -
            rightEye head -
            %Collar chest %Shoulder
            %Shldr %Collar %Arm
            %ForeArm %Shldr %ForeArm
            %Hand %ForeArm %Hand
            %Thumb1 %Hand -
            %Buttock hip -
            %Thigh %Buttock %UpLeg
            %Shin %Thigh %Leg
            %Foot %Shin %Foot,%ToeBase@End",
    },
    Rig {
        name: "cmu_31",
        sides: ["Left", "Right"],
        joints: "
            Hips . Hips
            %HipJoint Hips -
            %UpLeg %HipJoint %UpLeg
            %Leg %UpLeg %Leg
            %Foot %Leg %Foot
            %ToeBase %Foot %ToeBase
            LowerBack Hips Spine
            Spine LowerBack Spine1
            Spine1 Spine Spine2,Spine3,Spine4
            Neck Spine1 Neck
            Neck1 Neck -
            Head Neck1 Head
            %Shoulder Spine1 %Shoulder
            %Arm %Shoulder %Arm
            %ForeArm %Arm %ForeArm
            %Hand %ForeArm %Hand
            %FingerBase %Hand -
            %HandIndex1 %FingerBase -",
    },
    Rig {
        name: "lafan1",
        sides: ["Left", "Right"],
        joints: "
            Hips . Hips
            %UpLeg Hips %UpLeg
            %Leg %UpLeg %Leg
            %Foot %Leg %Foot
            %Toe %Foot %ToeBase
            Spine Hips Spine
            Spine1 Spine Spine1
            Spine2 Spine1 Spine2,Spine3,Spine4
            Neck Spine2 Neck
            Head Neck Head
            %Shoulder Spine2 %Shoulder
            %Arm %Shoulder %Arm
            %ForeArm %Arm %ForeArm
            %Hand %ForeArm %Hand",
    },
    Rig {
        name: "bandai_namco",
        sides: ["L", "R"],
        joints: "
            joint_Root . -
            Hips joint_Root Hips
            Spine Hips Spine
            Chest Spine Spine1,Spine2,Spine3,Spine4
            Neck Chest Neck
            Head Neck Head
            Shoulder_% Chest %Shoulder
            UpperArm_% Shoulder_% %Arm
            LowerArm_% UpperArm_% %ForeArm
            Hand_% LowerArm_% %Hand
            UpperLeg_% Hips %UpLeg
            LowerLeg_% UpperLeg_% %Leg
            Foot_% LowerLeg_% %Foot
            Toes_% Foot_% %ToeBase",
    },
    Rig {
        name: "rigify_metarig",
        sides: ["L", "R"],
        joints: "
            spine . Hips
            spine.001 spine Spine
            spine.002 spine.001 Spine1
            spine.003 spine.002 Spine2,Spine3,Spine4
            spine.004 spine.003 Neck
            spine.005 spine.004 -
            spine.006 spine.005 Head
            face spine.006 -
            pelvis.% spine -
            breast.% spine.003 -
            shoulder.% spine.003 %Shoulder
            upper_arm.% shoulder.% %Arm
            forearm.% upper_arm.% %ForeArm
            hand.% forearm.% %Hand
            palm.01.% hand.% -
            f_index.01.% palm.01.% -
            thigh.% spine %UpLeg
            shin.% thigh.% %Leg
            foot.% shin.% %Foot
            heel.02.% foot.% -
            toe.% foot.% %ToeBase",
    },
    Rig {
        name: "rigify",
        sides: ["L", "R"],
        joints: "
            root . -
            DEF-spine root Hips
            DEF-spine.001 DEF-spine Spine
            DEF-spine.002 DEF-spine.001 Spine1
            DEF-spine.003 DEF-spine.002 Spine2,Spine3,Spine4
            DEF-spine.004 DEF-spine.003 Neck
            DEF-spine.005 DEF-spine.004 -
            DEF-spine.006 DEF-spine.005 Head
            DEF-pelvis.% DEF-spine -
            DEF-shoulder.% DEF-spine.003 %Shoulder
            DEF-upper_arm.% DEF-shoulder.% %Arm
            DEF-upper_arm.%.001 DEF-upper_arm.% -
            DEF-forearm.% DEF-upper_arm.%.001 %ForeArm
            DEF-forearm.%.001 DEF-forearm.% -
            DEF-hand.% DEF-forearm.%.001 %Hand
            DEF-thigh.% DEF-spine %UpLeg
            DEF-thigh.%.001 DEF-thigh.% -
            DEF-shin.% DEF-thigh.%.001 %Leg
            DEF-shin.%.001 DEF-shin.% -
            DEF-foot.% DEF-shin.%.001 %Foot
            DEF-toe.% DEF-foot.% %ToeBase",
    },
    Rig {
        name: "biped",
        sides: ["L", "R"],
        joints: "
            Bip001 . -
            Bip001_Pelvis Bip001 -
            Bip001_Spine Bip001_Pelvis Hips
            Bip001_%_Thigh Bip001_Spine %UpLeg
            Bip001_%_Calf Bip001_%_Thigh %Leg
            Bip001_%_Foot Bip001_%_Calf %Foot
            Bip001_%_Toe0 Bip001_%_Foot %ToeBase
            Bip001_Spine1 Bip001_Spine Spine
            Bip001_Spine2 Bip001_Spine1 Spine1,Spine2,Spine3,Spine4
            Bip001_Neck Bip001_Spine2 Neck
            Bip001_Head Bip001_Neck Head
            Bip001_%_Clavicle Bip001_Neck %Shoulder
            Bip001_%_UpperArm Bip001_%_Clavicle %Arm
            Bip001_%_Forearm Bip001_%_UpperArm %ForeArm
            Bip001_%_Hand Bip001_%_Forearm %Hand
            Bip001_%_Finger0 Bip001_%_Hand -",
    },
    Rig {
        name: "unreal",
        sides: ["l", "r"],
        joints: "
            root . -
            ik_foot_root root -
            ik_foot_% ik_foot_root -
            ik_hand_root root -
            ik_hand_% ik_hand_root -
            pelvis root Hips
            spine_01 pelvis Spine
            spine_02 spine_01 Spine1
            spine_03 spine_02 -
            spine_04 spine_03 Spine2
            spine_05 spine_04 Spine3
            spine_06 spine_05 Spine4
            neck_01 spine_06 Neck
            head neck_01 Head
            clavicle_% spine_06 %Shoulder
            upperarm_% clavicle_% %Arm
            upperarm_twist_01_% upperarm_% -
            lowerarm_% upperarm_% %ForeArm
            hand_% lowerarm_% %Hand
            thigh_% pelvis %UpLeg
            thigh_twist_01_% thigh_% -
            calf_% thigh_% %Leg
            foot_% calf_% %Foot
            ball_% foot_% %ToeBase",
    },
];

/// A rig's skeleton, and what of it stands for each joint of the dance skeleton.
pub struct Body {
    pub skeleton: Skeleton,
    pub sources: BTreeMap<String, String>,
}

impl Rig {
    /// The body, in cm with Y up, facing along Z.
    pub fn body(&self) -> Body {
        let mut joints: Vec<Joint> = Vec::new();
        let mut places: Vec<DVec3> = Vec::new();
        let mut sources = BTreeMap::new();
        let rows = self.joints.lines().map(str::trim);
        let mut rows: Vec<String> = rows
            .filter(|row| !row.is_empty())
            .map(String::from)
            .collect();
        let mut sided = Vec::new();
        rows.retain(|row| {
            if row.contains('%') {
                sided.push(row.clone());
            }
            !row.contains('%')
        });
        for (own, side) in self.sides.into_iter().zip(["Left", "Right"]) {
            rows.extend(sided.iter().map(|row| {
                let words: Vec<&str> = row.split(' ').collect();
                let stands_for = words[2].replace('%', side);
                format!("{} {stands_for}", words[..2].join(" ").replace('%', own))
            }));
        }
        for row in &rows {
            let words: Vec<&str> = row.split(' ').collect();
            let parent = joints.iter().position(|joint| joint.name == words[1]);
            let above = parent.map_or(DVec3::ZERO, |parent| places[parent]);
            let stands_for: Vec<&str> = words[2].split(',').collect();
            let place = match place_of(stands_for[0]) {
                Some(place) => place,
                None if parent.is_none() => DVec3::ZERO,
                None => above + DVec3::new(0.5, 1.0, 3.0),
            };
            for joint in stands_for.iter().filter(|joint| **joint != "-") {
                let (joint, end) = match joint.strip_suffix("@End") {
                    Some(joint) => (joint, "/End Site"),
                    None => (*joint, ""),
                };
                sources.insert(joint.to_string(), format!("{}{end}", words[0]));
            }
            places.push(place);
            joints.push(Joint {
                name: words[0].into(),
                parent,
                offset: place - above,
                end_sites: Vec::new(),
            });
        }
        for index in 0..joints.len() {
            if !joints.iter().any(|joint| joint.parent == Some(index)) {
                joints[index].end_sites = vec![DVec3::new(0.0, -4.0, 11.0)];
            }
        }
        assert_eq!(sources.len(), DANCE_JOINTS.len(), "{}", self.name);
        Body {
            skeleton: Skeleton { joints },
            sources,
        }
    }
}

/// Where a joint of the dance skeleton is in a T-pose, cm.
fn place_of(joint: &str) -> Option<DVec3> {
    let (side, part) = match joint.strip_prefix("Left") {
        Some(part) => (1.0, part),
        None => (-1.0, joint.strip_prefix("Right").unwrap_or(joint)),
    };
    let (x, y, z) = match part {
        "Hips" => (0.0, 95.0, 0.0),
        "UpLeg" => (9.0, 90.0, 0.0),
        "Leg" => (9.0, 50.0, 1.0),
        "Foot" => (9.0, 8.0, -1.0),
        "ToeBase" => (9.0, 2.0, 12.0),
        "Spine" => (0.0, 105.0, -1.0),
        "Spine1" => (0.0, 115.0, -2.0),
        "Spine2" => (0.0, 125.0, -2.0),
        "Spine3" => (0.0, 133.0, -2.0),
        "Spine4" => (0.0, 140.0, -1.0),
        "Shoulder" => (4.0, 148.0, 0.0),
        "Arm" => (18.0, 148.0, 0.0),
        "ForeArm" => (46.0, 148.0, 0.0),
        "Hand" => (72.0, 148.0, 0.0),
        "Neck" => (0.0, 152.0, 0.0),
        "Head" => (0.0, 165.0, 1.0),
        _ => return None,
    };
    Some(DVec3::new(side * x, y, z))
}

/// A clip with the same motion from another rest pose, in which all bones but the root's point
/// along X.
pub fn from_another_rest_pose(clip: &Clip) -> Clip {
    let joints = &clip.skeleton.joints;
    // Of each joint's frame, before to after; as the bone to its last child asks.
    let mut turns = vec![DQuat::IDENTITY; joints.len()];
    for joint in joints {
        if let Some(parent) = joint.parent {
            let bone = joint.offset.normalize_or(DVec3::X);
            turns[parent] = DQuat::from_rotation_arc(bone, DVec3::X);
        }
    }
    let above = |joint: &Joint| joint.parent.map_or(DQuat::IDENTITY, |parent| turns[parent]);
    let mut other = clip.clone();
    for (index, joint) in joints.iter().enumerate() {
        other.skeleton.joints[index].offset = above(joint) * joint.offset;
        for pose in &mut other.poses {
            pose.translations[index] = above(joint) * pose.translations[index];
            pose.rotations[index] = above(joint) * pose.rotations[index] * turns[index].inverse();
        }
    }
    other
}
