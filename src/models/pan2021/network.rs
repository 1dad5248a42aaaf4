//! The motion synthesis network (figure 2): one frame after the other.

use ndarray::Array3;
use rand::Rng;

use super::TRANSFORMERS;
use super::config::{Controllers, Output, Pan2021Config};
use super::control_path::ControlPath;
use super::controller::{Controller, Session, Trajectory};
use super::given::GivenFrames;
use super::losses;
use super::prior::{self, Prior};
use super::units::{Units, VELOCITIES};
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::generator::Condition;
use crate::models::transition::Standardisation;
use crate::models::transition::{Batch, Forcing, Network};
use crate::models::{LossTerms, ModelError};
use crate::motion::features::{
    BODY_POSITIONS, BODY_VELOCITIES, CONTACTS, FACING, FRAME, ROOT_POSITION, VELOCITY_FACTORS,
};
use crate::nn::{Initialiser, LastLayer, Lstm, Mlp};

/// Numbers of the state encoder's input: p^b, p^r, o^r, c.
const STATE: std::ops::Range<usize> = 0..77;
/// Numbers of a keyframe: p^b, p^r, o^r.
const KEYFRAME: std::ops::Range<usize> = 0..FACING.end;
/// What the state decoder gives where there is a root decoder: p^b, c, v^b.
const DECODED_STATE: usize = 69 + 4 + 69;
/// What the root decoder gives: p^r, o^r, v^r.
const DECODED_ROOT: usize = 3 + 1 + 3;
/// What the names of the controllers' weights begin with.
const ROOT_TRAJECTORY_CONTROLLER: &str = "root_trajectory_controller";
const VELOCITY_FACTOR_CONTROLLER: &str = "velocity_factor_controller";

/// The network of Pan et al. 2021 and its ablations.
#[derive(Debug, Clone)]
pub struct Pan2021 {
    config: Pan2021Config,
    units: Units,
    state_encoder: Mlp,
    velocity_encoder: Mlp,
    target_controller: Mlp,
    position_encoder: Mlp,
    root_trajectory_controller: Controller,
    velocity_factor_controller: Option<Controller>,
    control_path: Option<ControlPath>,
    lstm: Backbone,
    state_decoder: Mlp,
    root_decoder: Option<Mlp>,
}

#[derive(Debug, Clone, Copy)]
enum Backbone {
    One(Lstm),
    Two(Lstm, Lstm),
}

/// What was fed for one frame.
#[derive(Debug, Clone, Copy)]
struct Fed {
    /// `[windows, 149]`
    frame: Var,
    /// p^r, `[windows, 3]`
    root: Var,
    /// f, `[windows, 5]`, where the network has a velocity factor controller.
    factors: Option<Var>,
}

