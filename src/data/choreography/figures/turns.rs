//! Turns: round in place with small steps, three-step turns that travel, pirouettes on one foot.

use std::f64::consts::{FRAC_PI_3, PI, TAU};

use glam::{DVec2, DVec3};
use rand::RngExt;
use rand_chacha::ChaCha12Rng;

use super::arms::{Cue, accompany};
use super::draw_side;
use crate::data::choreography::curve::ease;
use crate::data::choreography::feet::{Swing, Via};
use crate::data::choreography::score::Score;

/// Writes one turning figure.
pub fn perform(score: &mut Score, rng: &mut ChaCha12Rng) {
    let ahead = score.centre + Score::floor(score.heading, 0.0, 140.0 * score.free.side());
    match rng.random_range(0..10u8) {
        0..4 => walk_around(score, rng),
        4..7 if ahead.length() < 180.0 => three_step(score, rng),
        _ => pirouette(score, rng),
    }
}

/// Steps that turn the dancer round by a half to a full turn, nearly in place.
fn walk_around(score: &mut Score, rng: &mut ChaCha12Rng) {
    let steps = score.style.bar as usize;
    let turn = draw_side(rng) * rng.random_range(0.9..1.25) * FRAC_PI_3;
    step_round(score, steps, turn, rng);
}

/// Turns towards the middle of the floor, stepping.
pub fn to_the_middle(score: &mut Score, rng: &mut ChaCha12Rng) {
    let steps = score.style.bar as usize;
    let wanted = (-score.centre.x).atan2(-score.centre.y) - score.heading;
    let turn = wanted - TAU * (wanted / TAU).round();
    step_round(score, steps, turn / steps as f64, rng);
}

/// Steps round, nearly in place, by `turn` (rad) a step.
fn step_round(score: &mut Score, steps: usize, turn: f64, rng: &mut ChaCha12Rng) {
    let side = turn.signum();
    let length = rng.random_range(0.1..0.5) * score.style.step;
    accompany(score, steps as f64, Cue::Turn { side }, rng);
    for step in 0..steps {
        let beat = step as f64;
        let foot = score.free;
        score.centre += Score::floor(score.heading + turn, length, 0.0);
        score.face(beat + 0.95, score.heading + turn);
        let placement = score.home(foot, score.centre, score.heading, 0.0);
        score.step(foot, beat, beat + 0.9, placement, Swing::step(6.0));
        let yaw = score
            .home(foot.other(), score.centre, score.heading, 0.0)
            .yaw;
        let (from, to) = (score.frame(beat + 0.2), score.frame(beat + 0.9));
        score.feet[foot.other().index()].pivot(from, to, yaw);
        score.sink(beat + 0.9, 0.3 * score.style.depth);
    }
    let beats = steps as f64;
    score.spine(0.4 * beats, [2.0, -6.0 * side, 14.0 * side]);
    score.spine(beats, [0.0; 3]);
    score.tilt(0.5 * beats, [2.0, 3.0 * side]);
    score.tilt(beats, [0.0; 2]);
    score.sink(beats, 0.0);
    score.advance(beats);
}

/// A full turn over three travelling steps to the side of the free foot, and a close.
fn three_step(score: &mut Score, rng: &mut ChaCha12Rng) {
    let side = score.free.side();
    let start = score.heading;
    let length = 0.8 * score.style.step;
    let way = Score::floor(start, 0.0, side * length);
    accompany(score, 4.0, Cue::Turn { side }, rng);
    for step in 0..4u8 {
        let beat = f64::from(step);
        let foot = score.free;
        if step < 3 {
            score.centre += way;
            let turned = start + side * TAU * f64::from(step + 1) / 3.0;
            score.face(beat + 0.9, turned);
        }
        let placement = score.home(foot, score.centre, score.heading, 0.0);
        // The free foot goes round the standing one: before it, then behind it.
        let detour = match step {
            1 => 20.0,
            2 => -20.0,
            _ => 0.0,
        };
        let swing = Swing::step(6.0).around(Score::floor(start, detour, 0.0));
        score.step(foot, beat, beat + 0.88, placement, swing);
        if step < 3 {
            let yaw = score
                .home(foot.other(), score.centre, score.heading, 0.0)
                .yaw;
            let (from, to) = (score.frame(beat + 0.15), score.frame(beat + 0.88));
            score.feet[foot.other().index()].pivot(from, to, yaw);
        }
        score.sink(beat + 0.9, 0.15 * score.style.depth);
    }
    score.spine(0.6, [0.0, -6.0 * side, 14.0 * side]);
    score.spine(2.0, [-3.0, 0.0, 10.0 * side]);
    score.spine(4.0, [0.0; 3]);
    score.look(0.5, [0.0, 0.0, 40.0 * side]);
    score.look(2.5, [0.0, 0.0, 20.0 * side]);
    score.look(4.0, [0.0; 3]);
    score.sink(4.0, 0.0);
    score.advance(4.0);
}

