//! The path of the pelvis: over its supports, as high as the legs reach, ballistic in flight.

use glam::{DQuat, DVec2, DVec3, EulerRot};

use super::body::{FOOT_LENGTH, HIP_DROP, HIP_HALF_WIDTH, SHIN, STANDING, THIGH};
use super::curve::{hermite, smooth};
use super::feet::FootPose;
use super::score::{Jump, Score};

/// Gravity, cm/frame^2 at 30 frames a second.
const GRAVITY: f64 = 981.0 / 900.0;
/// Share of the leg's length to which a planted leg stretches.
pub const STRETCH: f64 = 0.993;
/// Frames by which the limit of the height looks ahead and back; the smoothing's kernel reaches as
/// far.
const LOOK: usize = 6;
/// Width (cm) over which the wished height gives way to the limit.
const BLEND: f64 = 1.0;
/// Frames from the floor within which a swinging leg limits the height too.
const NEAR_FLOOR: f64 = 3.0;

/// Position (cm) and rotation of the pelvis in one frame.
#[derive(Debug, Clone, Copy)]
pub struct Pelvis {
    pub position: DVec3,
    pub rotation: DQuat,
    /// Direction of its front about Y, rad.
    pub yaw: f64,
}

impl Pelvis {
    /// Where the hip joint of this side (+1 left) is, cm.
    pub fn hip(&self, side: f64) -> DVec3 {
        self.position + self.rotation * DVec3::new(side * HIP_HALF_WIDTH, -HIP_DROP, 0.0)
    }
}

/// How high the body flies over take-off and landing in frames `0..frames`, cm.
pub fn flight(jumps: &[Jump], frames: usize) -> Vec<f64> {
    (0..frames)
        .map(|frame| {
            let t = frame as f64;
            jumps
                .iter()
                .filter(|jump| jump.takeoff < t && t < jump.landing)
                .map(|jump| 0.5 * GRAVITY * (t - jump.takeoff) * (jump.landing - t))
                .sum()
        })
        .collect()
}

/// The pelvis in every frame of the sampled feet.
pub fn path(score: &Score, feet: &[Vec<FootPose>; 2]) -> Vec<Pelvis> {
    let frames = feet[0].len();
    let yaw = yaws(score, feet);
    let tilt = smooth(&score.pelvis.sample(frames), 3.0);
    let floor = supports(score, feet);
    let wish: Vec<[f64; 1]> = score
        .sink
        .sample(frames)
        .iter()
        .map(|[sink]| [STANDING - score.style.bend - sink])
        .collect();
    let wish = smooth(&wish, 2.0);
    let mut pelvis: Vec<Pelvis> = (0..frames)
        .map(|frame| {
            let [forward, left] = tilt[frame].map(f64::to_radians);
            Pelvis {
                position: DVec3::new(floor[frame][0], wish[frame][0], floor[frame][1]),
                rotation: DQuat::from_euler(EulerRot::YXZ, yaw[frame], forward, -left),
                yaw: yaw[frame],
            }
        })
        .collect();
    let limits_within = |near: f64, pelvis: &[Pelvis]| -> Vec<f64> {
        (0..frames)
            .map(|frame| limit(&pelvis[frame], [&feet[0][frame], &feet[1][frame]], near))
            .collect()
    };
    let limits = limits_within(NEAR_FLOOR, &pelvis);
    let lowest: Vec<[f64; 1]> = (0..frames)
        .map(|frame| {
            let around = &limits[frame.saturating_sub(LOOK)..(frame + LOOK + 1).min(frames)];
            [around.iter().copied().fold(2.0 * STANDING, f64::min)]
        })
        .collect();
    for (pelvis, [limit]) in pelvis.iter_mut().zip(smooth(&lowest, LOOK as f64 / 3.0)) {
        let wish = pelvis.position.y;
        // A soft minimum, never above either.
        pelvis.position.y = wish.min(limit) - BLEND * (-(wish - limit).abs() / BLEND).exp().ln_1p();
    }
    let planted = limits_within(0.0, &pelvis);
    for jump in &score.jumps {
        fly(jump, &planted, &mut pelvis);
    }
    pelvis
}

