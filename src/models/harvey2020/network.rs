//! The recurrent transition network: one frame after the other.

use glam::DVec3;
use ndarray::{Array2, Array3, s};
use rand::Rng;

use super::config::Harvey2020Config;
use super::critic::Critic;
use super::given::GivenWindows;
use super::losses::{self, PredictedFrames, Scales, constant, joints};
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::generator::Condition;
use crate::models::transition::Standardisation;
use crate::models::transition::pose_windows::ROTATIONS;
use crate::models::transition::posed_frames::posed_frames;
use crate::models::transition::{Batch, Forcing, Network};
use crate::models::{LossTerms, ModelError};
use crate::motion::JOINTS;
use crate::motion::features::{BODY_VELOCITIES, FRAME, ROOT_POSITION, ROOT_VELOCITY};
use crate::nn::{Activation, Initialiser, LastLayer, Lstm, Mlp, sinusoidal_positions};

/// Rotations, root velocity, contacts: the state encoder's input, and what the decoder gives (as
/// changes, for the rotations).
const STATE: usize = ROTATIONS + 3 + 4;
/// Root and rotations still to go to the target.
const OFFSET: usize = 3 + ROTATIONS;
/// The decoder's unit of a quaternion's change: about the mean change from one frame to the next in
/// the dance data's training clips. With it, and with the root's in its own unit, an untrained
/// network nearly stands still.
const QUATERNION_CHANGE: f64 = 0.01;
/// Keeps the gradient of a quaternion's length finite at 0.
const NORM_EPS: f64 = 1e-8;

/// The network of Harvey et al. 2020.
#[derive(Debug, Clone)]
pub struct Harvey2020 {
    config: Harvey2020Config,
    standardisation: Standardisation,
    state_encoder: Mlp,
    offset_encoder: Mlp,
    target_encoder: Mlp,
    initial_state: Mlp,
    lstm: Lstm,
    decoder: Mlp,
    critics: Vec<Critic>,
    /// The time-to-arrival embedding once for each of the three codes,
    /// `[arrival_frames + 1, 3 code]`.
    arrival: Array2<f64>,
    /// Root mean square of the standard deviations of p^r (cm) and of v^r (cm/frame): units of the
    /// root's offset and velocity.
    root_scale: f64,
    root_velocity_scale: f64,
}

/// A frame on the tape, in the windows' frames.
#[derive(Debug, Clone, Copy)]
struct State {
    /// `[windows, 96]`
    rotations: Var,
    /// `[windows, 3]`, cm
    root: Var,
    /// `[windows, 3]`, in units of `root_velocity_scale`
    velocity: Var,
    /// `[windows, 4]`
    contacts: Var,
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
        let (wide, code, recurrent) = (config.hidden, config.code, config.recurrent);
        let mut layers = |name: &str, sizes: &[usize], last: LastLayer| {
            Mlp::with_activation(init, name, sizes, Activation::Plu, last)
        };
        let (activated, linear) = (LastLayer::Activated, LastLayer::Linear);
        let state_encoder = layers("state_encoder", &[STATE, wide, code], activated);
        let offset_encoder = layers("offset_encoder", &[OFFSET, wide, code], activated);
        let target_encoder = layers("target_encoder", &[ROTATIONS, wide, code], activated);
        let first = [STATE + BODY_VELOCITIES.len(), wide, 2 * recurrent];
        let initial_state = layers("initial_state", &first, linear);
        let decoder = layers("decoder", &[recurrent, wide, code, STATE], linear);
        let lstm = Lstm::new(init, "lstm", 3 * code, recurrent);
        let critics = match config.adversarial {
            true => Critic::both(init, config),
            false => Vec::new(),
        };
        let embedding = sinusoidal_positions(config.arrival_frames + 1, code);
        let arrival = Array2::from_shape_fn((embedding.nrows(), 3 * code), |(time, column)| {
            embedding[[time, column % code]]
        });
        let scale =
            |std: &[f64]| (std.iter().map(|x| x * x).sum::<f64>() / std.len() as f64).sqrt();
        Ok(Self {
            config: config.clone(),
            state_encoder,
            offset_encoder,
            target_encoder,
            initial_state,
            lstm,
            decoder,
            critics,
            arrival,
            root_scale: scale(&standardisation.std[ROOT_POSITION]),
            root_velocity_scale: scale(&standardisation.std[ROOT_VELOCITY]),
            standardisation: standardisation.clone(),
        })
    }

    fn start<'n, T: Real>(
        &'n self,
        tape: &mut Tape<'_, T>,
        given: &GivenWindows<'_, T>,
    ) -> Result<Rollout<'n>, AutogradError> {
        let windows = given.windows;
        let velocity = constant(tape, windows, &given.root_velocities());
        let state = State {
            rotations: constant(tape, windows, &given.rotations(0)),
            root: constant(tape, windows, &given.roots(0)),
            velocity: tape.affine(velocity, 1.0 / self.root_velocity_scale, 0.0),
            contacts: constant(tape, windows, &given.contacts(0)),
        };
        let target_rotations = constant(tape, windows, &given.target_rotations());
        let target_root = constant(tape, windows, &given.roots(given.transition));
        let target_code = self.target_encoder.forward(tape, target_rotations)?;
        let joint_velocities = constant(tape, windows, &given.body_velocities());
        let first = tape.concat(&[
            state.rotations,
            state.velocity,
            state.contacts,
            joint_velocities,
        ])?;
        let memory = self.initial_state.forward(tape, first)?;
        let none = tape.constant_with(&[windows, 2 * self.config.code], |out| out.fill(T::zero()));
        Ok(Rollout {
            network: self,
            transition: given.transition,
            state,
            memory,
            target_rotations,
            target_root,
            target_code,
            noise: tape.noise(none, self.config.target_noise),
        })
    }
}

