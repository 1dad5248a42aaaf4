//! The columns of music (spec, section 3): what a request carries, and what a model makes of it.

use nalgebra::{DMatrix, SymmetricEigen};
use ndarray::{Array1, Array2, ArrayView2, Axis, concatenate, s};

use super::config::Audio;
use super::scale::rounded;
use crate::data::Recording;
use crate::models::weights::{SavedWeights, WeightsError};
use crate::models::{Generator, ModelError, Statistics};
use crate::music::FeatureSet;
use crate::music::features::{accents, beat_curve};
use crate::music::twentieths::FLUX_BANDS;

/// Principal components of the flux that are kept.
const COMPONENTS: usize = 2;
/// Steps after which no eigenvalues are expected any more.
const MOST_STEPS: usize = 10_000;
/// Frame times that differ by less are the same, as a share.
const SAME_TIME: f64 = 1e-3;

const MAGNITUDES: &str = "audio.magnitudes";
const FLUX_MEAN: &str = "audio.flux_mean";
const FLUX_COMPONENTS: &str = "audio.flux_components";

/// How columns of music `[frames, A]` are made of what is heard `[frames, numbers]`.
#[derive(Debug, Clone, PartialEq)]
pub struct AudioColumns {
    audio: Audio,
    /// Of what is heard.
    numbers: usize,
    /// Those of them that are raw magnitudes.
    magnitudes: Vec<usize>,
    flux: FluxComponents,
}

/// The first two principal components of 8-band flux; of other music than `transflower85` both are
/// empty.
#[derive(Debug, Clone, Default, PartialEq)]
struct FluxComponents {
    /// `[8]`
    mean: Array1<f64>,
    /// Loadings, `[8, 2]`.
    loadings: Array2<f64>,
}

impl AudioColumns {
    /// Fitted to training recordings; `heard` is what [`heard`] gives of each.
    ///
    /// # Errors
    /// There is no recording, or one's music has other numbers than the first's.
    pub fn fit(
        audio: Audio,
        recordings: &[Recording],
        heard: &[Array2<f64>],
    ) -> Result<Self, ModelError> {
        let first = heard.first().ok_or_else(|| ModelError::Data {
            reason: "there is no music to train on".into(),
        })?;
        let numbers = first.ncols();
        let given = recordings.first().and_then(|it| it.given_music.as_ref());
        let magnitudes = match (audio, given) {
            (Audio::AsGiven, Some(given)) => given.magnitudes.clone(),
            _ => Vec::new(),
        };
        for (recording, heard) in recordings.iter().zip(heard) {
            if heard.ncols() != numbers {
                return Err(ModelError::Shape {
                    what: format!("the music of {}", recording.name()),
                    expected: vec![heard.nrows(), numbers],
                    found: heard.shape().to_vec(),
                });
            }
        }
        let flux = match audio {
            Audio::Transflower85 => FluxComponents::of(heard),
            _ => FluxComponents::default(),
        };
        Ok(Self {
            audio,
            numbers,
            magnitudes,
            flux,
        })
    }

    pub fn audio(&self) -> Audio {
        self.audio
    }

    /// Numbers of what is heard.
    pub fn numbers(&self) -> usize {
        self.numbers
    }

    /// A.
    pub fn width(&self) -> usize {
        match self.audio {
            Audio::Transflower85 => self.numbers - FLUX_BANDS + COMPONENTS,
            _ => self.numbers,
        }
    }