/// Direction of the pelvis: the score's, turned a little with the hip whose foot is ahead.
fn yaws(score: &Score, feet: &[Vec<FootPose>; 2]) -> Vec<f64> {
    let frames = feet[0].len();
    let facing = smooth(&score.facing.sample(frames), 3.0);
    let twisted: Vec<[f64; 1]> = (0..frames)
        .map(|frame| {
            let apart = middle(&feet[0][frame]) - middle(&feet[1][frame]);
            let ahead = apart.dot(Score::floor(facing[frame][0], 1.0, 0.0));
            [facing[frame][0] - 0.22 * (ahead / 60.0).tanh()]
        })
        .collect();
    smooth(&twisted, 2.0).iter().map(|[yaw]| *yaw).collect()
}

/// The middle of a foot on the floor (x, z), cm.
fn middle(foot: &FootPose) -> DVec2 {
    DVec2::new(foot.ball.x, foot.ball.z) - Score::floor(foot.yaw, 0.5 * FOOT_LENGTH, 0.0)
}

/// Where the pelvis is over the floor (x, z): between the feet by their share of the weight.
fn supports(score: &Score, feet: &[Vec<FootPose>; 2]) -> Vec<[f64; 2]> {
    let frames = feet[0].len();
    let balance = smooth(&score.balance.sample(frames), 2.0);
    let support: Vec<[f64; 2]> = (0..frames)
        .map(|frame| {
            let (left, right) = (middle(&feet[0][frame]), middle(&feet[1][frame]));
            left.lerp(right, balance[frame][0]).to_array()
        })
        .collect();
    smooth(&support, 2.0 + 0.1 * score.rhythm.beat())
}

/// The greatest height of the root at which the legs reach whose feet are on the floor or are so
/// within `near` frames, cm; infinite with both in the air.
fn limit(pelvis: &Pelvis, feet: [&FootPose; 2], near: f64) -> f64 {
    let reach = STRETCH * (THIGH + SHIN);
    [1.0, -1.0]
        .iter()
        .zip(feet)
        .filter(|(_, foot)| foot.from_floor <= near)
        .map(|(side, foot)| {
            let (hip, ankle) = (pelvis.hip(*side), foot.ankle());
            let across = DVec2::new(hip.x - ankle.x, hip.z - ankle.z).length();
            let rise = (reach * reach - across * across).max(0.0).sqrt();
            ankle.y + rise + pelvis.position.y - hip.y
        })
        .fold(f64::INFINITY, f64::min)
}

/// Replaces the height over one jump: crouch, stretch, ballistic flight, landing, recovery, never
/// above what the planted legs reach.
fn fly(jump: &Jump, limits: &[f64], pelvis: &mut [Pelvis]) {
    let frames = pelvis.len();
    let height = |frame: f64| {
        limits
            .get(frame as usize)
            .copied()
            .filter(|y| y.is_finite())
    };
    let Some(takeoff) = height(jump.takeoff) else {
        return;
    };
    // A clip may end in flight.
    let landing = height(jump.landing).unwrap_or(takeoff);
    let span = jump.landing - jump.takeoff;
    let mean = (landing - takeoff) / span;
    let (up, down) = (mean + 0.5 * GRAVITY * span, mean - 0.5 * GRAVITY * span);
    let ground = |frame: f64| {
        let at = (frame as usize).min(frames - 1);
        let before = at.saturating_sub(1);
        (
            pelvis[at].position.y,
            pelvis[at].position.y - pelvis[before].position.y,
        )
    };
    let (start, end) = (ground(jump.start), ground(jump.end));
    let crouch = takeoff - 0.46 * up * (jump.takeoff - jump.crouch);
    let absorbed = landing + 0.42 * down * (jump.absorbed - jump.landing);
    let keys = [
        (jump.start, start.0, start.1),
        (jump.crouch, crouch, 0.0),
        (jump.takeoff, takeoff, up),
        (jump.landing, landing, down),
        (jump.absorbed, absorbed, 0.0),
        (jump.end, end.0, end.1),
    ];
    for pair in keys.windows(2) {
        let ((t0, y0, v0), (t1, y1, v1)) = (pair[0], pair[1]);
        let last = (t1 as usize).min(frames - 1);
        for (frame, (pelvis, limit)) in pelvis
            .iter_mut()
            .zip(limits)
            .enumerate()
            .take(last + 1)
            .skip(t0 as usize)
        {
            let u = (frame as f64 - t0) / (t1 - t0);
            let height = hermite(u, y0, y1, v0 * (t1 - t0), v1 * (t1 - t0));
            pelvis.position.y = height.min(*limit);
        }
    }
}
