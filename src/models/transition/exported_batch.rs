//! A batch with a trained model's outputs, losses and gradients, for comparison with another
//! implementation.

use std::collections::BTreeMap;

use safetensors::tensor::{Dtype, TensorView};

use super::training_windows::{features_of, poses_of};
use super::{Batch, DanceClip, Forcing, RootFrame, Standardisation, TrainedModel, Window, windows};
use crate::autograd::{AutogradError, Gradients, Tape, Workspace};
use crate::models::ModelError;

/// Which batch, and what is fed.
pub struct ExportedBatch {
    /// N, frames of a transition.
    pub frames: usize,
    pub windows: usize,
    pub forcing: Forcing,
}

/// Why there is no batch.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    #[error("no training clip has the {} frames that --frames {frames} needs", frames + 1)]
    TooShort { frames: usize },
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Autograd(#[from] AutogradError),
    #[error(transparent)]
    Tensors(#[from] safetensors::SafeTensorError),
}

/// One array of the file: its shape and its numbers, f32.
type Entry = (Vec<usize>, Vec<f32>);

/// The content of a safetensors file. Dropout is off. `window [N + 1, B, 154]`, `outputs [N, B,
/// 149]` (own predictions fed), `loss.*`, `gradient.*`.
///
/// # Errors
/// No clip is long enough, or an operation fails.
pub fn export_batch(
    model: &TrainedModel,
    root_frame: RootFrame,
    clips: &[DanceClip],
    asked: &ExportedBatch,
) -> Result<Vec<u8>, ExportError> {
    let (parameters, network) = (model.parameters(), model.network());
    let batch = cut(asked, clips, model.standardisation(), root_frame)?;
    let mut workspace = Workspace::new();
    let outputs = network.predict(&mut Tape::inference(parameters, &mut workspace), &batch)?;
    let forcing = network.forcing(asked.forcing);
    let mut gradients = Gradients::zeros(parameters);
    let mut tape = Tape::recording(parameters, &mut workspace);
    let losses = network.losses(&mut tape, &batch, forcing)?;
    let mut entries: BTreeMap<String, Entry> = BTreeMap::new();
    for (name, term) in losses.terms.iter().chain([&("total", losses.total)]) {
        entries.insert(
            format!("loss.{name}"),
            (vec![1], tape.values(*term).to_vec()),
        );
    }
    tape.backward(losses.total, &mut gradients)?;
    for ((name, value), gradient) in parameters.iter().zip(gradients.iter()) {
        let entry = (value.shape().to_vec(), gradient.to_vec());
        entries.insert(format!("gradient.{name}"), entry);
    }
    for (name, array) in [("window", batch.features), ("outputs", outputs)] {
        let entry = (array.shape().to_vec(), array.into_raw_vec_and_offset().0);
        entries.insert(name.into(), entry);
    }
    let fed = f32::from(u8::from(forcing == Forcing::Teacher));
    entries.insert("ground_truth_fed".into(), (vec![1], vec![fed]));
    Ok(serialise(&entries)?)
}

/// Windows `[N + 1, B, 154]` with their poses, spread evenly over the training clips.
fn cut(
    asked: &ExportedBatch,
    clips: &[DanceClip],
    standardisation: &Standardisation,
    root_frame: RootFrame,
) -> Result<Batch<f32>, ExportError> {
    let (frames, count) = (asked.frames, asked.windows);
    let lengths: Vec<usize> = clips.iter().map(|clip| clip.frames()).collect();
    let all = windows(&lengths, frames).windows;
    if all.is_empty() {
        return Err(ExportError::TooShort { frames });
    }
    let chosen: Vec<Window> = (0..count).map(|k| all[k * all.len() / count]).collect();
    let shown = (standardisation, root_frame);
    Ok(Batch {
        poses: Some(poses_of(clips, &chosen, frames)),
        ..Batch::of(features_of(clips, &chosen, frames, shown))
    })
}

fn serialise(entries: &BTreeMap<String, Entry>) -> Result<Vec<u8>, safetensors::SafeTensorError> {
    let bytes: Vec<Vec<u8>> = entries
        .values()
        .map(|(_, numbers)| numbers.iter().flat_map(|x| x.to_le_bytes()).collect())
        .collect();
    let mut views = Vec::new();
    for ((name, (shape, _)), bytes) in entries.iter().zip(&bytes) {
        let view = TensorView::new(Dtype::F32, shape.clone(), bytes)?;
        views.push((name.as_str(), view));
    }
    safetensors::serialize(views, None)
}
