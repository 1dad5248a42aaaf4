//! The learning rate over a training.

use keydance::optim::{RateSchedule, RateShape};
use proptest::prelude::*;

fn schedule(shape: RateShape) -> RateSchedule {
    RateSchedule {
        shape,
        warmup_steps: 4,
        final_share: 0.1,
        ..RateSchedule::default()
    }
}

#[test]
fn drops_leave_a_tenth_and_a_hundredth_of_the_rate() {
    let schedule = RateSchedule {
        drops: [0.25, 0.5],
        ..schedule(RateShape::Drops)
    };
    let share = |step| schedule.share(step, 104);
    assert_eq!(
        [share(0), share(3), share(4), share(28)],
        [0.25, 1.0, 1.0, 1.0]
    );
    assert_eq!([share(29), share(53)], [0.1; 2]);
    assert!((share(54) - 0.01).abs() < 1e-15 && share(54) == share(103));
}

#[test]
fn shares_at_hand_picked_steps() {
    use RateShape::{Constant, Cosine, Linear};
    for (shape, step, expected) in [
        (Linear, 0, 0.25),
        (Linear, 3, 1.0),
        (Linear, 4, 1.0),
        (Linear, 54, 0.55),
        (Linear, 103, 0.109),
        (Cosine, 4, 1.0),
        (Cosine, 29, 0.1 + 0.9 * (1.0 + 0.5f64.sqrt()) / 2.0),
        (Cosine, 54, 0.55),
        (Constant, 1, 0.5),
        (Constant, 103, 1.0),
    ] {
        let share = schedule(shape).share(step, 104);
        assert!(
            (share - expected).abs() < 1e-12,
            "{shape:?} {step}: {share}"
        );
    }
}

proptest! {
    #[test]
    fn a_rate_rises_over_the_warm_up_then_never_again_and_stays_between_final_share_and_1(
        shape in prop_oneof![
            Just(RateShape::Constant),
            Just(RateShape::Linear),
            Just(RateShape::Cosine),
        ],
        warmup_steps in 0u64..50, final_share in 0.0..1.0f64, steps in 1u64..200,
    ) {
        let schedule = RateSchedule { shape, warmup_steps, final_share, ..RateSchedule::default() };
        let shares: Vec<f64> = (0..steps).map(|step| schedule.share(step, steps)).collect();
        for (step, pair) in shares.windows(2).enumerate() {
            if (step as u64 + 1) < warmup_steps {
                prop_assert!(pair[1] > pair[0]);
            } else {
                prop_assert!(pair[1] <= pair[0]);
            }
        }
        let falling = shares.iter().skip(warmup_steps as usize);
        prop_assert!(falling.into_iter().all(|share| (final_share..=1.0).contains(share)));
        prop_assert!(shares.iter().all(|&share| share > 0.0));
    }
}
