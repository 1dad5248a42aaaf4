//! Weights as a safetensors file that PyTorch loads: every parameter and buffer by its name in f32,
//! or large ones in f16, the statistics that the model needs beside them, and the config.
//!
//! The metadata has one entry, `keydance`: JSON with `config` (TOML) and `version` (of the program
//! that wrote the file).

use std::collections::{BTreeMap, HashMap};
use std::fmt::Debug;
use std::path::{Path, PathBuf};

use half::f16;
use ndarray::{ArrayD, IxDyn};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use thiserror::Error;

use super::settings::{InitialRng, LoadError};
use super::{ModelError, Statistics, Streams};
use crate::autograd::{Parameters, Real};
use crate::data::{file_digest, hexadecimal};
use crate::nn::{Initialiser, MOST_WEIGHTS};
use crate::run::FileError;

const METADATA: &str = "keydance";
/// Bytes that a weights file may have beside its weights: config, names, shapes, statistics.
const LARGEST_HEADER: u64 = 1 << 24;

/// Arrays of fewer values than this stay in f32 where others become f16: biases, statistics.
const SMALL: usize = 1024;

/// Why a file does not give the weights of a model.
#[derive(Debug, Error)]
pub enum WeightsError {
    #[error(transparent)]
    File(#[from] FileError),
    /// It is damaged, or of something else: what does not fit.
    #[error("{0}")]
    Refused(String),
    #[error("{path}: {name} {problem}")]
    Value {
        path: PathBuf,
        name: &'static str,
        problem: &'static str,
    },
    #[error("the weights cannot be written as safetensors")]
    Serialise(#[from] safetensors::SafeTensorError),
}

#[derive(Serialize, Deserialize)]
struct Metadata {
    config: String,
    version: String,
}

/// A weights file, read.
#[derive(Debug, Clone, PartialEq)]
pub struct SavedWeights {
    /// Where it was read from.
    pub path: PathBuf,
    /// The experiment's config, TOML.
    pub config: String,
    /// Version of keydance that wrote the file.
    pub version: String,
    /// SHA-256 of the file, hexadecimal.
    pub digest: String,
    arrays: BTreeMap<String, ArrayD<f32>>,
}

/// The content of a weights file; the same bytes for the same weights.
///
/// # Errors
/// A header beyond the format's limits.
pub fn to_safetensors(
    parameters: &Parameters<f32>,
    statistics: &Statistics,
    config: &str,
) -> Result<Vec<u8>, WeightsError> {
    let single = |array: &ArrayD<f64>| bytes(array.iter().map(|&x| x as f32));
    let statistics = statistics.iter();
    let tensors: Vec<(&str, Vec<usize>, Vec<u8>)> = parameters
        .saved()
        .map(|(name, value)| (name, value.shape().to_vec(), bytes(value.iter().copied())))
        .chain(statistics.map(|(name, array)| (name, array.shape().to_vec(), single(array))))
        .collect();
    let views = tensors
        .iter()
        .map(|(name, shape, data)| Ok((*name, TensorView::new(Dtype::F32, shape.clone(), data)?)))
        .collect::<Result<Vec<_>, safetensors::SafeTensorError>>()?;
    let metadata = Metadata {
        config: config.into(),
        version: env!("CARGO_PKG_VERSION").into(),
    };
    serialised(views, &metadata)
}

fn serialised(
    views: Vec<(&str, TensorView<'_>)>,
    metadata: &Metadata,
) -> Result<Vec<u8>, WeightsError> {
    let metadata = serde_json::to_string(metadata).map_err(safetensors::SafeTensorError::from)?;
    // One entry only: several would be written in an order that changes from run to run.
    let metadata = HashMap::from([(METADATA.to_string(), metadata)]);
    Ok(safetensors::serialize(views, Some(metadata))?)
}

fn bytes(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(f32::to_le_bytes).collect()
}

/// SHA-256 over names, shapes and values of all parameters and buffers, hexadecimal.
pub fn digest(parameters: &Parameters<f32>) -> String {
    let mut hash = Sha256::new();
    for (name, value) in parameters.saved() {
        hash.update(format!("{name} {:?}\n", value.shape()));
        hash.update(bytes(value.iter().copied()));
    }
    hexadecimal(&hash.finalize())
}

/// The content of a file of at most `weights` weights.
pub(crate) fn read_file(path: &Path, weights: usize) -> Result<Vec<u8>, WeightsError> {
    let file = std::fs::metadata(path).map_err(FileError::at(path, "read"))?;
    let most = 4 * weights as u64 + LARGEST_HEADER;
    if file.len() > most {
        return Err(WeightsError::Refused(format!(
            "{} has {} bytes, weights of this model have at most {most}",
            path.display(),
            file.len()
        )));
    }
    Ok(std::fs::read(path).map_err(FileError::at(path, "read"))?)
}

impl SavedWeights {
    /// Reads a weights file.
    ///
    /// # Errors
    /// It cannot be read, is too large for any model, is damaged, or is not keydance's.
    pub fn read(path: &Path) -> Result<Self, WeightsError> {
        Self::parse(&read_file(path, MOST_WEIGHTS)?, path)
    }

    /// The same from a file's content; `path` is what errors call it.
    ///
    /// # Errors
    /// As [`SavedWeights::read`].
    pub fn parse(content: &[u8], path: &Path) -> Result<Self, WeightsError> {
        let bad = |problem: String| WeightsError::Refused(format!("{} {problem}", path.display()));
        let damaged = |cause| bad(format!("is not a whole safetensors file: {cause}"));
        let foreign = |problem: &str| {
            bad(format!(
                "was not written by keydance: its metadata{problem}"
            ))
        };
        let (_, header) = SafeTensors::read_metadata(content).map_err(damaged)?;
        let entries = header.metadata().as_ref();
        let metadata = entries
            .and_then(|entries| entries.get(METADATA))
            .ok_or_else(|| foreign(&format!(" has no entry {METADATA:?}")))?;
        let Metadata { config, version } = serde_json::from_str(metadata)
            .map_err(|error| foreign(&format!(" entry {METADATA:?}: {error}")))?;
        let tensors = SafeTensors::deserialize(content).map_err(damaged)?;
        let tensors = tensors.iter();
        let arrays = tensors.map(|(name, view)| Ok((name.into(), array(path, name, &view)?)));
        Ok(Self {
            path: path.into(),
            config,
            version,
            digest: file_digest(content),
            arrays: arrays.collect::<Result<_, WeightsError>>()?,
        })
    }

    /// The content of a weights file of half the size: arrays of 1,024 values and more in f16,
    /// rounded to the nearest.
    ///
    /// # Errors
    /// A weight is beyond the range of f16.
    pub fn to_half(&self) -> Result<Vec<u8>, WeightsError> {
        let mut tensors: Vec<(&str, Dtype, &[usize], Vec<u8>)> = Vec::new();
        for (name, array) in &self.arrays {
            let values = array.iter().copied();
            if array.len() < SMALL {
                tensors.push((name, Dtype::F32, array.shape(), bytes(values)));
                continue;
            }
            let halves: Vec<f16> = values.map(f16::from_f32).collect();
            if halves.iter().any(|half| !half.is_finite()) {
                let path = self.path.display();
                let problem = format!("{path}: a weight of {name} is beyond the range of f16");
                return Err(WeightsError::Refused(problem));
            }
            let data = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
            tensors.push((name, Dtype::F16, array.shape(), data));
        }
        let views = tensors.iter().map(|(name, dtype, shape, data)| {
            Ok((*name, TensorView::new(*dtype, shape.to_vec(), data)?))
        });
        let views = views.collect::<Result<Vec<_>, safetensors::SafeTensorError>>()?;
        let metadata = Metadata {
            config: self.config.clone(),
            version: self.version.clone(),
        };
        serialised(views, &metadata)
    }

    /// One of the model's [`Statistics`]; `expected` is its shape.
    ///
    /// # Errors
    /// It is not there, or has another shape.
    pub fn statistic(&self, name: &str, expected: &[usize]) -> Result<ArrayD<f64>, WeightsError> {
        let array = self.array(name, expected)?;
        Ok(array.mapv(f64::from))
    }

    /// Whether there is an array of this name: what files of earlier versions lack is optional.
    pub fn has(&self, name: &str) -> bool {
        self.arrays.contains_key(name)
    }

    /// One of the model's [`Statistics`] that is a list of any length.
    ///
    /// # Errors
    /// It is not there, or has several axes.
    pub fn statistic_list(&self, name: &str) -> Result<Vec<f64>, WeightsError> {
        let len = self.arrays.get(name).map_or(0, ArrayD::len);
        Ok(self.statistic(name, &[len])?.into_iter().collect())
    }

    fn array(&self, name: &str, expected: &[usize]) -> Result<&ArrayD<f32>, WeightsError> {
        let path = self.path.display();
        let array = self.arrays.get(name).ok_or_else(|| {
            WeightsError::Refused(format!(
                "{path} has no {name} {expected:?}, which the model of its config has"
            ))
        })?;
        match array.shape() {
            shape if shape == expected => Ok(array),
            shape => Err(misfit(&self.path, name, shape, expected)),
        }
    }

    /// Most weights that a model may have to be built for these: not many more than there are, as
    /// the sizes in a file cannot be trusted; but some, so that a parameter which the file lacks is
    /// named.
    pub fn most_weights(&self) -> usize {
        let weights: usize = self.arrays.values().map(ArrayD::len).sum();
        2 * weights + (1 << 20)
    }

    /// A network and its parameters with these values; `statistics` as in
    /// [`SavedWeights::load_into`].
    ///
    /// # Errors
    /// It cannot be built, or the values are those of another one.
    pub fn network<T: Real, N>(
        &self,
        statistics: &Statistics,
        build: impl FnOnce(&mut Initialiser<'_, T, InitialRng>) -> Result<N, ModelError>,
    ) -> Result<(N, Parameters<T>), LoadError> {
        let mut parameters = Parameters::new();
        // Overwritten by the saved values, whatever is drawn.
        let rng = Streams::new(0).initialisation();
        let mut init = Initialiser::limited(&mut parameters, rng, self.most_weights());
        let network = build(&mut init)?;
        self.load_into(&mut parameters, statistics)?;
        Ok((network, parameters))
    }

    /// Puts the values into a model's parameters and buffers. `statistics` are what else the file
    /// may hold.
    ///
    /// # Errors
    /// The file and the model do not have the same names and shapes; then nothing is changed.
    pub fn load_into<T: Real>(
        &self,
        parameters: &mut Parameters<T>,
        statistics: &Statistics,
    ) -> Result<(), WeightsError> {
        for (name, value) in parameters.saved() {
            self.array(name, value.shape())?;
        }
        let known = |name: &str| {
            parameters.saved().any(|(known, _)| known == name)
                || statistics.iter().any(|(known, _)| known == name)
        };
        if let Some((name, value)) = self.arrays.iter().find(|(name, _)| !known(name)) {
            return Err(WeightsError::Refused(format!(
                "{} has {name} {:?}, which the model of its config has not",
                self.path.display(),
                value.shape()
            )));
        }
        for (name, mut value) in parameters.saved_mut() {
            if let Some(saved) = self.arrays.get(name) {
                value.zip_mut_with(saved, |to, &from| *to = T::from_f64(from.into()));
            }
        }
        Ok(())
    }
}

fn array(path: &Path, name: &str, view: &TensorView) -> Result<ArrayD<f32>, WeightsError> {
    let bad = |found: String| misfit(path, name, format_args!("{found}"), format_args!("F32"));
    let values: Vec<f32> = match view.dtype() {
        Dtype::F32 => {
            let (chunks, _) = view.data().as_chunks::<4>();
            chunks
                .iter()
                .map(|bytes| f32::from_le_bytes(*bytes))
                .collect()
        }
        Dtype::F16 => {
            let (chunks, _) = view.data().as_chunks::<2>();
            let halves = chunks.iter().map(|bytes| f16::from_le_bytes(*bytes));
            halves.map(f16::to_f32).collect()
        }
        other => return Err(bad(other.to_string())),
    };
    ArrayD::from_shape_vec(IxDyn(view.shape()), values)
        .map_err(|error| bad(format!("{:?} ({error})", view.shape())))
}

/// The error of an array that is another than the model's.
fn misfit(path: &Path, name: &str, found: impl Debug, expected: impl Debug) -> WeightsError {
    WeightsError::Refused(format!(
        "{}: {name} is {found:?} in the file, {expected:?} in the model of its config",
        path.display()
    ))
}
