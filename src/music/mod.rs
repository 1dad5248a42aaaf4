//! What is heard in music: sound files, spectra, onsets, tempo, beats, downbeats, and the features
//! of a frame. It knows nothing of dance.
//!
//! Everything but [`twentieths`] is at 30 frames a second, 735 samples at 22,050 Hz, and equals librosa 0.11 with
//! `hop_length=735`, `n_fft=2048` and, for tempo and beats, `start_bpm=100`.
//!
//! ```
//! use keydance::music::{Analysis, FeatureSet, Sound};
//!
//! // Ten seconds of clicks, two a second.
//! let click = |n: usize| if n % 11_025 < 200 { 0.5 } else { 0.0 };
//! let samples: Vec<f32> = (0..220_500).map(click).collect();
//! let sound = Sound::new("clicks", &samples, 22_050)?;
//! let heard = Analysis::of(&sound)?;
//! assert_eq!((heard.frames(), heard.tempo), (300, 120.0));
//! assert_eq!(heard.beats[1] - heard.beats[0], 15);
//! assert_eq!(heard.features(FeatureSet::Paper15).dim(), (300, 15));
//! # Ok::<(), keydance::music::MusicError>(())
//! ```
//!
//! Of files: [`read`], or [`Cache::analysis`], which remembers what was heard.
//!
//! - [`sound`], [`decode`]: a file's samples, one channel at 22,050 Hz;
//! - [`spectrum`], [`mel`], [`chroma`], [`mfcc`], [`onset`], [`peaks`]: frame by frame;
//! - [`twentieths`]: frame by frame at 20 a second;
//! - [`tempo`], [`beats`], [`downbeats`]: over the whole sound;
//! - [`analysis`], [`features`]: all of it, and as a model takes it;
//! - [`cache`]: what was heard in a file, by the file's content.
#![forbid(unsafe_code)]

pub mod analysis;
pub mod beats;
mod behind;
pub mod cache;
pub mod chroma;
mod container;
pub mod decode;
pub mod downbeats;
mod error;
pub mod features;
pub mod mel;
pub mod mfcc;
pub mod onset;
pub mod peaks;
mod resample;
mod riff;
pub mod sound;
pub mod spectrum;
mod summary;
pub mod tempo;
pub mod twentieths;
mod wav;

pub use analysis::Analysis;
pub use cache::Cache;
pub use decode::{parse, read};
pub use error::MusicError;
pub use features::FeatureSet;
pub use sound::{FRAME_RATE, HOP, RATE, Sound};
pub use summary::Summary;
pub use twentieths::Twentieths;
pub use wav::write_wav;
