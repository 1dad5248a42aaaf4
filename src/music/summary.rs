//! What there is to say of a sound: as text and as JSON.

use std::fmt;

use serde::Serialize;

use super::analysis::Analysis;
use super::cache::Heard;
use super::sound::{FRAME_RATE, RATE};
use crate::counted::counted;

/// Tempo, metre and beats of a sound, in frames and seconds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    seconds: f64,
    sample_rate: u32,
    samples: usize,
    frame_rate: f64,
    frames: usize,
    tempo_bpm: f64,
    metre: usize,
    beats: Vec<usize>,
    beat_seconds: Vec<f64>,
    downbeats: Vec<usize>,
    downbeat_seconds: Vec<f64>,
    onset_peaks: Vec<usize>,
    silent: bool,
    warnings: Vec<String>,
    #[serde(skip)]
    has_onsets: bool,
}

impl From<&Heard> for Summary {
    fn from(Heard { analysis, warnings }: &Heard) -> Self {
        let seconds = |frames: &[usize]| {
            let seconds = frames.iter().map(|&frame| frame as f64 / FRAME_RATE);
            seconds.collect()
        };
        let Analysis {
            samples,
            tempo,
            metre,
            beats,
            downbeats,
            onset_peaks,
            silent,
            ..
        } = analysis;
        Self {
            seconds: analysis.seconds(),
            sample_rate: RATE,
            samples: *samples,
            frame_rate: FRAME_RATE,
            frames: analysis.frames(),
            tempo_bpm: *tempo,
            metre: *metre,
            beat_seconds: seconds(beats),
            beats: beats.clone(),
            downbeat_seconds: seconds(downbeats),
            downbeats: downbeats.clone(),
            onset_peaks: onset_peaks.clone(),
            silent: *silent,
            warnings: warnings.clone(),
            has_onsets: analysis.has_onsets(),
        }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (frames, tempo) = (counted(self.frames, "frame"), self.tempo_bpm);
        writeln!(f, "{:.2} s, {frames} of 1/30 s", self.seconds)?;
        if !self.has_onsets {
            let why = match self.silent {
                true => "silent",
                false => "nothing begins in it",
            };
            return writeln!(f, "{why}: no beats; its tempo counts as {tempo:.2}");
        }
        writeln!(f, "tempo      {tempo:.2} beats a minute")?;
        writeln!(f, "metre      {}", self.metre)?;
        for (name, times) in [
            ("beats", &self.beat_seconds),
            ("downbeats", &self.downbeat_seconds),
        ] {
            write!(f, "{name:<10} {}, at seconds", times.len())?;
            times.iter().try_for_each(|time| write!(f, " {time:.2}"))?;
            writeln!(f)?;
        }
        Ok(())
    }
}