impl Pan2021 {
    /// Builds the network and adds its weights.
    ///
    /// # Errors
    /// A config whose fields do not fit together.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        config: &Pan2021Config,
        standardisation: &Standardisation,
    ) -> Result<Self, ModelError> {
        config.check()?;
        let (wide, code) = (config.hidden, config.code);
        let mut encoder =
            |name: &str, sizes: &[usize]| Mlp::new(init, name, sizes, LastLayer::Activated);
        let state_encoder = encoder("state_encoder", &[STATE.len(), wide, code]);
        let velocity_encoder = encoder("velocity_encoder", &[VELOCITIES.len(), wide, code]);
        let target_controller = encoder("target_controller", &[KEYFRAME.len(), wide, code]);
        let codes = if config.velocity_factor { 4 } else { 3 };
        let last_input = match config.lstms {
            1 => (codes + 1) * code,
            _ => 2 * code,
        };
        let position_encoder = encoder("position_encoder", &[4, last_input]);
        let mut controller = |name: &str, channels: usize| {
            let controller = Controller::new(init, name, channels, config);
            controller.map_err(|error| ModelError::data(&error))
        };
        let root_trajectory_controller = controller(ROOT_TRAJECTORY_CONTROLLER, 3)?;
        let velocity_factor_controller = match config.velocity_factor {
            true => Some(controller(
                VELOCITY_FACTOR_CONTROLLER,
                VELOCITY_FACTORS.len(),
            )?),
            false => None,
        };
        let control_path = config.control_path.then(|| ControlPath::new(init, config));
        let lstm = match config.lstms {
            1 => Backbone::One(Lstm::new(init, "lstm", last_input, code)),
            _ => Backbone::Two(
                Lstm::new(init, "lstm1", codes * code, code),
                Lstm::new(init, "lstm2", last_input, code),
            ),
        };
        // A residual network begins as the mean that it adds to.
        let last = match config.output {
            Output::Absolute => LastLayer::Linear,
            Output::Residual => LastLayer::Zero,
        };
        let decoder = |init: &mut Initialiser<'_, T, R>, name: &str, outputs: usize| {
            Mlp::new(init, name, &[code, wide, code, outputs], last)
        };
        let (state_decoder, root_decoder) = match config.decoders {
            1 => (decoder(init, "state_decoder", FRAME), None),
            _ => (
                decoder(init, "state_decoder", DECODED_STATE),
                Some(decoder(init, "root_decoder", DECODED_ROOT)),
            ),
        };
        Ok(Self {
            config: config.clone(),
            units: Units::new(standardisation),
            state_encoder,
            velocity_encoder,
            target_controller,
            position_encoder,
            root_trajectory_controller,
            velocity_factor_controller,
            control_path,
            lstm,
            state_decoder,
            root_decoder,
        })
    }

    fn start<'n, 'f, T: Real>(
        &'n self,
        tape: &mut Tape<'_, T>,
        features: &'f Array3<T>,
    ) -> Result<Rollout<'n, 'f, T>, AutogradError> {
        let given = GivenFrames::new(features)?;
        let (transition, windows) = (given.transition, given.windows);
        let trajectory = |columns: std::ops::Range<usize>| Trajectory {
            values: given.all(columns),
            frames: transition + 1,
            windows,
        };
        let keyframe = given.constant(tape, transition, KEYFRAME);
        let target_code = self.target_controller.forward(tape, keyframe)?;
        let root = self
            .root_trajectory_controller
            .start(tape, trajectory(ROOT_POSITION))?;
        let factors = match &self.velocity_factor_controller {
            Some(controller) => Some(controller.start(tape, trajectory(VELOCITY_FACTORS))?),
            None => None,
        };
        let states = match &self.lstm {
            Backbone::One(lstm) => vec![lstm.start(tape, windows)],
            Backbone::Two(first, second) => {
                vec![first.start(tape, windows), second.start(tape, windows)]
            }
        };
        let prior = Prior::new(transition);
        let corrections = match &self.control_path {
            Some(path) => Some(path.corrections(tape, &self.units, prior, given)?),
            None => None,
        };
        Ok(Rollout {
            network: self,
            given,
            prior,
            corrections,
            target_code,
            states,
            root,
            factors,
            past: Vec::new(),
        })
    }
}

/// The network at work on the windows of one batch.
struct Rollout<'n, 'f, T> {
    network: &'n Pan2021,
    given: GivenFrames<'f, T>,
    prior: Prior,
    /// Of p^b, `[N * windows, 69]`, where the network has a control path.
    corrections: Option<Var>,
    target_code: Var,
    states: Vec<Var>,
    root: Session<'n, T>,
    factors: Option<Session<'n, T>>,
    /// The last frames fed, the latest at the end, with their index.
    past: Vec<(usize, Fed)>,
}

impl<T: Real> Rollout<'_, '_, T> {
    /// Feeds the true frame `t`.
    fn feed_truth(&mut self, tape: &mut Tape<'_, T>, t: usize) {
        let fed = Fed {
            frame: self.given.constant(tape, t, 0..FRAME),
            root: self.given.constant(tape, t, ROOT_POSITION),
            factors: self
                .factors
                .is_some()
                .then(|| self.given.constant(tape, t, VELOCITY_FACTORS)),
        };
        self.feed(t, fed);
    }

    /// Feeds a predicted frame `t`, `[windows, 149]`.
    fn feed_prediction(
        &mut self,
        tape: &mut Tape<'_, T>,
        t: usize,
        frame: Var,
    ) -> Result<(), AutogradError> {
        let factors = match self.factors {
            None => None,
            Some(_) => {
                let velocities = tape.columns(frame, VELOCITIES)?;
                let velocities = self.network.units.velocities(tape, velocities)?;
                Some(self.network.units.velocity_factors(tape, velocities)?)
            }
        };
        let root = tape.columns(frame, ROOT_POSITION)?;
        let fed = Fed {
            frame,
            root,
            factors,
        };
        self.feed(t, fed);
        Ok(())
    }

    fn feed(&mut self, t: usize, fed: Fed) {
        let past = Session::<T>::past(self.network.config.window).max(1);
        if self.past.len() == past {
            self.past.remove(0);
        }
        self.past.push((t, fed));
    }

