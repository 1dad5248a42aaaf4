//! Kinetic features of a dance: how much its joints move (Onuma et al. 2008, as the public tools of
//! AIST++ have them, without their slip in the unit of the acceleration).

use glam::DVec3;

use super::FRAMES_PER_SECOND;

/// Frames to either side over which velocity and acceleration are averaged.
const NEIGHBOURS: usize = 2;

/// Kinetic features of a window, three a joint, `[3 joints]`: means over frames 1..T of the squared
/// horizontal speed and the squared vertical speed (unit of the positions squared per s^2) and of
/// the norm of the acceleration (unit of the positions per s^2).
///
/// `world`: positions, `[T][joints]`, 30 frames a second, T at least 3 (else zeros). Velocity at
/// frame i is the mean of p_(i+j) - p_(i+j-1), acceleration that of p_(i+j+1) - 2 p_(i+j) +
/// p_(i+j-1), over those j from -2 to 2 whose frames lie in the window; then they are squared.
#[must_use]
pub fn kinetic_features(world: &[Vec<DVec3>]) -> Vec<f64> {
    let frames = world.len();
    let joints = world.first().map_or(0, Vec::len);
    let mut features = vec![0.0; 3 * joints];
    if frames < 3 {
        return features;
    }
    let position = |frame: usize, joint: usize| world[frame][joint];
    for (joint, sums) in features.chunks_exact_mut(3).enumerate() {
        for frame in 1..frames {
            let first = frame.saturating_sub(NEIGHBOURS).max(1);
            let last = (frame + NEIGHBOURS).min(frames - 1);
            let step = |at: usize| position(at, joint) - position(at - 1, joint);
            let velocity = mean(first..=last, step) * FRAMES_PER_SECOND;
            let bend = |at: usize| step(at + 1) - step(at);
            let acceleration = mean(first..=last.min(frames - 2), bend) * FRAMES_PER_SECOND.powi(2);
            let [horizontal, vertical, expenditure] = sums else {
                continue;
            };
            *horizontal += velocity.x.powi(2) + velocity.z.powi(2);
            *vertical += velocity.y.powi(2);
            *expenditure += acceleration.length();
        }
        sums.iter_mut().for_each(|sum| *sum /= (frames - 1) as f64);
    }
    features
}

/// A mean over frames of which there is at least one.
fn mean(frames: std::ops::RangeInclusive<usize>, of: impl Fn(usize) -> DVec3) -> DVec3 {
    let count = frames.clone().count();
    frames.map(of).sum::<DVec3>() / count.max(1) as f64
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::kinetic_features;

    /// Taken from the definition, term by term.
    fn slow(path: &[DVec3]) -> [f64; 3] {
        let frames = path.len() as i64;
        let at = |frame: i64| path[frame as usize];
        let mut sums = [0.0; 3];
        for i in 1..frames {
            let (mut velocities, mut accelerations) = (Vec::new(), Vec::new());
            for j in -2..=2 {
                if i + j - 1 < 0 || i + j >= frames {
                    continue;
                }
                velocities.push((at(i + j) - at(i + j - 1)) / (1.0 / 30.0));
                if i + j + 1 < frames {
                    let after = (at(i + j + 1) - at(i + j)) * 30.0;
                    let before = (at(i + j) - at(i + j - 1)) * 30.0;
                    accelerations.push((after - before) * 30.0);
                }
            }
            let v = velocities.iter().sum::<DVec3>() / velocities.len() as f64;
            let a = accelerations.iter().sum::<DVec3>() / accelerations.len() as f64;
            let own = [v.x * v.x + v.z * v.z, v.y * v.y, a.length()];
            for (sum, own) in sums.iter_mut().zip(own) {
                *sum += own / (frames - 1) as f64;
            }
        }
        sums
    }

    #[test]
    fn features_are_the_definitions_and_those_of_a_joint_depend_on_no_other() {
        let wave = |t: usize, joint: usize| {
            let t = t as f64 * 0.2 + joint as f64;
            DVec3::new(t.sin(), (1.7 * t).cos(), 0.3 * t * t)
        };
        for frames in [3, 4, 5, 6, 20] {
            let world: Vec<Vec<DVec3>> =
                (0..frames).map(|t| vec![wave(t, 0), wave(t, 1)]).collect();
            let features = kinetic_features(&world);
            for joint in 0..2 {
                let path: Vec<DVec3> = (0..frames).map(|t| wave(t, joint)).collect();
                for (found, expected) in features[3 * joint..].iter().zip(slow(&path)) {
                    assert!((found - expected).abs() < 1e-9 * (1.0 + expected));
                }
            }
        }
        assert_eq!(kinetic_features(&vec![vec![DVec3::X]; 2]), [0.0; 3]);
        assert!(kinetic_features(&[]).is_empty());
    }
}
