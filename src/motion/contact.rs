//! Foot contacts: a foot joint that hardly moves in the world stands on the ground.

use glam::DVec3;

/// The foot joints of the dance skeleton, in the order of the labels: LeftFoot, LeftToeBase, RightFoot, RightToeBase.
pub const FOOT_JOINTS: [usize; 4] = [3, 4, 7, 8];

/// Contact labels of every frame, `[frames][4]`: 1 where the squared world-space speed is below `threshold` ((cm/frame)^2).
///
/// The speed of frame t is that from t - 1 to t; the first frame has the labels of the second, and a clip of one frame
/// counts as standing. World space, because relative to the root a planted foot of a moving dancer looks like a moving one.
pub fn contacts(world: &[Vec<DVec3>], threshold: f64) -> Vec<[f64; 4]> {
    let mut labels: Vec<[f64; 4]> = world
        .windows(2)
        .map(|pair| {
            FOOT_JOINTS.map(|joint| {
                let squared_speed = (pair[1][joint] - pair[0][joint]).length_squared();
                if squared_speed < threshold { 1.0 } else { 0.0 }
            })
        })
        .collect();
    labels.insert(0, labels.first().copied().unwrap_or([1.0; 4]));
    labels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_planted_foot_of_a_moving_dancer_is_in_contact() {
        let mut frames = vec![vec![DVec3::ZERO; 24]; 3];
        for (time, frame) in frames.iter_mut().enumerate() {
            frame[0] = DVec3::new(5.0 * time as f64, 90.0, 0.0);
            frame[7] = DVec3::new(0.0, 0.0, 2.0 * time as f64);
        }
        frames[2][4] = DVec3::new(0.0, 0.5, 0.0);
        let labels = contacts(&frames, 0.2);
        assert_eq!(
            labels,
            vec![
                [1.0, 1.0, 0.0, 1.0],
                [1.0, 1.0, 0.0, 1.0],
                [1.0, 0.0, 0.0, 1.0]
            ]
        );
    }
}
