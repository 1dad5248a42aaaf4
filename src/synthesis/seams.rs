//! A dance that was made piece by piece goes on where two pieces meet.

use serde::Serialize;

use super::blend::{BLEND, Start, Track, blend};
use crate::motion::{Pose, Skeleton};

/// Where two pieces of a dance meet: a seed and what follows, or two windows of a model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Seam {
    /// First frame of the second.
    pub frame: usize,
    /// Mean distance of the joints from the frame before, on the seed's floor, not eased yet, cm.
    pub jump: f64,
}

/// Takes out the jumps at `seams` (ascending): what the second piece misses of where the first was
/// going is added as an offset that decays over 20 frames, or until the next of the frames `kept`
/// or the next seam. Returns what there was.
pub(super) fn ease(
    skeleton: &Skeleton,
    poses: &mut [Pose],
    seams: &[usize],
    kept: &[usize],
) -> Vec<Seam> {
    let within = |seam: &&usize| (1..poses.len()).contains(*seam);
    let seams: Vec<usize> = seams.iter().filter(within).copied().collect();
    let jump = |&frame: &usize| {
        let [before, after] = [frame - 1, frame].map(|it| poses[it].world_positions(skeleton));
        let distances = before.iter().zip(&after).map(|(a, b)| a.distance(*b));
        Seam {
            frame,
            jump: distances.sum::<f64>() / skeleton.len() as f64,
        }
    };
    let found: Vec<Seam> = seams.iter().map(jump).collect();
    for (index, &seam) in seams.iter().enumerate() {
        let next = seams.get(index + 1).copied().unwrap_or(poses.len());
        let key = kept.iter().find(|&&frame| frame >= seam);
        let end = key.map_or(next, |key| next.min(key + 1)).min(seam + BLEND);
        let (before, piece) = poses.split_at_mut(seam);
        let piece = &mut piece[..end - seam];
        let [pose, earlier] = [1, 2].map(|frames| before.len().checked_sub(frames));
        let (Some(pose), Some(target)) = (pose.map(|at| &before[at]), piece.last().cloned()) else {
            continue;
        };
        let start = Start {
            pose,
            facing: 0.0,
            before: earlier.map(|at| (&before[at], 0.0)),
        };
        let mut track = Track {
            facing: vec![0.0; piece.len()],
            poses: piece.to_vec(),
        };
        blend(&mut track, &start, &target, 0.0);
        piece.clone_from_slice(&track.poses);
    }
    found
}
