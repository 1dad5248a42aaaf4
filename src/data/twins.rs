//! The same motion twice in a data set.

use glam::{DQuat, DVec3};

use super::dataset::{DataError, Dataset, Recording};
use crate::motion::{Clip, Pose};

/// Roots and rotations of the same motion, written by different programs, are this close, cm and 1.
const SAME: f64 = 1e-3;

/// Warnings about clips that are the same motion.
///
/// # Errors
/// One trains or validates and the other tests: scores would be those of what is known by heart.
pub(super) fn twins(dataset: &Dataset) -> Result<Vec<String>, DataError> {
    let known = || dataset.train.iter().chain(&dataset.validation);
    let mut clips: Vec<(&Recording, bool)> = known().map(|clip| (clip, false)).collect();
    clips.extend(dataset.test.iter().map(|clip| (clip, true)));
    let mut warnings = Vec::new();
    for (index, (clip, tests)) in clips.iter().enumerate() {
        for (before, before_tests) in &clips[..index] {
            if !is_same(&before.clip, &clip.clip) {
                continue;
            }
            let [first, second] = [before, clip].map(|clip| clip.name().to_string());
            if tests != before_tests {
                return Err(DataError::SameMotion {
                    train: first,
                    test: second,
                });
            }
            warnings.push(format!("{first} and {second} are the same motion"));
        }
    }
    Ok(warnings)
}

fn is_same(a: &Clip, b: &Clip) -> bool {
    let close = |a: &Pose, b: &Pose| {
        let roots = a.translations.first().zip(b.translations.first());
        let rotations = a.rotations.iter().zip(&b.rotations);
        roots.is_some_and(|(a, b): (&DVec3, &DVec3)| a.distance(*b) <= SAME)
            && rotations
                .clone()
                .all(|(a, b): (&DQuat, &DQuat)| a.dot(*b).abs() >= 1.0 - SAME * SAME)
    };
    let frames = a.poses.iter().zip(&b.poses);
    a.poses.len() == b.poses.len()
        && a.skeleton.len() == b.skeleton.len()
        && frames.clone().all(|(a, b)| close(a, b))
}
