//! NPSS, the normalised power spectrum similarity (Gopalakrishnan et al. 2019), of quaternions.

use std::f64::consts::TAU;

use glam::DQuat;

use crate::motion::rotation_window::{continue_from, make_continuous};

/// The sums that NPSS is made of. Its weights are shared over all windows: these add, scores do
/// not.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Npss {
    /// Sum of a g over windows and dimensions.
    weighted: f64,
    /// Sum of g.
    weight: f64,
}

impl Npss {
    /// Of one window's scored frames, `[frames][joints]` of local rotations or the world's.
    ///
    /// For each of the 4 numbers of each joint's quaternion: the Fourier transform over the frames,
    /// the square of its real part, divided by its sum over all frequencies (those above the half,
    /// which repeat the others, counted), cumulated. a is the sum over frequencies of the distance
    /// of the two curves, g the truth's power before the division. A dimension without power has a
    /// curve of 0.
    ///
    /// Quaternions have the signs that are continuous in time; the prediction starts with the one
    /// nearer to the truth.
    pub fn of(truth: &[Vec<DQuat>], predicted: &[Vec<DQuat>]) -> Self {
        let (mut truth, mut predicted) = (truth.to_vec(), predicted.to_vec());
        make_continuous(&mut truth);
        let Some(first) = truth.first() else {
            return Self::default();
        };
        continue_from(first, &mut predicted);
        let transform = Transform::new(truth.len());
        let mut sums = Self::default();
        for joint in 0..first.len() {
            let numbers =
                |frames: &[Vec<DQuat>]| frames.iter().map(|it| it[joint].to_array()).collect();
            let of_truth: Vec<[f64; 4]> = numbers(&truth);
            let of_predicted: Vec<[f64; 4]> = numbers(&predicted);
            let (of_truth, of_predicted) =
                (transform.power(&of_truth), transform.power(&of_predicted));
            for number in 0..4 {
                let [of_truth, of_predicted] =
                    [&of_truth, &of_predicted].map(|power| power.iter().map(move |it| it[number]));
                let weight: f64 = of_truth.clone().sum();
                sums.weight += weight;
                sums.weighted += weight * apart(of_truth, of_predicted);
            }
        }
        sums
    }

    /// With those of other windows.
    pub fn add(&mut self, other: Self) {
        self.weighted += other.weighted;
        self.weight += other.weight;
    }

    /// Sum of a g over sum of g; 0 where nothing has power.
    pub fn score(&self) -> f64 {
        match self.weight > 0.0 {
            true => self.weighted / self.weight,
            false => 0.0,
        }
    }
}

/// Sum of the distances of two cumulated powers, each divided by its sum.
fn apart(
    truth: impl Iterator<Item = f64> + Clone,
    predicted: impl Iterator<Item = f64> + Clone,
) -> f64 {
    let share = |sum: f64| if sum > 0.0 { 1.0 / sum } else { 0.0 };
    let shares = [share(truth.clone().sum()), share(predicted.clone().sum())];
    let curves = truth.zip(predicted).scan([0.0; 2], |sums, (a, b)| {
        *sums = [sums[0] + a * shares[0], sums[1] + b * shares[1]];
        Some((sums[0] - sums[1]).abs())
    });
    curves.sum()
}

/// The real part of the discrete Fourier transform over some frames, as sums of cosines.
struct Transform {
    /// cos(2 pi t / frames).
    cosines: Vec<f64>,
}

impl Transform {
    fn new(frames: usize) -> Self {
        let cosine = |t: usize| (TAU * t as f64 / frames as f64).cos();
        Self {
            cosines: (0..frames).map(cosine).collect(),
        }
    }

    /// The square of the real part, `[frequencies][4]`, of numbers over time, `[frames][4]`.
    fn power(&self, numbers: &[[f64; 4]]) -> Vec<[f64; 4]> {
        let frames = numbers.len();
        let mut power = vec![[0.0; 4]; frames];
        for frequency in 0..=frames / 2 {
            let mut real = [0.0; 4];
            for (time, numbers) in numbers.iter().enumerate() {
                let cosine = self.cosines[(frequency * time) % frames];
                for (real, number) in real.iter_mut().zip(numbers) {
                    *real += cosine * number;
                }
            }
            let squares = real.map(|real| real * real);
            power[frequency] = squares;
            // The numbers are real: frequencies k and -k have the same real part.
            power[(frames - frequency) % frames] = squares;
        }
        power
    }
}
