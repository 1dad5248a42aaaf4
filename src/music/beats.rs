//! Beats by dynamic programming (Ellis 2007, "Beat tracking by dynamic programming"), as librosa's
//! `beat_track` does it.

/// How much a beat that is early or late costs.
const TIGHTNESS: f64 = 100.0;
/// Share of the largest local score that the first beat must reach.
const FIRST: f64 = 0.01;

/// The frames of the beats of an onset envelope whose beats are `period` frames apart, ascending.
/// None where no onset is.
#[must_use]
pub fn beats(onset: &[f64], period: usize) -> Vec<usize> {
    if period == 0 || onset.len() < 2 || onset.iter().all(|&x| x == 0.0) {
        return Vec::new();
    }
    let score = local_score(onset, period);
    let (cumulated, links) = cumulated_score(&score, period);
    let mut beats = Vec::new();
    let mut next = Some(last_beat(&cumulated));
    while let Some(beat) = next {
        beats.push(beat);
        next = links[beat];
    }
    beats.reverse();
    trimmed(beats, &score)
}

/// The envelope over its standard deviation, convolved with exp(-0.5 (32 j / period)^2) for |j| up
/// to the period.
fn local_score(onset: &[f64], period: usize) -> Vec<f64> {
    let count = onset.len() as f64;
    let mean = onset.iter().sum::<f64>() / count;
    let squares = onset.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    let deviation = (squares / (count - 1.0)).sqrt() + f64::from(f32::MIN_POSITIVE);
    let weight = |distance: usize| {
        let scaled = 32.0 * distance as f64 / period as f64;
        (-0.5 * scaled * scaled).exp() / deviation
    };
    let weights: Vec<f64> = (0..=period).map(weight).collect();
    let score = |frame: usize| {
        let first = frame.saturating_sub(period);
        let near = onset
            .iter()
            .enumerate()
            .take(frame + period + 1)
            .skip(first);
        near.map(|(at, onset)| weights[at.abs_diff(frame)] * onset)
            .sum()
    };
    (0..onset.len()).map(score).collect()
}

/// The best sum of scores over beats that end at each frame, and the beat before it.
fn cumulated_score(score: &[f64], period: usize) -> (Vec<f64>, Vec<Option<usize>>) {
    let nearest = half_to_even(period).max(1);
    let distances = nearest..=2 * period;
    let penalty = |distance: usize| {
        let off = (distance as f64).ln() - (period as f64).ln();
        TIGHTNESS * off * off
    };
    let penalties: Vec<(usize, f64)> = distances.map(|d| (d, penalty(d))).collect();
    let threshold = FIRST * score.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut started = false;
    let mut cumulated: Vec<f64> = Vec::with_capacity(score.len());
    let mut links = Vec::with_capacity(score.len());
    for (frame, &here) in score.iter().enumerate() {
        let mut best: Option<(usize, f64)> = None;
        for &(distance, penalty) in &penalties {
            let Some(before) = frame.checked_sub(distance) else {
                break;
            };
            let sum = cumulated[before] - penalty;
            // Of equal ones the nearer.
            if best.is_none_or(|(_, most)| sum > most) {
                best = Some((before, sum));
            }
        }
        cumulated.push(here + best.map_or(0.0, |(_, sum)| sum));
        started |= here >= threshold;
        links.push(best.map(|(before, _)| before).filter(|_| started));
    }
    (cumulated, links)
}

/// Half of a number, rounded to an even one where it has a half.
fn half_to_even(number: usize) -> usize {
    let half = number / 2;
    half + usize::from(number % 2 == 1 && half % 2 == 1)
}

/// The last local maximum that is at least half the median of all; the last frame where there is
/// none.
fn last_beat(cumulated: &[f64]) -> usize {
    let last = cumulated.len() - 1;
    let is_peak = |&frame: &usize| {
        let here = cumulated[frame];
        let falls = frame == last || here >= cumulated[frame + 1];
        frame > 0 && here > cumulated[frame - 1] && falls
    };
    let peaks: Vec<usize> = (0..cumulated.len()).filter(is_peak).collect();
    let mut heights: Vec<f64> = peaks.iter().map(|&peak| cumulated[peak]).collect();
    heights.sort_by(f64::total_cmp);
    let Some(&upper) = heights.get(heights.len() / 2) else {
        return last;
    };
    let median = match heights.len() % 2 {
        0 => (heights[heights.len() / 2 - 1] + upper) / 2.0,
        _ => upper,
    };
    let mut high = peaks
        .into_iter()
        .rev()
        .filter(|&peak| cumulated[peak] >= 0.5 * median);
    high.next().unwrap_or(last)
}

/// Without the beats before the first and behind the last frame whose score exceeds half the root
/// mean square of the smoothed scores at the beats.
fn trimmed(mut beats: Vec<usize>, score: &[f64]) -> Vec<usize> {
    let at = |beat: usize| beats.get(beat).map_or(0.0, |&frame| score[frame]);
    let smoothed = |beat: usize| {
        let before = if beat == 0 { 0.0 } else { at(beat - 1) };
        0.5 * before + at(beat) + 0.5 * at(beat + 1)
    };
    // librosa's slice of the convolution holds two values behind the last beat, the second 0.
    let count = beats.len() + 2;
    let squares = (0..count).map(|beat| smoothed(beat).powi(2)).sum::<f64>();
    let threshold = 0.5 * (squares / count as f64).sqrt();
    let first = score.iter().position(|&x| x > threshold);
    let last = score.iter().rposition(|&x| x > threshold);
    let (Some(first), Some(last)) = (first, last) else {
        return Vec::new();
    };
    beats.retain(|beat| (first..=last).contains(beat));
    beats
}
