//! The `[data]` table of an experiment's config.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::motion::{FeatureConfig, Mapping, Unit, Up};

/// How clips are read, measured and split.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DataConfig {
    /// Frames a second that clips are resampled to.
    pub fps: f64,
    /// A foot joint is in contact while its squared speed is below this, (cm/frame)^2.
    pub contact_threshold: f64,
    /// Standard deviation of the Gaussian that smooths the facing direction, frames.
    pub facing_sigma: f64,
    /// Which clips train and which test.
    pub split: Split,
    /// Share of the training clips that is kept aside for validation, at least 0 and below 1.
    pub validation_share: f64,
    /// For clips on another skeleton than the dance skeleton: what a mapping file says. A config
    /// may give the file's path, relative to itself; a run holds the content.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mapping: Option<Mapping>,
    /// Unit of the files' lengths: "cm", "m", "mm", "in"; "auto" recognises it by the body's
    /// height.
    #[serde(skip_serializing_if = "is_default")]
    pub unit: Unit,
    /// Axis that points up in the files: "y", "z"; "auto" recognises it by how the body stands.
    #[serde(skip_serializing_if = "is_default")]
    pub up: Up,
    /// Whether every clip comes with its music: a sound file of its name, beside it or in the
    /// folder `audio`.
    #[serde(skip_serializing_if = "is_default")]
    pub music: bool,
    /// Which extrema of the joints' mean speed are the beats of a motion, where they are scored
    /// against those of its music.
    #[serde(skip_serializing_if = "is_default")]
    pub motion_beats: BeatExtrema,
    /// Frames a second of the files, whatever their headers say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source_fps: Option<f64>,
    /// Frames that are left out at the beginning of every file of a data folder, such as a T-pose;
    /// counted at the file's own rate.
    #[serde(skip_serializing_if = "is_default")]
    pub skip_frames: usize,
}

/// Keys that keep their defaults are left out of a run's config, so that older versions read it.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl Default for DataConfig {
    fn default() -> Self {
        let FeatureConfig {
            contact_threshold,
            facing_sigma,
        } = FeatureConfig::default();
        Self {
            fps: 30.0,
            contact_threshold,
            facing_sigma,
            split: Split::Dance,
            validation_share: 0.0,
            mapping: None,
            unit: Unit::Auto,
            up: Up::Auto,
            music: false,
            motion_beats: BeatExtrema::Minima,
            source_fps: None,
            skip_frames: 0,
        }
    }
}

impl DataConfig {
    /// What of this concerns the features of a clip.
    pub fn features(&self) -> FeatureConfig {
        FeatureConfig {
            contact_threshold: self.contact_threshold,
            facing_sigma: self.facing_sigma,
        }
    }
}

/// Which extrema of the mean joint speed are the beats of a motion.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BeatExtrema {
    /// Where the body comes to rest, as in the public tools of AIST++.
    #[default]
    Minima,
    Maxima,
    /// "Extrema", as Pu and Shan say.
    Both,
}

impl fmt::Display for BeatExtrema {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Minima => "minima",
            Self::Maxima => "maxima",
            Self::Both => "minima and maxima",
        })
    }
}

/// Which clips train and which test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Split {
    /// The paper's split of its 123 dance clips: 98 train, 25 test; both frame counts are checked.
    Dance,
    /// The dance split's training clips alone: those of these dancers test, those of the others
    /// train. For choices that are to hold for dancers whom the model does not know, without a look
    /// at the test clips. A clip shows the dancer whose name stands before its first "_".
    UnseenDancers(Vec<String>),
    /// LaFAN1: files `theme_subjectN.bvh`; subject 5 tests, the others train. Numbers of files and
    /// frames other than those of its 77 files are warned of.
    Lafan1,
    /// The 43 dances with music: which train, validate and test stands in the folder's
    /// `split.json`; their numbers and frames are checked.
    MusicDance,
    /// The Motorica subset at 20 frames a second: the pieces of its `split.csv`; their frames are
    /// checked. Its music comes as numbers.
    Motorica,
    /// Every folder inside the data folder is a data set: with a `split.json` as `music_dance`,
    /// with a `split.csv` as `motorica`, else 0.8 of its clips train.
    Mixed,
    /// This share of the clips trains (rounded down), by the same rule as the dance split; the rest
    /// tests.
    Share(f64),
    /// Named files; files of the folder that no list names are left out. `validation_share` sets
    /// aside further ones of those that train.
    List {
        train: Vec<String>,
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        validation: Vec<String>,
        test: Vec<String>,
    },
}
