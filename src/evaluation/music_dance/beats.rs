//! Whether a dance moves to the beat of its music.

use glam::DVec3;
use rand::RngExt as _;

use super::FRAMES_PER_SECOND;
use crate::data::BeatExtrema;
use crate::models::Streams;

/// Standard deviation of the Gaussian that smooths the speed, frames.
const SMOOTHING: f64 = 2.5;
/// Standard deviation of the alignment score, frames at 30 a second: 3 at the 60 of AIST++.
const ALIGNMENT: f64 = 1.5;
/// Times that the beats are shifted to tell chance.
const SHIFTS: usize = 200;
/// Least frames of a shift, either way round.
const LEAST_SHIFT: usize = 30;

/// Speed of the joints, a mean over them, from each frame to the next, in the unit of the
/// positions per second; smoothed over time by [`smoothed`].
///
/// `world`: positions, `[frames][joints]`; the answer has a frame less.
#[must_use]
pub fn joint_speed(world: &[Vec<DVec3>]) -> Vec<f64> {
    let speeds = world.windows(2).map(|pair| match pair {
        [before, after] if !after.is_empty() => {
            let steps = before.iter().zip(after).map(|(a, b)| a.distance(*b));
            FRAMES_PER_SECOND * steps.sum::<f64>() / after.len() as f64
        }
        _ => 0.0,
    });
    smoothed(&speeds.collect::<Vec<f64>>())
}

/// Values smoothed by a Gaussian of 2.5 frames, cut at 4 standard deviations (10 frames) and
/// normalised; beyond an end they go on reflected, the end value twice: c b a | a b c | c b a.
#[must_use]
pub fn smoothed(values: &[f64]) -> Vec<f64> {
    let radius = (4.0 * SMOOTHING + 0.5) as usize;
    let weight = |tap: usize| {
        let distance = tap as f64 - radius as f64;
        (-0.5 * (distance / SMOOTHING).powi(2)).exp()
    };
    let kernel: Vec<f64> = (0..=2 * radius).map(weight).collect();
    let sum: f64 = kernel.iter().sum();
    let period = 2 * values.len();
    let reflected = |at: usize| {
        // A whole number of periods keeps the place above 0.
        let place = (at + radius * period - radius) % period;
        values.get(place.min(period - 1 - place)).copied()
    };
    let smooth = |at: usize| {
        let taps = kernel.iter().enumerate();
        let taps = taps.map(|(tap, weight)| weight * reflected(at + tap).unwrap_or(0.0));
        taps.sum::<f64>() / sum
    };
    (0..values.len()).map(smooth).collect()
}

/// Beats of a motion: indices i of the [speed](joint_speed) from frame i to i + 1 that lie strictly
/// below both neighbours (minima) or above both (maxima), ascending.
#[must_use]
pub fn motion_beats(speed: &[f64], extrema: BeatExtrema) -> Vec<usize> {
    let is_beat = |around: &[f64]| match around {
        [before, at, after] => {
            let (least, most) = (at < before && at < after, at > before && at > after);
            match extrema {
                BeatExtrema::Minima => least,
                BeatExtrema::Maxima => most,
                BeatExtrema::Both => least || most,
            }
        }
        _ => false,
    };
    let around = speed.windows(3).enumerate();
    around
        .filter(|(_, around)| is_beat(around))
        .map(|(before, _)| before + 1)
        .collect()
}

/// Beat hit rate, %: motion beats with a music beat within `delta` frames, over the number of
/// music beats (the paper's ratio, so it can exceed 100).
///
/// Both are frames, ascending. None without music beats.
#[must_use]
pub fn beat_hit_rate(motion: &[usize], music: &[usize], delta: usize) -> Option<f64> {
    let near = |beat: &&usize| distance(music, **beat).is_some_and(|frames| frames <= delta);
    let hits = motion.iter().filter(near).count();
    (!music.is_empty()).then(|| 100.0 * hits as f64 / music.len() as f64)
}

/// Beat alignment of `beats` with `others`: a mean over `beats` of exp(-d^2 / (2 x 1.5^2)), d the
/// frames to the nearest of `others`; 0 to 1.
///
/// Over music beats it is the score of AIST++; over motion beats it is what some of its public code
/// computes. Both are frames, ascending; 0 where either is empty.
#[must_use]
pub fn beat_alignment(beats: &[usize], others: &[usize]) -> f64 {
    let nearness = |beat: &usize| match distance(others, *beat) {
        Some(frames) => (-0.5 * (frames as f64 / ALIGNMENT).powi(2)).exp(),
        None => 0.0,
    };
    beats.iter().map(nearness).sum::<f64>() / beats.len().max(1) as f64
}

/// Frames from one to the nearest of some ascending ones.
fn distance(frames: &[usize], from: usize) -> Option<usize> {
    let next = frames.partition_point(|&frame| frame < from);
    let around = frames.iter().take(next + 1).skip(next.saturating_sub(1));
    around.map(|frame| frame.abs_diff(from)).min()
}

