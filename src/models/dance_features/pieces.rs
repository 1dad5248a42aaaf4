//! The parts of a data set in the numbers of a model.

use ndarray::{Array2, ArrayView2};
use rand::Rng;
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;

use super::config::FeaturesConfig;
use super::features::DanceFeatures;
use crate::data::{Dataset, Recording};
use crate::models::ModelError;

/// A recording in the numbers of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// The recording's name.
    pub name: String,
    /// Standardised, `[frames, D]`.
    pub motion: Array2<f32>,
    /// Standardised, `[frames, A]`.
    pub audio: Array2<f32>,
    /// How often a number of a rotation jumps by more than pi, see
    /// [`MotionColumns::flips`](crate::motion::MotionColumns::flips).
    pub flips: usize,
    /// Whether it is the mirror image of the recording.
    pub mirrored: bool,
}

/// What a model is trained and validated on.
#[derive(Debug, Clone, PartialEq)]
pub struct DanceData {
    pub features: DanceFeatures,
    /// The training recordings in their order, then, where they are trained, their mirror images.
    pub train: Vec<Piece>,
    pub validation: Vec<Piece>,
    /// What a person should know before a training begins.
    pub warnings: Vec<String>,
}

impl Piece {
    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.motion.nrows()
    }
}

impl DanceData {
    /// The parts of a data set; numbers are fitted to the training part, with `mirror` to its mirror
    /// images, too.
    ///
    /// # Errors
    /// As [`DanceFeatures::fit`] and [`DanceFeatures::piece`].
    pub fn of(
        dataset: &Dataset,
        config: &FeaturesConfig,
        mirror: bool,
    ) -> Result<Self, ModelError> {
        let features = DanceFeatures::fit(&dataset.train, config, mirror)?;
        Self::in_numbers(features, dataset, mirror)
    }

    /// The same in numbers that are known, such as those of weights that a training starts from.
    ///
    /// # Errors
    /// As [`DanceFeatures::piece`].
    pub fn in_numbers(
        features: DanceFeatures,
        dataset: &Dataset,
        mirror: bool,
    ) -> Result<Self, ModelError> {
        let part = |recordings: &[Recording]| {
            let pieces: Vec<_> = recordings.par_iter().map(|it| features.piece(it)).collect();
            pieces.into_iter().collect::<Result<Vec<_>, _>>()
        };
        let (mut train, validation) = (part(&dataset.train)?, part(&dataset.validation)?);
        let warnings = flips(train.iter().chain(&validation)).into_iter().collect();
        if mirror {
            let images = train.iter().map(|piece| features.mirrored(piece));
            let images = images.collect::<Result<Vec<_>, _>>()?;
            train.extend(images);
        }
        Ok(Self {
            features,
            train,
            validation,
            warnings,
        })
    }
}

impl DanceData {
    /// Keeps the training pieces whose names begin with one of `clips`; all where none is named.
    ///
    /// # Errors
    /// One of them begins no name.
    pub fn keep(&mut self, clips: &[String]) -> Result<(), ModelError> {
        for clip in clips {
            if !self
                .train
                .iter()
                .any(|piece| piece.name.starts_with(&**clip))
            {
                return Err(ModelError::Data {
                    reason: format!("schedule.clips: no training clip's name begins with {clip}"),
                });
            }
        }
        let named = |piece: &Piece| clips.iter().any(|clip| piece.name.starts_with(&**clip));
        self.train.retain(|piece| clips.is_empty() || named(piece));
        Ok(())
    }
}

/// Motion with Gaussian noise of a deviation in those of its columns (`target_noise`; spec,
/// section 2).
pub fn with_noise(motion: ArrayView2<'_, f32>, deviation: f64, rng: &mut impl Rng) -> Array2<f32> {
    let mut motion = motion.to_owned();
    if deviation > 0.0 {
        motion.mapv_inplace(|x| {
            let draw: f64 = StandardNormal.sample(rng);
            x + (deviation * draw) as f32
        });
    }
    motion
}

/// A warning about rotations whose numbers jump.
fn flips<'p>(pieces: impl Iterator<Item = &'p Piece>) -> Option<String> {
    let flipping: Vec<&Piece> = pieces.filter(|piece| piece.flips > 0).collect();
    let most = flipping.iter().max_by_key(|piece| piece.flips)?;
    let all: usize = flipping.iter().map(|piece| piece.flips).sum();
    Some(format!(
        "numbers of rotations jump by more than pi {all} times in {} of the clips, most in {} ({}): \
         rotations pass half a turn there; features.centre_rotations = true may avoid it",
        flipping.len(),
        most.name,
        most.flips
    ))
}
