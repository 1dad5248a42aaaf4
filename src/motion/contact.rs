//! Foot contacts: a foot joint that hardly moves in the world stands on the ground.

use glam::DVec3;
use ndarray::ArrayView1;

use super::features::CONTACTS;

/// The foot joints of the dance skeleton, in the order of the labels: LeftFoot, LeftToeBase,
/// RightFoot, RightToeBase.
pub const FOOT_JOINTS: [usize; 4] = [3, 4, 7, 8];

/// A foot joint is in contact where its label is above this.
pub const CONTACT_LABEL: f64 = 0.5;

/// Which foot joints are in contact by the labels of a frame, in the order of [`FOOT_JOINTS`].
///
/// `frame`: the 149 numbers of a predicted frame or the 154 of a recorded one, not standardised.
/// Panics on fewer than 77 numbers.
pub fn in_contact(frame: ArrayView1<f64>) -> [bool; 4] {
    std::array::from_fn(|foot| frame[CONTACTS.start + foot] > CONTACT_LABEL)
}

/// Contact labels of every frame, `[frames][4]`: 1 where the squared world-space speed is below
/// `threshold` ((cm/frame)^2).
///
/// The speed of frame t is that from t - 1 to t; the first frame has the labels of the second, and
/// a clip of one frame counts as standing. World space, because relative to the root a planted foot
/// of a moving dancer looks like a moving one.
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

/// Foot skate: the mean distance (cm/frame) that a foot joint moves in the world from the frame
/// before to one in which it is in contact. None where no joint is.
///
/// `world`: world positions of the dance skeleton's joints, `[frames][24]`, cm; `contacts`:
/// `[frames]` in the order of [`FOOT_JOINTS`].
pub fn foot_skate(world: &[Vec<DVec3>], contacts: &[[bool; 4]]) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0);
    for (pair, contacts) in world.windows(2).zip(contacts.iter().skip(1)) {
        for (joint, _) in FOOT_JOINTS.iter().zip(contacts).filter(|(_, on)| **on) {
            sum += pair[1][*joint].distance(pair[0][*joint]);
            count += 1;
        }
    }
    (count > 0).then(|| sum / f64::from(count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skate_counts_only_feet_in_contact() {
        let mut frames = vec![vec![DVec3::ZERO; 24]; 3];
        frames[1][3].x = 2.0;
        frames[2][3].x = 3.0;
        frames[2][7].y = 50.0;
        let on = |left, right| [left, false, right, false];
        let contacts = [on(true, true), on(true, false), on(true, false)];
        assert_eq!(foot_skate(&frames, &contacts), Some(1.5));
        assert_eq!(foot_skate(&frames, &[[false; 4]; 3]), None);
    }

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
