//! Weights that answer: tapes without gradients, on buffers that are kept from one to the next.

use std::sync::Mutex;

use super::ModelError;
use crate::autograd::{AutogradError, Parameters, Tape, Workspace};

/// The weights of a trained model, in f32.
pub struct Inference {
    model: String,
    parameters: Parameters<f32>,
    workspaces: Mutex<Vec<Workspace<f32>>>,
}

impl Inference {
    /// Of a model that errors call by its name.
    pub fn new(model: &str, parameters: Parameters<f32>) -> Self {
        Self {
            model: model.into(),
            parameters,
            workspaces: Mutex::new(Vec::new()),
        }
    }

    pub fn model(&self) -> &str {
        &self.model
    }

    /// What `compute` makes on a tape; any number of threads may ask at a time.
    ///
    /// # Errors
    /// An operation refuses its operands.
    pub fn run<R>(
        &self,
        compute: impl FnOnce(&mut Tape<'_, f32>) -> Result<R, AutogradError>,
    ) -> Result<R, ModelError> {
        let kept = self.workspaces.lock().map(|mut free| free.pop());
        let mut workspace = kept.unwrap_or_default().unwrap_or_default();
        let result = compute(&mut Tape::inference(&self.parameters, &mut workspace));
        if let Ok(mut free) = self.workspaces.lock() {
            free.push(workspace);
        }
        result.map_err(|error| ModelError::Model {
            model: self.model.clone(),
            reason: error.to_string(),
        })
    }
}
