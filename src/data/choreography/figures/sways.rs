//! Sways and bends on planted feet: weight shifts, plies with a rise, bows.

use rand::RngExt;
use rand_chacha::ChaCha12Rng;

use super::arms::{Cue, accompany};
use super::draw_side;
use crate::data::choreography::feet::{Foot, Swing};
use crate::data::choreography::score::Score;

/// Writes one figure on planted feet.
pub fn perform(score: &mut Score, rng: &mut ChaCha12Rng) {
    match rng.random_range(0..6u8) {
        0..3 => sway(score, rng),
        3..5 => plie(score, rng),
        _ => bow(score, rng),
    }
}

/// Opens the stance, sways from side to side, and closes.
fn sway(score: &mut Score, rng: &mut ChaCha12Rng) {
    let opening = score.free;
    let side = opening.side();
    let wide = rng.random_range(18.0..32.0);
    let swing = if score.rhythm.beat() < 20.0 { 2.0 } else { 1.0 };
    let sways = rng.random_range(2..5u8);
    let beats = 1.0 + swing * f64::from(sways) + 1.0;
    let mut open = score.home(opening, score.centre, score.heading, 0.0);
    open.ball += Score::floor(score.heading, 0.0, side * wide);
    score.step(opening, 0.0, 0.9, open, Swing::step(5.0));
    accompany(score, beats, Cue::Sway { side, swing }, rng);
    let mut to = opening;
    for shift in 0..sways {
        let beat = 1.0 + swing * f64::from(shift);
        let middle = score.frame(beat + 0.55 * swing);
        let weight = score.weight_on(to, 0.8);
        score.balance.key(middle, [weight]);
        score
            .balance
            .key(middle + 0.25 * swing * score.rhythm.beat(), [weight]);
        let s = to.side();
        score.tilt(beat + 0.6 * swing, [2.0, 6.0 * s]);
        score.spine(beat + 0.7 * swing, [3.0, -17.0 * s, 9.0 * s]);
        score.look(beat + 0.75 * swing, [4.0, -8.0 * s, 18.0 * s]);
        score.sink(beat + 0.1 * swing, 0.75 * score.style.depth);
        score.sink(beat + 0.65 * swing, 0.35 * score.style.depth);
        to = to.other();
    }
    let home = score.home(opening, score.centre, score.heading, 0.0);
    score.step(opening, beats - 1.0, beats - 0.1, home, Swing::step(5.0));
    score.tilt(beats, [0.0; 2]);
    score.spine(beats, [0.0; 3]);
    score.look(beats, [0.0; 3]);
    score.sink(beats, 0.0);
    score.advance(beats);
}

/// Bends the knees, then rises on the balls of the feet.
fn plie(score: &mut Score, rng: &mut ChaCha12Rng) {
    let slow = if score.rhythm.beat() < 20.0 { 2.0 } else { 1.0 };
    let beats = 4.0 * slow;
    let depth = score.style.depth * rng.random_range(0.9..1.5);
    let raised = rng.random_range(22.0..34.0f64).to_radians();
    accompany(score, beats, Cue::Rise, rng);
    score.balance.key(score.frame(0.7 * slow), [0.5]);
    score.balance.key(score.frame(3.6 * slow), [0.5]);
    score.sink(1.2 * slow, depth);
    score.sink(2.3 * slow, -7.0);
    score.sink(2.9 * slow, -6.5);
    score.sink(3.7 * slow, 0.2 * depth);
    for foot in [Foot::Left, Foot::Right] {
        let frames = [1.6, 2.3, 3.0, 3.6].map(|beat| score.frame(beat * slow));
        let plan = &mut score.feet[foot.index()];
        let yaw = plan.placement().yaw;
        plan.roll(frames[0], frames[1], yaw, raised);
        plan.roll(frames[2], frames[3], yaw, 0.0);
    }
    let curl = rng.random_range(4.0..16.0);
    score.spine(1.2 * slow, [curl, 0.0, 0.0]);
    score.tilt(1.2 * slow, [0.35 * curl, 0.0]);
    score.look(1.2 * slow, [10.0, 0.0, 0.0]);
    score.spine(2.5 * slow, [-9.0, 0.0, 0.0]);
    score.tilt(2.4 * slow, [0.0; 2]);
    score.look(2.5 * slow, [-12.0, 0.0, 0.0]);
    score.spine(beats, [0.0; 3]);
    score.look(beats, [0.0; 3]);
    score.sink(beats, 0.0);
    score.advance(beats);
}

/// Folds forward, to one side, and rolls up.
fn bow(score: &mut Score, rng: &mut ChaCha12Rng) {
    let slow = if score.rhythm.beat() < 20.0 { 2.0 } else { 1.0 };
    let beats = 4.0 * slow;
    let side = draw_side(rng);
    let deep = rng.random_range(14.0..26.0);
    accompany(score, beats, Cue::Bow, rng);
    score.balance.key(score.frame(0.8 * slow), [0.5]);
    score.sink(1.4 * slow, score.style.depth);
    score.sink(2.4 * slow, 0.8 * score.style.depth);
    score.tilt(1.4 * slow, [0.55 * deep, 0.0]);
    score.tilt(2.2 * slow, [0.5 * deep, 3.0 * side]);
    score.spine(1.5 * slow, [deep, -6.0 * side, 8.0 * side]);
    score.spine(2.3 * slow, [0.7 * deep, -16.0 * side, 16.0 * side]);
    score.look(1.6 * slow, [16.0, 0.0, 0.0]);
    score.look(2.6 * slow, [6.0, 0.0, 22.0 * side]);
    score.tilt(3.4 * slow, [0.0; 2]);
    score.spine(3.6 * slow, [-4.0, 0.0, 0.0]);
    score.spine(beats, [0.0; 3]);
    score.look(beats, [0.0; 3]);
    score.sink(beats, 0.0);
    score.advance(beats);
}
