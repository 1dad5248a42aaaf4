//! How fast the parts of the body move.

use ndarray::Array2;

use crate::motion::PARTS;
use crate::motion::features::VELOCITY_FACTORS;
use crate::synthesis::request::check_shape;
use crate::synthesis::{SequenceRequest, SynthesisError};

impl SequenceRequest {
    /// The same with other velocity factors, `[F, 5]`, cm/frame, in the order of the parts.
    ///
    /// # Errors
    /// Another number of rows than F, or of columns than parts.
    pub fn with_velocity_factors(mut self, factors: Array2<f64>) -> Result<Self, SynthesisError> {
        let expected = (self.frames(), PARTS);
        check_shape("the array of velocity factors", &factors, expected)?;
        self.velocity_factors = factors;
        Ok(self)
    }

    /// The velocity factors of each part times a constant of its own, in the order of the parts.
    ///
    /// # Errors
    /// A constant below 0 or not a number.
    pub fn velocity_times(mut self, gains: [f64; PARTS]) -> Result<Self, SynthesisError> {
        for (mut column, gain) in self.velocity_factors.columns_mut().into_iter().zip(gains) {
            if !(gain >= 0.0 && gain.is_finite()) {
                return Err(SynthesisError::Value {
                    what: "a velocity factor's constant",
                    value: gain,
                    expected: "a number of 0 or more",
                });
            }
            column.mapv_inplace(|factor| factor * gain);
        }
        Ok(self)
    }

    /// Velocity factors that go evenly from each keyframe's own to the next one's, `[F, 5]`,
    /// cm/frame.
    pub fn velocity_between_keyframes(&self) -> Array2<f64> {
        let mut factors = Array2::zeros((self.frames(), PARTS));
        for pair in self.keyframes.windows(2) {
            let length = pair[1].time - pair[0].time;
            for frame in 0..=length {
                let share = frame as f64 / length as f64;
                for (part, column) in VELOCITY_FACTORS.enumerate() {
                    let ends = [&pair[0], &pair[1]].map(|timed| timed.keyframe.features[column]);
                    factors[[pair[0].time + frame, part]] = ends[0] + share * (ends[1] - ends[0]);
                }
            }
        }
        factors
    }
}
