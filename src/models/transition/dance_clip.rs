//! A clip with what is measured of every frame.

use ndarray::Array2;
use rayon::prelude::*;

use crate::data::{DataConfig, DataError, FileReading, Recording};
use crate::motion::{Clip, FeatureConfig, FeatureError, Mapping, features};

/// A clip on the dance skeleton, with its features.
#[derive(Debug, Clone, PartialEq)]
pub struct DanceClip {
    /// The file's name with its extension.
    pub name: String,
    /// `[frames, 154]`, not standardised, the facing angle unwrapped along the clip.
    pub features: Array2<f64>,
    /// The motion at the config's rate.
    pub clip: Clip,
}

impl DanceClip {
    /// A clip in cm with Y up, brought to the config's rate, put on the dance skeleton by `mapping`
    /// where there is one, and measured.
    ///
    /// # Errors
    /// The clip cannot be resampled, mapped or measured.
    pub fn new(
        clip: Clip,
        mapping: Option<&Mapping>,
        config: &DataConfig,
    ) -> Result<Self, DataError> {
        let Recording { clip, .. } = Recording::new(clip, mapping, config)?;
        Ok(Self::measure(clip, &config.features())?)
    }

    /// A clip as a file has it, in whatever unit and axis, brought to the config's rate and onto
    /// the dance skeleton and measured; and what is to be said of the file,
    /// by its name, see [`FileReading`].
    ///
    /// # Errors
    /// As [`FileReading::of`], or it cannot be measured.
    pub fn from_file(
        clip: Clip,
        mapping: Option<&Mapping>,
        config: &DataConfig,
    ) -> Result<(Self, Vec<String>), DataError> {
        let reading = FileReading::of(clip, mapping, config)?;
        let FileReading {
            recording, notices, ..
        } = reading;
        let measured = Self::measure(recording.clip, &config.features())?;
        let named = |notice| format!("{}: {notice}", measured.name);
        let notices = notices.into_iter().map(named).collect();
        Ok((measured, notices))
    }

    /// A clip on the dance skeleton, measured.
    ///
    /// # Errors
    /// It is on another skeleton or too short.
    pub fn measure(clip: Clip, config: &FeatureConfig) -> Result<Self, FeatureError> {
        Ok(Self {
            name: clip.name.clone(),
            features: features(&clip, config)?,
            clip,
        })
    }

    /// Recordings, each measured, in their order.
    ///
    /// # Errors
    /// The first that cannot be.
    pub fn measure_all(
        recordings: &[Recording],
        config: &FeatureConfig,
    ) -> Result<Vec<Self>, FeatureError> {
        let measured: Vec<_> = recordings
            .par_iter()
            .map(|recording| Self::measure(recording.clip.clone(), config))
            .collect();
        measured.into_iter().collect()
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.features.nrows()
    }
}
