//! The foot plan: where each foot is planted, and how it swings from one place to the next.
//!
//! A foot is given by the ball of the foot (the ToeBase joint), its direction about Y and its
//! pitch, positive with the heel raised. While planted the ball stays where it is; the heel rises,
//! lowers and turns about it.

use glam::{DQuat, DVec2, DVec3, EulerRot};

use super::body::{ANKLE_RISE, BALL_HEIGHT, FOOT_LENGTH};
use super::curve::Track;

/// Shortest swing in frames.
const SHORTEST_SWING: f64 = 5.0;
/// Frames that a heel takes to come down after the ball has landed.
const SETTLE: f64 = 3.0;
/// Least mean speed (cm/frame) of a heel that rises, lowers or turns, and of a foot that steps: a
/// slow dancer waits, then moves.
const BRISK: f64 = 1.05;
/// Smallest turn (rad) worth a pivot.
const SMALLEST_PIVOT: f64 = 0.15;
/// Changes of a foot's pose over a frame below this (cm, rad) are none.
const STILL: f64 = 1e-6;

/// A foot of the dancer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Foot {
    Left,
    Right,
}

impl Foot {
    /// 0 for left, 1 for right.
    pub fn index(self) -> usize {
        match self {
            Foot::Left => 0,
            Foot::Right => 1,
        }
    }

    /// +1 for left, -1 for right: the sign of its side along X.
    pub fn side(self) -> f64 {
        match self {
            Foot::Left => 1.0,
            Foot::Right => -1.0,
        }
    }

    pub fn other(self) -> Self {
        match self {
            Foot::Left => Foot::Right,
            Foot::Right => Foot::Left,
        }
    }
}

/// Where a foot is to be planted: its ball on the floor (x, z in cm) and its direction about Y,
/// rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    pub ball: DVec2,
    pub yaw: f64,
}

/// The pose of a foot in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootPose {
    /// Ball of the foot, cm.
    pub ball: DVec3,
    pub yaw: f64,
    /// Positive with the heel raised, rad.
    pub pitch: f64,
    pub planted: bool,
    /// Frames to the nearest planted frame, 0 while planted.
    pub from_floor: f64,
}

impl FootPose {
    /// Rotation of the foot in the world.
    pub fn rotation(&self) -> DQuat {
        DQuat::from_euler(EulerRot::YXZ, self.yaw, self.pitch, 0.0)
    }

    /// Where the ankle is, cm.
    pub fn ankle(&self) -> DVec3 {
        self.ball - self.rotation() * DVec3::new(0.0, -ANKLE_RISE, FOOT_LENGTH)
    }

    /// Whether nothing of the foot moved since `before`.
    fn unmoved(&self, before: &Self) -> bool {
        self.ball.distance(before.ball) < STILL
            && (self.yaw - before.yaw).abs() < STILL
            && (self.pitch - before.pitch).abs() < STILL
    }
}

/// A point that a swinging foot passes.
#[derive(Debug, Clone, Copy)]
pub struct Via {
    /// Share of the swing's time, inside 0..1.
    pub at: f64,
    /// Ball of the foot, cm.
    pub ball: DVec3,
    pub yaw: f64,
    pub pitch: f64,
}

/// How a foot leaves the floor, swings and lands; angles in rad, lengths in cm.
#[derive(Debug, Clone)]
pub struct Swing {
    /// Pitch at which the ball leaves the floor.
    pub push: f64,
    /// Pitch at which the ball lands.
    pub landing: f64,
    /// Height of the ball half way, where no points are given.
    pub lift: f64,
    /// Sideways bulge of the path (x, z), where no points are given.
    pub detour: DVec2,
    pub vias: Vec<Via>,
}

impl Swing {
    /// A step that lifts the ball by `lift` cm and lands ball first.
    pub fn step(lift: f64) -> Self {
        Self {
            push: 35f64.to_radians(),
            landing: 15f64.to_radians(),
            lift,
            detour: DVec2::ZERO,
            vias: Vec::new(),
        }
    }

