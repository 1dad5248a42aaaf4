//! The measurements of one window behind LRP, AVF and ART (section 4.2, eq. 12 to 16).

use ndarray::{ArrayView2, s};

use crate::evaluation::transitions::{check_window, distance};
use crate::models::ModelError;
use crate::motion::contact::{FOOT_JOINTS, in_contact};
use crate::motion::features::{BODY_POSITIONS, ROOT_POSITION, VELOCITY_FACTORS};
use crate::motion::placement::world_positions;
use crate::motion::velocity_factor::{PARTS, velocity_factors_between};

/// How far one predicted window is from the recorded one.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct WindowScores {
    /// The window's term of eq. 12: mean over frames of `||p~^b - p^b||_2`, the norm of the
    /// 69-number difference, cm.
    pub body_position: f64,
    /// g_v, eq. 14: mean over frames and body parts of `|f~ - f^|`, cm/frame. f~ comes from the
    /// predicted positions.
    pub velocity_factor: f64,
    /// g_r, eq. 16: mean over frames of `||p~^r - p^^r||_2`, cm.
    pub root: f64,
    /// How far foot joints move in the world in the frames in which the recorded ones are in
    /// contact, summed, cm.
    pub foot_travel: f64,
    /// Number of these: foot joints and frames.
    pub foot_contacts: usize,
}

/// Measures a prediction against the recorded window.
///
/// `recorded`: `[N + 1, 154]`, frames k1 to k2, not standardised; its root positions and velocity
/// factors are the ones that were asked for (p^^r and f^). `predicted`: N frames, k1 + 1 to k2. The
/// velocity factors f~ (eq. 1) are those of the differences of predicted positions, p^b and p^r,
/// from frame to frame; the frame before k1 + 1 is the recorded k1. The predicted velocities are
/// not looked at.
///
/// Foot skate is measured where the recorded window has contact labels, from the predicted
/// positions of one frame to the next: the same frames for every model, and no model gains by
/// calling its own feet lifted. A model that sets its feet down at other times than the dancer is
/// charged for that.
///
/// # Errors
///
/// [`ModelError::Shape`], [`ModelError::NoFrames`] or [`ModelError::NotFinite`] where the two do
/// not fit together.
pub fn window_scores(
    recorded: ArrayView2<f64>,
    predicted: ArrayView2<f64>,
) -> Result<WindowScores, ModelError> {
    check_window(recorded, predicted)?;
    let mut sums = WindowScores::default();
    let mut before_world = world_positions(recorded.row(0));
    let mut before = recorded.row(0);
    for (truth, frame) in recorded.rows().into_iter().skip(1).zip(predicted.rows()) {
        let factors = velocity_factors_between(before, frame);
        let wanted = truth.slice(s![VELOCITY_FACTORS]);
        let errors = factors
            .iter()
            .zip(wanted)
            .map(|(x, wanted)| (x - wanted).abs());
        sums.body_position += distance(frame, truth, BODY_POSITIONS);
        sums.velocity_factor += errors.sum::<f64>() / PARTS as f64;
        sums.root += distance(frame, truth, ROOT_POSITION);
        let world = world_positions(frame);
        for (joint, on) in FOOT_JOINTS.into_iter().zip(in_contact(truth)) {
            if on {
                sums.foot_travel += world[joint].distance(before_world[joint]);
                sums.foot_contacts += 1;
            }
        }
        before_world = world;
        before = frame;
    }
    let frames = predicted.nrows() as f64;
    Ok(WindowScores {
        body_position: sums.body_position / frames,
        velocity_factor: sums.velocity_factor / frames,
        root: sums.root / frames,
        ..sums
    })
}

/// Foot skate over the windows of one length: mean distance (cm/frame) that a foot joint moves in a
/// frame in which the recorded one is in contact. None where no window has a contact.
pub fn foot_skate(windows: &[WindowScores]) -> Option<f64> {
    let travel: f64 = windows.iter().map(|window| window.foot_travel).sum();
    let contacts: usize = windows.iter().map(|window| window.foot_contacts).sum();
    (contacts > 0).then(|| travel / contacts as f64)
}

/// Means over the windows of one length: LRP (cm, eq. 12), AVF (share, eq. 13) and ART (share, eq.
/// 15), in this order.
///
/// A window counts for AVF where g_v is strictly below `delta_v` (cm/frame), for ART where g_r is
/// strictly below `delta_r` (cm). No windows give NaN.
pub fn means(windows: &[WindowScores], delta_v: f64, delta_r: f64) -> [f64; 3] {
    let count = windows.len() as f64;
    let share = |hit: &dyn Fn(&WindowScores) -> bool| {
        windows.iter().filter(|window| hit(window)).count() as f64 / count
    };
    let distances = windows.iter().map(|window| window.body_position);
    [
        distances.sum::<f64>() / count,
        share(&|window| window.velocity_factor < delta_v),
        share(&|window| window.root < delta_r),
    ]
}
