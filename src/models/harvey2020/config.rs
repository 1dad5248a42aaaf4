//! Sizes of the recurrent network, its noise and its losses.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::models::settings::ValueError;

/// Weights of the loss terms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HarveyLossWeights {
    pub quaternion: f64,
    pub root: f64,
    pub position: f64,
    pub contact: f64,
    /// Of the critics' judgement in the generator's loss; the critics' own loss has weight 1.
    pub adversarial: f64,
}

impl Default for HarveyLossWeights {
    fn default() -> Self {
        Self {
            quaternion: 1.0,
            root: 1.0,
            position: 0.5,
            contact: 0.1,
            adversarial: 0.1,
        }
    }
}

/// The network of Harvey et al. 2020; the defaults are that paper's. A config has these keys beside
/// those of what the network is trained on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RecurrentConfig {
    /// Whether the two critics are trained with the network.
    pub adversarial: bool,
    /// First hidden layer of encoders, decoder and critics.
    pub hidden: usize,
    /// Codes, second hidden layer of decoder and critics, time-to-arrival embedding; even.
    pub code: usize,
    /// Units of the LSTM.
    pub recurrent: usize,
    /// Time to arrival from which on its embedding stays the same, frames.
    pub arrival_frames: usize,
    /// Standard deviation of the target noise in training; 0 for none.
    pub target_noise: f64,
    /// Frames before the target up to which there is no target noise.
    pub noise_from: usize,
    /// Frames before the target from which on the target noise is whole.
    pub noise_whole: usize,
    pub loss: HarveyLossWeights,
}

impl Default for RecurrentConfig {
    fn default() -> Self {
        Self {
            adversarial: true,
            hidden: 512,
            code: 256,
            recurrent: 1024,
            arrival_frames: 66,
            target_noise: 0.5,
            noise_from: 5,
            noise_whole: 30,
            loss: HarveyLossWeights::default(),
        }
    }
}

impl RecurrentConfig {
    /// The same structure in small sizes (8 units a layer), for checks in f64.
    pub fn small(&self) -> Self {
        Self {
            hidden: 8,
            code: 8,
            recurrent: 8,
            ..self.clone()
        }
    }

    /// Share of the target noise `arrival` frames before the target: 0 up to `noise_from`, 1 from
    /// `noise_whole` on.
    pub(super) fn noise_share(&self, arrival: usize) -> f64 {
        let span = (self.noise_whole - self.noise_from) as f64;
        ((arrival as f64 - self.noise_from as f64) / span).clamp(0.0, 1.0)
    }

    /// Checks the fields by themselves and against each other.
    ///
    /// # Errors
    /// The first out of its range.
    pub fn check(&self) -> Result<(), ValueError> {
        let require = |valid: bool, key: &str, value: &dyn fmt::Display, expected: &str| {
            ValueError::unless(valid, format!("model.{key}"), value, expected)
        };
        for (key, value, most) in [
            ("hidden", self.hidden, 65_536),
            ("code", self.code, 4096),
            ("recurrent", self.recurrent, 65_536),
            ("arrival_frames", self.arrival_frames, 4096),
            ("noise_whole", self.noise_whole, 65_536),
        ] {
            let valid = (1..=most).contains(&value);
            require(valid, key, &value, &format!("1 to {most}"))?;
        }
        let even = self.code.is_multiple_of(2);
        require(even, "code", &self.code, "an even number")?;
        require(
            self.noise_from < self.noise_whole,
            "noise_from",
            &self.noise_from,
            &format!("less than model.noise_whole = {}", self.noise_whole),
        )?;
        let loss = self.loss;
        for (key, value) in [
            ("target_noise", self.target_noise),
            ("loss.quaternion", loss.quaternion),
            ("loss.root", loss.root),
            ("loss.position", loss.position),
            ("loss.contact", loss.contact),
            ("loss.adversarial", loss.adversarial),
        ] {
            require(value.is_finite() && value >= 0.0, key, &value, "0 or more")?;
        }
        Ok(())
    }
}
