//! Adam: its steps, rates, limit and bits.

use std::collections::BTreeMap;

use keydance::autograd::{Gradients, Parameters, Real};
use keydance::optim::{Adam, AdamConfig, AdamError, RateSchedule};
use ndarray::ArrayD;

fn parameters<T: Real>(values: &[&[f64]]) -> Parameters<T> {
    let mut parameters = Parameters::new();
    for (k, values) in values.iter().enumerate() {
        let value = values.iter().map(|&x| T::from_f64(x)).collect();
        let value = ArrayD::from_shape_vec(vec![values.len()], value).unwrap();
        parameters.add(format!("p{k}"), value);
    }
    parameters
}

fn gradients<T: Real>(of: &Parameters<T>, gradient: impl Fn(usize, usize) -> f64) -> Gradients<T> {
    let mut gradients = Gradients::zeros(of);
    for (k, values) in gradients.iter_mut().enumerate() {
        for (i, value) in values.iter_mut().enumerate() {
            *value = T::from_f64(gradient(k, i));
        }
    }
    gradients
}

fn weights<T: Real>(parameters: &Parameters<T>) -> Vec<f64> {
    parameters
        .iter()
        .flat_map(|(_, v)| v.iter().map(|x| Real::to_f64(*x)))
        .collect()
}

/// The published algorithm, one weight at a time.
fn naive(config: AdamConfig, w: f64, gradients: &[f64]) -> f64 {
    let (mut w, mut m, mut v) = (w, 0.0, 0.0);
    for (t, g) in gradients.iter().enumerate() {
        let t = t as i32 + 1;
        m = config.beta1 * m + (1.0 - config.beta1) * g;
        v = config.beta2 * v + (1.0 - config.beta2) * g * g;
        let (m_hat, v_hat) = (
            m / (1.0 - config.beta1.powi(t)),
            v / (1.0 - config.beta2.powi(t)),
        );
        w -= config.learning_rate * m_hat / (v_hat.sqrt() + config.epsilon);
    }
    w
}

#[test]
fn steps_follow_the_published_algorithm() {
    let config = AdamConfig {
        learning_rate: 0.01,
        ..AdamConfig::default()
    };
    let start: Vec<f64> = (0..40_000).map(|i| (i as f64 * 0.37).sin()).collect();
    let gradient =
        |t: usize, i: usize| ((i * 7 + t * 13) as f64 * 0.11).cos() * 10f64.powi(i as i32 % 9 - 6);
    let mut parameters = parameters::<f64>(&[&start]);
    let mut adam = Adam::new(config.clone(), &parameters).unwrap();
    for t in 0..20 {
        // Two shards that add up to the gradient.
        let shard = |share: f64| gradients(&parameters, |_, i| gradient(t, i) * share);
        let mut shards = [shard(0.25), shard(0.75)];
        adam.step_shards(&mut parameters, &mut shards).unwrap();
        assert!(
            shards
                .iter()
                .flat_map(|s| s.iter().flatten())
                .all(|&g| g == 0.0)
        );
    }
    for (i, (w, start)) in weights(&parameters).into_iter().zip(start).enumerate() {
        let history: Vec<f64> = (0..20).map(|t| gradient(t, i)).collect();
        assert!(
            (w - naive(config.clone(), start, &history)).abs() < 1e-12,
            "weight {i}"
        );
    }
}

#[test]
fn a_constant_gradient_moves_a_weight_by_the_learning_rate_a_step() {
    // With g constant both corrected moments are exact: every step is rate * g / (|g| + eps).
    let mut parameters = parameters::<f32>(&[&[1.0, 2.0, 3.0]]);
    let mut adam = Adam::new(AdamConfig::default(), &parameters).unwrap();
    for _ in 0..5 {
        let mut gradients = gradients(&parameters, |_, i| [3.0, -0.02, 1e-8][i]);
        adam.step(&mut parameters, &mut gradients).unwrap();
    }
    let expected = [1.0 - 5e-4, 2.0 + 5e-4, 3.0 - 2.5e-4];
    for (w, expected) in weights(&parameters).into_iter().zip(expected) {
        assert!((w - expected).abs() < 1e-6, "{w} is not {expected}");
    }
}

#[test]
fn a_group_of_weights_has_a_rate_of_its_own() {
    let config = AdamConfig {
        learning_rate: 1e-3,
        rates: BTreeMap::from([("slow".into(), 2e-4)]),
        ..AdamConfig::default()
    };
    let start = [1.0, -2.0];
    let mut both = parameters::<f64>(&[&start, &start]);
    // Half of the rates, once the schedule's warm-up has come so far.
    let schedule = RateSchedule {
        warmup_steps: 2,
        ..RateSchedule::default()
    };
    let halved = AdamConfig {
        rate_schedule: Some(schedule),
        ..config.clone()
    };
    let mut adam = Adam::new(halved, &both)
        .unwrap()
        .with_rate_groups(&both, |name| (name == "p1").then_some("slow"));
    assert_eq!(adam.learning_rate(), 5e-4);
    let mut step = gradients(&both, |_, i| i as f64 - 1.5);
    adam.step(&mut both, &mut step).unwrap();
    for (k, rate) in [5e-4, 1e-4].into_iter().enumerate() {
        let mut alone = parameters::<f64>(&[&start]);
        let config = AdamConfig {
            learning_rate: rate,
            ..AdamConfig::default()
        };
        let mut adam = Adam::new(config, &alone).unwrap();
        let mut step = gradients(&alone, |_, i| i as f64 - 1.5);
        adam.step(&mut alone, &mut step).unwrap();
        for (w, expected) in weights(&both)[2 * k..].iter().zip(weights(&alone)) {
            assert!((w - expected).abs() < 1e-12, "p{k}: {w} is not {expected}");
        }
    }
}

