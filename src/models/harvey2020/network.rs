//! The recurrent transition network: one frame after the other.

use ndarray::Array2;
use rand::Rng;

use super::config::RecurrentConfig;
use super::critic::Critic;
use super::given::{GivenState, GivenWindows, Recorded};
use super::losses::{self, PredictedFrames, Scales, constant};
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::LossTerms;
use crate::models::settings::ValueError;
use crate::nn::{Activation, Initialiser, LastLayer, Lstm, Mlp, sinusoidal_positions};

/// Contact labels of a frame.
const CONTACTS: usize = 4;
/// The decoder's unit of a quaternion's change: about the mean change from one frame to the next in
/// the dance data's training clips. With it, and with the root's in its own unit, an untrained
/// network nearly stands still.
const QUATERNION_CHANGE: f64 = 0.01;
/// Keeps the gradient of a quaternion's length finite at 0.
const NORM_EPS: f64 = 1e-8;

/// The network on a body of J joints.
#[derive(Debug, Clone)]
pub(super) struct RecurrentNetwork {
    config: RecurrentConfig,
    joints: usize,
    scales: Scales,
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
}

/// A frame on the tape, in the windows' frames.
#[derive(Debug, Clone, Copy)]
pub(super) struct State {
    /// `[windows, 4 J]`
    pub rotations: Var,
    /// `[windows, 3]`, cm
    pub root: Var,
    /// `[windows, 3]`, in units of [`Scales::root_velocity`]
    velocity: Var,
    /// `[windows, 4]`
    pub contacts: Var,
}

impl RecurrentNetwork {
    /// Builds the network for `joints` joints and adds its weights. `first` is how many numbers the
    /// LSTM's first state follows from beside the first frame.
    ///
    /// # Errors
    /// A config whose fields do not fit together.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        config: &RecurrentConfig,
        joints: usize,
        first: usize,
        scales: Scales,
    ) -> Result<Self, ValueError> {
        config.check()?;
        let (wide, code, recurrent) = (config.hidden, config.code, config.recurrent);
        let rotations = 4 * joints;
        // Rotations, root velocity, contacts: what the state encoder reads and the decoder gives.
        let state = rotations + 3 + CONTACTS;
        let mut layers = |name: &str, sizes: &[usize], last: LastLayer| {
            Mlp::with_activation(init, name, sizes, Activation::Plu, last)
        };
        let (activated, linear) = (LastLayer::Activated, LastLayer::Linear);
        let state_encoder = layers("state_encoder", &[state, wide, code], activated);
        let offset_encoder = layers("offset_encoder", &[3 + rotations, wide, code], activated);
        let target_encoder = layers("target_encoder", &[rotations, wide, code], activated);
        let initial_state = layers(
            "initial_state",
            &[state + first, wide, 2 * recurrent],
            linear,
        );
        let decoder = layers("decoder", &[recurrent, wide, code, state], linear);
        let lstm = Lstm::new(init, "lstm", 3 * code, recurrent);
        let critics = match config.adversarial {
            true => Critic::both(init, config, joints),
            false => Vec::new(),
        };
        let embedding = sinusoidal_positions(config.arrival_frames + 1, code);
        let arrival = Array2::from_shape_fn((embedding.nrows(), 3 * code), |(time, column)| {
            embedding[[time, column % code]]
        });
        Ok(Self {
            config: config.clone(),
            joints,
            scales,
            state_encoder,
            offset_encoder,
            target_encoder,
            initial_state,
            lstm,
            decoder,
            critics,
            arrival,
        })
    }

    fn state<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        given: &GivenState<T>,
        windows: usize,
    ) -> State {
        let velocity = constant(tape, windows, &given.velocity);
        State {
            rotations: constant(tape, windows, &given.rotations),
            root: constant(tape, windows, &given.root),
            velocity: tape.affine(velocity, 1.0 / self.scales.root_velocity, 0.0),
            contacts: constant(tape, windows, &given.contacts),
        }
    }

    /// At keyframe k1, the past behind it.
    ///
    /// # Errors
    /// Windows of another body.
    pub fn start<'n, T: Real>(
        &'n self,
        tape: &mut Tape<'_, T>,
        given: &GivenWindows<T>,
    ) -> Result<Rollout<'n>, AutogradError> {
        let windows = given.windows;
        let (first, later) = given.lead.split_first().ok_or(AutogradError::Misplaced {
            operation: "harvey2020",
            what: "windows without their first keyframe",
        })?;
        let state = self.state(tape, first, windows);
        let target_rotations = constant(tape, windows, &given.target_rotations);
        let target_root = constant(tape, windows, &given.target_root);
        let target_code = self.target_encoder.forward(tape, target_rotations)?;
        let mut numbers = vec![state.rotations, state.velocity, state.contacts];
        if !given.first.is_empty() {
            numbers.push(constant(tape, windows, &given.first));
        }
        let numbers = tape.concat(&numbers)?;
        let memory = self.initial_state.forward(tape, numbers)?;
        let none = tape.constant_with(&[windows, 2 * self.config.code], |out| out.fill(T::zero()));
        let mut rollout = Rollout {
            network: self,
            state,
            memory,
            target_rotations,
            target_root,
            target_code,
            noise: tape.noise(none, self.config.target_noise),
        };
        for (gone, state) in later.iter().enumerate() {
            rollout.step(tape, given.transition + later.len() - gone)?;
            rollout.state = self.state(tape, state, windows);
        }
        Ok(rollout)
    }

    /// The losses of windows beside what was recorded of them; `total_windows` as in
    /// [`crate::models::transition::Batch`].
    ///
    /// # Errors
    /// Windows of another body.
    pub fn losses<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        given: &GivenWindows<T>,
        recorded: &Recorded<T>,
        total_windows: usize,
    ) -> Result<LossTerms, AutogradError> {
        let mut rollout = self.start(tape, given)?;
        let mut motion = PredictedFrames::default();
        for t in 0..=given.transition {
            motion.rotations.push(rollout.state.rotations);
            motion.roots.push(rollout.state.root);
            motion.contacts.push(rollout.state.contacts);
            if t < given.transition {
                rollout.step(tape, given.transition - t)?;
            }
        }
        let recorded = losses::recorded(tape, recorded, given.windows);
        losses::terms(
            tape,
            &self.config,
            self.scales,
            &self.critics,
            given,
            [&motion, &recorded],
            total_windows,
        )
    }
}

