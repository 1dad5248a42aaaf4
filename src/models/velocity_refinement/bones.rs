//! The lengths of a body's bones.

use super::Body;
use crate::motion::{DANCE_PARENTS, JOINTS};

/// The length of the bone that leads to each joint but the root, cm.
pub type Lengths = [f64; JOINTS - 1];

/// From its parent to a joint, cm; joints but the root are counted from 0.
fn bone(body: &Body, joint: usize) -> [f64; 3] {
    let parent = place(body, DANCE_PARENTS[joint + 1]);
    std::array::from_fn(|axis| body[3 * joint + axis] - parent[axis])
}

/// A joint's place, cm from the root.
fn place(body: &Body, joint: Option<usize>) -> [f64; 3] {
    match joint {
        None | Some(0) => [0.0; 3],
        Some(joint) => std::array::from_fn(|axis| body[3 * (joint - 1) + axis]),
    }
}

fn length(bone: [f64; 3]) -> f64 {
    bone.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The lengths that bones are to have in every frame, k1 first: the mean of those they have and of the dancer's.
pub fn lengths_wanted(predicted: &[Body]) -> Vec<Lengths> {
    let has = |body: &Body| -> Lengths { std::array::from_fn(|joint| length(bone(body, joint))) };
    let steps = predicted.len() - 1;
    let [first, last] = [0, steps].map(|t| has(&predicted[t]));
    let bodies = predicted.iter().enumerate();
    bodies
        .map(|(t, body)| {
            let share = t as f64 / steps as f64;
            let has = has(body);
            std::array::from_fn(|joint| {
                let of_dancer = first[joint] + share * (last[joint] - first[joint]);
                (has[joint] + of_dancer) / 2.0
            })
        })
        .collect()
}

/// The body with its bones in their directions, but of these lengths.
pub fn with_lengths(body: &Body, lengths: &Lengths) -> Body {
    let mut changed = *body;
    for (joint, &wanted) in lengths.iter().enumerate() {
        let bone = bone(body, joint);
        let parent = place(&changed, DANCE_PARENTS[joint + 1]);
        // 0 / 0 is 0 here: a bone without length has no direction.
        let times = wanted / length(bone).max(f64::MIN_POSITIVE);
        for axis in 0..3 {
            changed[3 * joint + axis] = parent[axis] + times * bone[axis];
        }
    }
    changed
}
