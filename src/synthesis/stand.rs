//! A dance stands on the floor that its seed stands on.

use crate::motion::{Pose, Skeleton};

/// Of how many frames one may be lower than what counts as the floor: it may have been measured
/// wrong, or made so.
const LOWER: usize = 20;

/// Moves what follows a seed of so many frames up or down, as a whole, until it comes as low as the
/// seed: a model has learned how high hips are from dancers with other legs.
pub(super) fn stand(skeleton: &Skeleton, poses: &mut [Pose], seed: usize) {
    let (before, after) = poses.split_at_mut(seed.min(poses.len()));
    let Some((floor, found)) = lowest(skeleton, before).zip(lowest(skeleton, after)) else {
        return;
    };
    for pose in after {
        pose.translations[0].y += floor - found;
    }
}

/// The height of the lowest joint that all but a twentieth of the frames stay above, cm.
fn lowest(skeleton: &Skeleton, poses: &[Pose]) -> Option<f64> {
    let lowest = |pose: &Pose| {
        let places = pose.world_positions(skeleton).into_iter();
        places.map(|place| place.y).fold(f64::INFINITY, f64::min)
    };
    let mut heights: Vec<f64> = poses.iter().map(lowest).collect();
    heights.sort_by(f64::total_cmp);
    heights.get(heights.len() / LOWER).copied()
}