    /// Predicts frame `t + 1`, standardised `[windows, 149]`, from what was fed up to frame t.
    fn step(&mut self, tape: &mut Tape<'_, T>, t: usize) -> Result<Var, AutogradError> {
        let network = self.network;
        let past = self.past.clone();
        let fed = |frame: usize| -> Fed {
            past.iter()
                .find(|(index, _)| *index == frame)
                .or(past.first())
                .map(|&(_, fed)| fed)
                .expect("frame t is fed before frame t + 1 is predicted")
        };
        let now = fed(t);
        let state = tape.columns(now.frame, STATE)?;
        let state = network.state_encoder.forward(tape, state)?;
        let velocity = tape.columns(now.frame, VELOCITIES)?;
        let velocity = network.velocity_encoder.forward(tape, velocity)?;
        let mut codes = vec![state, velocity];
        codes.push(self.root.code(tape, t, |frame| fed(frame).root)?);
        if let Some(session) = &mut self.factors {
            codes.push(session.code(tape, t, |frame| {
                let fed = fed(frame);
                fed.factors.unwrap_or(fed.root)
            })?);
        }
        let position = self.position_code(tape, t)?;
        let hidden = match &network.lstm {
            Backbone::One(lstm) => {
                codes.push(self.target_code);
                let input = tape.concat(&codes)?;
                let input = tape.add(input, position)?;
                let (hidden, state) = lstm.step(tape, input, self.states[0])?;
                self.states[0] = state;
                hidden
            }
            Backbone::Two(first, second) => {
                let input = tape.concat(&codes)?;
                let (hidden, state) = first.step(tape, input, self.states[0])?;
                self.states[0] = state;
                let input = tape.concat(&[hidden, self.target_code])?;
                let input = tape.add(input, position)?;
                let (hidden, state) = second.step(tape, input, self.states[1])?;
                self.states[1] = state;
                hidden
            }
        };
        let decoded = self.decode(tape, hidden)?;
        match network.config.output {
            Output::Absolute => Ok(decoded),
            Output::Residual => {
                let deviation = self.residual_deviation(tape, t);
                let scaled = tape.mul(decoded, deviation)?;
                let mean = self.prior_mean(tape, t);
                let frame = tape.add(scaled, mean)?;
                match self.corrections {
                    Some(corrections) => self.corrected(tape, t, frame, corrections),
                    None => Ok(frame),
                }
            }
        }
    }

    /// Frame t + 1 with the control path's corrections of p^b, and their change since frame t in
    /// v^b.
    fn corrected(
        &self,
        tape: &mut Tape<'_, T>,
        t: usize,
        frame: Var,
        corrections: Var,
    ) -> Result<Var, AutogradError> {
        let windows = self.given.windows;
        let places = tape.rows(corrections, t * windows..(t + 1) * windows)?;
        // In k1 there is nothing to correct.
        let changes = match t {
            0 => places,
            _ => {
                let before = tape.rows(corrections, (t - 1) * windows..t * windows)?;
                tape.sub(places, before)?
            }
        };
        let speeds = self.network.units.speed_changes(tape, changes)?;
        let mut nothing =
            |columns: usize| tape.constant_with(&[windows, columns], |out| out.fill(T::zero()));
        let between = nothing(VELOCITIES.start - BODY_POSITIONS.end);
        let rest = nothing(FRAME - BODY_VELOCITIES.end);
        let correction = tape.concat(&[places, between, speeds, rest])?;
        tape.add(frame, correction)
    }

    /// The decoders' numbers, `[windows, 149]`.
    fn decode(&self, tape: &mut Tape<'_, T>, hidden: Var) -> Result<Var, AutogradError> {
        let network = self.network;
        let decoded = network.state_decoder.forward(tape, hidden)?;
        let Some(root_decoder) = &network.root_decoder else {
            return Ok(decoded);
        };
        let root = root_decoder.forward(tape, hidden)?;
        let parts = [
            tape.columns(decoded, 0..69)?,
            tape.columns(root, 0..4)?,
            tape.columns(decoded, 69..DECODED_STATE)?,
            tape.columns(root, 4..DECODED_ROOT)?,
        ];
        tape.concat(&parts)
    }

    /// What a residual is multiplied with in frame t + 1, `[149]`: the deviation that the prior
    /// leaves p^b, of p^r and o^r the same; of the velocities that of v^b; 1 for c.
    fn residual_deviation(&self, tape: &mut Tape<'_, T>, t: usize) -> Var {
        tape.constant_with(&[FRAME], |out| {
            out.fill(T::from_f64(self.prior.deviation(t + 1)));
            out[CONTACTS].fill(T::one());
            out[VELOCITIES].fill(T::from_f64(self.prior.step_deviation(t + 1)));
        })
    }