    /// The columns of what is heard, not standardised, `[frames, A]`.
    ///
    /// # Errors
    /// It has other numbers than that of the training part.
    pub fn columns(&self, heard: ArrayView2<f64>) -> Result<Array2<f64>, ModelError> {
        if heard.ncols() != self.numbers {
            return Err(ModelError::Shape {
                what: "the music".into(),
                expected: vec![heard.nrows(), self.numbers],
                found: heard.shape().to_vec(),
            });
        }
        if self.audio == Audio::Transflower85 {
            let (own, flux) = heard.split_at(Axis(1), self.numbers - FLUX_BANDS);
            let flux = (&flux - &self.flux.mean).dot(&self.flux.loadings);
            let joined = concatenate(Axis(1), &[own, flux.view()]);
            return joined.map_err(|error| ModelError::data(&error));
        }
        let mut columns = heard.to_owned();
        for &column in &self.magnitudes {
            columns
                .column_mut(column)
                .mapv_inplace(|x| x.max(0.0).ln_1p());
        }
        Ok(columns)
    }

    pub(super) fn statistics(&self, statistics: Statistics) -> Statistics {
        let is_magnitude = |column| f64::from(u8::from(self.magnitudes.contains(&column)));
        let magnitudes: Array1<f64> = (0..self.numbers).map(is_magnitude).collect();
        let statistics = statistics.with(MAGNITUDES, magnitudes.into_dyn());
        match self.audio {
            Audio::Transflower85 => statistics
                .with(FLUX_MEAN, self.flux.mean.clone().into_dyn())
                .with(FLUX_COMPONENTS, self.flux.loadings.clone().into_dyn()),
            _ => statistics,
        }
    }

    /// # Errors
    /// They are not there, or are none.
    pub(super) fn saved(saved: &SavedWeights, audio: Audio) -> Result<Self, WeightsError> {
        let magnitudes = saved.statistic_list(MAGNITUDES)?;
        let numbers = magnitudes.len();
        let columns = magnitudes.iter().enumerate();
        let magnitudes = columns
            .filter(|(_, x)| **x != 0.0)
            .map(|(column, _)| column);
        let is_right = match audio.feature_set() {
            Some(set) => numbers == set.numbers(),
            None => numbers > 0,
        };
        if !is_right {
            let path = saved.path.display();
            return Err(WeightsError::Refused(format!(
                "{path}: {MAGNITUDES} has {numbers} numbers, which the music of its config has not"
            )));
        }
        let flux = match audio {
            Audio::Transflower85 => {
                let loadings = saved.statistic(FLUX_COMPONENTS, &[FLUX_BANDS, COMPONENTS])?;
                let shape = (FLUX_BANDS, COMPONENTS);
                FluxComponents {
                    mean: saved
                        .statistic(FLUX_MEAN, &[FLUX_BANDS])?
                        .into_iter()
                        .collect(),
                    loadings: Array2::from_shape_fn(shape, |(row, column)| loadings[[row, column]]),
                }
            }
            _ => FluxComponents::default(),
        };
        Ok(Self {
            audio,
            numbers,
            magnitudes: magnitudes.collect(),
            flux,
        })
    }
}

impl FluxComponents {
    /// Of the last 8 numbers of what is heard; largest loading positive.
    fn of(heard: &[Array2<f64>]) -> Self {
        let flux =
            |heard: &Array2<f64>| heard.slice(s![.., heard.ncols() - FLUX_BANDS..]).to_owned();
        let songs: Vec<Array2<f64>> = heard.iter().map(flux).collect();
        let count = songs.iter().map(Array2::nrows).sum::<usize>().max(1) as f64;
        let mut mean = Array1::<f64>::zeros(FLUX_BANDS);
        songs
            .iter()
            .for_each(|song| mean += &song.sum_axis(Axis(0)));
        mean = rounded(mean / count);
        let mut covariance = Array2::<f64>::zeros((FLUX_BANDS, FLUX_BANDS));
        for song in &songs {
            let centred = song - &mean;
            covariance += &centred.t().dot(&centred);
        }
        covariance /= count;
        let matrix = DMatrix::from_fn(FLUX_BANDS, FLUX_BANDS, |row, column| {
            covariance[[row, column]]
        });
        let mut loadings = Array2::zeros((FLUX_BANDS, COMPONENTS));
        // Of numbers that are not finite there are none.
        if let Some(found) = SymmetricEigen::try_new(matrix, f64::EPSILON, MOST_STEPS) {
            let mut order: Vec<usize> = (0..FLUX_BANDS).collect();
            order.sort_by(|&a, &b| found.eigenvalues[b].total_cmp(&found.eigenvalues[a]));
            for (mut column, at) in loadings.columns_mut().into_iter().zip(order) {
                let vector = found.eigenvectors.column(at);
                let largest =
                    vector.iter().copied().fold(
                        0.0,
                        |most: f64, x| {
                            if x.abs() > most.abs() { x } else { most }
                        },
                    );
                let sign = if largest < 0.0 { -1.0 } else { 1.0 };
                column
                    .iter_mut()
                    .zip(vector.iter())
                    .for_each(|(into, x)| *into = sign * x);
            }
        }
        Self {
            mean,
            loadings: rounded(loadings),
        }
    }
}