/// The network at work on the windows of one batch.
struct Rollout<'n> {
    network: &'n Harvey2020,
    /// N
    transition: usize,
    state: State,
    /// The LSTM's state, `[windows, 2 recurrent]`
    memory: Var,
    /// `[windows, 96]`
    target_rotations: Var,
    /// `[windows, 3]`, cm
    target_root: Var,
    target_code: Var,
    /// z_target, `[windows, 2 code]`; zeros where noise is off.
    noise: Var,
}

impl Rollout<'_> {
    /// Goes on from frame t to frame t + 1.
    fn step<T: Real>(&mut self, tape: &mut Tape<'_, T>, t: usize) -> Result<(), AutogradError> {
        let network = self.network;
        let arrival = self.transition - t;
        let State {
            rotations,
            root,
            velocity,
            contacts,
        } = self.state;
        let state = tape.concat(&[rotations, velocity, contacts])?;
        let state_code = network.state_encoder.forward(tape, state)?;
        let way = tape.sub(self.target_root, root)?;
        let way = tape.affine(way, 1.0 / network.root_scale, 0.0);
        let turns = tape.sub(self.target_rotations, rotations)?;
        let offset = tape.concat(&[way, turns])?;
        let offset_code = network.offset_encoder.forward(tape, offset)?;
        let mut codes = tape.concat(&[offset_code, self.target_code])?;
        let share = network.config.noise_share(arrival);
        if share > 0.0 {
            let noise = tape.affine(self.noise, share, 0.0);
            codes = tape.add(codes, noise)?;
        }
        let codes = tape.concat(&[state_code, codes])?;
        let embedding = network
            .arrival
            .row(arrival.min(network.config.arrival_frames));
        let embedding = tape.constant_with(&[embedding.len()], |out| {
            let values = embedding.iter().map(|&x| T::from_f64(x));
            out.iter_mut().zip(values).for_each(|(out, x)| *out = x);
        });
        let codes = tape.add(codes, embedding)?;
        let (hidden, memory) = network.lstm.step(tape, codes, self.memory)?;
        self.memory = memory;
        let decoded = network.decoder.forward(tape, hidden)?;
        let changes = tape.columns(decoded, 0..ROTATIONS)?;
        let changes = tape.affine(changes, QUATERNION_CHANGE, 0.0);
        let changed = tape.add(rotations, changes)?;
        let velocity = tape.columns(decoded, ROTATIONS..ROTATIONS + 3)?;
        let moved = tape.affine(velocity, network.root_velocity_scale, 0.0);
        let contacts = tape.columns(decoded, ROTATIONS + 3..STATE)?;
        self.state = State {
            rotations: tape.normalise(changed, 4, NORM_EPS)?,
            root: tape.add(root, moved)?,
            velocity,
            contacts: tape.sigmoid(contacts),
        };
        Ok(())
    }

    /// The values on the tape that later frames need.
    fn keep(&mut self) -> [&mut Var; 5] {
        let State {
            rotations,
            root,
            velocity,
            contacts,
        } = &mut self.state;
        [rotations, root, velocity, contacts, &mut self.memory]
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
        let given = GivenWindows::new(batch, &self.standardisation)?;
        let mut rollout = self.start(tape, &given)?;
        let mut motion = PredictedFrames::default();
        for t in 0..=given.transition {
            motion.rotations.push(rollout.state.rotations);
            motion.roots.push(rollout.state.root);
            motion.contacts.push(rollout.state.contacts);
            if t < given.transition {
                rollout.step(tape, t)?;
            }
        }
        let scales = Scales {
            position: self.standardisation.position_scale,
            velocity: self.standardisation.velocity_scale,
        };
        losses::terms(
            tape,
            &self.config,
            scales,
            &self.critics,
            &given,
            &motion,
            batch.total_windows,
        )
    }

    fn predict(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Array3<T>, AutogradError> {
        let given = GivenWindows::new(batch, &self.standardisation)?;
        let (transition, windows) = (given.transition, given.windows);
        let mut rollout = self.start(tape, &given)?;
        let mut world = vec![Vec::with_capacity(transition); windows];
        let mut contacts = Array3::zeros((windows, transition, 4));
        let mark = tape.mark();
        for t in 0..transition {
            rollout.step(tape, t)?;
            let joints = joints(tape, &given, rollout.state.rotations)?;
            let (roots, joints) = (tape.values(rollout.state.root), tape.values(joints));
            for (window, world) in world.iter_mut().enumerate() {
                let root = vector(&roots[3 * window..]);
                let joints = joints[3 * JOINTS * window..].chunks_exact(3).take(JOINTS);
                world.push(
                    joints
                        .map(|joint| given.in_world(window, root + vector(joint)))
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
            let [start, target] = [0, transition].map(|row| given.features(row, window));
            let contacts = contacts.slice(s![window, .., ..]).to_owned();
            let ends = [start.view(), target.view()];
            let frames = posed_frames(ends, world, &contacts, self.config.facing_sigma);
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
