//! Steps: walks, side steps, boxes, grapevines and lunges.

use rand::RngExt;
use rand_chacha::ChaCha12Rng;

use super::arms::{Cue, accompany};
use super::{draw_direction, draw_side};
use crate::data::choreography::feet::Swing;
use crate::data::choreography::score::Score;

/// Writes one figure of steps.
pub fn perform(score: &mut Score, rng: &mut ChaCha12Rng) {
    match rng.random_range(0..10u8) {
        0..3 => walk(score, rng),
        3..5 => side_steps(score, rng),
        5..7 => walk_box(score, rng),
        7 => grapevine(score, rng),
        _ => lunge(score, rng),
    }
}

/// A walk forward, back or diagonally that may bend to one side, ended by a close.
pub fn walk(score: &mut Score, rng: &mut ChaCha12Rng) {
    let steps = score.style.bar as usize;
    let length = score.style.step;
    let ways = [
        (1.0, 0.0),
        (1.0, 0.0),
        (-0.8, 0.0),
        (0.85, 0.45),
        (0.85, -0.45),
    ];
    let (forward, left) = draw_direction(score, &ways, length * (steps as f64 - 1.0), rng);
    let bend = if forward > 0.0 && left == 0.0 {
        rng.random_range(-0.35..0.35)
    } else {
        0.0
    };
    let first = score.free.side();
    let cue = Cue::Travel {
        forward,
        left,
        step: 1.0,
        first,
    };
    accompany(score, steps as f64, cue, rng);
    score.spine(0.5, [4.0 * forward, -3.0 * left, 0.0]);
    score.tilt(0.5, [3.0 * forward, 0.0]);
    for step in 0..steps {
        let beat = step as f64;
        let foot = score.free;
        if step + 1 < steps {
            score.centre += Score::floor(score.heading, length * forward, length * left);
            score.face(beat + 1.0, score.heading + bend);
        }
        let placement = score.home(foot, score.centre, score.heading, 0.0);
        score.sink(beat + 0.5, 0.0);
        score.sink(beat + 1.0, 0.2 * score.style.depth);
        score.spine(beat + 1.0, [4.0 * forward, -3.0 * left, 9.0 * foot.side()]);
        score.step(foot, beat, beat + 0.9, placement, Swing::step(7.0));
    }
    score.look(
        0.6,
        [
            0.0,
            0.0,
            20.0 * bend.signum() * f64::from(u8::from(bend != 0.0)),
        ],
    );
    score.look(steps as f64, [0.0; 3]);
    score.spine(steps as f64, [0.0; 3]);
    score.tilt(steps as f64, [0.0; 2]);
    score.sink(steps as f64, 0.0);
    score.advance(steps as f64);
}

/// Two side steps (step, close, step) to the side of the free foot, or one and one back.
fn side_steps(score: &mut Score, rng: &mut ChaCha12Rng) {
    let length = 0.75 * score.style.step;
    let there = score.free.side();
    let cue = Cue::Travel {
        forward: 0.0,
        left: there,
        step: 2.0,
        first: there,
    };
    accompany(score, 4.0, cue, rng);
    let turn = 0.35 * f64::from(rng.random_range(-1i8..=1));
    for bar in 0..2 {
        let beat = 2.0 * f64::from(bar);
        let lead = score.free;
        let side = lead.side();
        let way = Score::floor(score.heading, 0.0, side * length);
        score.spine(beat + 0.8, [3.0, -10.0 * side, 6.0 * side]);
        score.tilt(beat + 0.8, [0.0, 5.0 * side]);
        score.look(beat + 0.6, [0.0, -4.0 * side, 32.0 * side]);
        for (from, to, foot, share) in [
            (0.0, 0.7, lead, 1.0),
            (0.75, 1.2, lead.other(), 0.0),
            (1.25, 1.9, lead, 1.0),
        ] {
            score.centre += share * way;
            let placement = score.home(foot, score.centre, score.heading, 0.0);
            score.step(foot, beat + from, beat + to, placement, Swing::step(5.0));
            let depth = if share > 0.0 { 0.5 } else { 0.1 };
            score.sink(beat + to, depth * score.style.depth);
        }
        score.face(beat + 2.0, score.heading + turn);
        score.spine(beat + 2.0, [0.0, 4.0 * side, 0.0]);
        score.tilt(beat + 2.0, [0.0; 2]);
        score.look(beat + 2.0, [0.0; 3]);
    }
    score.sink(4.0, 0.0);
    score.advance(4.0);
}

