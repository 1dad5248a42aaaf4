//! All that is heard in a sound, over the whole of it at once.

use ndarray::{Array2, ArrayView2, Axis};
use serde::{Deserialize, Serialize};

use super::beats::beats;
use super::chroma::{ChromaFilters, PITCH_CLASSES};
use super::downbeats::metre;
use super::error::MusicError;
use super::mel::{BANDS, MelFilters, to_decibels};
use super::mfcc::mfcc;
use super::onset::onset_strength;
use super::peaks::onset_peaks;
use super::sound::{FRAME_RATE, HOP, Sound};
use super::spectrum::PowerSpectra;
use super::tempo::tempo;
use super::twentieths::Twentieths;

/// What was heard in a sound of F = floor(samples / 735) frames, 30 a second; frame k is centred on
/// sample 735 k.
///
/// Tempo, beats, peaks and the floor of the decibels come from one frame more, whose centre is the
/// sound's end, as librosa has it; so a beat or peak may be frame F.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Analysis {
    /// Samples at 22,050 Hz.
    pub samples: usize,
    /// Beats a minute; 100 where there is no onset.
    pub tempo: f64,
    /// Beats of a bar, 3 or 4.
    pub metre: usize,
    /// Frames of the beats, ascending.
    pub beats: Vec<usize>,
    /// Those of the beats that begin a bar.
    pub downbeats: Vec<usize>,
    /// Frames of the onset peaks, ascending.
    pub onset_peaks: Vec<usize>,
    /// No sample is other than 0.
    pub silent: bool,
    /// Onset strength of the F frames, dB.
    pub onset: Vec<f32>,
    /// Mel spectrum [F, 128], dB.
    pub mel: Array2<f32>,
    /// Mel-frequency cepstral coefficients [F, 20].
    pub mfcc: Array2<f32>,
    /// Chroma [F, 12], from C, the largest of a frame 1.
    pub chroma: Array2<f32>,
    /// What is heard every twentieth of a second.
    pub twentieths: Twentieths,
}

impl Analysis {
    /// # Errors
    /// The sound is shorter than a frame.
    pub fn of(sound: &Sound) -> Result<Self, MusicError> {
        let samples = sound.samples();
        let frames = samples.len() / HOP;
        if frames == 0 {
            return Err(MusicError::TooShort {
                file: sound.name().into(),
                samples: samples.len(),
            });
        }
        let mut mel = Array2::zeros((frames + 1, BANDS));
        let mut chroma = Array2::zeros((frames + 1, PITCH_CLASSES));
        let mut spectra = PowerSpectra::new(samples);
        let (mel_filters, chroma_filters) = (MelFilters::new(), ChromaFilters::new());
        let rows = mel.rows_mut().into_iter().zip(chroma.rows_mut());
        for (frame, (mut mel, mut chroma)) in rows.enumerate() {
            let power = spectra.of(frame);
            mel.iter_mut()
                .zip(mel_filters.apply(power))
                .for_each(|(into, band)| *into = band);
            chroma
                .iter_mut()
                .zip(chroma_filters.apply(power))
                .for_each(|(into, class)| *into = class);
        }
        to_decibels(&mut mel);
        let onset = onset_strength(mel.view());
        let tempo = tempo(&onset);
        let beats = beats(&onset, tempo.period);
        let metre = metre(&onset, chroma.view(), &beats);
        let kept = |array: ArrayView2<'_, f64>| {
            let kept = array.slice_axis(Axis(0), (..frames).into());
            kept.mapv(|value| value as f32)
        };
        Ok(Self {
            samples: samples.len(),
            tempo: tempo.bpm,
            metre: metre.beats,
            downbeats: metre.downbeats(&beats),
            beats,
            onset_peaks: onset_peaks(&onset),
            silent: samples.iter().all(|&sample| sample == 0.0),
            onset: onset[..frames].iter().map(|&x| x as f32).collect(),
            mfcc: kept(mfcc(mel.view()).view()),
            mel: kept(mel.view()),
            chroma: kept(chroma.view()),
            twentieths: Twentieths::of(samples).single(),
        })
    }

    /// F, the frames that the features have.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.onset.len()
    }

    /// How long the sound is, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.samples as f64 / (HOP as f64 * FRAME_RATE)
    }

    /// Whether anything begins in the sound; where nothing does, it has no beats and the tempo is
    /// the one to which others are drawn.
    #[must_use]
    pub fn has_onsets(&self) -> bool {
        !self.onset_peaks.is_empty() || self.onset.iter().any(|&onset| onset > 0.0)
    }
}
