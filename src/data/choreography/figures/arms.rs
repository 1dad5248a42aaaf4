//! Arm figures: swings, port de bras, waves, circles, reaches, gathering and opening.

use rand::RngExt;
use rand_chacha::ChaCha12Rng;

use crate::data::choreography::score::Score;
use crate::data::choreography::upper_body::ArmPose;

/// What the rest of the body does, for the arms to follow.
#[derive(Debug, Clone, Copy)]
pub enum Cue {
    /// Travel in this direction (forward, left), this many beats a step; the side (+1 left) of the
    /// foot that steps first.
    Travel {
        forward: f64,
        left: f64,
        step: f64,
        first: f64,
    },
    /// A turn to the left (+1) or right (-1).
    Turn { side: f64 },
    /// The weight goes to the left (+1) or right (-1), then to and fro, this many beats each.
    Sway { side: f64, swing: f64 },
    /// Down, then up.
    Rise,
    /// A leg of this side is lifted: forward, sideways or behind.
    Leg { side: f64, forward: f64 },
    /// The trunk goes down and comes up again.
    Bow,
}

/// Kinds of arm figures.
#[derive(Debug, Clone, Copy)]
enum ArmFigure {
    Opposition,
    PortDeBras,
    Wave,
    Circle,
    Reach,
    Gather,
    Scoop,
    Waist,
}

/// Frames that one arm figure takes at most; longer cues get several, to alternate sides.
const LONGEST: f64 = 44.0;

/// Writes arms over the next `beats`: by the style's coupling those that belong to the cue, else
/// drawn freely.
pub fn accompany(score: &mut Score, beats: f64, cue: Cue, rng: &mut ChaCha12Rng) {
    let figure = if rng.random_bool(score.style.coupling) {
        of_cue(cue, score.style.name)
    } else {
        match rng.random_range(0..7u8) {
            0 => ArmFigure::PortDeBras,
            1 => ArmFigure::Wave,
            2 => ArmFigure::Circle,
            3 => ArmFigure::Reach,
            4 => ArmFigure::Gather,
            5 => ArmFigure::Waist,
            _ => ArmFigure::Scoop,
        }
    };
    let rounds = (beats * score.rhythm.beat() / LONGEST).round().max(1.0);
    let (start, beats) = (score.beat, beats / rounds);
    let mut cue = cue;
    for round in 0..rounds as u32 {
        score.beat = start + f64::from(round) * beats;
        write(figure, score, beats, cue);
        cue = mirrored(cue);
    }
    score.beat = start;
}

fn write(figure: ArmFigure, score: &mut Score, beats: f64, cue: Cue) {
    match figure {
        ArmFigure::Opposition => opposition(score, beats, cue),
        ArmFigure::PortDeBras => port_de_bras(score, beats, cue),
        ArmFigure::Wave => wave(score, beats, cue),
        ArmFigure::Circle => circle(score, beats, cue),
        ArmFigure::Reach => reach(score, beats, cue),
        ArmFigure::Gather => gather(score, beats, cue),
        ArmFigure::Scoop => scoop(score, beats),
        ArmFigure::Waist => waist(score, beats, cue),
    }
}

/// The cue of the other side.
fn mirrored(cue: Cue) -> Cue {
    match cue {
        Cue::Travel {
            forward,
            left,
            step,
            first,
        } => Cue::Travel {
            forward,
            left: -left,
            step,
            first: -first,
        },
        Cue::Turn { side } => Cue::Turn { side: -side },
        Cue::Sway { side, swing } => Cue::Sway { side: -side, swing },
        Cue::Leg { side, forward } => Cue::Leg {
            side: -side,
            forward,
        },
        Cue::Rise | Cue::Bow => cue,
    }
}

fn of_cue(cue: Cue, style: &str) -> ArmFigure {
    match cue {
        Cue::Travel { forward, .. } if forward > 0.5 && style != "waltz" => ArmFigure::Opposition,
        Cue::Travel { forward, .. } if forward < -0.5 => ArmFigure::PortDeBras,
        Cue::Travel { .. } if style == "folk" => ArmFigure::Waist,
        Cue::Travel { .. } => ArmFigure::Reach,
        Cue::Turn { .. } => ArmFigure::Gather,
        Cue::Sway { .. } => ArmFigure::Wave,
        Cue::Rise => ArmFigure::Scoop,
        Cue::Leg { .. } => ArmFigure::PortDeBras,
        Cue::Bow => ArmFigure::Circle,
    }
}

/// The side a cue leans to, +1 left.
fn side(cue: Cue) -> f64 {
    match cue {
        Cue::Travel { left, first, .. } => {
            if left.abs() > 0.2 {
                left.signum()
            } else {
                first
            }
        }
        Cue::Turn { side } | Cue::Sway { side, .. } | Cue::Leg { side, .. } => side,
        Cue::Rise | Cue::Bow => 1.0,
    }
}

/// Keys the arm of `side` with `near` and the other with `far`.
fn pair(score: &mut Score, beats: f64, side: f64, near: ArmPose, far: ArmPose) {
    if side > 0.0 {
        score.arms(beats, near, far);
    } else {
        score.arms(beats, far, near);
    }
}

/// Keys the arm of the cue's side with the first pose and the other with the second, each at a
/// share of the figure's beats.
fn keys<const N: usize>(
    score: &mut Score,
    beats: f64,
    cue: Cue,
    poses: [(f64, ArmPose, ArmPose); N],
) {
    for (share, near, far) in poses {
        pair(score, share * beats, side(cue), near, far);
    }
}