/// What is heard of a recording for some columns, frame by frame, `[frames, numbers]`: of its sound,
/// or what its data set gives. A last frame that the sound lacks repeats the one before.
///
/// # Errors
/// It has no such music, or not at the sound's 20 frames a second.
pub fn heard(recording: &Recording, audio: Audio) -> Result<Array2<f64>, ModelError> {
    match (audio.feature_set(), &recording.given_music) {
        (None, Some(given)) => Ok(given.columns.mapv(f64::from)),
        (None, None) => Err(ModelError::Data {
            reason: format!(
                "{} comes without numbers of its music; features.audio = \"as_given\" is for data \
                 that has them, such as split = \"motorica\"",
                recording.name()
            ),
        }),
        (Some(set), _) => of_set(recording, set),
    }
}

/// What a model hears of a recording, `[frames, numbers]`: the music of a request about it.
///
/// # Errors
/// As [`heard`].
pub fn heard_by(model: &dyn Generator, recording: &Recording) -> Result<Array2<f64>, ModelError> {
    match model.reads_given_music() {
        true => heard(recording, Audio::AsGiven),
        false => of_set(recording, model.music_features()),
    }
}

fn of_set(recording: &Recording, set: FeatureSet) -> Result<Array2<f64>, ModelError> {
    let frames = recording.frames();
    let frame_time = recording.clip.frame_time;
    let wrong = |reason: String| ModelError::Data {
        reason: format!("{}: {reason}", recording.name()),
    };
    if let (FeatureSet::OnsetBeats, None, Some(given)) =
        (set, &recording.music, &recording.given_music)
    {
        let onset: Vec<f32> = given.columns.column(given.onset).to_vec();
        let (onset, beats) = (
            accents(&onset),
            beat_curve(&given.beats, frames, 1.0 / frame_time),
        );
        let rows = onset.iter().zip(&beats).take(frames);
        let numbers = rows.flat_map(|(&onset, &beat)| [f64::from(onset), f64::from(beat)]);
        return Array2::from_shape_vec((frames, 2), numbers.collect())
            .map_err(|error| wrong(error.to_string()));
    }
    let rate = set.frame_rate();
    if (frame_time * rate - 1.0).abs() > SAME_TIME {
        return Err(wrong(format!(
            "{set} is heard {rate} times a second, the motion has {:.3} frames; set data.fps = {rate}",
            1.0 / frame_time
        )));
    }
    let music = recording.music.as_ref().ok_or_else(|| {
        wrong(
            "it comes without music; set data.music = true and give a sound file of its name"
                .into(),
        )
    })?;
    let heard = music.features(set);
    let last = heard
        .nrows()
        .checked_sub(1)
        .ok_or_else(|| wrong("its music has no frame".into()))?;
    let shape = (frames, heard.ncols());
    Ok(Array2::from_shape_fn(shape, |(frame, number)| {
        f64::from(heard[[frame.min(last), number]])
    }))
}