/// The network at work on the windows of one batch.
pub(super) struct Rollout<'n> {
    network: &'n RecurrentNetwork,
    pub state: State,
    /// The LSTM's state, `[windows, 2 recurrent]`
    memory: Var,
    /// `[windows, 4 J]`
    target_rotations: Var,
    /// `[windows, 3]`, cm
    target_root: Var,
    target_code: Var,
    /// z_target, `[windows, 2 code]`; zeros where noise is off.
    noise: Var,
}

impl Rollout<'_> {
    /// Goes on to the next frame, `arrival` frames before the target.
    ///
    /// # Errors
    /// Windows of another body.
    pub fn step<T: Real>(
        &mut self,
        tape: &mut Tape<'_, T>,
        arrival: usize,
    ) -> Result<(), AutogradError> {
        let network = self.network;
        let numbers = 4 * network.joints;
        let State {
            rotations,
            root,
            velocity,
            contacts,
        } = self.state;
        let state = tape.concat(&[rotations, velocity, contacts])?;
        let state_code = network.state_encoder.forward(tape, state)?;
        let way = tape.sub(self.target_root, root)?;
        let way = tape.affine(way, 1.0 / network.scales.root, 0.0);
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
        let changes = tape.columns(decoded, 0..numbers)?;
        let changes = tape.affine(changes, QUATERNION_CHANGE, 0.0);
        let changed = tape.add(rotations, changes)?;
        let velocity = tape.columns(decoded, numbers..numbers + 3)?;
        let moved = tape.affine(velocity, network.scales.root_velocity, 0.0);
        let contacts = tape.columns(decoded, numbers + 3..numbers + 3 + CONTACTS)?;
        self.state = State {
            rotations: tape.normalise(changed, 4, NORM_EPS)?,
            root: tape.add(root, moved)?,
            velocity,
            contacts: tape.sigmoid(contacts),
        };
        Ok(())
    }

    /// The values on the tape that later frames need.
    pub fn keep(&mut self) -> [&mut Var; 5] {
        let State {
            rotations,
            root,
            velocity,
            contacts,
        } = &mut self.state;
        [rotations, root, velocity, contacts, &mut self.memory]
    }
}
