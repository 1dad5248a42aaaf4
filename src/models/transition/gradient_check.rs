//! The gradient of a model's whole loss, end to end through time, against central differences in
//! f64.

use ndarray::{Array3, Axis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use thiserror::Error;

use super::training_windows::{features_of, poses_of};
use super::{
    Batch, DanceClip, Forcing, ModelConfig, RootFrame, SingleFrame, Standardisation, Window,
};
use crate::autograd::check::CheckReport;
use crate::autograd::{AutogradError, Parameters};
use crate::data::choreography::{ChoreographyConfig, ChoreographyError, generate};
use crate::data::{DataConfig, DataError};
use crate::models::ModelError;
use crate::models::gradient_report::check_losses;
use crate::models::settings::GradientCheckOptions;
use crate::nn::Initialiser;

/// Transitions with more and with fewer frames than two times m = 5 (the two cases of eq. 10).
const TRANSITIONS: [usize; 2] = [12, 6];
/// Frames of a generated clip beyond those of a window.
const SPARE_FRAMES: usize = 120;
/// Uniform noise on every weight, so that none stands at a special value such as 0.
const NOISE: f64 = 0.1;
/// Key of the dropout masks.
const DROPOUT_KEY: u64 = 0x5eed;

/// One way to compute a model's loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GradientCase {
    /// N, frames from k1 to k2.
    pub transition: usize,
    pub forcing: Forcing,
    /// Whether dropout acts, with the same masks at every evaluation.
    pub dropout: bool,
}

/// Why a gradient could not be checked.
#[derive(Debug, Error)]
pub enum GradientCheckError {
    #[error("a gradient check needs at least one frame and one window")]
    Empty,
    #[error(transparent)]
    Choreography(#[from] ChoreographyError),
    #[error(transparent)]
    Data(#[from] DataError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Autograd(#[from] AutogradError),
}

impl GradientCase {
    /// All ways: own predictions and the truth fed, without dropout and with it.
    fn all(frames: Option<usize>) -> Vec<Self> {
        let transitions = frames.map_or(TRANSITIONS.to_vec(), |frames| vec![frames]);
        let mut cases = Vec::new();
        for transition in transitions {
            for forcing in [Forcing::FreeRunning, Forcing::Teacher] {
                for dropout in [false, true] {
                    cases.push(Self {
                        transition,
                        forcing,
                        dropout,
                    });
                }
            }
        }
        cases
    }

    fn title(&self) -> String {
        let forcing = match self.forcing {
            Forcing::Teacher => "the truth fed",
            Forcing::FreeRunning => "own predictions fed",
        };
        let dropout = if self.dropout { "on" } else { "off" };
        format!("N = {}, {forcing}, dropout {dropout}", self.transition)
    }
}

/// Checks a model in every [`GradientCase`] that it is trained in.
///
/// # Errors
/// As [`check_model`].
pub fn check_all(
    model: &ModelConfig,
    options: &GradientCheckOptions,
) -> Result<Vec<(String, CheckReport)>, GradientCheckError> {
    let cases = GradientCase::all(options.frames);
    let reports: Vec<_> = cases
        .par_iter()
        .map(|&case| Ok(check_model(model, case, options)?.map(|report| (case.title(), report))))
        .collect::<Result<_, GradientCheckError>>()?;
    Ok(reports.into_iter().flatten().collect())
}

/// Windows of generated dance, each from a clip of its own, with their poses, and the statistics of
/// those clips.
///
/// # Errors
/// No frames or no windows; more frames than can be generated.
pub fn generated_batch(
    transition: usize,
    windows: usize,
    seed: u64,
) -> Result<(Batch<f64>, Standardisation), GradientCheckError> {
    if transition == 0 || windows == 0 {
        return Err(GradientCheckError::Empty);
    }
    let clips = generate(&ChoreographyConfig {
        clips: windows,
        frames_per_clip: transition.saturating_add(SPARE_FRAMES),
        seed,
    })?;
    let clips = clips
        .into_iter()
        .map(|clip| DanceClip::new(clip.clip, None, &DataConfig::default()))
        .collect::<Result<Vec<_>, _>>()?;
    let standardisation = Standardisation::fit(clips.iter().map(|clip| clip.features.view()));
    let start = SPARE_FRAMES / 2;
    let cut: Vec<Window> = (0..windows).map(|clip| Window { clip, start }).collect();
    let shown = (&standardisation, RootFrame::World);
    let features: Array3<f64> = features_of(&clips, &cut, transition, shown);
    let single_frames: Vec<_> = features
        .axis_iter(Axis(1))
        .map(|window| SingleFrame {
            window: window
                .insert_axis(Axis(1))
                .as_standard_layout()
                .into_owned(),
            frame: transition.div_ceil(2),
        })
        .collect();
    let batch = Batch {
        poses: Some(poses_of(&clips, &cut, transition)),
        total_single_frames: single_frames.len(),
        single_frames,
        ..Batch::of(features)
    };
    Ok((batch, standardisation))
}

/// Compares the gradient of a model's total loss with central differences: for critics of their own
/// part of it, for all other weights of the rest (see [`crate::models::LossTerms::critics`]). None
/// where the model is never fed as the case says.
///
/// # Errors
/// A model that is not trained, or whose settings do not fit together; nothing to check it on.
pub fn check_model(
    model: &ModelConfig,
    case: GradientCase,
    options: &GradientCheckOptions,
) -> Result<Option<CheckReport>, GradientCheckError> {
    let (batch, standardisation) = generated_batch(case.transition, options.windows, options.seed)?;
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let mut parameters = Parameters::<f64>::new();
    let network = model.build(
        &mut Initialiser::new(&mut parameters, &mut rng),
        &standardisation,
    )?;
    if network.forcing(case.forcing) != case.forcing {
        return Ok(None);
    }
    for (_, mut value) in parameters.values_mut() {
        value.mapv_inplace(|x| x + rng.random_range(-NOISE..NOISE));
    }
    let key = case.dropout.then_some(DROPOUT_KEY);
    let report = check_losses(&mut parameters, key, options.per_parameter, |tape| {
        network.losses(tape, &batch, case.forcing)
    })?;
    Ok(Some(report))
}
