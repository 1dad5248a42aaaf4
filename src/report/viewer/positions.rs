//! Positions as 16-bit steps: 2.7 characters a number in base64.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use serde::Serialize;

/// Positions as steps from an origin; the page has `origin + step * steps`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Steps {
    /// cm.
    origin: [f64; 3],
    /// cm: 1/64, or more where that does not reach to all of the motion (beyond 5 m from its
    /// middle).
    step: f64,
    /// Little-endian i16 in base64, `[frames * joints * 3]`.
    steps: String,
}

/// The finest step, cm.
const FINEST: f64 = 1.0 / 64.0;

impl Steps {
    pub(super) fn new(frames: &[Vec<DVec3>]) -> Self {
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
