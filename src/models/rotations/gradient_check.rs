//! The gradient of a network's whole loss against central differences in f64.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::settings::build;
use super::{Batch, Body, RotationSettings, TrainingClip, WindowStatistics};
use crate::autograd::Parameters;
use crate::autograd::check::CheckReport;
use crate::data::choreography::{ChoreographyConfig, generate};
use crate::models::ModelError;
use crate::models::gradient_report::check_losses;
use crate::models::settings::GradientCheckOptions;
use crate::models::transition::Window;
use crate::motion::rotation_window::Interpolation;
use crate::nn::Initialiser;

/// T of the windows that are checked.
const LENGTHS: [usize; 2] = [5, 12];
/// Frames of a generated clip beyond those of a window.
const SPARE_FRAMES: usize = 40;
/// Uniform noise on every weight, so that none stands at a special value such as 0.
const NOISE: f64 = 0.1;
/// Key of the masks of stochastic depth and dropout.
const DROPOUT_KEY: u64 = 0x5eed;

/// Windows of generated dance, each from a clip of its own, with their body and statistics.
///
/// # Errors
/// Fewer than 3 frames or no windows; more frames than can be generated.
pub fn generated_batch<S: RotationSettings>(
    settings: &S,
    frames: usize,
    windows: usize,
    seed: u64,
    input: Interpolation,
) -> Result<(Batch<f64>, Body, WindowStatistics), ModelError> {
    if frames < 3 || windows == 0 {
        return Err(ModelError::Data {
            reason: "there is nothing to compute a loss of without a window of 3 frames or more"
                .into(),
        });
    }
    let clips = generate(&ChoreographyConfig {
        clips: windows,
        frames_per_clip: frames.saturating_add(SPARE_FRAMES),
        seed,
    })
    .map_err(|error| ModelError::data(&error))?;
    let rng = || ChaCha8Rng::seed_from_u64(seed);
    let clips: Vec<TrainingClip> = clips
        .into_iter()
        .map(|clip| TrainingClip::new(clip.clip, settings.contact_rule(), 0.15, rng()))
        .collect::<Result<_, _>>()?;
    let start = SPARE_FRAMES / 2;
    let root_frame = settings.root_frame();
    let windows_of = clips
        .iter()
        .map(|clip| clip.window(start, frames, settings.past(), root_frame));
    let (given, truths): (Vec<_>, Vec<_>) = windows_of.unzip();
    let cut: Vec<Window> = (0..windows).map(|clip| Window { clip, start }).collect();
    let body = Body::of(&clips[0].clip.skeleton);
    let statistics = WindowStatistics::of(
        (body.joints(), clips.len()),
        |clip| Ok(clips[clip].clone()),
        (&cut, frames),
        root_frame,
    )?;
    Ok((Batch::of(&given, &truths, input), body, statistics))
}

/// Checks a model at every length, without its random masks and with them.
///
/// # Errors
/// Settings that do not fit together; nothing to check them on.
pub(super) fn check_all<S: RotationSettings>(
    settings: &S,
    options: &GradientCheckOptions,
) -> Result<Vec<(String, CheckReport)>, ModelError> {
    let lengths = options
        .frames
        .map_or(LENGTHS.to_vec(), |frames| vec![frames]);
    let mut reports = Vec::new();
    for frames in lengths {
        for masks in [false, true] {
            let title = format!("T = {frames}, masks {}", if masks { "on" } else { "off" });
            reports.push((title, check(settings, frames, masks, options)?));
        }
    }
    Ok(reports)
}

fn check<S: RotationSettings>(
    settings: &S,
    frames: usize,
    masks: bool,
    options: &GradientCheckOptions,
) -> Result<CheckReport, ModelError> {
    let (windows, seed) = (options.windows, options.seed);
    let sample = |input| generated_batch(settings, frames, windows, seed, input);
    let (batch, body, statistics) = sample(Interpolation::Slerp)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut parameters = Parameters::<f64>::new();
    let mut init = Initialiser::new(&mut parameters, &mut rng);
    let network = build(settings, &mut init, &body, &statistics)?;
    if frames > network.longest() {
        return Err(ModelError::Data {
            reason: format!(
                "--frames {frames}: the model's longest window (schedule.lengths.max) has {}",
                network.longest()
            ),
        });
    }
    let batch = match network.input() {
        Interpolation::Slerp => batch,
        input => sample(input)?.0,
    };
    for (_, mut value) in parameters.values_mut() {
        value.mapv_inplace(|x| x + rng.random_range(-NOISE..NOISE));
    }
    let key = masks.then_some(DROPOUT_KEY);
    let report = check_losses(&mut parameters, key, options.per_parameter, |tape| {
        network.losses(tape, &batch)
    });
    report.map_err(|error| ModelError::data(&error))
}