/// Each step brings the opposite arm forward.
fn opposition(score: &mut Score, beats: f64, cue: Cue) {
    let (step, first) = match cue {
        Cue::Travel { step, first, .. } => (step, first),
        Cue::Sway { side, swing } => (swing, side),
        _ => (1.0, side(cue)),
    };
    let front = ArmPose::new(62.0, -36.0, 0.0, 38.0, 0.0);
    let back = ArmPose::new(-26.0, -58.0, 0.0, 22.0, 0.0);
    let mut stepping = first;
    let mut beat = step;
    while beat <= beats + 1e-9 {
        pair(score, beat, stepping, back, front);
        stepping = -stepping;
        beat += step;
    }
}

/// Low, before the chest, then open: overhead on the side of the cue.
fn port_de_bras(score: &mut Score, beats: f64, cue: Cue) {
    let (near, far) = match cue {
        Cue::Leg { forward, .. } if forward < -0.5 => (ArmPose::SECOND, ArmPose::CALL),
        Cue::Leg { forward, .. } if forward > 0.5 => (ArmPose::SECOND, ArmPose::HIGH),
        _ => (ArmPose::HIGH, ArmPose::SECOND),
    };
    let poses = [
        (0.3, ArmPose::FIRST, ArmPose::FIRST),
        (0.62, near, far),
        (1.0, ArmPose::LOW, ArmPose::SECOND.moved(6.0, -30.0)),
    ];
    keys(score, beats, cue, poses);
}

/// A wave that runs from one arm to the other, following the weight.
fn wave(score: &mut Score, beats: f64, cue: Cue) {
    let (mut side, swing) = match cue {
        Cue::Sway { side, swing } => (side, swing),
        _ => (side(cue), 1.0),
    };
    let mut beat = 0.0;
    while beat + swing <= beats + 1e-9 {
        let (wing, near) = (
            ArmPose::WING.moved(4.0, -6.0),
            ArmPose::SECOND.moved(0.0, 34.0),
        );
        let far = ArmPose::SECOND.moved(6.0, -32.0);
        pair(score, beat + 0.35 * swing, side, wing, far.moved(0.0, 12.0));
        pair(score, beat + 0.9 * swing, side, near, far);
        side = -side;
        beat += swing;
    }
}

/// Circles before the body: up across the middle, down at the sides.
fn circle(score: &mut Score, beats: f64, cue: Cue) {
    let side = side(cue);
    let lag = match cue {
        Cue::Bow | Cue::Rise => 0.0,
        _ => 0.12,
    };
    let way = [
        ArmPose::LOW,
        ArmPose::ACROSS.moved(-20.0, 0.0),
        ArmPose::HIGH,
        ArmPose::SECOND,
    ];
    for (turn, pose) in way.iter().enumerate() {
        let at = beats * (turn as f64 + 0.8) / 4.0;
        let late = way[turn].towards(way[(turn + 3) % 4], 8.0 * lag / 2.0);
        pair(score, at, side, *pose, late);
    }
}

/// One arm reaches where the body goes, the other balances it.
fn reach(score: &mut Score, beats: f64, cue: Cue) {
    let (near, far) = match cue {
        Cue::Travel { forward, .. } if forward > 0.5 => (ArmPose::CALL, ArmPose::BACK),
        Cue::Travel { .. } | Cue::Sway { .. } => (ArmPose::SKY, ArmPose::SECOND.moved(-8.0, -22.0)),
        _ => (ArmPose::FRONT, ArmPose::BACK.moved(0.0, 20.0)),
    };
    let poses = [
        (0.22, ArmPose::ACROSS, ArmPose::LOW),
        (0.6, near, far),
        (0.8, near.moved(-6.0, 4.0), far.moved(-4.0, 4.0)),
        (1.0, ArmPose::SECOND.moved(4.0, -35.0), ArmPose::LOW),
    ];
    keys(score, beats, cue, poses);
}

/// Open, gather before the chest while turning, open again.
fn gather(score: &mut Score, beats: f64, cue: Cue) {
    let gathered = ArmPose::FIRST.moved(0.0, 6.0);
    let poses = [
        (0.16, ArmPose::SECOND, ArmPose::FIRST),
        (0.4, ArmPose::FIRST, ArmPose::FIRST.moved(8.0, 0.0)),
        (0.68, gathered, gathered),
        (1.0, ArmPose::SECOND.moved(0.0, 12.0), ArmPose::SECOND),
    ];
    keys(score, beats, cue, poses);
}

/// Back and down, then up with the rise, and out.
fn scoop(score: &mut Score, beats: f64) {
    for (share, pose) in [
        (0.3, ArmPose::BACK),
        (0.48, ArmPose::FRONT.moved(-15.0, 10.0)),
        (0.6, ArmPose::SKY),
        (0.82, ArmPose::SECOND),
        (1.0, ArmPose::LOW),
    ] {
        score.arms(share * beats, pose, pose);
    }
}

/// One hand at the waist, the other bent up and swinging.
fn waist(score: &mut Score, beats: f64, cue: Cue) {
    let poses = [
        (0.25, ArmPose::CACTUS, ArmPose::HIP),
        (0.5, ArmPose::SKY, ArmPose::HIP.moved(3.0, 3.0)),
        (0.75, ArmPose::CACTUS.moved(10.0, 5.0), ArmPose::HIP),
        (1.0, ArmPose::SECOND, ArmPose::HIP.moved(4.0, 2.0)),
    ];
    keys(score, beats, cue, poses);
}
