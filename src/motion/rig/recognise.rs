//! The 24 joints of the dance skeleton on any humanoid rig, by names and by what hangs on what.

use std::fmt;

use super::names::{Name, Part, Side};
use crate::counted::counted;
use crate::motion::skeleton::{DANCE_JOINTS, Skeleton};

/// Joints of the dance skeleton's spine, from the hips up.
const SPINE: [&str; 5] = ["Spine", "Spine1", "Spine2", "Spine3", "Spine4"];

/// What of a rig stands for the dance skeleton.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recognised {
    /// For each of the 24 joints what a mapping file names: a joint, or a joint's End Site.
    pub sources: Vec<Option<String>>,
    /// Joints of the rig that stand for none: fingers, twist bones, props.
    pub others: Vec<String>,
}

/// The joints of a leg or an arm from the trunk outwards.
#[derive(Debug, Clone, Copy)]
struct Limb {
    upper: usize,
    lower: usize,
    /// Foot or hand; a rig may lack it.
    end: Option<usize>,
}

impl Recognised {
    /// Finds the limbs by the names of their joints, with any prefix, and the trunk by where the
    /// limbs come together; twist bones and fingers may stand between and beside them. A spine of
    /// fewer joints stands for the lowest of the dance skeleton's one by one and with its last for
    /// the others; one of more stands for them with evenly chosen ones.
    pub fn of(skeleton: &Skeleton) -> Self {
        let body = Body::of(skeleton);
        let mut sources = vec![None; DANCE_JOINTS.len()];
        let mut set = |joint: &str, source: Option<String>| {
            let index = DANCE_JOINTS.iter().position(|name| *name == joint);
            if let Some(index) = index {
                sources[index] = source;
            }
        };
        let name = |joint: usize| skeleton.joints[joint].name.clone();
        let sides = [(Side::Left, "Left"), (Side::Right, "Right")];
        let legs = sides.map(|(side, _)| body.leg(side));
        let arms = sides.map(|(side, _)| body.arm(side));
        for (place, (side, word)) in sides.into_iter().enumerate() {
            if let Some(Limb { upper, lower, end }) = legs[place] {
                set(&format!("{word}UpLeg"), Some(name(upper)));
                set(&format!("{word}Leg"), Some(name(lower)));
                set(&format!("{word}Foot"), end.map(name));
                set(
                    &format!("{word}ToeBase"),
                    end.map(|foot| body.toe(side, foot)),
                );
            }
            if let Some(Limb { upper, lower, end }) = arms[place] {
                set(
                    &format!("{word}Shoulder"),
                    Some(name(body.collar(side, upper))),
                );
                set(&format!("{word}Arm"), Some(name(upper)));
                set(&format!("{word}ForeArm"), Some(name(lower)));
                set(
                    &format!("{word}Hand"),
                    end.map(name).or_else(|| body.end_site(lower)),
                );
            }
        }
        if let [Some(left), Some(right)] = legs {
            let hips = body.meeting(left.upper, right.upper);
            set("Hips", hips.map(name));
            if let (Some(hips), [Some(left), Some(right)]) = (hips, arms) {
                let chest = body.meeting(left.upper, right.upper);
                let trunk = chest.and_then(|chest| body.trunk(hips, chest));
                if let Some((chest, spine)) = chest.zip(trunk) {
                    for (place, joint) in SPINE.into_iter().enumerate() {
                        set(joint, spine_joint(&spine, place).map(name));
                    }
                    let (neck, head) = body.neck_and_head(chest).unzip();
                    set("Neck", neck.map(name));
                    set("Head", head.map(name));
                }
            }
        }
        let stands = |joint: &&str| {
            let is_it = |source: &String| source == joint;
            sources.iter().flatten().any(is_it)
        };
        let names = skeleton.joints.iter().map(|joint| joint.name.as_str());
        let others = names.filter(|name| !stands(name)).map(String::from);
        Self {
            others: others.collect(),
            sources,
        }
    }

    /// Joints of the dance skeleton that were not found.
    pub fn missing(&self) -> Vec<&'static str> {
        let joints = DANCE_JOINTS.into_iter().zip(&self.sources);
        let missing = joints.filter(|(_, source)| source.is_none());
        missing.map(|(joint, _)| joint).collect()
    }
}

