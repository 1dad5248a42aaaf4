//! Beats of whole clips: of the answer, of the recorded dance, and by chance.

use super::beats::{beat_alignment, beat_hit_rate, joint_speed, motion_beats, shifted_beats};
use super::window::Mean;
use crate::data::BeatExtrema;
use crate::motion::{Pose, Skeleton};

/// Largest distance of a hit, frames; the columns of the hit rate are 1 to this.
pub(super) const DELTAS: usize = 5;

/// Scores of a motion with its music.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct BeatScores {
    /// %, by delta from 1 on.
    pub hit_rate: HitRates,
    /// Of music beats with motion beats.
    pub alignment: Mean,
    /// Of motion beats with music beats.
    pub alignment_of_dance: Mean,
}

/// Hit rates by delta.
type HitRates = [Mean; DELTAS];

/// Share of the shifts that give the made dance no more hits than [`ClipBeats::made_by_chance`].
const LIKELY: f64 = 0.975;

/// What is told of a clip.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ClipBeats {
    pub made: BeatScores,
    pub real: BeatScores,
    /// The recorded dance with shifted beats, a mean over shifts.
    pub chance: BeatScores,
    /// The made dance with shifted beats, `[shifts]`.
    made_shifted: Vec<HitRates>,
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
        let mut made_shifted = Vec::new();
        for shifted in shifted_beats(clip, &music, frames) {
            chance.add(&BeatScores::of(&recorded, &shifted));
            made_shifted.push(BeatScores::of(&made, &shifted).hit_rate);
        }
        Self {
            made: BeatScores::of(&made, &music),
            real: BeatScores::of(&recorded, &music),
            chance,
            made_shifted,
        }
    }

    /// With those of another clip.
    pub fn add(&mut self, other: &Self) {
        self.made.add(&other.made);
        self.real.add(&other.real);
        self.chance.add(&other.chance);
        let shifts = self.made_shifted.len().max(other.made_shifted.len());
        self.made_shifted.resize_with(shifts, Default::default);
        for (own, other) in self.made_shifted.iter_mut().zip(&other.made_shifted) {
            add_rates(own, other);
        }
    }

    /// By delta, the hit rate that the made dance has by chance at most in 97.5 % of the shifts, %:
    /// of each shift the mean over clips.
    pub fn made_by_chance(&self) -> [Option<f64>; DELTAS] {
        std::array::from_fn(|delta| {
            let rates = self.made_shifted.iter().map(|rates| rates[delta].value());
            let mut rates: Vec<f64> = rates.collect::<Option<_>>()?;
            rates.sort_by(f64::total_cmp);
            let rank = (LIKELY * rates.len() as f64).ceil() as usize;
            rates.get(rank.checked_sub(1)?).copied()
        })
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
        add_rates(&mut self.hit_rate, &other.hit_rate);
        add_mean(&mut self.alignment, &other.alignment);
        add_mean(&mut self.alignment_of_dance, &other.alignment_of_dance);
    }
}

/// Means that are added as one value each.
fn add_rates(own: &mut HitRates, other: &HitRates) {
    let pairs = own.iter_mut().zip(other);
    pairs.for_each(|(own, other)| add_mean(own, other));
}

fn add_mean(own: &mut Mean, other: &Mean) {
    other.value().into_iter().for_each(|value| own.add(value));
}