/// Forward or back, side, close; rising on the second step and falling at the end, perhaps with a
/// quarter turn.
fn walk_box(score: &mut Score, rng: &mut ChaCha12Rng) {
    let length = 0.8 * score.style.step;
    let (forward, _) = draw_direction(score, &[(1.0, 0.0), (-1.0, 0.0)], length, rng);
    let turn = f64::from(rng.random_range(-1i8..=1)) * 0.6;
    let lead = score.free;
    let side = lead.other().side();
    let cue = Cue::Travel {
        forward,
        left: side,
        step: 1.0,
        first: lead.side(),
    };
    accompany(score, 3.0, cue, rng);
    let rise = 4.0;
    let depth = score.style.depth;
    score.centre += Score::floor(score.heading, forward * length, 0.0);
    let placement = score.home(lead, score.centre, score.heading, 0.0);
    score.step(lead, 0.0, 0.9, placement, Swing::step(5.0));
    score.sink(0.9, 0.6 * depth);
    score.face(1.9, score.heading + turn);
    let across = Score::floor(score.heading, 0.0, side * 0.6 * length);
    score.centre += across;
    let placement = score.home(lead.other(), score.centre, score.heading, 0.0);
    score.step(lead.other(), 1.0, 1.9, placement, Swing::step(6.0));
    let (from, to) = (score.frame(1.1), score.frame(1.9));
    let yaw = score.home(lead, score.centre, score.heading, 0.0).yaw;
    score.feet[lead.index()].pivot(from, to, yaw);
    score.sink(1.9, -0.5 * rise);
    let placement = score.home(lead, score.centre, score.heading, 0.0);
    score.step(lead, 2.0, 2.9, placement, Swing::step(6.0));
    score.sink(2.5, -rise);
    score.sink(3.0, 0.1 * depth);
    score.spine(1.0, [5.0 * forward, 0.0, 8.0 * side]);
    score.spine(2.0, [-4.0, -9.0 * side, 6.0 * side]);
    score.spine(3.0, [0.0; 3]);
    score.look(1.8, [-6.0, -6.0 * side, 18.0 * side]);
    score.look(3.0, [0.0; 3]);
    score.advance(3.0);
}

/// Side, cross behind, side, close or cross before.
fn grapevine(score: &mut Score, rng: &mut ChaCha12Rng) {
    let length = 0.62 * score.style.step;
    let lead = score.free;
    let side = lead.side();
    let behind = draw_side(rng);
    let cue = Cue::Travel {
        forward: 0.0,
        left: side,
        step: 1.0,
        first: side,
    };
    accompany(score, 4.0, cue, rng);
    let heading = score.heading;
    let way = Score::floor(heading, 0.0, side * length);
    for step in 0..4u8 {
        let beat = f64::from(step);
        let foot = score.free;
        score.centre += way * if step < 3 { 1.0 } else { 0.0 };
        let mut placement = score.home(foot, score.centre, heading, 0.0);
        let mut swing = Swing::step(6.0);
        if step == 1 {
            placement.ball += Score::floor(heading, -14.0 * behind, side * 12.0);
            swing = swing.around(Score::floor(heading, -14.0 * behind, 0.0));
            score.spine(beat + 0.9, [3.0, 0.0, 16.0 * side * behind]);
            score.sink(beat + 0.9, 0.6 * score.style.depth);
        } else {
            score.spine(beat + 0.9, [0.0, -7.0 * side, -8.0 * side]);
            score.sink(beat + 0.9, 0.15 * score.style.depth);
        }
        score.step(foot, beat, beat + 0.9, placement, swing);
    }
    score.look(0.8, [0.0, 0.0, 36.0 * side]);
    score.look(3.0, [0.0, 0.0, 30.0 * side]);
    score.look(4.0, [0.0; 3]);
    score.spine(4.0, [0.0; 3]);
    score.sink(4.0, 0.0);
    score.advance(4.0);
}

/// A deep step to the side or forward, held, and back.
fn lunge(score: &mut Score, rng: &mut ChaCha12Rng) {
    let foot = score.free;
    let side = foot.side();
    let length = 1.25 * score.style.step;
    let ways = [(0.2, side), (0.75, 0.6 * side), (1.0, 0.1 * side)];
    let (forward, left) = ways[rng.random_range(0..ways.len())];
    let cue = Cue::Travel {
        forward,
        left,
        step: 1.5,
        first: side,
    };
    accompany(score, 4.0, cue, rng);
    let heading = score.heading;
    let home = score.home(foot, score.centre, heading, 0.0);
    let mut placement = home;
    placement.ball += Score::floor(heading, forward * length, left * length);
    placement.yaw += 0.5 * left;
    score.step(foot, 0.0, 0.95, placement, Swing::step(9.0));
    let deep = score.style.depth + 6.0;
    let weight = score.weight_on(foot, 0.72);
    let settled = score.frame(1.4);
    score.balance.key(settled, [weight]);
    score.sink(0.5, 0.1 * deep);
    score.sink(1.5, deep);
    score.sink(2.4, 0.9 * deep);
    let bow = rng.random_range(-6.0..18.0);
    score.tilt(1.5, [0.3 * bow + 6.0 * forward, -4.0 * left]);
    score.spine(1.6, [bow, -14.0 * left, 14.0 * left]);
    score.spine(2.5, [0.8 * bow, -16.0 * left, 18.0 * left]);
    score.look(1.6, [-0.5 * bow, 0.0, 30.0 * left]);
    let held = score.frame(2.3);
    score.balance.key(held, [weight]);
    let recover = score.weight_on(foot.other(), 0.86);
    let (start, back) = (score.frame(2.5), score.frame(3.7));
    score.balance.key(start + 0.4 * (back - start), [recover]);
    score.feet[foot.index()].swing(start, None, back, home, Swing::step(6.0));
    let weight = score.weight_on(foot.other(), 0.6);
    score.balance.key(back + 3.0, [weight]);
    score.tilt(4.0, [0.0; 2]);
    score.spine(4.0, [0.0; 3]);
    score.look(4.0, [0.0; 3]);
    score.sink(3.3, 0.2 * deep);
    score.sink(4.0, 0.0);
    score.free = foot;
    score.advance(4.0);
}