impl Recognised {
    /// A mapping file of it, for a person to edit: joints that were not found stand there as
    /// comments. `clip` is the file's name.
    pub fn mapping_file(&self, clip: &str) -> String {
        let entries = DANCE_JOINTS.into_iter().zip(&self.sources);
        let entry = |(joint, source): (&str, &Option<String>)| match source {
            Some(name) => format!("{joint} = {}\n", toml::Value::from(name.as_str())),
            None => format!("# {joint} = \"?\"\n"),
        };
        let entries: String = entries.map(entry).collect();
        format!(
            "# What was recognised of {}.\n\n[joints]\n{entries}",
            clip.escape_debug()
        )
    }
}

impl fmt::Display for Recognised {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (joint, source) in DANCE_JOINTS.iter().zip(&self.sources) {
            let source = source.as_deref().unwrap_or("not found");
            writeln!(f, "{joint:<14} {source}")?;
        }
        let found = DANCE_JOINTS.len() - self.missing().len();
        let others = counted(self.others.len(), "joint");
        writeln!(
            f,
            "{found} of {} recognised; {others} of the rig beside them",
            DANCE_JOINTS.len()
        )
    }
}

/// Which of a rig's spine joints, from the hips up, stands for the dance skeleton's at `place`.
fn spine_joint(spine: &[usize], place: usize) -> Option<usize> {
    let last = spine.len().checked_sub(1)?;
    let index = if spine.len() <= SPINE.len() {
        place.min(last)
    } else {
        (place * last + (SPINE.len() - 1) / 2) / (SPINE.len() - 1)
    };
    Some(spine[index])
}

/// A skeleton whose names have been read.
struct Body<'s> {
    skeleton: &'s Skeleton,
    names: Vec<Name>,
}

impl<'s> Body<'s> {
    fn of(skeleton: &'s Skeleton) -> Self {
        let joints = skeleton.joints.iter();
        Self {
            skeleton,
            names: joints.map(|joint| Name::of(&joint.name)).collect(),
        }
    }

