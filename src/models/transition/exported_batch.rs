//! The windows of a batch with what a trained network makes of them.

use super::training_windows::{features_of, poses_of};
use super::{Batch, DanceClip, Forcing, RootFrame, TrainedModel, windows};
use crate::autograd::{Tape, Workspace};
use crate::models::ModelError;
use crate::models::exported_batch::{ExportOptions, ExportedBatch, FRAMES, spread};

/// Dropout is off. `window [N + 1, B, 154]`, `outputs [N, B, 149]` (own predictions fed), `loss.*`,
/// `gradient.*`, `ground_truth_fed [1]`.
///
/// # Errors
/// No clip is long enough; an operation fails; f64 is asked for, or what the model is never fed.
pub(super) fn export(
    model: &TrainedModel,
    root_frame: RootFrame,
    clips: &[DanceClip],
    options: &ExportOptions,
) -> Result<ExportedBatch, ModelError> {
    if options.double {
        return Err(ModelError::Data {
            reason: "a model of transitions exports batches in f32 only".into(),
        });
    }
    let (parameters, network) = (model.parameters(), model.network());
    let forcing = network.forcing(match options.ground_truth {
        true => Forcing::Teacher,
        false => Forcing::FreeRunning,
    });
    if forcing != Forcing::Teacher {
        options.check_not_fed()?;
    }
    let batch = cut(options, clips, model, root_frame)?;
    let mut workspace = Workspace::new();
    let failed = |error| ModelError::data(&error);
    let outputs = network.predict(&mut Tape::inference(parameters, &mut workspace), &batch);
    let outputs = outputs.map_err(failed)?;
    let mut exported = ExportedBatch::default();
    let losses = exported.add_losses(parameters, &mut workspace, |tape| {
        network.losses(tape, &batch, forcing)
    });
    losses.map_err(failed)?;
    for (name, array) in [("window", batch.features), ("outputs", outputs)] {
        let shape = array.shape().to_vec();
        exported.add(name, &shape, &array.into_raw_vec_and_offset().0);
    }
    let fed = f32::from(u8::from(forcing == Forcing::Teacher));
    exported.add("ground_truth_fed", &[1], &[fed]);
    Ok(exported)
}

/// Windows `[N + 1, B, 154]` with their poses, spread evenly over the training clips.
fn cut(
    options: &ExportOptions,
    clips: &[DanceClip],
    model: &TrainedModel,
    root_frame: RootFrame,
) -> Result<Batch<f32>, ModelError> {
    let frames = options.frames.unwrap_or(FRAMES);
    let lengths: Vec<usize> = clips.iter().map(|clip| clip.frames()).collect();
    let all = windows(&lengths, frames).windows;
    let chosen = spread(&all, options.windows, frames, frames + 1)?;
    let shown = (model.standardisation(), root_frame);
    Ok(Batch {
        poses: Some(poses_of(clips, &chosen, frames)),
        ..Batch::of(features_of(clips, &chosen, frames, shown))
    })
}
