//! What the name of a joint says, whatever program gave it: `mixamorig:LeftUpLeg`, `lThigh`,
//! `DEF-thigh.L.001` and `Bip001 L Thigh` are all a left thigh.

/// The side of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

/// A part of the body as names have it. Some mean several: a "leg" is a shin beside an "upleg" and
/// a thigh beside a "knee"; a "shoulder" is a collar bone beside an "arm" and an upper arm beside a
/// "collar".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Thigh,
    Shin,
    Foot,
    Toe,
    Collar,
    Shoulder,
    UpperArm,
    Forearm,
    Hand,
    Neck,
    Head,
}

/// Ends of names, without separators, side and numbers. The longest that fits counts.
const PARTS: [(&str, Part); 38] = [
    ("upleg", Part::Thigh),
    ("upperleg", Part::Thigh),
    ("legupper", Part::Thigh),
    ("thigh", Part::Thigh),
    ("hip", Part::Thigh),
    ("femur", Part::Thigh),
    ("leg", Part::Shin),
    ("lowerleg", Part::Shin),
    ("loleg", Part::Shin),
    ("leglower", Part::Shin),
    ("shin", Part::Shin),
    ("calf", Part::Shin),
    ("knee", Part::Shin),
    ("tibia", Part::Shin),
    ("foot", Part::Foot),
    ("ankle", Part::Foot),
    ("toe", Part::Toe),
    ("toes", Part::Toe),
    ("toebase", Part::Toe),
    ("ball", Part::Toe),
    ("collar", Part::Collar),
    ("clavicle", Part::Collar),
    ("shoulder", Part::Shoulder),
    ("arm", Part::UpperArm),
    ("upperarm", Part::UpperArm),
    ("uparm", Part::UpperArm),
    ("armupper", Part::UpperArm),
    ("shldr", Part::UpperArm),
    ("humerus", Part::UpperArm),
    ("forearm", Part::Forearm),
    ("lowerarm", Part::Forearm),
    ("loarm", Part::Forearm),
    ("armlower", Part::Forearm),
    ("elbow", Part::Forearm),
    ("hand", Part::Hand),
    ("wrist", Part::Hand),
    ("neck", Part::Neck),
    ("head", Part::Head),
];
/// Words that say nothing of the body.
const SILENT: [&str; 4] = ["joint", "jnt", "bone", "bend"];

/// A name that has been read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Name {
    pub side: Option<Side>,
    pub part: Option<Part>,
    /// Its words without side and numbers: the same for the segments of one bone
    /// (`thigh.L`, `thigh.L.001`).
    pub core: String,
}

impl Name {
    pub fn of(name: &str) -> Self {
        let own = name.rsplit([':', '|']).next().unwrap_or(name);
        let mut side = None;
        let mut core = String::new();
        for word in words(own) {
            let (of_word, rest) = match word.as_str() {
                "l" => (Some(Side::Left), ""),
                "r" => (Some(Side::Right), ""),
                word if SILENT.contains(&word) => (None, ""),
                word => side_of(word),
            };
            side = of_word.or(side);
            core.push_str(rest);
        }
        let fitting = PARTS.iter().filter(|(end, _)| core.ends_with(end));
        let part = fitting.max_by_key(|(end, _)| end.len());
        Self {
            side,
            part: part.map(|(_, part)| *part),
            core,
        }
    }

    /// Whether it is a part of this side, or of none where `side` is none.
    pub fn is(&self, side: Option<Side>, parts: &[Part]) -> bool {
        self.side == side && self.part.is_some_and(|part| parts.contains(&part))
    }
}

/// The side that a word begins with, and its rest: "leftleg" is a left leg.
fn side_of(word: &str) -> (Option<Side>, &str) {
    let sides = [("left", Side::Left), ("right", Side::Right)].into_iter();
    let mut found = sides.filter_map(|(name, side)| Some((Some(side), word.strip_prefix(name)?)));
    found.next().unwrap_or((None, word))
}

/// The words of a name in lower case, without numbers: separators stand between them, or a capital
/// letter begins one (`LHipJoint` is l, hip, joint).
fn words(name: &str) -> Vec<String> {
    let letters: Vec<char> = name.chars().collect();
    let mut words = vec![String::new()];
    for (at, &letter) in letters.iter().enumerate() {
        let follows_small = at > 0 && letters[at - 1].is_lowercase();
        let before_small = letters.get(at + 1).is_some_and(|next| next.is_lowercase());
        let begins = letter.is_uppercase() && (follows_small || before_small);
        if begins || !letter.is_alphabetic() {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut().filter(|_| letter.is_alphabetic()) {
            word.extend(letter.to_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    words
}
