//! The same motion twice in a data set.

use glam::{DQuat, DVec3};

use super::dataset::DataError;
use super::source::ClipSource;
use crate::motion::Pose;

/// Roots and rotations of the same motion, written by different programs, are this close, cm and 1.
const SAME: f64 = 1e-3;

/// Warnings about clips that are the same motion: `known` are those that train or validate.
///
/// # Errors
/// One is known and the other tests: scores would be those of what is known by heart. Clips cannot
/// be read.
pub(super) fn twins<'c>(
    known: impl IntoIterator<Item = ClipSource<'c>>,
    tested: impl IntoIterator<Item = ClipSource<'c>>,
) -> Result<Vec<String>, DataError> {
    let known = known.into_iter().map(|clip| (clip, false));
    let clips = known.chain(tested.into_iter().map(|clip| (clip, true)));
    let clips = clips.map(|(clip, tests)| {
        let first = clip.poses(0..clip.frames().min(1))?.into_owned();
        Ok((clip, first, tests))
    });
    let clips: Vec<(ClipSource<'_>, Vec<Pose>, bool)> = clips.collect::<Result<_, DataError>>()?;
    let mut warnings = Vec::new();
    for (index, (clip, first, tests)) in clips.iter().enumerate() {
        for (before, first_before, before_tests) in &clips[..index] {
            if !are_close(first_before, first) || !is_same(before, clip)? {
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

fn are_close(a: &[Pose], b: &[Pose]) -> bool {
    let close = |a: &Pose, b: &Pose| {
        let roots = a.translations.first().zip(b.translations.first());
        let rotations = a.rotations.iter().zip(&b.rotations);
        roots.is_some_and(|(a, b): (&DVec3, &DVec3)| a.distance(*b) <= SAME)
            && rotations
                .clone()
                .all(|(a, b): (&DQuat, &DQuat)| a.dot(*b).abs() >= 1.0 - SAME * SAME)
    };
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| close(a, b))
}

fn is_same(a: &ClipSource<'_>, b: &ClipSource<'_>) -> Result<bool, DataError> {
    let frames = a.frames();
    Ok(frames == b.frames()
        && a.skeleton().len() == b.skeleton().len()
        && are_close(&a.poses(0..frames)?, &b.poses(0..frames)?))
}