    /// What a residual is added to in frame t + 1, standardised `[windows, 149]`: p^b as
    /// [`Prior`] has it, p^r of the given trajectory, o^r linearly between the keyframes; v^b
    /// and v^r the differences of these p^b and p^r; c 0, their means.
    fn prior_mean(&self, tape: &mut Tape<'_, T>, t: usize) -> Var {
        let (units, n) = (&self.network.units, self.given.transition);
        let weights = [t, t + 1].map(|t| self.prior.weights(t).map(T::from_f64));
        let share = T::from_f64((t + 1) as f64 / n as f64);
        let ends = self.given.frame(0).zip(self.given.frame(n));
        let given = self.given.frame(t).zip(self.given.frame(t + 1));
        tape.constant_with(&[self.given.windows, FRAME], |out| {
            for (out, ((first, last), (before, now))) in
                out.chunks_exact_mut(FRAME).zip(ends.zip(given))
            {
                let (places, velocities) = out.split_at_mut(VELOCITIES.start);
                for (column, velocity) in (0..).zip(velocities) {
                    let [earlier, place] = match BODY_POSITIONS.contains(&column) {
                        true => {
                            let ends = units.ends(column, first, last);
                            weights.map(|weights| prior::mean(weights, ends))
                        }
                        false => [before[column], now[column]],
                    };
                    places[column] = place;
                    *velocity = units.standardised_speed(column, place - earlier);
                }
                let facing = FACING.start;
                places[facing] = first[facing] + (last[facing] - first[facing]) * share;
                places[CONTACTS].fill(T::zero());
            }
        })
    }

    /// The code of frame t + 1's place: p^r of the given trajectory, and a_t = (t + 1 - k1) / (k2 -
    /// k1) (eq. 2).
    fn position_code(&self, tape: &mut Tape<'_, T>, t: usize) -> Result<Var, AutogradError> {
        let root = self.given.constant(tape, t + 1, ROOT_POSITION);
        let arrival = T::from_f64((t + 1) as f64 / self.given.transition as f64);
        let arrival = tape.constant_with(&[self.given.windows, 1], |out| out.fill(arrival));
        let input = tape.concat(&[root, arrival])?;
        self.network.position_encoder.forward(tape, input)
    }

    /// The values on the tape that later frames need.
    fn keep(&mut self) -> Vec<&mut Var> {
        let mut keep: Vec<&mut Var> = self.states.iter_mut().collect();
        for (_, fed) in &mut self.past {
            keep.extend([&mut fed.frame, &mut fed.root]);
            keep.extend(fed.factors.as_mut());
        }
        keep.extend(self.root.keep());
        if let Some(session) = &mut self.factors {
            keep.extend(session.keep());
        }
        keep
    }
}

impl<T: Real> Network<T> for Pan2021 {
    fn single_frames(&self) -> usize {
        match self.control_path {
            Some(_) => self.config.single_frames,
            None => 0,
        }
    }

    fn conditions(&self) -> &'static [Condition] {
        match self.config.velocity_factor {
            true => &[Condition::RootTrajectory, Condition::VelocityFactors],
            false => &[Condition::RootTrajectory],
        }
    }

    fn rate_group(&self, parameter: &str) -> Option<&'static str> {
        let (part, _) = parameter.split_once('.').unwrap_or((parameter, ""));
        let in_transformer = self.config.controllers == Controllers::Transformer
            && [ROOT_TRAJECTORY_CONTROLLER, VELOCITY_FACTOR_CONTROLLER].contains(&part);
        in_transformer.then_some(TRANSFORMERS)
    }

    fn losses(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
        forcing: Forcing,
    ) -> Result<LossTerms, AutogradError> {
        let mut rollout = self.start(tape, &batch.features)?;
        let first = rollout.given.constant(tape, 0, 0..FRAME);
        let mut frames = vec![first];
        rollout.feed_truth(tape, 0);
        for t in 0..rollout.given.transition {
            let frame = rollout.step(tape, t)?;
            frames.push(frame);
            match forcing {
                Forcing::Teacher => rollout.feed_truth(tape, t + 1),
                Forcing::FreeRunning => rollout.feed_prediction(tape, t + 1, frame)?,
            }
        }
        let single_frames = match &self.control_path {
            Some(path) => Some(path.loss(tape, &self.units, batch)?),
            None => None,
        };
        let frames = losses::Predicted {
            frames: &frames,
            single_frames,
        };
        losses::terms(tape, &self.units, &self.config, batch, frames)
    }

    fn predict(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Array3<T>, AutogradError> {
        let mut rollout = self.start(tape, &batch.features)?;
        let (transition, windows) = (rollout.given.transition, rollout.given.windows);
        let mut predicted = Vec::with_capacity(transition * windows * FRAME);
        rollout.feed_truth(tape, 0);
        let mark = tape.mark();
        for t in 0..transition {
            let frame = rollout.step(tape, t)?;
            predicted.extend_from_slice(tape.values(frame));
            rollout.feed_prediction(tape, t + 1, frame)?;
            tape.forget_since(mark, &mut rollout.keep());
        }
        Array3::from_shape_vec((transition, windows, FRAME), predicted).map_err(|_| {
            AutogradError::Argument {
                operation: "pan2021",
                shape: batch.features.shape().to_vec(),
                argument: "the predicted frames".into(),
                expected: "149 numbers a frame",
            }
        })
    }
}