/// A half or full turn on one foot with the other drawn up to the knee, out of a plie.
fn pirouette(score: &mut Score, rng: &mut ChaCha12Rng) {
    let lifted = score.free;
    let stance = lifted.other();
    let full = score.rhythm.beat() > 18.0 && rng.random_bool(0.5);
    let side = draw_side(rng);
    let turn = side * if full { TAU } else { PI };
    let beats = if full || score.rhythm.beat() < 18.0 {
        4.0
    } else {
        3.0
    };
    accompany(score, beats, Cue::Turn { side }, rng);
    let start = score.heading;
    let spot = score.feet[stance.index()].placement();
    let (up, down) = (score.frame(0.9), score.frame(beats - 0.6));
    let (from, to) = (up + 2.0, down - 2.0);
    score.facing.key(score.frame(0.7), [start - 0.12 * side]);
    score.facing.key(down + 1.0, [start + turn]);
    score.heading = start + turn;
    // The middle of the base turns with the body about the standing foot.
    let offset = score.centre - score.home(stance, score.centre, start, 0.0).ball;
    let turned = DVec2::from_angle(-turn).rotate(offset);
    score.centre = spot.ball + turned;
    let raised = 28f64.to_radians();
    let foot = &mut score.feet[stance.index()];
    foot.roll(from - 4.0, from, spot.yaw, raised);
    foot.roll(from, to, spot.yaw + turn, raised);
    foot.roll(to, to + 5.0, spot.yaw + turn, 0.0);
    let vias = (1..=5u8)
        .map(|i| {
            let at = f64::from(i) / 6.0;
            let along = ease((at * 1.3 - 0.15).clamp(0.0, 1.0));
            let heading = start + along * turn;
            let height = 44.0 * (PI * at).sin().powf(0.7);
            let ball = spot.ball + Score::floor(heading, 9.0, 9.0 * lifted.side());
            Via {
                at,
                ball: DVec3::new(ball.x, 3.0 + height, ball.y),
                yaw: heading + lifted.side() * 0.7,
                pitch: 62f64.to_radians(),
            }
        })
        .collect();
    let placement = score.home(lifted, score.centre, score.heading, 0.0);
    let lift = score.frame(0.8);
    let land = score.feet[lifted.index()].swing(
        lift,
        None,
        down.max(to + 3.0),
        placement,
        Swing::step(0.0).through(vias),
    );
    let on_stance = score.weight_on(stance, 1.0);
    score.balance.key(score.frame(0.3), [0.5]);
    score.balance.key(lift + 3.0, [on_stance]);
    score.balance.key(land - 3.0, [on_stance]);
    score.balance.key(land + 6.0, [0.5]);
    score.sink(0.6, score.style.depth);
    score.sink(1.3, -5.0);
    score.sink(beats - 0.8, -4.0);
    score.sink(beats - 0.1, 0.5 * score.style.depth);
    score.spine(0.6, [4.0, 0.0, -12.0 * side]);
    score.spine(0.5 * beats, [-2.0, 0.0, 8.0 * side]);
    score.spine(beats, [0.0; 3]);
    score.look(0.4 * beats, [0.0, 0.0, 30.0 * side]);
    score.look(beats, [0.0; 3]);
    score.free = lifted.other();
    score.advance(beats);
}
