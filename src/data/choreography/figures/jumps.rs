//! Jumps from two feet, in place or turning, and leaps from one foot to the other.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;
use rand::RngExt;
use rand_chacha::ChaCha12Rng;

use super::arms::{Cue, accompany};
use super::{draw_direction, draw_side};
use crate::data::choreography::body::BALL_HEIGHT;
use crate::data::choreography::feet::{Foot, Swing, Via};
use crate::data::choreography::score::{Jump, Score};

/// Writes one jumping figure.
pub fn perform(score: &mut Score, rng: &mut ChaCha12Rng) {
    if rng.random_bool(0.6) {
        jump(score, rng)
    } else {
        leap(score, rng)
    }
}

/// Crouch, both feet off the floor, perhaps with a quarter or half turn, landing on both.
fn jump(score: &mut Score, rng: &mut ChaCha12Rng) {
    let beats = if score.rhythm.beat() < 22.0 { 4.0 } else { 3.0 };
    let turn = FRAC_PI_2 * f64::from(rng.random_range(-2i8..=2)) * 0.75;
    let flight = rng.random_range(9.0..14.0f64).round();
    let tuck = rng.random_range(0.0..14.0);
    let takeoff = score.frame(0.45 * beats);
    let landing = takeoff + flight;
    accompany(score, beats, Cue::Rise, rng);
    score.balance.key(score.frame(0.4), [0.5]);
    let length = 22.0;
    let ways = [(1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
    let (forward, left) = draw_direction(score, &ways, length, rng);
    score.facing.key(takeoff - 4.0, [score.heading]);
    score.centre += Score::floor(score.heading, forward * length, left * length);
    score.heading += turn;
    score.facing.key(landing + 2.0, [score.heading]);
    for foot in [Foot::Left, Foot::Right] {
        let mut placement = score.home(foot, score.centre, score.heading, 2.0);
        placement.yaw = score.heading + foot.side() * score.style.turnout;
        let swing = Swing {
            push: 48f64.to_radians(),
            landing: 32f64.to_radians(),
            ..Swing::step(tuck)
        };
        score.feet[foot.index()].swing(takeoff - 5.0, Some(takeoff), landing, placement, swing);
    }
    score.jumps.push(Jump {
        start: score.frame(0.05),
        crouch: takeoff - 7.0,
        takeoff,
        landing,
        absorbed: landing + 6.0,
        end: (landing + 16.0).max(score.frame(beats) - 2.0),
    });
    score.spine(0.25 * beats, [16.0, 0.0, -0.08 * turn.to_degrees()]);
    score.tilt(0.25 * beats, [14.0, 0.0]);
    score.look(0.25 * beats, [-8.0, 0.0, 0.0]);
    score.tilt(0.47 * beats, [0.0; 2]);
    score.spine(0.52 * beats, [-5.0, 0.0, 0.05 * turn.to_degrees()]);
    score.spine(0.75 * beats, [12.0, 0.0, 0.0]);
    score.tilt(0.75 * beats, [8.0, 0.0]);
    score.look(0.7 * beats, [0.0; 3]);
    score.spine(beats, [0.0; 3]);
    score.tilt(beats, [0.0; 2]);
    score.balance.key(landing + 8.0, [0.5]);
    score.sink(0.0, 0.0);
    score.sink(beats, 0.0);
    score.advance(beats);
}

/// A step, a leap from the stepped foot onto the other, and a close.
fn leap(score: &mut Score, rng: &mut ChaCha12Rng) {
    let beats = if score.rhythm.beat() < 22.0 { 4.0 } else { 3.0 };
    let unit = beats / 4.0;
    let run = 0.85 * score.style.step;
    let span = run + 26.0;
    let ways = [(1.0, 0.0), (0.8, 0.5), (0.8, -0.5)];
    let (forward, left) = draw_direction(score, &ways, run + span, rng);
    let away = score.centre + Score::floor(score.heading, forward * 130.0, left * 130.0);
    if away.length() > 200.0 {
        return jump(score, rng);
    }
    let heading = score.heading;
    let push = score.free;
    let lead = push.other();
    let side = draw_side(rng);
    let cue = Cue::Travel {
        forward,
        left,
        step: unit,
        first: push.side(),
    };
    accompany(score, beats, cue, rng);
    score.centre += Score::floor(heading, forward * run, left * run);
    let placement = score.home(push, score.centre, heading, -3.0);
    score.step(push, 0.0, 0.95 * unit, placement, Swing::step(6.0));
    let flight = rng.random_range(10.0..14.0f64).round();
    let takeoff = score.frame(2.0 * unit).max(score.frame(0.95 * unit) + 12.0);
    let landing = takeoff + flight;
    let from = score.centre;
    score.centre += Score::floor(heading, forward * span, left * span);
    let placement = score.home(lead, score.centre, heading, -3.0);
    let ahead = from + 0.75 * (placement.ball - from) + Score::floor(heading, 16.0, 0.0);
    let reach = Via {
        at: 0.62,
        ball: DVec3::new(ahead.x, BALL_HEIGHT + rng.random_range(14.0..26.0), ahead.y),
        yaw: placement.yaw,
        pitch: 30f64.to_radians(),
    };
    let swing = Swing {
        landing: 25f64.to_radians(),
        ..Swing::step(0.0).through(vec![reach])
    };
    score.feet[lead.index()].swing(takeoff - 7.0, None, landing, placement, swing);
    // The pushing leg stays behind and closes after the landing.
    let close = score.home(push, score.centre, heading, 0.0);
    let off = score.feet[push.index()].placement();
    let trail = 0.45 * off.ball + 0.55 * close.ball - Score::floor(heading, 24.0, 0.0);
    let behind = Via {
        at: 0.5,
        ball: DVec3::new(trail.x, BALL_HEIGHT + 24.0, trail.y),
        yaw: close.yaw,
        pitch: 75f64.to_radians(),
    };
    let closed = landing + (0.9 * unit * score.rhythm.beat()).max(11.0);
    let swing = Swing {
        push: 48f64.to_radians(),
        ..Swing::step(0.0).through(vec![behind])
    };
    score.feet[push.index()].swing(takeoff - 5.0, Some(takeoff), closed, close, swing);
    score.jumps.push(Jump {
        start: score.frame(0.9 * unit),
        crouch: takeoff - 6.0,
        takeoff,
        landing,
        absorbed: landing + 6.0,
        end: (landing + 16.0).max(closed + 4.0),
    });
    let (on_push, on_lead) = (score.weight_on(push, 0.95), score.weight_on(lead, 0.95));
    score.balance.key(takeoff - 3.0, [on_push]);
    score.balance.key(landing + 2.0, [on_lead]);
    let weight = score.weight_on(lead, 0.85);
    score.balance.key(closed - 2.0, [weight]);
    score.balance.key(closed + 5.0, [0.5]);
    score.spine(1.6 * unit, [10.0, 0.0, 6.0 * side]);
    score.tilt(1.6 * unit, [6.0, 0.0]);
    score.spine(2.4 * unit, [-8.0, 0.0, 12.0 * lead.side()]);
    score.tilt(2.4 * unit, [3.0, 0.0]);
    score.spine(3.2 * unit, [8.0, 0.0, 0.0]);
    score.look(2.2 * unit, [-10.0, 0.0, 0.0]);
    score.look(beats, [0.0; 3]);
    score.spine(beats, [0.0; 3]);
    score.tilt(beats, [0.0; 2]);
    score.sink(0.0, 0.0);
    let rest = (closed - score.frame(0.0)) / score.rhythm.beat();
    let beats = beats.max(match score.to_music {
        true => (rest + 0.5).ceil(),
        false => (2.0 * rest).ceil() / 2.0 + 0.5,
    });
    score.sink(beats, 0.0);
    score.free = push;
    score.advance(beats);
}