/// The music's beats shifted round a clip of so many frames, by 200 offsets that are drawn evenly
/// from 30 to `frames` - 30, both among them; none of a clip under 60 frames.
///
/// Their stream is the clip's by its name, so they are the same whatever else is scored.
pub(super) fn shifted_beats(clip: &str, music: &[usize], frames: usize) -> Vec<Vec<usize>> {
    let mut stream = Streams::new(0).stream(&format!("beats by chance, {clip}"), &[]);
    if frames < 2 * LEAST_SHIFT {
        return Vec::new();
    }
    let mut shifted = || {
        let offset = stream.random_range(LEAST_SHIFT..=frames - LEAST_SHIFT);
        let beats = music.iter().map(|beat| (beat + offset) % frames);
        let mut beats: Vec<usize> = beats.collect();
        beats.sort_unstable();
        beats
    };
    (0..SHIFTS).map(|_| shifted()).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn smoothing_keeps_a_constant_and_reflects_the_ends() {
        for length in 1..30 {
            for value in smoothed(&vec![3.0; length]) {
                assert!((value - 3.0).abs() < 1e-12);
            }
        }
        // Written out: the value at the end counts once more for its reflection.
        let mut values = vec![0.0; 40];
        values[0] = 1.0;
        let weight = |distance: i32| (-0.5 * (f64::from(distance) / 2.5).powi(2)).exp();
        let sum: f64 = (-10..=10).map(weight).sum();
        let smooth = smoothed(&values);
        assert!((smooth[0] - (weight(0) + weight(1)) / sum).abs() < 1e-12);
        assert!((smooth[4] - (weight(4) + weight(5)) / sum).abs() < 1e-12);
        assert_eq!(smooth[11], 0.0);
        assert_eq!(smoothed(&[]), Vec::<f64>::new());
    }

    #[test]
    fn the_speed_is_a_mean_over_joints_per_second() {
        let world: Vec<Vec<DVec3>> = (0..50)
            .map(|t| vec![DVec3::X * f64::from(t), DVec3::ZERO])
            .collect();
        let speed = joint_speed(&world);
        assert_eq!(speed.len(), 49);
        assert!(speed.iter().all(|speed| (speed - 15.0).abs() < 1e-12));
    }

    #[test]
    fn beats_are_strict_extrema() {
        let speed = [0.0, 2.0, 1.0, 1.0, 3.0, 2.0, 5.0, 4.0];
        assert_eq!(motion_beats(&speed, BeatExtrema::Minima), [5]);
        assert_eq!(motion_beats(&speed, BeatExtrema::Maxima), [1, 4, 6]);
        assert_eq!(motion_beats(&speed, BeatExtrema::Both), [1, 4, 5, 6]);
        assert!(motion_beats(&[1.0, 0.0], BeatExtrema::Both).is_empty());
    }

    #[test]
    fn hits_are_counted_over_music_beats() {
        let (motion, music) = ([10, 12, 30], [11, 40]);
        assert_eq!(beat_hit_rate(&motion, &music, 1), Some(100.0));
        assert_eq!(beat_hit_rate(&motion, &music, 10), Some(150.0));
        assert_eq!(beat_hit_rate(&motion, &[], 1), None);
        assert_eq!(beat_hit_rate(&music, &music, 0), Some(100.0));
        assert_eq!(beat_hit_rate(&[], &music, 5), Some(0.0));
    }

    #[test]
    fn alignment_has_two_directions() {
        let near = |frames: f64| (-frames * frames / 4.5).exp();
        let (a, b) = ([10, 20], [11, 100, 200]);
        let expected = (near(1.0) + near(9.0)) / 2.0;
        assert!((beat_alignment(&a, &b) - expected).abs() < 1e-12);
        let expected = (near(1.0) + near(80.0) + near(180.0)) / 3.0;
        assert!((beat_alignment(&b, &a) - expected).abs() < 1e-12);
        assert_eq!(beat_alignment(&a, &a), 1.0);
        assert_eq!(
            (beat_alignment(&a, &[]), beat_alignment(&[], &a)),
            (0.0, 0.0)
        );
    }

    #[test]
    fn shifts_go_round_and_stay_away_from_none() {
        let music = [0, 25, 50, 99];
        let shifts = shifted_beats("a clip", &music, 100);
        assert_eq!(shifts.len(), 200);
        assert_eq!(shifts, shifted_beats("a clip", &music, 100));
        for shifted in &shifts {
            assert!(shifted.is_sorted() && shifted.iter().all(|&beat| beat < 100));
            // Beats 99 and 0 follow on each other still.
            let is_shift = (30..=70).any(|offset| {
                music
                    .iter()
                    .all(|beat| shifted.contains(&((beat + offset) % 100)))
            });
            assert!(is_shift, "{shifted:?}");
        }
        assert!(shifted_beats("short", &music, 59).is_empty());
    }
}
