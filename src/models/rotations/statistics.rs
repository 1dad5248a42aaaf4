//! Ranges and deviations of the training windows, in the frame of reference of the network.

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::body::array;
use super::{Body, TrainingClip};
use crate::models::transition::{RootFrame, Window};
use crate::models::weights::{SavedWeights, WeightsError};
use crate::models::{ModelError, Statistics};

const NAMES: [&str; 3] = [
    "windows.root_deviation",
    "windows.position_deviation",
    "windows.ranges",
];

/// What is measured of all training windows.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowStatistics {
    /// Standard deviation of the root's displacement from R_1, each axis, `[3]`, cm.
    pub root_deviation: [f64; 3],
    /// sigma: standard deviation of every coordinate of the joints' world positions, the mean of
    /// the root's x and z over the window subtracted, `[3 J]`, cm.
    pub position_deviation: Vec<f64>,
    /// Largest minus smallest coordinate of P, of the root's displacement from R_1, cm.
    pub ranges: [f64; 2],
}

/// Sums over frames.
#[derive(Debug, Clone)]
struct Sums {
    count: f64,
    /// Of displacement and of positions: sums and sums of squares.
    sums: Vec<f64>,
    squares: Vec<f64>,
    /// Smallest and largest of P, and of the displacement.
    bounds: [[f64; 2]; 2],
}

impl WindowStatistics {
    /// Of windows of `frames` frames of so many clips of a body with so many joints; `clip` gives
    /// one of them.
    ///
    /// # Errors
    /// Those of `clip`.
    pub fn of(
        (joints, clips): (usize, usize),
        clip: impl Fn(usize) -> Result<TrainingClip, ModelError> + Sync,
        (windows, frames): (&[Window], usize),
        root_frame: RootFrame,
    ) -> Result<Self, ModelError> {
        let of_clip = |index: usize| {
            let clip = clip(index)?;
            let mut sums = Sums::zeros(3 + 3 * joints);
            let world = clip.clip.skeleton.world_positions(&clip.clip.poses);
            let own = windows.iter().filter(|window| window.clip == index);
            own.for_each(|it| {
                let turn = match root_frame {
                    RootFrame::KeyframeFacing => {
                        DQuat::from_rotation_y(-clip.facing.angle(&world[it.start]))
                    }
                    _ => DQuat::IDENTITY,
                };
                sums.add(&world[it.start..it.start + frames], turn);
            });
            Ok(sums)
        };
        // Clip by clip and then in order: the same sums on any number of threads.
        let all: Vec<Result<Sums, ModelError>> = (0..clips).into_par_iter().map(of_clip).collect();
        let mut sums = Sums::zeros(3 + 3 * joints);
        for other in all {
            sums.join(&other?);
        }
        let deviation = |k: usize| {
            let mean = sums.sums[k] / sums.count.max(1.0);
            let variance = sums.squares[k] / sums.count.max(1.0) - mean * mean;
            // A joint that never moves is not divided by 0.
            variance.max(0.0).sqrt().max(1e-3)
        };
        Ok(Self {
            root_deviation: [0, 1, 2].map(deviation),
            position_deviation: (3..3 + 3 * joints).map(deviation).collect(),
            ranges: sums.bounds.map(|[least, most]| (most - least).max(1e-3)),
        })
    }

    pub(super) fn statistics(&self, statistics: Statistics) -> Statistics {
        let [root, positions, ranges] = NAMES;
        statistics
            .with(root, array(self.root_deviation.to_vec()))
            .with(positions, array(self.position_deviation.clone()))
            .with(ranges, array(self.ranges.to_vec()))
    }

    /// # Errors
    /// They are not there.
    pub(super) fn saved(saved: &SavedWeights, body: &Body) -> Result<Self, WeightsError> {
        let [root, positions, ranges] = NAMES;
        let root = saved.statistic(root, &[3])?;
        let positions = saved.statistic(positions, &[3 * body.joints()])?;
        let ranges = saved.statistic(ranges, &[2])?;
        Ok(Self {
            root_deviation: [root[0], root[1], root[2]],
            position_deviation: positions.into_iter().collect(),
            ranges: [ranges[0], ranges[1]],
        })
    }

    /// Made-up ones, all 1.
    pub(super) fn ones(body: &Body) -> Self {
        Self {
            root_deviation: [1.0; 3],
            position_deviation: vec![1.0; 3 * body.joints()],
            ranges: [1.0; 2],
        }
    }
}

impl Sums {
    fn zeros(numbers: usize) -> Self {
        Self {
            count: 0.0,
            sums: vec![0.0; numbers],
            squares: vec![0.0; numbers],
            bounds: [[f64::INFINITY, f64::NEG_INFINITY]; 2],
        }
    }

    /// World positions of a window, `[T][J]`.
    fn add(&mut self, window: &[Vec<DVec3>], turn: DQuat) {
        let mean: DVec3 = window.iter().map(|joints| joints[0]).sum::<DVec3>();
        let mean = mean / window.len() as f64;
        let centre = DVec3::new(mean.x, 0.0, mean.z);
        let start = window[0][0];
        for joints in window {
            self.count += 1.0;
            let root = turn * (joints[0] - start);
            bound(&mut self.bounds[1], root);
            let relative = joints.iter().map(|&joint| turn * (joint - joints[0]));
            relative.for_each(|x| bound(&mut self.bounds[0], x));
            let placed = joints.iter().map(|&joint| turn * (joint - centre));
            let numbers = [root].into_iter().chain(placed).flat_map(|x| x.to_array());
            for ((sum, square), x) in self.sums.iter_mut().zip(&mut self.squares).zip(numbers) {
                *sum += x;
                *square += x * x;
            }
        }
    }

    fn join(&mut self, other: &Self) {
        self.count += other.count;
        let pairs = |a: &mut Vec<f64>, b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        pairs(&mut self.sums, &other.sums);
        pairs(&mut self.squares, &other.squares);
        for (own, other) in self.bounds.iter_mut().zip(other.bounds) {
            *own = [own[0].min(other[0]), own[1].max(other[1])];
        }
    }
}

fn bound(bounds: &mut [f64; 2], x: DVec3) {
    *bounds = [
        bounds[0].min(x.min_element()),
        bounds[1].max(x.max_element()),
    ];
}
