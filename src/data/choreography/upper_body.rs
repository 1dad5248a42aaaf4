//! Arms as a dancer thinks of them: where the upper arm points, how the elbow bends, how the wrist
//! trails.

use glam::{DQuat, DVec3};

use super::curve::Track;

/// Frames by which the elbow trails the shoulder, and the wrist the elbow.
const TRAIL: f64 = 2.0;

/// One arm, angles in degrees, mirrored for the right arm. All zero: stretched to the side, elbow
/// creases forward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmPose {
    /// Upper arm forward (+90 straight ahead, more across the chest, negative behind).
    pub forward: f64,
    /// Upper arm up (-90 hanging, +90 overhead).
    pub up: f64,
    /// Twist of the upper arm: at +90 the forearm bends down, at -90 up.
    pub twist: f64,
    /// Bend of the elbow, 0..150.
    pub elbow: f64,
    /// Bend of the wrist, positive with the palm.
    pub wrist: f64,
}

impl ArmPose {
    /// Hanging, softly rounded.
    pub const LOW: Self = Self::new(12.0, -72.0, 0.0, 22.0, 10.0);
    /// Rounded before the chest.
    pub const FIRST: Self = Self::new(58.0, -22.0, 8.0, 62.0, 15.0);
    /// Open to the side.
    pub const SECOND: Self = Self::new(14.0, -8.0, 5.0, 24.0, -8.0);
    /// Rounded overhead.
    pub const HIGH: Self = Self::new(22.0, 72.0, -72.0, 38.0, 12.0);
    /// Stretched forward.
    pub const FRONT: Self = Self::new(80.0, 6.0, 0.0, 10.0, -8.0);
    /// Stretched forward and up.
    pub const CALL: Self = Self::new(48.0, 50.0, -15.0, 10.0, -10.0);
    /// Stretched up and out.
    pub const SKY: Self = Self::new(8.0, 62.0, -30.0, 12.0, -15.0);
    /// Down and behind.
    pub const BACK: Self = Self::new(-38.0, -52.0, 0.0, 12.0, -20.0);
    /// Across the chest.
    pub const ACROSS: Self = Self::new(98.0, -14.0, 5.0, 58.0, 10.0);
    /// Hand at the waist, elbow out.
    pub const HIP: Self = Self::new(-18.0, -50.0, 70.0, 82.0, 20.0);
    /// Elbow high, forearm hanging.
    pub const WING: Self = Self::new(10.0, 14.0, 65.0, 62.0, 25.0);
    /// Elbow to the side, forearm up.
    pub const CACTUS: Self = Self::new(12.0, 6.0, -70.0, 82.0, -15.0);

    pub const fn new(forward: f64, up: f64, twist: f64, elbow: f64, wrist: f64) -> Self {
        Self {
            forward,
            up,
            twist,
            elbow,
            wrist,
        }
    }

    fn values(self) -> [f64; 5] {
        [self.forward, self.up, self.twist, self.elbow, self.wrist]
    }

    pub fn from_values([forward, up, twist, elbow, wrist]: [f64; 5]) -> Self {
        Self::new(forward, up, twist, elbow, wrist)
    }

    /// The share `share` of the way from here to `other`.
    pub fn towards(self, other: Self, share: f64) -> Self {
        let (from, to) = (self.values(), other.values());
        Self::from_values(std::array::from_fn(|k| from[k] + share * (to[k] - from[k])))
    }

    /// This pose with the arm moved by the given degrees.
    pub fn moved(self, forward: f64, up: f64) -> Self {
        Self {
            forward: self.forward + forward,
            up: self.up + up,
            ..self
        }
    }

    /// The pose done with less reach: nearer to hanging.
    pub fn scaled(self, reach: f64) -> Self {
        Self::LOW.towards(self, reach)
    }

    /// Local rotations of Shoulder, Arm, ForeArm and Hand; `side` is +1 for the left arm.
    pub fn rotations(self, side: f64) -> [DQuat; 4] {
        // A rotation mirrored in the plane X = 0 keeps its X component and changes the sign of the
        // others.
        let turn = |x: f64, y: f64, z: f64| {
            DQuat::from_scaled_axis(DVec3::new(x, side * y, side * z) * 1f64.to_radians())
        };
        let girdle_up = 0.18 * (self.up + 25.0);
        let girdle_forward = 0.16 * (self.forward - 10.0);
        let girdle = turn(0.0, -girdle_forward, girdle_up);
        let arm = turn(0.0, -(self.forward - girdle_forward), self.up - girdle_up)
            * turn(self.twist, 0.0, 0.0);
        let forearm = turn(0.25 * self.twist, 0.0, 0.0) * turn(0.0, -self.elbow.max(3.0), 0.0);
        let hand = turn(0.0, 0.0, -self.wrist);
        [girdle, arm, forearm, hand]
    }
}

/// The keys of one arm. Forearm and hand trail the upper arm by a few frames, as in a whip.
#[derive(Debug, Clone)]
pub struct ArmTrack {
    track: Track<5>,
}

impl ArmTrack {
    pub fn new(pose: ArmPose) -> Self {
        Self {
            track: Track::new(pose.values()),
        }
    }

    pub fn key(&mut self, frame: f64, pose: ArmPose) {
        self.track.key(frame, pose.values());
    }

    /// The values of [`ArmPose`] in frames `0..frames`, before smoothing.
    pub fn sample(&self, frames: usize) -> Vec<[f64; 5]> {
        (0..frames)
            .map(|frame| {
                let t = frame as f64;
                let (upper, fore, hand) = (
                    self.track.at(t),
                    self.track.at(t - TRAIL),
                    self.track.at(t - 2.0 * TRAIL),
                );
                [upper[0], upper[1], upper[2], fore[3], hand[4]]
            })
            .collect()
    }
}
