//! A network with its weights and statistics, as a model of transitions.

use std::sync::{Arc, Mutex};

use ndarray::{Array2, Array3, s};

use super::root_frame::WindowFrame;
use super::{
    Batch, Network, PoseWindows, Transition, TransitionModel, TransitionRequest,
    velocity_refinement,
};
use super::{RootFrame, Standardisation};
use crate::autograd::{Parameters, Tape, Workspace};
use crate::models::ModelError;
use crate::models::generator::Condition;
use crate::motion::Mapping;
use crate::motion::features::{FEATURES, ROOT_POSITION, VELOCITY_FACTORS};

/// A trained network, in f32.
pub struct TrainedModel {
    name: String,
    network: Arc<dyn Network<f32>>,
    parameters: Parameters<f32>,
    standardisation: Standardisation,
    root_frame: RootFrame,
    refines_velocities: bool,
    mapping: Option<Mapping>,
    workspaces: Mutex<Vec<Workspace<f32>>>,
}

impl TrainedModel {
    /// `parameters` are those that `network` was built with, `standardisation` and `root_frame`
    /// those that it was trained in.
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
            refines_velocities: false,
            mapping: None,
            workspaces: Mutex::new(Vec::new()),
        }
    }

    /// The same model, with its predictions brought to the velocity factors that were asked for or
    /// as the network gives them.
    pub fn refining_velocities(self, refining: bool) -> Self {
        Self {
            refines_velocities: refining,
            ..self
        }
    }

    /// The same model for requests on another skeleton, which it sees by a mapping.
    pub fn seeing_through(self, mapping: Option<Mapping>) -> Self {
        Self { mapping, ..self }
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

    /// The frame of reference that the network sees a request in.
    fn frame_of(&self, request: &TransitionRequest) -> WindowFrame {
        let mut first = request.start.features.clone();
        first
            .slice_mut(s![ROOT_POSITION])
            .assign(&request.root_trajectory.row(0));
        self.root_frame.of_window(first.view())
    }

    /// The network's inputs for requests of one length: features `[N + 1, windows, 154]`,
    /// standardised, and the keyframes' poses where the network reads them; what is not given is 0.
    fn inputs(&self, requests: &[&TransitionRequest], length: usize) -> Batch<f32> {
        let mut features = Array3::zeros((length + 1, requests.len(), FEATURES));
        for (window, request) in requests.iter().enumerate() {
            let mut rows = Array2::zeros((length + 1, FEATURES));
            rows.row_mut(0).assign(&request.start.features);
            rows.row_mut(length).assign(&request.target.features);
            rows.slice_mut(s![.., ROOT_POSITION])
                .assign(&request.root_trajectory);
            rows.slice_mut(s![.., VELOCITY_FACTORS])
                .assign(&request.velocity_factors);
            let frame = self.frame_of(request);
            rows.rows_mut().into_iter().for_each(|row| frame.enter(row));
            let rows = self.standardisation.standardise(rows.view());
            for (row, numbers) in rows.rows().into_iter().enumerate() {
                let all = row == 0 || row == length;
                for number in 0..FEATURES {
                    if all || ROOT_POSITION.contains(&number) || VELOCITY_FACTORS.contains(&number)
                    {
                        features[[row, window, number]] = numbers[number] as f32;
                    }
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
            let frame = self.frame_of(request);
            let predicted = predicted.slice(s![.., window, ..]);
            let mut frames = self
                .standardisation
                .restore(predicted.mapv(f64::from).view());
            frames
                .rows_mut()
                .into_iter()
                .for_each(|row| frame.leave(row));
            if self.refines_velocities {
                velocity_refinement::refine(request, frames.view_mut());
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

    fn conditions(&self) -> &'static [Condition] {
        match self.refines_velocities {
            true => &[Condition::RootTrajectory, Condition::VelocityFactors],
            false => self.network.conditions(),
        }
    }

    fn mapping(&self) -> Option<&Mapping> {
        self.mapping.as_ref()
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
