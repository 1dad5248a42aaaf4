//! Frames that a step trains one by one, each in a window of its own.

use std::ops::RangeInclusive;

use rand::{Rng, RngExt as _};

use super::Window;

/// Transitions of their windows, frames; the longest is that of the papers' evaluation.
const TRANSITIONS: RangeInclusive<usize> = 5..=150;

/// Frame k1 + `frame` of a window of `length` + 1 frames; `frame` is from 1 to `length`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SingleFramePlan {
    pub window: Window,
    pub length: usize,
    pub frame: usize,
}

/// Draws `count` of them from clips of these numbers of frames, every frame of a clip as likely as
/// another.
///
/// The logarithm of a window's length is uniform, so that frames near keyframes are as frequent as
/// frames far from both; a clip that is too short for the length is taken whole. Clips of one frame
/// have none.
pub(super) fn draw(
    clip_frames: &[usize],
    count: usize,
    rng: &mut impl Rng,
) -> Vec<SingleFramePlan> {
    let usable = |frames: usize| if frames < 2 { 0 } else { frames };
    let all: usize = clip_frames.iter().map(|&frames| usable(frames)).sum();
    if all == 0 {
        return Vec::new();
    }
    let [shortest, longest] = [*TRANSITIONS.start(), TRANSITIONS.end() + 1].map(|n| n as f64);
    std::iter::repeat_with(|| {
        let mut place = rng.random_range(0..all);
        let mut clip = 0;
        while place >= usable(clip_frames[clip]) {
            place -= usable(clip_frames[clip]);
            clip += 1;
        }
        let frames = clip_frames[clip];
        let length = rng.random_range(shortest.ln()..longest.ln()).exp() as usize;
        let length = length.min(frames - 1);
        SingleFramePlan {
            window: Window {
                clip,
                start: rng.random_range(0..frames - length),
            },
            length,
            frame: rng.random_range(1..=length),
        }
    })
    .take(count)
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    proptest! {
        #[test]
        fn drawn_frames_lie_in_their_windows_and_these_in_their_clips(frames in prop::collection::vec(0usize..400, 0..5), seed: u64) {
            let drawn = draw(&frames, 40, &mut ChaCha8Rng::seed_from_u64(seed));
            let any = frames.iter().any(|&frames| frames > 1);
            prop_assert_eq!(drawn.len(), if any { 40 } else { 0 });
            for SingleFramePlan { window, length, frame } in drawn {
                prop_assert!((1..=length).contains(&frame));
                prop_assert!(window.start + length < frames[window.clip]);
                prop_assert!(TRANSITIONS.contains(&length) || length == frames[window.clip] - 1);
            }
        }
    }

    #[test]
    fn short_and_long_windows_are_drawn_alike_and_clips_by_their_frames() {
        let drawn = draw(&[300, 900], 4000, &mut ChaCha8Rng::seed_from_u64(1));
        let share = |found: &dyn Fn(&SingleFramePlan) -> bool| {
            drawn.iter().filter(|&plan| found(plan)).count() as f64 / drawn.len() as f64
        };
        // The geometric mean of 5 and 151 is 27.5.
        assert!((share(&|plan| plan.length < 28) - 0.5).abs() < 0.03);
        assert!((share(&|plan| plan.window.clip == 0) - 0.25).abs() < 0.03);
    }
}