    /// The joint itself, its parent, and so on up to the root.
    fn upwards(&self, joint: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(joint), |&joint| self.skeleton.joints[joint].parent)
    }

    fn children(&self, joint: usize) -> impl Iterator<Item = usize> {
        let hangs = move |&child: &usize| self.skeleton.joints[child].parent == Some(joint);
        (0..self.skeleton.len()).filter(hangs)
    }

    /// The nearest joint above that is one of these parts: of a bone in several segments the first.
    fn above(&self, joint: usize, side: Side, parts: &[Part]) -> Option<usize> {
        let mut above = self.upwards(joint).skip(1);
        let found = above.find(|&it| self.names[it].is(Some(side), parts))?;
        Some(self.first_segment(found))
    }

    /// The uppermost joint of a bone in several segments.
    fn first_segment(&self, joint: usize) -> usize {
        let same = |&above: &usize| self.names[above] == self.names[joint];
        self.upwards(joint).take_while(same).last().unwrap_or(joint)
    }

    /// Joints of these parts that lie below no other of them.
    fn uppermost(&self, side: Option<Side>, parts: &[Part]) -> impl Iterator<Item = usize> {
        let is = move |joint: usize| self.names[joint].is(side, parts);
        let first = move |&joint: &usize| is(joint) && !self.upwards(joint).skip(1).any(is);
        (0..self.skeleton.len()).filter(first)
    }

    /// Thigh, shin and foot of a side.
    fn leg(&self, side: Side) -> Option<Limb> {
        self.limb(side, Part::Foot, Part::Shin, &[Part::Thigh, Part::Shin])
    }

    /// A limb by its end or, where the rig has none, by the lower of its bones.
    fn limb(&self, side: Side, end: Part, lower: Part, uppers: &[Part]) -> Option<Limb> {
        let (ends, lowers) = ([end], [lower]);
        let mut found = self.uppermost(Some(side), &ends);
        let whole = found.find_map(|end| {
            let lower = self.above(end, side, &lowers)?;
            let upper = self.above(lower, side, uppers)?;
            let end = Some(end);
            Some(Limb { upper, lower, end })
        });
        let endless = || {
            let is_lower = |&it: &usize| self.names[it].is(Some(side), &lowers);
            let mut lowers = (0..self.skeleton.len()).filter(is_lower);
            lowers.find_map(|lower| {
                let upper = self.above(lower, side, uppers)?;
                let end = None;
                Some(Limb { upper, lower, end })
            })
        };
        whole.or_else(endless)
    }

    /// The End Site of a joint as a mapping file names it, where there is one.
    fn end_site(&self, joint: usize) -> Option<String> {
        let joint = &self.skeleton.joints[joint];
        let has_end = !joint.end_sites.is_empty();
        has_end.then(|| format!("{}/End Site", joint.name))
    }

    /// What ends a foot: a toe, any joint on the foot, the foot's End Site, the foot itself.
    fn toe(&self, side: Side, foot: usize) -> String {
        let names = &self.names;
        let below = |&joint: &usize| self.upwards(joint).skip(1).any(|above| above == foot);
        let mut below = (0..self.skeleton.len()).filter(below);
        let toe = below.find(|&it| names[it].is(Some(side), &[Part::Toe, Part::Foot]));
        let toe = toe.or_else(|| self.children(foot).next());
        let name = |joint: usize| self.skeleton.joints[joint].name.clone();
        let end = toe.map(name).or_else(|| self.end_site(foot));
        end.unwrap_or_else(|| name(foot))
    }

    /// Upper arm, forearm and hand of a side.
    fn arm(&self, side: Side) -> Option<Limb> {
        let uppers = [Part::UpperArm, Part::Shoulder];
        self.limb(side, Part::Hand, Part::Forearm, &uppers)
    }

    /// The joint that carries an upper arm: its collar bone, or the upper arm itself.
    fn collar(&self, side: Side, upper_arm: usize) -> usize {
        let collar = self.above(upper_arm, side, &[Part::Collar, Part::Shoulder]);
        collar.unwrap_or(upper_arm)
    }

    /// The lowest joint on which both hang.
    fn meeting(&self, one: usize, other: usize) -> Option<usize> {
        let above: Vec<usize> = self.upwards(other).collect();
        self.upwards(one).find(|joint| above.contains(joint))
    }

    /// The joints from the hips up to where the arms begin, without the hips and a neck that
    /// carries the arms; the hips alone where there are no others.
    fn trunk(&self, hips: usize, chest: usize) -> Option<Vec<usize>> {
        let fork = self.meeting(hips, chest)?;
        let spine = self.upwards(chest).take_while(|&it| it != fork);
        let mut spine: Vec<usize> = spine.filter(|&it| !self.is_neck(it)).collect();
        spine.reverse();
        if spine.is_empty() {
            spine.push(fork);
        }
        Some(spine)
    }

    fn is_neck(&self, joint: usize) -> bool {
        self.names[joint].is(None, &[Part::Neck])
    }

    /// The head by its name, or else the end of the chain of joints called as the chest that goes
    /// on from it; the neck is the first joint on the way to it that is called so, or else the
    /// first.
    fn neck_and_head(&self, chest: usize) -> Option<(usize, usize)> {
        let hangs = |&joint: &usize| self.upwards(joint).skip(1).any(|above| above == chest);
        let mut heads = self.uppermost(None, &[Part::Head]).filter(hangs);
        let head = heads.next().or_else(|| self.chain_end(chest))?;
        let mut way: Vec<usize> = self.upwards(head).take_while(|&it| it != chest).collect();
        way.reverse();
        if self.is_neck(chest) {
            return Some((chest, head));
        }
        let named = way.iter().copied().find(|&joint| self.is_neck(joint));
        Some((named.or(way.first().copied())?, head))
    }

    /// The last joint of the chain that goes on from a joint in joints called as it.
    fn chain_end(&self, joint: usize) -> Option<usize> {
        let next = |&joint: &usize| {
            let mut children = self.children(joint);
            children.find(|&child| self.names[child] == self.names[joint])
        };
        let chain = std::iter::successors(Some(joint), next);
        chain.last().filter(|&end| end != joint)
    }
}
