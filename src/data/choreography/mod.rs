//! The built-in choreography: human dance motion on the dance skeleton, from a seed.
//!
//! For whoever has no motion capture. A clip is made in layers, each a file, in this order: `style`
//! (what kind of dance) and `rhythm` (beats to frames); `figures` write a `score`: what feet,
//! pelvis, trunk, head and arms do when; `feet` turns it into planted and swinging feet and the
//! true contacts; `pelvis` finds the path of the pelvis within the legs' reach; `assembly` finds
//! the rotations, the legs' by inverse kinematics.

mod assembly;
mod body;
mod curve;
#[cfg(feature = "music")]
mod dataset;
mod feet;
mod figures;
#[cfg(feature = "music")]
mod files;
#[cfg(feature = "music")]
mod music;
mod pelvis;
mod rhythm;
mod score;
mod style;
mod upper_body;

use std::ops::RangeInclusive;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::motion::Clip;
#[cfg(feature = "music")]
pub use dataset::{by_name, dataset_with_music};
#[cfg(feature = "music")]
pub use files::{DanceFileError, write_clips};
#[cfg(feature = "music")]
pub use music::{DanceWithMusic, clips_with_music, generate_with_music};

use feet::{Foot, FootPose};
use figures::Family;
use rhythm::{FRAME_RATE, Rhythm};
use score::Score;
use style::Style;

/// Frames that a clip may have: two, so that there is a velocity, to about nine hours.
pub const FRAMES: RangeInclusive<usize> = 2..=1_000_000;

/// How many clips may be asked for: they may be held in memory until all are made.
pub const CLIPS: RangeInclusive<usize> = 1..=1000;

/// Distance (cm) from the middle of the floor at which a dancer turns back.
const FARTHEST: f64 = 120.0;

/// What to generate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ChoreographyConfig {
    /// Number of clips; styles take turns.
    pub clips: usize,
    /// Frames of each clip, at 30 a second.
    pub frames_per_clip: usize,
    /// Everything follows from it, to the bit on one platform. Clip n is the same however many
    /// clips are asked for.
    pub seed: u64,
}

impl Default for ChoreographyConfig {
    fn default() -> Self {
        Self {
            clips: 24,
            frames_per_clip: 900,
            seed: 0,
        }
    }
}

/// Why there is no choreography.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ChoreographyError {
    #[error("choreography: `clips` is 0; ask for at least one clip")]
    NoClips,
    #[error("choreography: `clips` is {clips}; it must be at most {}", CLIPS.end())]
    TooManyClips { clips: usize },
    #[error(
        "choreography: `frames_per_clip` is {frames}; it must be between {} and {}",
        FRAMES.start(), FRAMES.end()
    )]
    Frames { frames: usize },
}

/// A generated clip with what only its maker knows for certain.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneratedClip {
    /// The motion: dance skeleton, cm, 30 frames a second.
    pub clip: Clip,
    /// `[frames]` of LeftFoot, LeftToeBase, RightFoot, RightToeBase: whether the joint was held
    /// still by a planted foot since the frame before. The first frame counts what the second does.
    pub contacts: Vec<[bool; 4]>,
}

/// Generates the clips of a configuration.
///
/// # Errors
/// [`ChoreographyError`] where no clip or more than 1000 are asked for, or clips shorter or longer
/// than what can be made.
pub fn generate(config: &ChoreographyConfig) -> Result<Vec<GeneratedClip>, ChoreographyError> {
    Ok(clips(config)?.collect())
}

/// The clips of a configuration one after the other, for more of them than memory holds.
///
/// # Errors
/// As [`generate`].
pub fn clips(
    config: &ChoreographyConfig,
) -> Result<impl Iterator<Item = GeneratedClip> + use<>, ChoreographyError> {
    check(config)?;
    let (frames, seed) = (config.frames_per_clip, config.seed);
    Ok((0..config.clips).map(move |number| dance_of(number, frames, seed, false).0))
}

fn check(config: &ChoreographyConfig) -> Result<(), ChoreographyError> {
    if config.clips == 0 {
        return Err(ChoreographyError::NoClips);
    }
    if !CLIPS.contains(&config.clips) {
        return Err(ChoreographyError::TooManyClips {
            clips: config.clips,
        });
    }
    if !FRAMES.contains(&config.frames_per_clip) {
        return Err(ChoreographyError::Frames {
            frames: config.frames_per_clip,
        });
    }
    Ok(())
}

/// One clip, on a random stream of its own, with its rhythm and the beats of a bar.
fn dance_of(
    number: usize,
    frames: usize,
    seed: u64,
    to_music: bool,
) -> (GeneratedClip, Rhythm, f64) {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    rng.set_stream(number as u64);
    let style = Style::draw(number, &mut rng);
    let name = format!("choreography_{number:03}_{}.bvh", style.name);
    let rhythm = Rhythm::new(style.draw_tempo(&mut rng), style.rubato, &mut rng);
    let heading = rng.random_range(0.0..std::f64::consts::TAU);
    let bar = style.bar;
    let mut score = Score::new(style, rhythm.clone(), heading, to_music);
    let mut last: Option<Family> = None;
    while score.frame(0.0) < frames as f64 {
        if score.centre.length() > FARTHEST {
            figures::return_to_the_middle(&mut score, &mut rng);
            continue;
        }
        let family = score.style.draw_family(&mut rng);
        // The same family rarely follows itself.
        if last == Some(family) && rng.random_bool(0.6) {
            continue;
        }
        family.perform(&mut score, &mut rng);
        last = Some(family);
    }
    let flight = pelvis::flight(&score.jumps, frames);
    let feet =
        [Foot::Left, Foot::Right].map(|foot| score.feet[foot.index()].sample(frames, &flight));
    let pelvis = pelvis::path(&score, &feet);
    let skeleton = body::skeleton();
    let poses = assembly::poses(&score, &skeleton, &feet, &pelvis, &mut rng);
    let clip = Clip {
        name,
        skeleton,
        frame_time: 1.0 / FRAME_RATE,
        poses,
    };
    let dance = GeneratedClip {
        clip,
        contacts: contacts(&feet),
    };
    (dance, rhythm, bar)
}

fn contacts(feet: &[Vec<FootPose>; 2]) -> Vec<[bool; 4]> {
    let [left, right] = [0, 1].map(|foot| feet::contacts(&feet[foot]));
    left.iter()
        .zip(right)
        .map(|(l, r)| [l[0], l[1], r[0], r[1]])
        .collect()
}