#[test]
fn a_long_gradient_is_scaled_to_the_limit_over_all_parameters() {
    let clipped = AdamConfig {
        clip_norm: Some(1.0),
        epsilon: 1.0,
        ..AdamConfig::default()
    };
    let free = AdamConfig {
        clip_norm: None,
        ..clipped.clone()
    };
    let run = |config, scale: f64| {
        let mut parameters = parameters::<f64>(&[&[0.0], &[0.0]]);
        let mut adam = Adam::new(config, &parameters).unwrap();
        let mut gradients = gradients(&parameters, |k, _| [3.0, 4.0][k] * scale);
        let norm = adam.step(&mut parameters, &mut gradients).unwrap();
        (norm, weights(&parameters))
    };
    let (norm, long) = run(clipped.clone(), 1.0);
    assert!((norm - 5.0).abs() < 1e-12);
    let scaled = run(free.clone(), 0.2).1;
    assert!(
        long.iter().zip(&scaled).all(|(a, b)| (a - b).abs() < 1e-9),
        "{long:?} {scaled:?}"
    );
    assert_eq!(run(clipped, 0.1).1, run(free, 0.1).1);
}

#[test]
fn a_gradient_that_is_not_finite_changes_nothing_and_is_named() {
    let mut parameters = parameters::<f32>(&[&[1.0, 2.0], &[3.0; 20]]);
    let mut adam = Adam::new(AdamConfig::default(), &parameters).unwrap();
    let before = (weights(&parameters), adam.clone());
    for bad in [f64::NAN, f64::INFINITY] {
        let mut gradients = gradients(
            &parameters,
            |k, i| if (k, i) == (1, 17) { bad } else { 1e30 },
        );
        let error = adam.step(&mut parameters, &mut gradients).unwrap_err();
        let expected = AdamError::NonFinite {
            parameter: "p1".into(),
            shape: vec![20],
        };
        assert_eq!(error, expected);
    }
    assert_eq!((weights(&parameters), adam), before);
}

#[test]
fn gradients_of_other_parameters_change_nothing() {
    let mut parameters = parameters::<f32>(&[&[1.0, 2.0], &[3.0; 20]]);
    let mut adam = Adam::new(AdamConfig::default(), &parameters).unwrap();
    let before = (weights(&parameters), adam.clone());
    let mut others: Vec<Parameters<f32>> = vec![Parameters::new()];
    for sizes in [vec![2], vec![2, 19], vec![20, 2], vec![2, 20, 1]] {
        let values: Vec<Vec<f64>> = sizes.iter().map(|&size| vec![0.0; size]).collect();
        let values: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
        others.push(self::parameters(&values));
    }
    for mut other in others {
        let own = gradients(&parameters, |_, _| 1.0);
        let mut of_other = gradients(&other, |_, _| 1.0);
        let refused = |error| assert_eq!(error, Err(AdamError::OtherParameters));
        refused(adam.step(&mut parameters, &mut of_other));
        // The first shard fits, one after it does not.
        refused(adam.step_shards(&mut parameters, &mut [own, of_other.clone()]));
        refused(adam.step(&mut other, &mut of_other));
    }
    assert_eq!((weights(&parameters), adam), before);
}

#[test]
fn settings_out_of_their_range_make_no_optimiser() {
    let parameters = parameters::<f32>(&[&[1.0]]);
    let default = AdamConfig::default;
    for (key, config) in [
        (
            "learning_rate",
            AdamConfig {
                learning_rate: f64::NAN,
                ..default()
            },
        ),
        (
            "learning_rate",
            AdamConfig {
                learning_rate: 0.0,
                ..default()
            },
        ),
        (
            "rates.slow",
            AdamConfig {
                rates: BTreeMap::from([("slow".into(), -1.0)]),
                ..default()
            },
        ),
        (
            "beta1",
            AdamConfig {
                beta1: 1.0,
                ..default()
            },
        ),
        (
            "beta2",
            AdamConfig {
                beta2: f64::NAN,
                ..default()
            },
        ),
        (
            "epsilon",
            AdamConfig {
                epsilon: -1e-8,
                ..default()
            },
        ),
        (
            "clip_norm",
            AdamConfig {
                clip_norm: Some(f64::NAN),
                ..default()
            },
        ),
        (
            "rate_schedule.final_share",
            AdamConfig {
                rate_schedule: Some(RateSchedule {
                    final_share: f64::NAN,
                    ..RateSchedule::default()
                }),
                ..default()
            },
        ),
    ] {
        let error = Adam::new(config, &parameters).unwrap_err();
        assert_eq!(error.key, key);
    }
}

#[test]
fn the_bits_do_not_depend_on_the_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let start: Vec<f64> = (0..100_000).map(|i| (i as f64).sin()).collect();
        let mut parameters = parameters::<f32>(&[&start]);
        let mut adam = Adam::new(
            AdamConfig {
                clip_norm: Some(0.5),
                ..AdamConfig::default()
            },
            &parameters,
        )
        .unwrap();
        for t in 0..3 {
            let mut shards: Vec<_> = (0..4)
                .map(|s| gradients(&parameters, |_, i| ((i + s * 31 + t) as f64).cos()))
                .collect();
            pool.install(|| adam.step_shards(&mut parameters, &mut shards))
                .unwrap();
        }
        weights(&parameters)
    };
    assert_eq!(run(1), run(3));
}
