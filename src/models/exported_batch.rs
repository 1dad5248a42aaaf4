//! A batch with a trained model's outputs, losses and gradients, as arrays by name, for comparison
//! with another implementation.

use std::collections::BTreeMap;

use safetensors::tensor::{Dtype, SafeTensorError, TensorView};

use super::{LossTerms, ModelError};
use crate::autograd::{AutogradError, Gradients, Parameters, Real, Tape, Workspace};
use crate::data::Window;

/// Which batch, and how it is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExportOptions {
    /// Frames of a transition; for a model of rotations of a window, its keyframes among them.
    /// None: [`FRAMES`], or the length of a model that has no such choice.
    pub frames: Option<usize>,
    pub windows: usize,
    /// Feed the true frames to a model that is fed its own.
    pub ground_truth: bool,
    /// Compute in f64.
    pub double: bool,
}

/// Frames of a transition or window where none are asked for.
pub const FRAMES: usize = 30;

impl ExportOptions {
    /// Refuses `ground_truth` of a model that is not fed its own predictions.
    ///
    /// # Errors
    /// It is asked for.
    pub fn check_not_fed(&self) -> Result<(), ModelError> {
        match self.ground_truth {
            false => Ok(()),
            true => Err(ModelError::Data {
                reason: "--ground-truth: the model is never fed the true frames in place of its \
                         own; leave it out"
                    .into(),
            }),
        }
    }

    /// Refuses another number of frames than the one that a model has, the value of `key`.
    ///
    /// # Errors
    /// Another is asked for.
    pub fn check_frames(&self, own: usize, key: &str) -> Result<(), ModelError> {
        match self.frames.filter(|frames| *frames != own) {
            None => Ok(()),
            Some(frames) => Err(ModelError::Data {
                reason: format!(
                    "--frames {frames}: the model has {own} ({key}) and no other number; leave it \
                     out"
                ),
            }),
        }
    }
}

/// Arrays by name.
#[derive(Debug, Clone, Default)]
pub struct ExportedBatch {
    arrays: BTreeMap<String, Exported>,
}

/// One array of the file.
#[derive(Debug, Clone)]
struct Exported {
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl ExportedBatch {
    /// Adds an array in the type that it has.
    pub fn add<T: Real>(&mut self, name: impl Into<String>, shape: &[usize], values: &[T]) {
        let numbers = values.iter().map(|&x| Real::to_f64(x));
        let (dtype, bytes) = match size_of::<T>() {
            8 => (Dtype::F64, numbers.flat_map(f64::to_le_bytes).collect()),
            _ => {
                let single = numbers.map(|x| x as f32);
                (Dtype::F32, single.flat_map(f32::to_le_bytes).collect())
            }
        };
        let array = Exported {
            dtype,
            shape: shape.to_vec(),
            bytes,
        };
        self.arrays.insert(name.into(), array);
    }

    /// Adds `loss.*`, every term and `total`, and `gradient.*`, that of `total`, under each
    /// parameter's name.
    ///
    /// # Errors
    /// What `losses` returns; a loss that is not finite.
    pub fn add_losses<T: Real>(
        &mut self,
        parameters: &Parameters<T>,
        workspace: &mut Workspace<T>,
        losses: impl FnOnce(&mut Tape<'_, T>) -> Result<LossTerms, AutogradError>,
    ) -> Result<(), AutogradError> {
        let mut gradients = Gradients::zeros(parameters);
        let mut tape = Tape::recording(parameters, workspace);
        let losses = losses(&mut tape)?;
        for (name, term) in losses.terms.iter().chain([&("total", losses.total)]) {
            self.add(format!("loss.{name}"), &[1], tape.values(*term));
        }
        tape.backward(losses.total, &mut gradients)?;
        for ((name, value), gradient) in parameters.iter().zip(gradients.iter()) {
            self.add(format!("gradient.{name}"), value.shape(), gradient);
        }
        Ok(())
    }

    /// The content of a safetensors file.
    ///
    /// # Errors
    /// Numbers that do not fill their shape.
    pub fn to_safetensors(&self) -> Result<Vec<u8>, SafeTensorError> {
        let views = self.arrays.iter().map(|(name, array)| {
            let view = TensorView::new(array.dtype, array.shape.clone(), &array.bytes)?;
            Ok((name.as_str(), view))
        });
        let views = views.collect::<Result<Vec<_>, SafeTensorError>>()?;
        safetensors::serialize(views, None)
    }
}

/// So many of the windows, spread evenly; `all` have the `needed` frames that `frames` of the model
/// take.
///
/// # Errors
/// There are none.
pub fn spread(
    all: &[Window],
    count: usize,
    frames: usize,
    needed: usize,
) -> Result<Vec<Window>, ModelError> {
    if all.is_empty() {
        return Err(ModelError::Data {
            reason: format!(
                "no training clip has the {needed} frames that --frames {frames} needs"
            ),
        });
    }
    Ok((0..count).map(|k| all[k * all.len() / count]).collect())
}
