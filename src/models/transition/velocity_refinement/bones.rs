//! The lengths of a body's bones.

use super::system::System;
use super::{ACCELERATION_WEIGHT, Body, rough};
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

/// The lengths that bones are to have in every frame, k1 first: the mean of those they have, made
/// smooth, and of the dancer's.
pub fn lengths_wanted(predicted: &[Body]) -> Vec<Lengths> {
    let has = |body: &Body| -> Lengths { std::array::from_fn(|joint| length(bone(body, joint))) };
    let mut lengths: Vec<Lengths> = predicted.iter().map(has).collect();
    smooth(&mut lengths);
    let steps = predicted.len() - 1;
    let [first, last] = [lengths[0], lengths[steps]];
    for (t, lengths) in lengths.iter_mut().enumerate() {
        let share = t as f64 / steps as f64;
        for (joint, length) in lengths.iter_mut().enumerate() {
            let of_dancer = first[joint] + share * (last[joint] - first[joint]);
            *length = (*length + of_dancer) / 2.0;
        }
    }
    lengths
}

/// Replaces the lengths l of the frames between the keyframes by the x of least `sum_t |x_t -
/// l_t|^2 + 100 |x_(t+1) - 2 x_t + x_(t-1)|^2`.
fn smooth(lengths: &mut [Lengths]) {
    let steps = lengths.len() - 1;
    let rough = rough(lengths);
    let mut change: Vec<Lengths> = rough[1..steps]
        .iter()
        .map(|rough| rough.map(|rough| -ACCELERATION_WEIGHT * rough))
        .collect();
    System::new(steps, 0.0, ACCELERATION_WEIGHT).solve(&mut change);
    for (lengths, change) in lengths[1..].iter_mut().zip(&change) {
        for (length, change) in lengths.iter_mut().zip(change) {
            *length += change;
        }
    }
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
