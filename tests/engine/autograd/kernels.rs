//! Kernels: shapes that do not fit, the exponentials' bounds, dropout.

use keydance::autograd::kernels::{Mat, MatMut, Real, dropout_into, product};

#[test]
#[should_panic(expected = "does not give")]
fn shapes_that_do_not_fit_panic() {
    let (a, b, mut c) = (vec![0.0f32; 6], vec![0.0; 6], vec![0.0; 4]);
    product(
        Mat::new(&a, 2, 3),
        Mat::new(&b, 2, 3),
        MatMut::new(&mut c, 2, 2),
        false,
    );
}

#[test]
#[should_panic(expected = "does not fit")]
fn a_shape_changed_after_its_check_panics() {
    let (a, b, mut c) = (vec![0.0f32; 6], vec![0.0; 6], vec![0.0; 4]);
    let mut a = Mat::new(&a, 2, 3);
    a.stride = 100;
    product(a, Mat::new(&b, 3, 2), MatMut::new(&mut c, 2, 2), false);
}

/// The distance of `found` from `expected` in units of the last place of a f32 near `expected`.
fn ulps(found: f32, expected: f64) -> f64 {
    let nearest = expected as f32;
    if !nearest.is_finite() || !found.is_finite() {
        return if nearest == found { 0.0 } else { f64::INFINITY };
    }
    let exponent = (expected.abs().log2().floor() as i32).clamp(-126, 127);
    (f64::from(found) - expected).abs() / 2f64.powi(exponent - 23)
}

/// The largest distance over every 1,009th f32, on slices with a length that leaves a remainder.
fn worst(function: fn(&mut [f32]), exact: fn(f64) -> f64) -> f64 {
    let inputs: Vec<f32> = (0..=u32::MAX)
        .step_by(1009)
        .map(f32::from_bits)
        .filter(|x| x.is_finite())
        .collect();
    let mut worst = 0f64;
    for inputs in inputs.chunks(1023) {
        let mut outputs = inputs.to_vec();
        function(&mut outputs);
        for (&x, &y) in inputs.iter().zip(&outputs) {
            let distance = ulps(y, exact(f64::from(x)));
            assert!(
                distance < 4.0,
                "{y:e} for {:e} at {x:e}",
                exact(f64::from(x))
            );
            worst = worst.max(distance);
        }
    }
    worst
}

#[test]
fn exponential_is_within_its_bound() {
    let found = worst(f32::exp_slice, f64::exp);
    assert!(found <= 1.5, "{found} ulp");
}

#[test]
fn tanh_is_within_its_bound() {
    let found = worst(f32::tanh_slice, f64::tanh);
    assert!(found <= 2.0, "{found} ulp");
}

#[test]
fn sigmoid_is_within_its_bound() {
    let found = worst(f32::sigmoid_slice, |x| 1.0 / (1.0 + (-x).exp()));
    assert!(found <= 2.5, "{found} ulp");
}

#[test]
fn exponentials_have_their_limits_and_keep_nan() {
    let run = |function: fn(&mut [f32])| {
        let mut x = [f32::NEG_INFINITY, f32::INFINITY, 0.0, f32::NAN, -f32::NAN];
        function(&mut x);
        assert!(x[3].is_nan() && x[4].is_nan());
        [x[0], x[1], x[2]]
    };
    assert_eq!(run(f32::exp_slice), [0.0, f32::INFINITY, 1.0]);
    assert_eq!(run(f32::tanh_slice), [-1.0, 1.0, 0.0]);
    assert_eq!(run(f32::sigmoid_slice), [0.0, 1.0, 0.5]);
    assert!((-0.0f32).tanh_lane().is_sign_negative());
}

#[test]
fn lanes_and_slices_have_the_same_bits() {
    let x: Vec<f32> = (0..4001).map(|i| (i as f32 - 2000.0) / 19.0).collect();
    let check = |slice: fn(&mut [f32]), lane: fn(f32) -> f32| {
        let mut y = x.clone();
        slice(&mut y);
        assert_eq!(y, x.iter().map(|&x| lane(x)).collect::<Vec<_>>());
    };
    check(f32::exp_slice, f32::exp_lane);
    check(f32::tanh_slice, f32::tanh_lane);
    check(f32::sigmoid_slice, f32::sigmoid_lane);
    check(f32::gelu_slice, f32::gelu_lane);
}

#[test]
fn dropout_drops_with_its_probability_and_scales_the_rest() {
    let x = vec![3.0f32; 1 << 20];
    for p in [0.0, 0.1, 0.5, 0.9, 1.0] {
        let mut out = vec![f32::NAN; x.len()];
        dropout_into(42, p, &x, &mut out);
        let scaled = (3.0 / (1.0 - p)) as f32;
        let kept = out.iter().filter(|&&y| y != 0.0).count() as f64 / x.len() as f64;
        assert!(
            out.iter()
                .all(|&y| y == 0.0 || (y - scaled).abs() <= 1e-6 * scaled)
        );
        // Five standard deviations of the share kept.
        assert!((kept - (1.0 - p)).abs() <= 5.0 * (p * (1.0 - p) / x.len() as f64).sqrt() + 1e-5);
    }
}

#[test]
fn dropout_masks_are_reproducible_and_unrelated_between_keys() {
    let n = 1 << 18;
    let masks = [0, 1, 2, 1 << 32, u64::MAX].map(|key| {
        let mut kept = vec![0f32; n as usize];
        dropout_into(key, 0.5, &vec![1.0; n as usize], &mut kept);
        kept.iter().map(|&x| x != 0.0).collect::<Vec<bool>>()
    });
    let agreement = |a: &[bool], b: &[bool]| {
        a.iter().zip(b).filter(|(a, b)| a == b).count() as f64 / a.len().min(b.len()) as f64
    };
    let deviation = 5.0 * 0.5 / f64::from(n).sqrt();
    for (i, a) in masks.iter().enumerate() {
        for lag in [1, 2, 16, 64] {
            assert!(
                (agreement(a, &a[lag..]) - 0.5).abs() < deviation,
                "mask {i}, lag {lag}"
            );
        }
        for b in &masks[..i] {
            assert!((agreement(a, b) - 0.5).abs() < deviation);
        }
    }
    let x: Vec<f64> = (0..n).map(f64::from).collect();
    let mut out = vec![0.0; x.len()];
    dropout_into(2, 0.5, &x, &mut out);
    for (i, (x, y)) in x.iter().zip(&out).enumerate() {
        assert_eq!(*y, if masks[2][i] { 2.0 * x } else { 0.0 });
    }
}
