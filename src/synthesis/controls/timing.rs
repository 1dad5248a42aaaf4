//! The same keyframes at other times.

use ndarray::Array2;

use super::row_at;
use crate::synthesis::request::check_times;
use crate::synthesis::{SequenceRequest, SynthesisError};

impl SequenceRequest {
    /// The same keyframes at other frames of the result; the controls between them are stretched
    /// along.
    ///
    /// The root goes the same way in more or less time. Velocity factors keep their values, so a
    /// longer transition is filled with more movement at the same speeds, as in the paper's figure
    /// 10, not with slower movement.
    ///
    /// # Errors
    /// Not one time a keyframe, or times that do not ascend from 0.
    pub fn at_times(mut self, times: &[usize]) -> Result<Self, SynthesisError> {
        if times.len() != self.keyframes.len() {
            return Err(SynthesisError::Times {
                keyframes: self.keyframes.len(),
                times: times.len(),
            });
        }
        check_times(times)?;
        let old = self.times();
        let sources = stretched(&old, times);
        self.root_trajectory = rows_at(&self.root_trajectory, &sources);
        self.velocity_factors =
            rows_at(&self.velocity_factors, &sources).mapv(|factor| factor.max(0.0));
        for (keyframe, &time) in self.keyframes.iter_mut().zip(times) {
            keyframe.time = time;
        }
        Ok(self)
    }

    /// The same with `length` frames from each keyframe to the next.
    ///
    /// # Errors
    /// A length of 0.
    pub fn with_length(self, length: usize) -> Result<Self, SynthesisError> {
        let times: Vec<usize> = (0..self.keyframes.len()).map(|k| k * length).collect();
        self.at_times(&times)
    }
}

/// For each frame of the new times the time between the old ones that it shows.
fn stretched(old: &[usize], new: &[usize]) -> Vec<f64> {
    let mut sources = vec![old[0] as f64];
    for (old, new) in old.windows(2).zip(new.windows(2)) {
        let (frames, step) = (new[1] - new[0], (old[1] - old[0]) as f64);
        let source = |frame: usize| old[0] as f64 + step * frame as f64 / frames as f64;
        sources.extend((1..=frames).map(source));
    }
    sources
}

fn rows_at(rows: &Array2<f64>, times: &[f64]) -> Array2<f64> {
    let mut out = Array2::zeros((times.len(), rows.ncols()));
    for (mut out, &time) in out.rows_mut().into_iter().zip(times) {
        for (slot, value) in out.iter_mut().zip(row_at(rows.view(), time)) {
            *slot = value;
        }
    }
    out
}
