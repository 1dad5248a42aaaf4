//! The network on transitions of the dance skeleton, as Pan et al. compare with it.

use glam::DVec3;
use ndarray::{Array3, s};
use rand::Rng;
use serde::{Deserialize, Serialize};

use super::config::RecurrentConfig;
use super::losses::{Scales, joints};
use super::network::RecurrentNetwork;
use super::transition_windows::TransitionWindows;
use crate::autograd::{AutogradError, Real, Tape};
use crate::models::generator::Condition;
use crate::models::settings::ValueError;
use crate::models::transition::posed_frames::posed_frames;
use crate::models::transition::{Batch, Forcing, Network, Standardisation};
use crate::models::{LossTerms, ModelError};
use crate::motion::JOINTS;
use crate::motion::features::{BODY_VELOCITIES, FRAME, ROOT_POSITION, ROOT_VELOCITY};
use crate::nn::Initialiser;

/// `[model]` of kind `harvey2020`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Harvey2020Config {
    #[serde(flatten)]
    pub network: RecurrentConfig,
    /// Standard deviation of the Gaussian that smooths the facing direction of predicted frames,
    /// frames: as `data.facing_sigma`.
    pub facing_sigma: f64,
}

impl Default for Harvey2020Config {
    fn default() -> Self {
        Self {
            network: RecurrentConfig::default(),
            facing_sigma: 20.0,
        }
    }
}

impl Harvey2020Config {
    /// The same structure in small sizes (8 units a layer), for checks in f64.
    pub fn small(&self) -> Self {
        Self {
            network: self.network.small(),
            ..self.clone()
        }
    }

    /// Checks the fields by themselves and against each other.
    ///
    /// # Errors
    /// The first out of its range.
    pub fn check(&self) -> Result<(), ValueError> {
        self.network.check()?;
        ValueError::unless(
            self.facing_sigma > 0.0 && self.facing_sigma <= 10_000.0,
            "model.facing_sigma",
            self.facing_sigma,
            "a number of frames above 0 and at most 10000",
        )
    }
}

/// The network of Harvey et al. 2020 on the features of a transition.
#[derive(Debug, Clone)]
pub struct Harvey2020 {
    network: RecurrentNetwork,
    facing_sigma: f64,
    standardisation: Standardisation,
}

impl Harvey2020 {
    /// Builds the network and adds its weights.
    ///
    /// # Errors
    /// A config whose fields do not fit together.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        config: &Harvey2020Config,
        standardisation: &Standardisation,
    ) -> Result<Self, ModelError> {
        config.check()?;
        let root_mean_square =
            |std: &[f64]| (std.iter().map(|x| x * x).sum::<f64>() / std.len() as f64).sqrt();
        let scales = Scales {
            position: standardisation.position_scale,
            velocity: standardisation.velocity_scale,
            root: root_mean_square(&standardisation.std[ROOT_POSITION]),
            root_velocity: root_mean_square(&standardisation.std[ROOT_VELOCITY]),
        };
        let first = BODY_VELOCITIES.len();
        Ok(Self {
            network: RecurrentNetwork::new(init, &config.network, JOINTS, first, scales)?,
            facing_sigma: config.facing_sigma,
            standardisation: standardisation.clone(),
        })
    }
}

impl<T: Real> Network<T> for Harvey2020 {
    fn reads_poses(&self) -> bool {
        true
    }

    fn conditions(&self) -> &'static [Condition] {
        &[]
    }

    fn forcing(&self, _drawn: Forcing) -> Forcing {
        Forcing::FreeRunning
    }

    fn losses(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
        _forcing: Forcing,
    ) -> Result<LossTerms, AutogradError> {
        let windows = TransitionWindows::new(batch, &self.standardisation)?;
        let (given, recorded) = (windows.given(), windows.recorded());
        let total = batch.total_windows;
        self.network.losses(tape, &given, &recorded, total)
    }

    fn predict(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Array3<T>, AutogradError> {
        let of_batch = TransitionWindows::new(batch, &self.standardisation)?;
        let (transition, windows) = (of_batch.transition, of_batch.windows);
        let given = of_batch.given();
        let mut rollout = self.network.start(tape, &given)?;
        let mut world = vec![Vec::with_capacity(transition); windows];
        let mut contacts = Array3::zeros((windows, transition, 4));
        let mark = tape.mark();
        for t in 0..transition {
            rollout.step(tape, transition - t)?;
            let joints = joints(tape, &given, rollout.state.rotations)?;
            let (roots, joints) = (tape.values(rollout.state.root), tape.values(joints));
            for (window, world) in world.iter_mut().enumerate() {
                let root = vector(&roots[3 * window..]);
                let joints = joints[3 * JOINTS * window..].chunks_exact(3).take(JOINTS);
                world.push(
                    joints
                        .map(|joint| of_batch.in_world(window, root + vector(joint)))
                        .collect::<Vec<_>>(),
                );
            }
            let labels = tape.values(rollout.state.contacts);
            for (place, &label) in contacts.slice_mut(s![.., t, ..]).iter_mut().zip(labels) {
                *place = Real::to_f64(label);
            }
            tape.forget_since(mark, &mut rollout.keep());
        }
        let mut predicted = Array3::from_elem((transition, windows, FRAME), T::zero());
        for (window, world) in world.iter().enumerate() {
            let [start, target] = [0, transition].map(|row| of_batch.features(row, window));
            let contacts = contacts.slice(s![window, .., ..]).to_owned();
            let ends = [start.view(), target.view()];
            let frames = posed_frames(ends, world, &contacts, self.facing_sigma);
            let standardised = self.standardisation.standardise(frames.view());
            predicted
                .slice_mut(s![.., window, ..])
                .assign(&standardised.mapv(T::from_f64));
        }
        Ok(predicted)
    }
}

fn vector<T: Real>(values: &[T]) -> DVec3 {
    DVec3::new(
        Real::to_f64(values[0]),
        Real::to_f64(values[1]),
        Real::to_f64(values[2]),
    )
}
