//! A critic of motion: an MLP that scores every window of a few frames in a row.

use rand::Rng;

use super::config::RecurrentConfig;
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::CRITICS;
use crate::nn::{Activation, Initialiser, LastLayer, Mlp};

/// Numbers of a frame that a critic sees: J - 1 joints relative to the root and the velocities of
/// all J.
fn seen(joints: usize) -> usize {
    3 * (joints - 1) + 3 * joints
}

/// Names, and frames that each critic sees at once.
const CRITICS_OF_THE_PAPER: [(&str, usize); 2] = [("short", 2), ("long", 10)];

/// Scores a sliding window: trained to give 1 for recorded motion and 0 for the network's.
#[derive(Debug, Clone)]
pub(super) struct Critic {
    frames: usize,
    layers: Mlp,
}

/// What the critics make of a batch, each `[1]`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Judgement {
    /// Sum over critics of the mean of 1/2 (D(predicted) - 1)^2, the critics held.
    pub(super) generator: Var,
    /// Sum over critics of the means of 1/2 (D(recorded) - 1)^2 and 1/2 D(predicted)^2, the motion
    /// held.
    pub(super) critics: Var,
}

impl Critic {
    pub(super) fn both<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        config: &RecurrentConfig,
        joints: usize,
    ) -> Vec<Self> {
        CRITICS_OF_THE_PAPER
            .iter()
            .map(|&(name, frames)| {
                let sizes = [frames * seen(joints), config.hidden, config.code, 1];
                let name = format!("{CRITICS}{name}");
                let layers =
                    Mlp::with_activation(init, &name, &sizes, Activation::Relu, LastLayer::Linear);
                Self { frames, layers }
            })
            .collect()
    }

    /// Windows of frames in a row, `[(N - frames + 1) * windows, frames * n]`, from the n numbers
    /// of each frame, `[N * windows, n]`.
    fn slide<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        seen: Var,
        windows: usize,
    ) -> Result<Var, AutogradError> {
        let rows = tape.shape(seen)[0] - (self.frames - 1) * windows;
        let parts = (0..self.frames)
            .map(|k| tape.rows(seen, k * windows..k * windows + rows))
            .collect::<Result<Vec<_>, _>>()?;
        tape.concat(&parts)
    }

    /// Sum over all scores of 1/2 (score - wanted)^2.
    fn distance<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        slides: Var,
        wanted: f64,
    ) -> Result<Var, AutogradError> {
        let scores = self.layers.forward(tape, slides)?;
        let missing = tape.affine(scores, 1.0, -wanted);
        let squares = tape.square(missing);
        let sum = tape.sum(squares);
        Ok(tape.affine(sum, 0.5, 0.0))
    }
}

/// Judges `predicted [N * windows, n]` beside `recorded`, as a mean over positions in time and
/// over `total_windows`. A critic that sees more than N frames has no say.
pub(super) fn judge<T: Real>(
    tape: &mut Tape<'_, T>,
    critics: &[Critic],
    [predicted, recorded]: [Var; 2],
    windows: usize,
    total_windows: usize,
) -> Result<Judgement, AutogradError> {
    let transition = tape.shape(predicted)[0] / windows.max(1);
    let zero = tape.constant_with(&[1], |out| out.fill(T::zero()));
    let mut judgement = Judgement {
        generator: zero,
        critics: zero,
    };
    for critic in critics.iter().filter(|critic| critic.frames <= transition) {
        let mean = 1.0 / ((transition - critic.frames + 1) * total_windows) as f64;
        let slides = critic.slide(tape, predicted, windows)?;
        let judged = tape.frozen(|tape| critic.distance(tape, slides, 1.0))?;
        let held = tape.detach(slides);
        let taken = critic.distance(tape, held, 0.0)?;
        let slides = critic.slide(tape, recorded, windows)?;
        let missed = critic.distance(tape, slides, 1.0)?;
        let own = tape.add(taken, missed)?;
        let (judged, own) = (tape.affine(judged, mean, 0.0), tape.affine(own, mean, 0.0));
        judgement.generator = tape.add(judgement.generator, judged)?;
        judgement.critics = tape.add(judgement.critics, own)?;
    }
    Ok(judgement)
}
