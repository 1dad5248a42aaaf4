//! The prior of a residual network, [`Prior`].

use keydance::models::pan2021::Prior;

#[test]
fn a_keyframe_is_its_own_mean() {
    for n in [1, 2, 10, 150, 1000] {
        for (t, expected) in [(0, [1.0, 0.0, 0.0]), (n, [0.0, 0.0, 1.0])] {
            for (weight, expected) in Prior::new(n).weights(t).into_iter().zip(expected) {
                assert!(
                    (weight - expected).abs() < 1e-2,
                    "N = {n}, t = {t}: {weight}"
                );
            }
        }
    }
}

#[test]
fn far_from_both_keyframes_little_is_left_of_them() {
    let [first, velocity, last] = Prior::new(1000).weights(500);
    // 0.2 of two poses that share it; of the first one two frames are known, and count
    // together.
    for weight in [first, last, -2.0 * velocity] {
        assert!((weight - 0.2 / 1.2).abs() < 2e-3, "{weight}");
    }
}

#[test]
fn the_deviation_is_nothing_in_the_keyframes_and_nearly_all_far_from_them() {
    for n in [1, 2, 10, 150] {
        for t in [0, n] {
            let deviation = Prior::new(n).deviation(t);
            assert!(deviation < 2e-3, "N = {n}, t = {t}: {deviation}");
        }
        let deviations: Vec<f64> = (0..=n).map(|t| Prior::new(n).deviation(t)).collect();
        assert!(
            deviations
                .iter()
                .all(|deviation| (0.0..1.0).contains(deviation)),
            "{deviations:?}"
        );
        // Rises to one frame between the keyframes and falls after it.
        let turns = deviations
            .windows(3)
            .filter(|o| o[1] > o[0] && o[1] >= o[2]);
        assert!(turns.count() <= 1, "{deviations:?}");
    }
    let long = Prior::new(150);
    let deviations = |t: usize| (long.deviation(t), long.step_deviation(t));
    let (far, near) = (deviations(75), deviations(1));
    assert!(far.0 > 0.9 && far.1 > 0.99, "{far:?}");
    assert!(near.0 < 0.1 && near.1 < 0.6, "{near:?}");
}

#[test]
fn the_mean_goes_on_with_the_first_keyframes_velocity() {
    let [first, velocity, last] = Prior::new(100).weights(1);
    assert!((first - 1.0).abs() < 0.02, "{first}");
    assert!((0.8..1.0).contains(&velocity), "{velocity}");
    assert!(last.abs() < 0.01, "{last}");
}
