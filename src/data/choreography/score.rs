//! The score of one dance: what feet, pelvis, trunk, head and arms are to do when, written by
//! figures one after another.

use glam::DVec2;

use super::body::FOOT_LENGTH;
use super::curve::Track;
use super::feet::{Foot, FootPlan, Placement, Swing};
use super::rhythm::Rhythm;
use super::style::Style;
use super::upper_body::{ArmPose, ArmTrack};

/// Greatest distance between the balls of the feet, cm.
const LONGEST_STRIDE: f64 = 82.0;

/// How far the spine bends at most: forward or back, to a side, round (degrees).
const MOST_BEND: [f64; 3] = [52.0, 34.0, 42.0];

/// A jump, in frames.
#[derive(Debug, Clone, Copy)]
pub struct Jump {
    /// Start of the crouch.
    pub start: f64,
    /// Deepest crouch.
    pub crouch: f64,
    pub takeoff: f64,
    pub landing: f64,
    /// Deepest point after the landing.
    pub absorbed: f64,
    /// Standing again.
    pub end: f64,
}

/// The written dance. Figures append to it; `beat` is where the next figure starts.
#[derive(Debug, Clone)]
pub struct Score {
    pub style: Style,
    pub rhythm: Rhythm,
    /// Whether there is music, so that every figure takes whole beats; without it some take half
    /// ones.
    pub to_music: bool,
    /// Where the score has got to, beats.
    pub beat: f64,
    /// The middle of the dancer's base on the floor (x, z), cm.
    pub centre: DVec2,
    /// The direction of the front about Y, rad, not wrapped.
    pub heading: f64,
    /// The foot that is free to step next.
    pub free: Foot,
    pub feet: [FootPlan; 2],
    pub jumps: Vec<Jump>,
    /// Direction of the pelvis about Y, rad.
    pub facing: Track<1>,
    /// Share of the weight on the right foot, 0..1.
    pub balance: Track<1>,
    /// How far the pelvis sinks below the style's height, cm.
    pub sink: Track<1>,
    /// Tilt of the pelvis: forward, to the left (degrees).
    pub pelvis: Track<2>,
    /// Bend of the spine: forward, to the left, turn to the left (degrees).
    pub spine: Track<3>,
    /// Head over the trunk: nod, tilt to the left, turn to the left (degrees).
    pub head: Track<3>,
    /// Left and right arm.
    pub arms: [ArmTrack; 2],
}

impl Score {
    /// A dancer who stands in the middle, ready to begin.
    pub fn new(style: Style, rhythm: Rhythm, heading: f64, to_music: bool) -> Self {
        let mut score = Self {
            rhythm,
            to_music,
            beat: 0.0,
            centre: DVec2::ZERO,
            heading,
            free: Foot::Right,
            feet: [Foot::Left, Foot::Right].map(|_| {
                FootPlan::standing(Placement {
                    ball: DVec2::ZERO,
                    yaw: 0.0,
                })
            }),
            jumps: Vec::new(),
            facing: Track::new([heading]),
            balance: Track::new([0.5]),
            sink: Track::new([0.0]),
            pelvis: Track::new([0.0; 2]),
            spine: Track::new([0.0; 3]),
            head: Track::new([0.0; 3]),
            arms: [(); 2].map(|()| ArmTrack::new(ArmPose::LOW)),
            style,
        };
        score.feet = [Foot::Left, Foot::Right]
            .map(|foot| FootPlan::standing(score.home(foot, DVec2::ZERO, heading, 0.0)));
        score
    }

    /// The frame of a beat counted from where the score is.
    pub fn frame(&self, beats: f64) -> f64 {
        self.rhythm.frame(self.beat + beats)
    }

    /// Moves on by `beats`; what the figure left alone was held.
    pub fn advance(&mut self, beats: f64) {
        self.beat += beats;
        let frame = self.frame(0.0);
        self.facing.hold(frame);
        self.balance.hold(frame);
        self.sink.hold(frame);
        self.pelvis.hold(frame);
        self.spine.hold(frame);
        self.head.hold(frame);
    }