    pub fn around(mut self, detour: DVec2) -> Self {
        self.detour = detour;
        self
    }

    pub fn through(mut self, vias: Vec<Via>) -> Self {
        self.vias = vias;
        self
    }
}

/// One planting of a foot. Its yaw and pitch follow a curve; the ball stays.
#[derive(Debug, Clone)]
struct Stance {
    ball: DVec2,
    start: f64,
    /// The last frame on the floor.
    end: f64,
    /// The last frame with a key so far.
    busy: f64,
    pose: Track<2>,
    /// How the foot got here.
    arrival: Swing,
}

/// The plantings of one foot in the order of time.
#[derive(Debug, Clone)]
pub struct FootPlan {
    stances: Vec<Stance>,
}

impl FootPlan {
    /// A foot that stands at `placement` from frame 0.
    pub fn standing(placement: Placement) -> Self {
        Self {
            stances: vec![Stance {
                ball: placement.ball,
                start: 0.0,
                end: f64::INFINITY,
                busy: 0.0,
                pose: Track::new([placement.yaw, 0.0]),
                arrival: Swing::step(0.0),
            }],
        }
    }

    /// Where the foot stands, or lands next.
    pub fn placement(&self) -> Placement {
        let stance = self.last();
        Placement {
            ball: stance.ball,
            yaw: stance.pose.last()[0],
        }
    }

    fn last(&self) -> &Stance {
        // A plan is made with one stance and only ever grows.
        &self.stances[self.stances.len() - 1]
    }

    fn last_mut(&mut self) -> &mut Stance {
        let last = self.stances.len() - 1;
        &mut self.stances[last]
    }

    /// Turns the planted foot about its ball and raises its heel: the pose is met at `to`, begun at
    /// `from` or as much later as a brisk movement allows. Frames; angles in rad.
    pub fn roll(&mut self, from: f64, to: f64, yaw: f64, pitch: f64) {
        let stance = self.last_mut();
        let [yaw_before, pitch_before] = stance.pose.last();
        let heel = FOOT_LENGTH.hypot(ANKLE_RISE);
        let travel = heel * (yaw - yaw_before).hypot(pitch - pitch_before);
        let from = from.max(to - (travel / BRISK).ceil()).max(stance.busy);
        let to = to.max(from + 2.0);
        stance.pose.hold(from);
        stance.pose.key(to, [yaw, pitch]);
        stance.busy = to;
    }

    /// Turns the planted foot about its ball to `yaw`, with the heel just off the floor.
    pub fn pivot(&mut self, from: f64, to: f64, yaw: f64) {
        let turn = yaw - self.placement().yaw;
        if turn.abs() < SMALLEST_PIVOT {
            return;
        }
        let from = from.max(to - (FOOT_LENGTH * turn.abs() / BRISK).ceil());
        let from = from.max(self.last().busy);
        let to = to.max(from + 4.0);
        let middle = (0.5 * (from + to)).round();
        let half = 0.5 * (self.placement().yaw + yaw);
        self.roll(from, middle, half, 10f64.to_radians());
        self.roll(middle, to, yaw, 0.0);
    }

