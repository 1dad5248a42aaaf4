//! Beat alignment (table 3): seconds from the music's beats to the dance's, and what chance gives
//! (spec, section 9).

use super::kinematic_beats::kinematic_beats;

/// When a dance has its beats.
#[derive(Debug, Clone, PartialEq)]
pub struct DanceBeats {
    /// Seconds from the first frame, ascending.
    pub times: Vec<f64>,
    /// Seconds.
    pub duration: f64,
}

impl DanceBeats {
    /// Those of a dance by its root's height, `[frames]` in cm.
    #[must_use]
    pub fn of(height: &[f64], fps: f64) -> Self {
        let beats = kinematic_beats(height, fps);
        Self {
            times: beats.iter().map(|beat| beat.time).collect(),
            duration: height.len() as f64 / fps,
        }
    }

    /// Distance of each music beat within the dance from the nearest beat of the dance, seconds;
    /// none where the dance has no beat. `music`: seconds from the dance's first frame.
    pub fn offsets<'a>(&'a self, music: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        let within = |time: &&f64| (0.0..self.duration).contains(*time);
        let offset = |time: &f64| {
            let next = self.times.partition_point(|beat| beat < time);
            let around = self
                .times
                .iter()
                .take(next + 1)
                .skip(next.saturating_sub(1));
            around
                .map(|beat| (beat - time).abs())
                .min_by(f64::total_cmp)
        };
        music.iter().filter(within).filter_map(offset)
    }

    /// The offset of a uniformly drawn moment, its mean: (sum of g^2 / 4 over the gaps between
    /// beats + sum of e^2 / 2 over both ends) / duration, seconds. None without a beat.
    #[must_use]
    pub fn chance(&self) -> Option<f64> {
        let (first, last) = (self.times.first()?, self.times.last()?);
        let gaps = self.times.windows(2).map(|pair| match pair {
            [before, after] => (after - before).powi(2) / 4.0,
            _ => 0.0,
        });
        let ends = (first.powi(2) + (self.duration - last).powi(2)) / 2.0;
        Some((gaps.sum::<f64>() + ends) / self.duration)
    }
}

/// A dance and the music that it was made to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Performance<'a> {
    /// Dances to one song have music beats in common.
    pub song: &'a str,
    pub dance: &'a DanceBeats,
    /// Beats of the music, seconds from the dance's first frame.
    pub music: &'a [f64],
}

/// Beat alignment of some dances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeatAlignment {
    /// Offset of a music beat, seconds, a mean over all music beats of all dances; none without.
    pub mean: Option<f64>,
    /// Its population standard deviation, seconds.
    pub deviation: Option<f64>,
    /// The mean that beats drawn uniformly would have, as many in each dance as its music has.
    pub chance: Option<f64>,
    /// Kinematic beats a second, of all dances together.
    pub beats_per_second: Option<f64>,
    /// Dances without a kinematic beat: they have no offsets.
    pub without_beat: usize,
    pub dances: usize,
}

impl BeatAlignment {
    /// Each dance with its own music.
    #[must_use]
    pub fn matched(performances: &[Performance<'_>]) -> Self {
        let pairs = performances.iter().map(|it| (it.dance, it.music));
        Self::of(&pairs.collect::<Vec<_>>())
    }

    /// Each dance with the music of each dance to another song, begun together.
    #[must_use]
    pub fn mismatched(performances: &[Performance<'_>]) -> Self {
        let pairs = performances.iter().flat_map(|it| {
            let others = performances.iter().filter(|other| other.song != it.song);
            others.map(|other| (it.dance, other.music))
        });
        Self::of(&pairs.collect::<Vec<_>>())
    }

    /// Mean offset over that of chance: 1 where beats of dance and music know nothing of each
    /// other. A trembling dance has small offsets, but not by this.
    #[must_use]
    pub fn over_chance(&self) -> Option<f64> {
        Some(self.mean? / self.chance?)
    }

    fn of(pairs: &[(&DanceBeats, &[f64])]) -> Self {
        let offsets: Vec<f64> = pairs
            .iter()
            .flat_map(|(dance, music)| dance.offsets(music))
            .collect();
        let over = |sum: f64, count: f64| (count > 0.0).then(|| sum / count);
        let count = offsets.len() as f64;
        let mean = over(offsets.iter().sum(), count);
        let variance = mean.and_then(|mean| {
            let squares = offsets.iter().map(|offset| (offset - mean).powi(2));
            over(squares.sum(), count)
        });
        let by_chance = pairs.iter().filter_map(|(dance, music)| {
            Some(dance.chance()? * dance.offsets(music).count() as f64)
        });
        let dances = pairs.iter().map(|(dance, _)| dance);
        let beats: usize = dances.clone().map(|dance| dance.times.len()).sum();
        let seconds: f64 = dances.clone().map(|dance| dance.duration).sum();
        Self {
            mean,
            deviation: variance.map(f64::sqrt),
            chance: over(by_chance.sum(), count),
            beats_per_second: over(beats as f64, seconds),
            without_beat: dances.filter(|dance| dance.times.is_empty()).count(),
            dances: pairs.len(),
        }
    }
}