    /// The floor vector (x, z) of `forward` and `left` (cm) for a dancer who faces `heading`.
    pub fn floor(heading: f64, forward: f64, left: f64) -> DVec2 {
        let (sin, cos) = heading.sin_cos();
        DVec2::new(sin * forward + cos * left, cos * forward - sin * left)
    }

    /// Where a foot stands under a dancer at `centre` who faces `heading`, `wider` cm farther out
    /// than in the style's own stance.
    pub fn home(&self, foot: Foot, centre: DVec2, heading: f64, wider: f64) -> Placement {
        let half = self.style.half_stance + wider;
        let yaw = heading + foot.side() * self.style.turnout;
        let ball = centre
            + Self::floor(heading, 0.0, foot.side() * half)
            + Self::floor(yaw, 0.5 * FOOT_LENGTH, 0.0);
        Placement { ball, yaw }
    }

    /// Steps with `foot` to a placement between two beats counted from here, and shifts the weight:
    /// at the landing the weight is between the feet, half of the step's time later mostly on the
    /// landed foot.
    pub fn step(&mut self, foot: Foot, from: f64, to: f64, placement: Placement, swing: Swing) {
        let (start, end) = (self.frame(from), self.frame(to));
        let placement = self.within_stride(foot, placement);
        let land = self.feet[foot.index()].swing(start, None, end, placement, swing);
        let stance = self.weight_on(foot.other(), 0.86);
        let arrived = self.weight_on(foot, 0.86);
        self.balance.key(start + 0.45 * (land - start), [stance]);
        self.balance.key(land, [0.5 + 0.25 * (arrived - 0.5)]);
        self.balance
            .key(land + 0.4 * (end - start).max(4.0), [arrived]);
        self.free = foot.other();
    }

    /// The placement, nearer to the other foot where it is farther away than a stride.
    fn within_stride(&self, foot: Foot, placement: Placement) -> Placement {
        let other = self.feet[foot.other().index()].placement().ball;
        let ball = other + (placement.ball - other).clamp_length_max(LONGEST_STRIDE);
        Placement { ball, ..placement }
    }

    /// The balance that puts the share `most` of the weight on `foot`.
    pub fn weight_on(&self, foot: Foot, most: f64) -> f64 {
        match foot {
            Foot::Left => 1.0 - most,
            Foot::Right => most,
        }
    }

    /// Turns the front to `heading`, met `beats` from here.
    pub fn face(&mut self, beats: f64, heading: f64) {
        let frame = self.frame(beats);
        self.facing.key(frame, [heading]);
        self.heading = heading;
    }

    /// Keys at `beats` from here: sink of the pelvis, cm.
    pub fn sink(&mut self, beats: f64, depth: f64) {
        let frame = self.frame(beats);
        self.sink.key(frame, [depth]);
    }

    /// Keys the spine at `beats` from here (degrees: forward, left, turn to the left), scaled by
    /// the style and kept within what a spine does.
    pub fn spine(&mut self, beats: f64, bend: [f64; 3]) {
        let frame = self.frame(beats);
        let scale = 2.5 * self.style.trunk;
        let bend = std::array::from_fn(|k| MOST_BEND[k] * (scale * bend[k] / MOST_BEND[k]).tanh());
        self.spine.key(frame, bend);
    }

    /// Keys the tilt of the pelvis at `beats` from here (degrees: forward, left), scaled by the
    /// style.
    pub fn tilt(&mut self, beats: f64, tilt: [f64; 2]) {
        let frame = self.frame(beats);
        let scale = 1.6 * self.style.trunk;
        self.pelvis.key(frame, tilt.map(|angle| scale * angle));
    }

    /// Keys the head at `beats` from here (degrees: nod, left, turn to the left).
    pub fn look(&mut self, beats: f64, turn: [f64; 3]) {
        let frame = self.frame(beats);
        self.head.key(frame, turn);
    }

    /// Keys both arms at `beats` from here.
    pub fn arms(&mut self, beats: f64, left: ArmPose, right: ArmPose) {
        let frame = self.frame(beats);
        let reach = self.style.arms;
        self.arms[0].key(frame, left.scaled(reach));
        self.arms[1].key(frame, right.scaled(reach));
    }
}
