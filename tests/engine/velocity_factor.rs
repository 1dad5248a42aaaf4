//! Velocity factors, eq. 1.

use keydance::motion::{PART_WEIGHTS, velocity_factors};

#[test]
fn one_moving_joint_counts_with_its_share_of_the_weights() {
    let mut velocities = [0.0; 72];
    velocities[3 * (17 - 1)..3 * 17].copy_from_slice(&[3.0, 0.0, 4.0]);
    velocities[69..].copy_from_slice(&[0.0, 9.0, 0.0]);
    assert_eq!(velocity_factors(&velocities), [1.0, 0.0, 0.0, 2.0, 0.0]);
}

#[test]
fn every_joint_belongs_to_exactly_one_part() {
    let mut joints: Vec<usize> = PART_WEIGHTS
        .iter()
        .flat_map(|part| part.iter().map(|&(joint, _)| joint))
        .collect();
    joints.sort_unstable();
    assert_eq!(joints, (0..24).collect::<Vec<_>>());
}
