//! What participants are asked of a clip.

use serde::{Deserialize, Serialize};

/// A question of the paper's user study (Valle-Pérez et al. 2021, section 5.2), each an experiment
/// of its own there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Question {
    /// Whether a human being could move so; without sound
    Naturalness,
    /// Whether the dance goes to the music; with sound
    Appropriateness,
    /// How different two pieces of one dance are, side by side; without sound
    Diversity,
}

impl Question {
    /// In the order in which a page asks them: whoever has heard the music has it in mind.
    pub const ALL: [Self; 3] = [Self::Naturalness, Self::Appropriateness, Self::Diversity];

    /// What stands in tables of ratings.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Naturalness => "naturalness",
            Self::Appropriateness => "appropriateness",
            Self::Diversity => "diversity",
        }
    }

    /// The question of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|question| question.name() == name)
    }

    /// As the paper words it.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::Naturalness => {
                "On a scale from 1 to 5: how natural is the dancing motion? I.e. to what extent \
                 the movements look like they could be carried out by a dancing human being?"
            }
            Self::Appropriateness => {
                "On a scale from 1 to 5: To what extent is the character dancing to the music? \
                 I.e. how well do the movements match the audio?"
            }
            Self::Diversity => {
                "On a scale from 1 to 5: How different are the two dances from each other?"
            }
        }
    }

    /// What 1 and 5 mean, as the paper words it.
    #[must_use]
    pub fn ends(self) -> [&'static str; 2] {
        match self {
            Self::Naturalness => ["very unnatural", "very natural"],
            Self::Appropriateness => ["not at all", "very well"],
            Self::Diversity => ["very similar", "very different"],
        }
    }

    /// Whether the music is heard.
    #[must_use]
    pub fn has_sound(self) -> bool {
        self == Self::Appropriateness
    }

    /// Whether it is about two pieces of one dance.
    #[must_use]
    pub fn is_of_pairs(self) -> bool {
        self == Self::Diversity
    }
}
