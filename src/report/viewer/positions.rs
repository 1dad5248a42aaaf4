//! Positions as 16-bit steps: 2.7 characters a number in base64.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use serde::Serialize;

use crate::motion::skeleton::JOINTS;

/// Positions as steps from an origin; the page has `origin + step * steps`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Steps {
    /// cm.
    origin: [f64; 3],
    /// cm: 1/64, or more where that does not reach to all of the motion (beyond 5 m from its middle).
    step: f64,
    /// Little-endian i16 in base64, `[frames * 24 * 3]`.
    steps: String,
}

/// The finest step, cm.
const FINEST: f64 = 1.0 / 64.0;

impl Steps {
    pub(super) fn new(frames: &[[DVec3; JOINTS]]) -> Self {
        let places = || frames.iter().flatten();
        let low = places().fold(DVec3::INFINITY, |low, &place| low.min(place));
        let high = places().fold(DVec3::NEG_INFINITY, |high, &place| high.max(place));
        let origin = (low + high) / 2.0;
        let step = ((high - low).max_element() / 2.0 / f64::from(i16::MAX)).max(FINEST);
        let bytes: Vec<u8> = places()
            .flat_map(|&place| ((place - origin) / step).to_array())
            .flat_map(|steps| (steps.round() as i16).to_le_bytes())
            .collect();
        Self {
            origin: origin.to_array(),
            step,
            steps: STANDARD.encode(bytes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What `data.js` does.
    fn decoded(steps: &Steps) -> Vec<f64> {
        let bytes = STANDARD.decode(&steps.steps).unwrap();
        bytes
            .chunks_exact(2)
            .enumerate()
            .map(|(index, pair)| {
                steps.origin[index % 3]
                    + steps.step * f64::from(i16::from_le_bytes([pair[0], pair[1]]))
            })
            .collect()
    }

    #[test]
    fn positions_come_back_to_half_a_step_however_wide_the_motion() {
        for width in [0.0, 40.0, 900.0, 90_000.0] {
            let frames: Vec<[DVec3; JOINTS]> = (0..20)
                .map(|time| {
                    std::array::from_fn(|joint| {
                        let share = (time * JOINTS + joint) as f64 / 479.0;
                        DVec3::new(
                            width * share - 7.0,
                            90.0 - 0.3 * share,
                            -width * share * share,
                        )
                    })
                })
                .collect();
            let steps = Steps::new(&frames);
            assert!(steps.step <= (width / 65_000.0).max(FINEST));
            let places = frames.iter().flatten().flat_map(DVec3::to_array);
            for (expected, found) in places.zip(decoded(&steps)) {
                assert!(
                    (expected - found).abs() <= 0.51 * steps.step,
                    "{expected} {found}"
                );
            }
        }
    }
}
