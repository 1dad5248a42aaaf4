//! A sound in memory, as everything here hears it.

use super::error::MusicError;
use super::resample::Resampler;

/// Samples a second.
pub const RATE: u32 = 22_050;
/// Samples from a frame to the next.
pub const HOP: usize = 735;
/// Frames a second, that of the motion.
pub const FRAME_RATE: f64 = 30.0;

/// A sound of one channel at 22,050 Hz.
#[derive(Debug, Clone, PartialEq)]
pub struct Sound {
    pub(super) name: String,
    pub(super) samples: Vec<f32>,
    pub(super) warnings: Vec<String>,
}

impl Sound {
    /// A sound made in memory: samples in -1..1 of one channel, `rate` a second. A number that is
    /// not finite counts as 0.
    ///
    /// # Errors
    /// The rate is none from which sounds are resampled.
    pub fn new(name: &str, samples: &[f32], rate: u32) -> Result<Self, MusicError> {
        let mut resampler = Resampler::new(name, rate)?;
        let finite = |&sample: &f32| {
            if sample.is_finite() {
                f64::from(sample)
            } else {
                0.0
            }
        };
        let samples: Vec<f64> = samples.iter().map(finite).collect();
        resampler.push(&samples)?;
        Ok(Self {
            name: name.into(),
            samples: resampler.finish()?,
            warnings: Vec::new(),
        })
    }

    /// What messages call it: the file's path.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Samples at 22,050 Hz, finite.
    #[must_use]
    pub fn samples(&self) -> &[f32] {
        &self.samples
    }

    /// What is odd about the file that it came from, a sentence each.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}
