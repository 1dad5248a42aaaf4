//! A network with its weights and statistics, as a model of transitions.

use std::sync::{Arc, Mutex};

use ndarray::{Array2, Array3, s};

use super::{
    Batch, ModelError, Network, PoseWindows, Transition, TransitionModel, TransitionRequest,
};
use crate::autograd::{Parameters, Tape, Workspace};
use crate::data::window::wrap;
use crate::data::{RootFrame, Standardisation};
use crate::motion::features::{FACING, FEATURES, FRAME, ROOT_POSITION, VELOCITY_FACTORS};

/// A trained network, in f32.
pub struct TrainedModel {
    name: String,
    network: Arc<dyn Network<f32>>,
    parameters: Parameters<f32>,
    standardisation: Standardisation,
    root_frame: RootFrame,
    workspaces: Mutex<Vec<Workspace<f32>>>,
}

impl TrainedModel {
    /// `parameters` are those that `network` was built with, `standardisation` and `root_frame` those that it was trained in.
    pub fn new(
        name: String,
        network: impl Into<Arc<dyn Network<f32>>>,
        parameters: Parameters<f32>,
        standardisation: Standardisation,
        root_frame: RootFrame,
    ) -> Self {
        Self {
            name,
            network: network.into(),
            parameters,
            standardisation,
            root_frame,
            workspaces: Mutex::new(Vec::new()),
        }
    }

    pub fn network(&self) -> &dyn Network<f32> {
        &*self.network
    }

    pub fn parameters(&self) -> &Parameters<f32> {
        &self.parameters
    }

    pub fn standardisation(&self) -> &Standardisation {
        &self.standardisation
    }

    /// Origin of the network's root positions in a request, cm.
    fn origin(&self, request: &TransitionRequest) -> [f64; 3] {
        let first = std::array::from_fn(|axis| request.root_trajectory[[0, axis]]);
        self.root_frame.origin(first)
    }

    /// The network's inputs for requests of one length: features `[N + 1, windows, 154]`, standardised, and the keyframes' poses where
    /// the network reads them; what is not given is 0.
    fn inputs(&self, requests: &[&TransitionRequest], length: usize) -> Batch<f32> {
        let mut features = Array3::zeros((length + 1, requests.len(), FEATURES));
        let standardise = |value: f64, number: usize| {
            ((value - self.standardisation.mean[number]) / self.standardisation.std[number]) as f32
        };
        for (window, request) in requests.iter().enumerate() {
            // As in training, the first frame faces within [-pi, pi) and the angle runs on from there.
            let facing = request.start.features[FACING.start];
            let shift = wrap(facing) - facing;
            for (row, keyframe) in [(0, &request.start), (length, &request.target)] {
                for number in 0..FEATURES {
                    let shift = if number == FACING.start { shift } else { 0.0 };
                    let value = keyframe.features[number] + shift;
                    features[[row, window, number]] = standardise(value, number);
                }
            }
            let origin = self.origin(request);
            for row in 0..=length {
                for (k, number) in ROOT_POSITION.enumerate() {
                    let place = request.root_trajectory[[row, k]] - origin[k];
                    features[[row, window, number]] = standardise(place, number);
                }
                for (k, number) in VELOCITY_FACTORS.enumerate() {
                    let factor = request.velocity_factors[[row, k]];
                    features[[row, window, number]] = standardise(factor, number);
                }
            }
        }
        let poses = self.network.reads_poses().then(|| {
            let mut poses = PoseWindows::zeros(length + 1, requests.len());
            for (window, request) in requests.iter().enumerate() {
                let keyframes = [&request.start.pose, &request.target.pose];
                poses.write(window, [0, length], keyframes);
            }
            poses
        });
        Batch {
            poses,
            ..Batch::of(features)
        }
    }

    fn predict(
        &self,
        requests: &[&TransitionRequest],
        length: usize,
    ) -> Result<Vec<Transition>, ModelError> {
        let inputs = self.inputs(requests, length);
        let mut workspace = self
            .workspaces
            .lock()
            .map(|mut free| free.pop())
            .unwrap_or_default()
            .unwrap_or_default();
        let predicted = {
            let mut tape = Tape::inference(&self.parameters, &mut workspace);
            self.network.predict(&mut tape, &inputs)
        }
        .map_err(|error| ModelError::Model {
            model: self.name.clone(),
            reason: error.to_string(),
        })?;
        if let Ok(mut free) = self.workspaces.lock() {
            free.push(workspace);
        }
        let mut transitions = Vec::with_capacity(requests.len());
        for (window, request) in requests.iter().enumerate() {
            let facing = request.start.features[FACING.start];
            let shift = wrap(facing) - facing;
            let origin = self.origin(request);
            let mut frames = Array2::zeros((length, FRAME));
            for (mut out, row) in frames
                .rows_mut()
                .into_iter()
                .zip(predicted.slice(s![.., window, ..]).rows())
            {
                for number in 0..FRAME {
                    out[number] = f64::from(row[number]) * self.standardisation.std[number]
                        + self.standardisation.mean[number];
                }
                out[FACING.start] -= shift;
                for (number, origin) in ROOT_POSITION.zip(origin) {
                    out[number] += origin;
                }
            }
            let transition = Transition { frames };
            transition.check(length)?;
            transitions.push(transition);
        }
        Ok(transitions)
    }
}

impl TransitionModel for TrainedModel {
    fn name(&self) -> &str {
        &self.name
    }

    fn transitions(&self, requests: &[TransitionRequest]) -> Result<Vec<Transition>, ModelError> {
        for request in requests {
            request.check()?;
        }
        let mut lengths: Vec<usize> = requests.iter().map(TransitionRequest::length).collect();
        lengths.sort_unstable();
        lengths.dedup();
        let mut results: Vec<Option<Transition>> = vec![None; requests.len()];
        for length in lengths {
            let (places, of_length): (Vec<usize>, Vec<&TransitionRequest>) = requests
                .iter()
                .enumerate()
                .filter(|(_, request)| request.length() == length)
                .unzip();
            for (place, transition) in places.into_iter().zip(self.predict(&of_length, length)?) {
                results[place] = Some(transition);
            }
        }
        Ok(results.into_iter().flatten().collect())
    }
}
