//! Robust Motion In-betweening (Harvey et al. 2020, ACM TOG 39(4)): the recurrent baseline without
//! root-trajectory control.
//!
//! - `network`: encoders, LSTM and decoder, one frame after the other, with sizes and weights in
//!   `config`;
//! - `losses`: reconstruction, and what the two sliding critics of `critic` add;
//! - `given`: windows in the frame of keyframe k1;
//! - `transitions`, `transition_windows`: on transitions of the dance skeleton, beside Pan et al.;
//! - `rotations`: on windows of rotations of any skeleton, beside Li et al.
//!
//! What comes from where ("that paper" is Harvey et al. 2020):
//!
//! - From that paper: local quaternions, root velocity and contacts as state; offsets of root and
//!   quaternions to the target; the target's quaternions; encoders of 512 and 256 units, decoder of
//!   512 and 256, PLU; one LSTM layer of 1024; the time-to-arrival embedding added to all three
//!   codes and constant beyond a largest time; target noise N(0, 0.5) drawn once a window on the
//!   codes of offset and target, none for the last 5 frames, whole from 30 frames before the target
//!   on; outputs that are changes of quaternions and root, and contacts through a sigmoid; L1
//!   losses on quaternions, root, contacts and the positions of forward kinematics, in units that
//!   make them about equal before training, with weights 1, 1, 0.1 and 0.5; least-squares critics
//!   of 512 and 256 units (ReLU) over sliding windows of 2 and 10 frames, weight 0.1; windows
//!   turned to one heading.
//! - From the comparison in Pan et al. 2021: the same data, curriculum and optimiser as the other
//!   models (that paper has AMSGrad with rate 1e-3 and betas 0.5 and 0.9 on windows of up to 30
//!   frames).
//! - Ours: that paper warms the LSTM up on 10 frames of past, of which a transition here has one;
//!   instead an MLP of 512 units gives the first LSTM state from k1's state and the joints'
//!   velocities, as the network of Harvey and Pal 2018 starts its state. The codes have their PLU
//!   before the embedding is added. Quaternions are normalised after every change. The target
//!   quaternion is the nearer of two to k1's, since the way between is not known. The critics see
//!   joints relative to the root, and all joints' velocities, of the frames k1 + 1 to k2. The
//!   largest time to arrival of the embedding is that paper's rule, longest transition + past - 5,
//!   for 70 and 1. The decoder gives changes of quaternions in units of 0.01 and the root's
//!   velocity in units of its deviation, as the other models' outputs are standardised. Loss units:
//!   positions and root s_p (cm, see `docs/model.md`), quaternions 0.07, contacts 1.
//!
//! The network always trains on its own predictions, as in that paper: scheduled sampling draws
//! without effect. Without noise, which acts in training only, a prediction is deterministic. Root
//! trajectory and velocity factors are not read. On transitions predicted poses become the 149
//! numbers of a frame by forward kinematics; a [`crate::models::transition::Transition`] holds what
//! LRP compares, so the facing angle matters: see `posed_frames`.
//!
//! On windows of rotations (`kind = "harvey2020_rotations"`) the frames of the past that are given,
//! as in that paper 9 before k1, are run through the LSTM, whose first state follows from the first
//! of them; without a past, k1's velocity and contacts are not known and are 0. Training windows
//! are those that have that past. s_p is the root mean square deviation of joints' positions in the
//! training windows; velocities are in units of s_p, and of the root's deviation, over the mean way
//! of a window.
//!
//! Parameters: `state_encoder`, `offset_encoder`, `target_encoder`, `initial_state`, `decoder`
//! (`.0`, `.2`, `.4` as in a `torch.nn.Sequential`), `lstm`, `critics.short`, `critics.long`.

mod config;
mod critic;
mod given;
mod losses;
mod network;
mod rotations;
mod transition_windows;
mod transitions;

pub use config::{HarveyLossWeights, RecurrentConfig};
pub use rotations::{
    Harvey2020Rotations, Harvey2020RotationsConfig, Harvey2020RotationsSettings, KIND as ROTATIONS,
};
pub use transitions::{Harvey2020, Harvey2020Config};
