//! Music for a generated dance, on its beats: drums that accent the downbeats, chords that change
//! at the bar, noise.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rayon::prelude::*;

use super::{ChoreographyConfig, ChoreographyError, GeneratedClip, check, dance_of};
use crate::motion::Clip;
use crate::music::{HOP, RATE};

/// Streams of the music lie beyond those of the dances.
const STREAM: u64 = 1 << 32;
/// Roots of the chords in semitones from C: I, IV, V, VI.
const ROOTS: [i32; 4] = [0, 5, 7, 9];
/// Middle C, Hz.
const MIDDLE_C: f64 = 261.63;
/// Amplitudes of a chord's note, of a drum, of the noise.
const CHORD: f64 = 0.05;
const DRUM: f64 = 0.25;
const NOISE: f64 = 0.002;
/// A drum on another beat than the first of a bar.
const UNACCENTED: f64 = 0.6;
/// Longest that a drum sounds, s.
const DRUM_SECONDS: f64 = 0.04;

/// A generated dance with its music.
#[derive(Debug, Clone, PartialEq)]
pub struct DanceWithMusic {
    pub dance: GeneratedClip,
    /// One channel at 22,050 Hz, 735 samples a frame of the dance.
    pub samples: Vec<f32>,
    /// Frames of the beats, ascending.
    pub beats: Vec<usize>,
    /// Those that begin a bar.
    pub downbeats: Vec<usize>,
    /// Beats of a bar.
    pub metre: usize,
}

/// Generates dances with music: each begins somewhere in its first bar, and its figures keep to
/// whole beats.
///
/// # Errors
/// As [`super::generate`].
pub fn generate_with_music(
    config: &ChoreographyConfig,
) -> Result<Vec<DanceWithMusic>, ChoreographyError> {
    check(config)?;
    let numbers = (0..config.clips).into_par_iter();
    let dances = numbers.map(|number| of_number(number, config.frames_per_clip, config.seed));
    Ok(dances.collect())
}

/// The same one after the other, for more of them than memory holds.
///
/// # Errors
/// As [`super::generate`].
pub fn clips_with_music(
    config: &ChoreographyConfig,
) -> Result<impl Iterator<Item = DanceWithMusic> + use<>, ChoreographyError> {
    check(config)?;
    let (frames, seed) = (config.frames_per_clip, config.seed);
    Ok((0..config.clips).map(move |number| of_number(number, frames, seed)))
}

fn of_number(number: usize, frames: usize, seed: u64) -> DanceWithMusic {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    rng.set_stream(STREAM + number as u64);
    let spare = rng.random_range(0..60);
    let (mut dance, rhythm, bar) = dance_of(number, frames + spare, seed, true);
    cut(&mut dance.clip, spare);
    dance.contacts.drain(..spare);
    let metre = bar as usize;
    let all = (0..)
        .map(|beat| (beat, rhythm.frame(beat as f64) as usize))
        .take_while(|(_, frame)| *frame < frames + spare);
    let inside = all.filter(|(_, frame)| *frame >= spare);
    let beats: Vec<(usize, usize)> = inside.map(|(beat, frame)| (beat, frame - spare)).collect();
    DanceWithMusic {
        samples: samples(frames, &beats, metre, &mut rng),
        downbeats: beats
            .iter()
            .filter(|(beat, _)| beat % metre == 0)
            .map(|(_, frame)| *frame)
            .collect(),
        beats: beats.iter().map(|(_, frame)| *frame).collect(),
        metre,
        dance,
    }
}

/// Leaves out the first frames of a clip.
fn cut(clip: &mut Clip, frames: usize) {
    clip.poses.drain(..frames);
}

/// The sound of beats, given by number and frame.
fn samples(
    frames: usize,
    beats: &[(usize, usize)],
    metre: usize,
    rng: &mut ChaCha12Rng,
) -> Vec<f32> {
    let mut sound: Vec<f64> = (0..frames * HOP)
        .map(|_| NOISE * rng.random_range(-1.0..1.0))
        .collect();
    let mut root = ROOTS[0];
    for (place, &(beat, frame)) in beats.iter().enumerate() {
        let begins_bar = beat % metre == 0;
        if begins_bar {
            let others: Vec<i32> = ROOTS.into_iter().filter(|it| *it != root).collect();
            root = others[rng.random_range(0..others.len())];
        }
        let strength = if begins_bar { 1.0 } else { UNACCENTED };
        drum(&mut sound, frame * HOP, strength, rng);
        if begins_bar || place == 0 {
            let later = beats[place + 1..].iter();
            let end = later.clone().find(|(beat, _)| beat % metre == 0);
            let end = end.map_or(frames, |(_, frame)| *frame);
            chord(&mut sound, frame * HOP..end * HOP, root);
        }
    }
    sound.into_iter().map(|x| x as f32).collect()
}

/// A dry stroke, from a sample on: noise, without a tone that would drown the chord's.
fn drum(sound: &mut [f64], from: usize, strength: f64, rng: &mut ChaCha12Rng) {
    let length = (DRUM_SECONDS * RATE as f64) as usize;
    let end = sound.len().min(from + length);
    for (n, sample) in sound[from.min(end)..end].iter_mut().enumerate() {
        let time = n as f64 / RATE as f64;
        let click = (-time / 0.004).exp() * rng.random_range(-1.0..1.0);
        *sample += DRUM * strength * click;
    }
}

/// A major triad that fades a little, with three partials a note.
fn chord(sound: &mut [f64], range: std::ops::Range<usize>, root: i32) {
    let end = range.end.min(sound.len());
    let notes = [0, 4, 7].map(|step| MIDDLE_C * 2_f64.powf(f64::from(root + step) / 12.0));
    let own = &mut sound[range.start.min(end)..end];
    let length = own.len();
    for (n, sample) in own.iter_mut().enumerate() {
        let time = n as f64 / RATE as f64;
        // Soft at both ends: no click of its own.
        let left = (length - n) as f64 / RATE as f64;
        let level = CHORD * (time / 0.02).min(1.0) * (left / 0.02).min(1.0) * (-time / 2.0).exp();
        let partial = |frequency: f64, k: f64| (TAU * frequency * k * time).sin() / (k * k);
        let tones = notes
            .iter()
            .map(|&f| (1..=3).map(|k| partial(f, f64::from(k))).sum::<f64>());
        *sample += level * tones.sum::<f64>();
    }
}
