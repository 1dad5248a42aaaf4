//! Beats of a dance: where the body falls fastest (spec, section 9).

/// Standard deviation of the Gaussian that smooths the velocity, seconds.
const SMOOTHING: f64 = 0.1;
/// Standard deviations at which it is cut.
const CUT: f64 = 4.0;

/// A local minimum of the root's vertical velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KinematicBeat {
    /// Seconds from the first frame.
    pub time: f64,
    /// Smoothed velocity, cm/s upwards: below 0.
    pub velocity: f64,
}

/// The root's vertical velocity from each frame to the next, smoothed, in the unit of the height
/// per second, `[frames - 1]`.
///
/// v_k = (y_k - y_(k-1)) fps belongs to the time (k - 1/2) / fps. The Gaussian of 0.1 s is cut at 4
/// standard deviations, and no further than the dance is long; beyond an end the end value goes on.
#[must_use]
pub fn vertical_velocity(height: &[f64], fps: f64) -> Vec<f64> {
    let steps = height.windows(2).filter_map(|pair| match pair {
        [before, after] => Some((after - before) * fps),
        _ => None,
    });
    let velocity: Vec<f64> = steps.collect();
    let deviation = SMOOTHING * fps;
    let radius = ((CUT * deviation + 0.5) as usize).min(velocity.len());
    let weight = |tap: usize| {
        let distance = tap as f64 - radius as f64;
        (-0.5 * (distance / deviation).powi(2)).exp()
    };
    let kernel: Vec<f64> = (0..=2 * radius).map(weight).collect();
    let sum: f64 = kernel.iter().sum();
    let last = velocity.len().saturating_sub(1);
    let smooth = |at: usize| {
        let taps = kernel.iter().enumerate();
        let taps = taps.filter_map(|(tap, weight)| {
            let place = (at + tap).saturating_sub(radius).min(last);
            Some(weight * velocity.get(place)?)
        });
        taps.sum::<f64>() / sum
    };
    (0..velocity.len()).map(smooth).collect()
}

/// The beats of a dance by its root's height, `[frames]` in cm, ascending in time.
///
/// They are minima v_k < v_(k-1), v_k <= v_(k+1), v_k < 0 of [`vertical_velocity`], neither its
/// first nor its last value. Without smoothing a recorded dance has over 3 a second at 20 fps.
#[must_use]
pub fn kinematic_beats(height: &[f64], fps: f64) -> Vec<KinematicBeat> {
    let velocity = vertical_velocity(height, fps);
    let around = velocity.windows(3).enumerate();
    let beats = around.filter_map(|(before, around)| match *around {
        [earlier, velocity, later] if velocity < earlier && velocity <= later && velocity < 0.0 => {
            // Velocity 0 lies between frames 0 and 1.
            let time = (before as f64 + 1.5) / fps;
            Some(KinematicBeat { time, velocity })
        }
        _ => None,
    });
    beats.collect()
}