    /// Swings the foot to `placement`: the heel starts to rise at frame `from`, the ball leaves the
    /// floor at `off` (where the roll over the ball decides if `None`) and lands at `to`; a short
    /// step begins later. Returns the frame of landing, later than `to` where time was too short.
    pub fn swing(
        &mut self,
        from: f64,
        off: Option<f64>,
        to: f64,
        placement: Placement,
        swing: Swing,
    ) -> f64 {
        let stance = self.last_mut();
        let travel = stance.ball.distance(placement.ball) + 2.0 * swing.lift;
        let longest = if swing.vias.is_empty() && off.is_none() {
            (travel / BRISK).ceil()
        } else {
            f64::INFINITY
        };
        let from = from.max(to - longest).max(stance.busy);
        let roll = ((to - from) * 0.25).round().clamp(2.0, 6.0);
        let off = off.unwrap_or(from + roll).max(from + 2.0);
        let land = to.max(off + SHORTEST_SWING);
        let [yaw, _] = stance.pose.last();
        stance.pose.hold(from);
        stance.pose.key(off, [yaw, swing.push]);
        stance.end = off;
        let mut pose = Track::new([placement.yaw, swing.landing]);
        pose.key(land, [placement.yaw, swing.landing]);
        pose.key(land + SETTLE, [placement.yaw, 0.0]);
        self.stances.push(Stance {
            ball: placement.ball,
            start: land,
            end: f64::INFINITY,
            busy: land + SETTLE,
            pose,
            arrival: swing,
        });
        land
    }

    /// The foot in frames `0..frames`; `flight` is how high the body flies in each of them, cm.
    pub fn sample(&self, frames: usize, flight: &[f64]) -> Vec<FootPose> {
        let mut stance = 0;
        (0..frames)
            .map(|frame| {
                let t = frame as f64;
                while stance + 1 < self.stances.len() && t >= self.stances[stance + 1].start {
                    stance += 1;
                }
                let here = &self.stances[stance];
                if t <= here.end {
                    let [yaw, pitch] = here.pose.at(t);
                    let ball = DVec3::new(here.ball.x, BALL_HEIGHT, here.ball.y);
                    return FootPose {
                        ball,
                        yaw,
                        pitch,
                        planted: true,
                        from_floor: 0.0,
                    };
                }
                let mut pose = between(here, &self.stances[stance + 1], t);
                pose.ball.y += flight.get(frame).copied().unwrap_or(0.0);
                pose
            })
            .collect()
    }
}

/// The foot on its way from one stance to the next.
fn between(from: &Stance, to: &Stance, t: f64) -> FootPose {
    let swing = &to.arrival;
    let (start, duration) = (from.end, to.start - from.end);
    let (yaw_from, yaw_to) = (from.pose.last()[0], to.pose.at(to.start)[0]);
    let mut path = Track::new([from.ball.x, BALL_HEIGHT, from.ball.y, yaw_from, swing.push]);
    if swing.vias.is_empty() {
        let middle = 0.5 * (from.ball + to.ball) + swing.detour;
        let height = BALL_HEIGHT + swing.lift;
        let (yaw, pitch) = (
            0.5 * (yaw_from + yaw_to),
            0.5 * (swing.push + swing.landing),
        );
        path.key(0.5 * duration, [middle.x, height, middle.y, yaw, pitch]);
    }
    for via in &swing.vias {
        let key = [via.ball.x, via.ball.y, via.ball.z, via.yaw, via.pitch];
        path.key(via.at * duration, key);
    }
    path.key(
        duration,
        [to.ball.x, BALL_HEIGHT, to.ball.y, yaw_to, swing.landing],
    );
    let [x, y, z, yaw, pitch] = path.at(t - start);
    FootPose {
        ball: DVec3::new(x, y, z),
        yaw,
        pitch,
        planted: false,
        from_floor: (t - start).min(to.start - t),
    }
}

/// The true contacts of one foot: for each frame whether the heel (LeftFoot, RightFoot) and the
/// ball (ToeBase) were held still on the floor since the frame before. The first frame counts what
/// the second does.
pub fn contacts(poses: &[FootPose]) -> Vec<[bool; 2]> {
    let mut labels: Vec<[bool; 2]> = poses
        .windows(2)
        .map(|pair| {
            let ball = pair[0].planted && pair[1].planted;
            [ball && pair[1].unmoved(&pair[0]), ball]
        })
        .collect();
    let first = labels.first().copied().unwrap_or([true; 2]);
    labels.insert(0, first);
    labels
}
