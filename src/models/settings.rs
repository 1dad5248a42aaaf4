//! What the commands ask of a model as a config describes it: to be checked, and to be built.

use std::any::Any;
use std::fmt;

use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use thiserror::Error;
use toml::Table;

use super::exported_batch::{ExportOptions, ExportedBatch};
use super::weights::{SavedWeights, WeightsError};
use super::{Generator, ModelError, Streams, Task};
use crate::autograd::check::CheckReport;
use crate::data::{DataConfig, Dataset};
use crate::nn::Initialiser;

/// What draws a model's initial weights.
pub type InitialRng = ChaCha8Rng;

/// A model as a config describes it.
pub trait ModelSettings: Tables + Any + Send + Sync + fmt::Debug {
    fn kind(&self) -> &str;

    /// Checks values against each other and against how the data is read.
    ///
    /// # Errors
    /// The first value out of its range.
    fn check(&self, _data: &DataConfig) -> Result<(), ValueError> {
        Ok(())
    }

    /// How much of its schedule is trained, in its own words, for the caption of a table.
    fn budget_note(&self) -> String {
        String::new()
    }

    /// The groups of learning rates that its parameters fall into, see [`Task::rate_group`].
    fn rate_groups(&self) -> &'static [&'static str] {
        &[]
    }

    /// Keys, such as `model.refinement`, that act after the network: weights do not depend on them.
    fn keys_after_the_network(&self) -> &'static [&'static str] {
        &[]
    }

    /// The steps of its training, its weights added through `init`; none of a model that needs no
    /// training.
    ///
    /// # Errors
    /// A model that is not trained, data that it cannot be trained on, more weights than `init`
    /// allows.
    fn task<'d>(
        &self,
        _setting: &TaskSetting<'d>,
        _init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Box<dyn Task<f32> + 'd>, ModelError> {
        Err(without_weights(self.kind()))
    }

    /// Whether its task reads windows of clips that stay in a prepared set, see
    /// [`Dataset::load_to_train`]; the others' clips are in memory.
    fn reads_stored_clips(&self) -> bool {
        false
    }

    /// Steps to time: each `batch` windows of `frames` frames, made up; of as many as it has itself
    /// where none are given.
    ///
    /// # Errors
    /// As [`ModelSettings::task`]; a model that has none.
    fn made_up_task(
        &self,
        _frames: Option<usize>,
        _batch: usize,
        _streams: Streams,
        _init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Box<dyn Task<f32>>, ModelError> {
        Err(lacks(self.kind(), "made-up step to time"))
    }

    /// The model with saved weights.
    ///
    /// # Errors
    /// The weights are those of another model; a model that has none.
    fn trained(&self, _name: &str, _saved: &SavedWeights) -> Result<Box<dyn Generator>, LoadError> {
        Err(without_weights(self.kind()).into())
    }

    /// The model, where it needs no training.
    fn untrained(&self, _data: &DataConfig) -> Option<Box<dyn Generator>> {
        None
    }

    /// Compares the gradient of its loss with central differences, in f64 and, unless `full_size`,
    /// in small sizes. A title and a report for each way to compute the loss.
    ///
    /// # Errors
    /// A model that is not trained, or nothing to check it on.
    fn check_gradients(
        &self,
        _options: &GradientCheckOptions,
    ) -> Result<Vec<(String, CheckReport)>, ModelError> {
        Err(lacks(self.kind(), "gradient check"))
    }

    /// Training windows with what saved weights make of them, for comparison with another
    /// implementation.
    ///
    /// # Errors
    /// The weights are those of another model; there are no such windows; a model that has none.
    fn export_batch(
        &self,
        _saved: &SavedWeights,
        _setting: &TaskSetting<'_>,
        _options: &ExportOptions,
    ) -> Result<ExportedBatch, LoadError> {
        Err(lacks(self.kind(), "batch to export").into())
    }
}

/// What settings have by being written to TOML and cloned.
pub trait Tables {
    /// Every key of its tables with its value.
    ///
    /// # Errors
    /// A number that TOML does not have.
    fn tables(&self) -> Result<Table, toml::ser::Error>;

    fn clone_box(&self) -> Box<dyn ModelSettings>;
}

impl<S: ModelSettings + Serialize + Clone> Tables for S {
    fn tables(&self) -> Result<Table, toml::ser::Error> {
        Table::try_from(self)
    }

    fn clone_box(&self) -> Box<dyn ModelSettings> {
        Box::new(self.clone())
    }
}

/// The error of a model that is to be trained and needs no training.
pub(super) fn without_weights(model: &str) -> ModelError {
    ModelError::Model {
        model: model.into(),
        reason: "has no weights and needs no training; evaluate its config as it is".into(),
    }
}

/// The error of a model that is asked for what it does not have.
fn lacks(model: &str, what: &str) -> ModelError {
    ModelError::Model {
        model: model.into(),
        reason: format!("has no {what}"),
    }
}

/// What a task or a batch is built from beside the model's own settings.
#[derive(Debug, Clone)]
pub struct TaskSetting<'d> {
    pub dataset: &'d Dataset,
    /// How the data was read, and how it is measured.
    pub data: DataConfig,
    pub streams: Streams,
    /// Trained weights that the training starts from, with the statistics that they know the data
    /// by; none where it starts from drawn ones.
    pub start: Option<&'d SavedWeights>,
}

/// How a gradient check is drawn and how much of it is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GradientCheckOptions {
    /// Frames to predict, where they are not the model's own choice.
    pub frames: Option<usize>,
    /// Windows in the batch.
    pub windows: usize,
    /// Most numbers of each parameter that are compared.
    pub per_parameter: usize,
    /// Seed of data and weights.
    pub seed: u64,
    /// Keep the sizes of the config.
    pub full_size: bool,
}

/// Why saved weights give no model.
#[derive(Debug, Error)]
pub enum LoadError {
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Weights(#[from] WeightsError),
}

/// A value that no config can have.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{key} = {value}: expected {expected}")]
pub struct ValueError {
    pub key: String,
    pub value: String,
    pub expected: String,
}

impl ValueError {
    /// An error about this key unless `valid`.
    ///
    /// # Errors
    /// Where it is not valid.
    pub fn unless(
        valid: bool,
        key: impl Into<String>,
        value: impl fmt::Display,
        expected: impl Into<String>,
    ) -> Result<(), Self> {
        match valid {
            true => Ok(()),
            false => Err(Self {
                key: key.into(),
                value: value.to_string(),
                expected: expected.into(),
            }),
        }
    }
}

impl Clone for Box<dyn ModelSettings> {
    fn clone(&self) -> Self {
        self.clone_box()
    }
}

impl PartialEq for dyn ModelSettings {
    fn eq(&self, other: &Self) -> bool {
        self.kind() == other.kind() && self.tables() == other.tables()
    }
}

impl dyn ModelSettings {
    /// The settings, where they are of this type.
    pub fn downcast_ref<S: ModelSettings>(&self) -> Option<&S> {
        (self as &dyn Any).downcast_ref()
    }

    /// The settings, to be changed, where they are of this type.
    pub fn downcast_mut<S: ModelSettings>(&mut self) -> Option<&mut S> {
        (self as &mut dyn Any).downcast_mut()
    }
}
