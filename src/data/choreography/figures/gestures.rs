//! Leg gestures over one planted foot: kicks and unfoldings in three directions, and pointing the
//! foot along the floor.

use glam::DVec3;
use rand::RngExt;
use rand_chacha::ChaCha12Rng;

use super::arms::{Cue, accompany};
use crate::data::choreography::body::{HIP_HALF_WIDTH, STANDING};
use crate::data::choreography::feet::{Foot, Swing, Via};
use crate::data::choreography::score::Score;

/// Writes one leg gesture.
pub fn perform(score: &mut Score, rng: &mut ChaCha12Rng) {
    if rng.random_bool(0.65) {
        raise(score, rng)
    } else {
        point(score, rng)
    }
}

/// Where the ball of the foot is with the leg raised by `angle` (rad) from hanging towards
/// (forward, left), `length` cm long.
fn raised(score: &Score, foot: Foot, way: (f64, f64), angle: f64, length: f64) -> DVec3 {
    let stance = score.feet[foot.other().index()].placement();
    let under = 0.75 * (stance.ball - score.centre) + score.centre;
    let hip = under + Score::floor(score.heading, -2.0, foot.side() * 1.7 * HIP_HALF_WIDTH);
    let out = Score::floor(score.heading, way.0, way.1) * (length * angle.sin());
    let height = STANDING - score.style.bend - 3.0 - length * angle.cos();
    DVec3::new(hip.x + out.x, height.max(4.0), hip.y + out.y)
}

/// A kick (fast) or an unfolding through the knee (slow), held for a moment, and home.
fn raise(score: &mut Score, rng: &mut ChaCha12Rng) {
    let foot = score.free;
    let side = foot.side();
    let slow = score.rhythm.beat() > 22.0;
    let beats = if slow { 4.0 } else { 3.0 };
    let (way, turned_out, behind) = match rng.random_range(0..3u8) {
        0 => ((1.0, 0.0), 0.3, false),
        1 => ((0.15, side), 1.0, false),
        _ => ((-1.0, 0.0), 0.5, true),
    };
    let top = if behind {
        rng.random_range(0.5..0.95)
    } else {
        rng.random_range(0.7..1.4)
    };
    let forward = way.0;
    accompany(score, beats, Cue::Leg { side, forward }, rng);
    let yaw = score.heading + side * turned_out;
    let pitch = |angle: f64| if behind { 0.95 + angle } else { 0.95 - angle };
    let via = |at: f64, angle: f64, length: f64, score: &Score| Via {
        at,
        ball: raised(score, foot, way, angle, length),
        yaw,
        pitch: pitch(angle),
    };
    let vias = if slow && !behind {
        let knee = score.feet[foot.other().index()].placement().ball
            + Score::floor(score.heading, 8.0, side * 10.0);
        let passe = Via {
            at: 0.25,
            ball: DVec3::new(knee.x, 42.0, knee.y),
            yaw,
            pitch: 1.0,
        };
        vec![
            passe,
            via(0.52, top - 0.08, 85.0, score),
            via(0.68, top + 0.1, 87.0, score),
            via(0.86, 0.45, 86.0, score),
        ]
    } else {
        vec![
            via(0.22, 0.35, 84.0, score),
            via(0.48, top, 86.0, score),
            via(0.6, top - 0.12, 86.0, score),
            via(0.82, 0.4, 85.0, score),
        ]
    };
    let home = score.home(foot, score.centre, score.heading, 0.0);
    let (from, to) = (score.frame(0.4), score.frame(beats - 0.4));
    let swing = Swing::step(0.0).through(vias);
    let land = score.feet[foot.index()].swing(from, None, to, home, swing);
    let stance = score.weight_on(foot.other(), 0.95);
    score.balance.key(from + 4.0, [stance]);
    score.balance.key(land - 4.0, [stance]);
    let weight = score.weight_on(foot.other(), 0.55);
    score.balance.key(land + 6.0, [weight]);
    let lean = top * if behind { 20.0 } else { -9.0 * way.0 };
    let aside = top * 8.0 * way.1;
    score.sink(0.5, 0.35 * score.style.depth);
    score.sink(0.5 * beats, -1.0);
    score.sink(beats - 0.3, 0.3 * score.style.depth);
    score.tilt(0.52 * beats, [lean, -1.1 * aside]);
    score.tilt(0.65 * beats, [lean, -1.1 * aside]);
    score.tilt(beats, [0.0; 2]);
    let arch = if behind { -12.0 } else { 2.0 };
    score.spine(0.55 * beats, [arch, 0.4 * aside, 7.0 * side]);
    score.spine(beats, [0.0; 3]);
    score.look(0.5 * beats, [-4.0, 0.0, 24.0 * way.1]);
    score.look(beats, [0.0; 3]);
    score.free = foot;
    score.advance(beats);
}

/// Points the foot along the floor in one or two directions and draws it back.
fn point(score: &mut Score, rng: &mut ChaCha12Rng) {
    let foot = score.free;
    let side = foot.side();
    let times = rng.random_range(1..3u8);
    let whole = score.to_music || score.rhythm.beat() < 20.0;
    let unit = if whole { 1.0 } else { 0.8 };
    let beats = (4.0 * unit * f64::from(times)).ceil();
    let ways = [(1.0, 0.1 * side), (0.1, side), (-0.9, 0.1 * side)];
    let mut chosen = (0.0, side);
    let depth = score.style.depth;
    let stance = score.weight_on(foot.other(), 0.88);
    for time in 0..times {
        let beat = beats / f64::from(times) * f64::from(time);
        let (forward, left) = ways[rng.random_range(0..ways.len())];
        chosen = (forward, left);
        let home = score.home(foot, score.centre, score.heading, 0.0);
        let mut out = home;
        let length = rng.random_range(30.0..44.0);
        out.ball += Score::floor(score.heading, length * forward, length * left);
        out.yaw += 0.4 * left;
        let frames = [0.0, 1.0, 2.4, 3.6].map(|at| score.frame(beat + at * unit));
        let plan = &mut score.feet[foot.index()];
        let touch = Swing {
            landing: 35f64.to_radians(),
            ..Swing::step(3.0)
        };
        let landed = plan.swing(frames[0], None, frames[1], out, touch);
        plan.roll(landed + 3.0, landed + 7.0, out.yaw, 30f64.to_radians());
        plan.swing(frames[2], None, frames[3], home, Swing::step(3.0));
        score.balance.key(frames[0] + 4.0, [stance]);
        score.balance.key(frames[3], [stance]);
        score.sink(beat + 1.0 * unit, depth * rng.random_range(0.3..0.9));
        score.sink(beat + 3.4 * unit, 0.1 * depth);
        score.spine(
            beat + 1.4 * unit,
            [-5.0 * forward, -12.0 * left, 10.0 * left],
        );
        score.spine(beat + 3.4 * unit, [0.0, 3.0 * left, 0.0]);
        score.look(beat + 1.2 * unit, [5.0, 0.0, 26.0 * left]);
        score.look(beat + 3.2 * unit, [0.0; 3]);
    }
    let forward = chosen.0;
    accompany(score, beats, Cue::Leg { side, forward }, rng);
    score.sink(beats, 0.0);
    score.spine(beats, [0.0; 3]);
    score.free = foot;
    score.advance(beats);
}
