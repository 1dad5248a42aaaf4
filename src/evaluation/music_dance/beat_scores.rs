//! Beats of whole clips: of the answer, of the recorded dance, and by chance.

use super::beats::{
    BeatExtrema, beat_alignment, beat_hit_rate, joint_speed, motion_beats, shifted_beats,
};
use super::window::Mean;
use crate::motion::{Pose, Skeleton};

/// Largest distance of a hit, frames; the columns of the hit rate are 1 to this.
pub(super) const DELTAS: usize = 5;

/// Scores of a motion with its music.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct BeatScores {
    /// %, by delta from 1 on.
    pub hit_rate: [Mean; DELTAS],
    /// Of music beats with motion beats.
    pub alignment: Mean,
    /// Of motion beats with music beats.
    pub alignment_of_dance: Mean,
}

/// What is told of a clip.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct ClipBeats {
    pub made: BeatScores,
    pub real: BeatScores,
    /// The recorded dance with shifted beats, a mean over shifts.
    pub chance: BeatScores,
}

impl ClipBeats {
    /// Of a whole clip's recorded and made poses; `music`: its beats, frames.
    pub fn of(
        clip: &str,
        skeleton: &Skeleton,
        [recorded, made]: [&[Pose]; 2],
        music: &[usize],
        extrema: BeatExtrema,
    ) -> Self {
        let frames = recorded.len();
        // The music may go on after the dance.
        let music: Vec<usize> = music
            .iter()
            .copied()
            .filter(|beat| *beat < frames)
            .collect();
        let [recorded, made] = [recorded, made].map(|poses| {
            let speed = joint_speed(&skeleton.world_positions(poses));
            motion_beats(&speed, extrema)
        });
        let mut chance = BeatScores::default();
        for shifted in shifted_beats(clip, &music, frames) {
            chance.add(&BeatScores::of(&recorded, &shifted));
        }
        Self {
            made: BeatScores::of(&made, &music),
            real: BeatScores::of(&recorded, &music),
            chance,
        }
    }

    /// With those of another clip.
    pub fn add(&mut self, other: &Self) {
        self.made.add(&other.made);
        self.real.add(&other.real);
        self.chance.add(&other.chance);
    }
}

impl BeatScores {
    /// Of one motion; of music without beats there are none.
    fn of(motion: &[usize], music: &[usize]) -> Self {
        let mut scores = Self::default();
        for (mean, delta) in scores.hit_rate.iter_mut().zip(1..) {
            *mean = beat_hit_rate(motion, music, delta).into_iter().collect();
        }
        if !music.is_empty() {
            scores.alignment.add(beat_alignment(music, motion));
            scores.alignment_of_dance.add(beat_alignment(motion, music));
        }
        scores
    }

    /// With the mean of others as one value.
    fn add(&mut self, other: &Self) {
        let own = self
            .hit_rate
            .iter_mut()
            .chain([&mut self.alignment, &mut self.alignment_of_dance]);
        let others = other
            .hit_rate
            .iter()
            .chain([&other.alignment, &other.alignment_of_dance]);
        for (own, other) in own.zip(others) {
            other.value().into_iter().for_each(|value| own.add(value));
        }
    }
}
