//! sigma of L2P: the standard deviation of each coordinate over the training windows.

use glam::DVec3;
use rayon::prelude::*;

use super::data_set::DataSet;
use super::placement::Placement;
use crate::motion::{Clip, MissingJoint};

/// Population standard deviations of the joints' world positions, `[joints]`, cm; 1 for a
/// coordinate that never changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviations(pub Vec<DVec3>);

/// Number, mean and sum of squared distances from it, of every coordinate.
struct Moments {
    count: f64,
    mean: Vec<DVec3>,
    squares: Vec<DVec3>,
}

impl Deviations {
    /// Over all frames of all training windows, each placed like those that are scored; none
    /// where no clip is long enough for a window.
    ///
    /// The clips share a skeleton. The deviations are the same to the bit on any number of threads.
    pub(super) fn of(set: &DataSet, clips: &[&Clip]) -> Result<Option<Self>, MissingJoint> {
        let moments: Vec<_> = clips.par_iter().map(|clip| of_clip(set, clip)).collect();
        let mut all: Option<Moments> = None;
        for moments in moments {
            let moments = moments?;
            match &mut all {
                Some(all) => all.add(&moments),
                None => all = Some(moments),
            }
        }
        let all = all.filter(|all| all.count > 0.0);
        Ok(all.map(|all| Self(all.deviations())))
    }
}

fn of_clip(set: &DataSet, clip: &Clip) -> Result<Moments, MissingJoint> {
    let heading = set.heading(&clip.skeleton)?;
    let world = clip.skeleton.world_positions(&clip.poses);
    let mut moments = Moments::new(clip.skeleton.len());
    for window in set.training.windows(&[clip.poses.len()]) {
        let frames = window.start..window.start + set.training.frames;
        let poses = &clip.poses[frames.clone()];
        let placement = Placement::of(&heading, &clip.skeleton, poses, set.start);
        for positions in &world[frames] {
            moments.push(positions.iter().map(|&position| placement.point(position)));
        }
    }
    Ok(moments)
}

impl Moments {
    fn new(joints: usize) -> Self {
        Self {
            count: 0.0,
            mean: vec![DVec3::ZERO; joints],
            squares: vec![DVec3::ZERO; joints],
        }
    }

    /// Welford's update by a frame.
    fn push(&mut self, positions: impl Iterator<Item = DVec3>) {
        self.count += 1.0;
        let share = 1.0 / self.count;
        let joints = self.mean.iter_mut().zip(&mut self.squares);
        for (position, (mean, squares)) in positions.zip(joints) {
            let before = position - *mean;
            *mean += before * share;
            *squares += before * (position - *mean);
        }
    }

    /// The moments of both together (Chan, Golub and LeVeque).
    fn add(&mut self, other: &Self) {
        let count = self.count + other.count;
        if count == 0.0 {
            return;
        }
        let share = other.count / count;
        for joint in 0..self.mean.len() {
            let apart = other.mean[joint] - self.mean[joint];
            self.mean[joint] += apart * share;
            self.squares[joint] += other.squares[joint] + apart * apart * (self.count * share);
        }
        self.count = count;
    }

    fn deviations(&self) -> Vec<DVec3> {
        let known = |deviation: f64| if deviation > 0.0 { deviation } else { 1.0 };
        let joints = self.squares.iter();
        joints
            .map(|squares| DVec3::from_array((*squares / self.count).to_array().map(f64::sqrt)))
            .map(|deviation| DVec3::from_array(deviation.to_array().map(known)))
            .collect()
    }
}
