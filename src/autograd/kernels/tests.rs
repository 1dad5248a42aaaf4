//! The kernels against plain formulas, on every instruction set of the machine.

use proptest::prelude::*;

use super::{dropout::Dropout, matrix::Operand, product::product_on, *};

/// The sets that this machine can run.
fn sets() -> Vec<Isa> {
    Isa::ALL
        .into_iter()
        .filter(|isa| isa.is_available())
        .collect()
}

/// A reproducible number in -1 to 1.
fn number(seed: u64) -> f64 {
    let mut z = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    ((z >> 11) as f64) / (1u64 << 52) as f64 - 1.0
}

/// `rows` rows `stride` apart, NaN in the gaps: reading a gap would show in the result.
fn matrix<T: Real>(rows: usize, cols: usize, stride: usize, seed: u64) -> Vec<T> {
    let mut data = vec![T::nan(); (rows * stride).saturating_sub(stride - cols)];
    for i in 0..rows {
        for j in 0..cols {
            data[i * stride + j] = T::from_f64(number(seed + (i * cols + j) as u64));
        }
    }
    data
}

/// C (+)= A B for operands by index, in f64 with compensated sums; and the sum of the sizes of the
/// terms, the measure of a rounding error.
fn naive(k: usize, a: impl Fn(usize) -> f64, b: impl Fn(usize) -> f64, start: f64) -> (f64, f64) {
    let (mut sum, mut lost, mut size) = (start, 0.0, start.abs());
    for p in 0..k {
        let term = a(p) * b(p);
        let next: f64 = sum + term;
        lost += if sum.abs() >= term.abs() {
            (sum - next) + term
        } else {
            (term - next) + sum
        };
        sum = next;
        size += term.abs();
    }
    (sum + lost, size)
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    Plain,
    RightTransposed,
    LeftTransposed,
    Packed,
    PackedTransposed,
}

const FORMS: [Form; 5] = [
    Form::Plain,
    Form::RightTransposed,
    Form::LeftTransposed,
    Form::Packed,
    Form::PackedTransposed,
];

/// Computes one form on one set.
fn run<T: Real>(isa: Isa, form: Form, a: Mat<T>, b: Mat<T>, c: MatMut<T>, accumulate: bool) {
    match form {
        Form::Plain => product_on(isa, Operand::new(a), Operand::new(b), c, accumulate),
        Form::RightTransposed => {
            product_on(isa, Operand::new(a), Operand::transpose(b), c, accumulate);
        }
        Form::LeftTransposed => {
            product_on(isa, Operand::transpose(a), Operand::new(b), c, accumulate);
        }
        Form::Packed => {
            product_packed(a, &Packed::new_on(isa, Operand::new(b)), c, accumulate);
        }
        Form::PackedTransposed => {
            product_packed(
                a,
                &Packed::new_on(isa, Operand::transpose(b)),
                c,
                accumulate,
            );
        }
    }
}

/// Checks every form and set at one shape, and that nothing outside C's columns is written.
fn check<T: Real>((m, k, n): (usize, usize, usize), gap: usize, accumulate: bool) {
    for form in FORMS {
        let left = form == Form::LeftTransposed;
        let right = matches!(form, Form::RightTransposed | Form::PackedTransposed);
        let (ar, ac) = if left { (k, m) } else { (m, k) };
        let (br, bc) = if right { (n, k) } else { (k, n) };
        let a = matrix::<T>(ar, ac, ac + gap, 1);
        let b = matrix::<T>(br, bc, bc + gap, 1 << 40);
        let start = matrix::<T>(m, n, n + gap, 1 << 41);
        for isa in sets() {
            let mut c = start.clone();
            if !accumulate {
                // What was there before must not matter, be it NaN.
                for i in 0..m {
                    c[i * (n + gap)..][..n].fill(T::nan());
                }
            }
            run(
                isa,
                form,
                Mat::strided(&a, ar, ac, ac + gap),
                Mat::strided(&b, br, bc, bc + gap),
                MatMut::strided(&mut c, m, n, n + gap),
                accumulate,
            );
            for (at, &found) in c.iter().enumerate() {
                let (i, j) = (at / (n + gap), at % (n + gap));
                if j >= n {
                    assert!(
                        found.is_nan(),
                        "{form:?} on {isa:?} wrote beside C at ({i}, {j})"
                    );
                    continue;
                }
                let (a_at, b_at) = (
                    |p: usize| {
                        a[if left {
                            p * (ac + gap) + i
                        } else {
                            i * (ac + gap) + p
                        }]
                        .to_f64()
                    },
                    |p: usize| {
                        b[if right {
                            j * (bc + gap) + p
                        } else {
                            p * (bc + gap) + j
                        }]
                        .to_f64()
                    },
                );
                let begin = if accumulate { start[at].to_f64() } else { 0.0 };
                let (expected, size) = naive(k, a_at, b_at, begin);
                let bound = (k + 2) as f64 * T::epsilon().to_f64() * size;
                assert!(
                    (found.to_f64() - expected).abs() <= bound,
                    "{form:?} on {isa:?}, {m} x {k} x {n}, ({i}, {j}): {found} for {expected}"
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn f32_products_agree_with_the_naive_product(
        shape in (0usize..40, 0usize..40, 0usize..150), gap in 0usize..4, accumulate: bool,
    ) {
        check::<f32>(shape, gap, accumulate);
    }

    #[test]
    fn f64_products_agree_with_the_naive_product(
        shape in (0usize..20, 0usize..20, 0usize..40), gap in 0usize..4, accumulate: bool,
    ) {
        check::<f64>(shape, gap, accumulate);
    }
}

#[test]
fn products_over_several_blocks_agree_with_the_naive_product() {
    for shape in [(1, 520, 530), (3, 257, 40), (29, 300, 545), (14, 513, 33)] {
        check::<f32>(shape, 1, true);
        check::<f32>(shape, 0, false);
    }
}

#[test]
fn every_number_of_rows_has_its_kernels() {
    for m in 1..=30 {
        for n in [1, 8, 9, 16, 17, 31, 32, 33, 63, 64, 65, 128, 129] {
            check::<f32>((m, 3, n), 0, true);
        }
    }
}

#[test]
fn a_row_has_the_same_bits_whatever_else_is_in_the_call_and_on_every_kernel() {
    let (m, k, n) = (47, 301, 71);
    let a = matrix::<f32>(m, k, k, 3);
    let b = matrix::<f32>(k, n, n, 1 << 40);
    let of_rows = |isa, form, first: usize, rows: usize| {
        let mut c = vec![0.0; rows * n];
        let a = Mat::new(&a[first * k..], rows, k);
        run(
            isa,
            form,
            a,
            Mat::new(&b, k, n),
            MatMut::new(&mut c, rows, n),
            false,
        );
        c
    };
    let kernels: Vec<Isa> = sets()
        .into_iter()
        .filter(|&isa| isa != Isa::Portable)
        .collect();
    for &isa in &kernels {
        let whole = of_rows(kernels[0], Form::Packed, 0, m);
        for form in [Form::Plain, Form::Packed] {
            for rows in [1, 2, 5, 14, 15, 30] {
                let part = of_rows(isa, form, 7, rows);
                assert!(
                    part == whole[7 * n..(7 + rows) * n],
                    "{rows} rows, {form:?} on {isa:?}"
                );
            }
        }
    }
}

#[test]
fn nan_and_infinity_spread_as_in_the_naive_product() {
    let (m, k, n) = (17, 9, 37);
    for isa in sets() {
        for form in FORMS {
            for (bad, zero_row) in [
                (f32::NAN, true),
                (f32::INFINITY, true),
                (f32::INFINITY, false),
            ] {
                let left = form == Form::LeftTransposed;
                let right = matches!(form, Form::RightTransposed | Form::PackedTransposed);
                let (ar, ac) = if left { (k, m) } else { (m, k) };
                let (br, bc) = if right { (n, k) } else { (k, n) };
                let a = vec![if zero_row { 0.0 } else { 1.0 }; m * k];
                let mut b = vec![1.0; k * n];
                // Element (4, 20) of B.
                b[if right { 20 * k + 4 } else { 4 * n + 20 }] = bad;
                let mut c = vec![0.0; m * n];
                run(
                    isa,
                    form,
                    Mat::new(&a, ar, ac),
                    Mat::new(&b, br, bc),
                    MatMut::new(&mut c, m, n),
                    true,
                );
                for (at, c) in c.iter().enumerate() {
                    let whole = if zero_row { 0.0 } else { k as f32 };
                    match (at % n == 20, zero_row) {
                        (false, _) => assert_eq!(*c, whole, "{form:?} on {isa:?}"),
                        (true, true) => assert!(c.is_nan(), "{form:?} on {isa:?}: 0 * {bad} = {c}"),
                        (true, false) => assert_eq!(*c, bad, "{form:?} on {isa:?}"),
                    }
                }
            }
        }
    }
}

#[test]
fn an_empty_sum_clears_or_keeps() {
    for isa in sets() {
        for form in FORMS {
            for accumulate in [false, true] {
                let mut c = vec![5.0f32; 6];
                let (a, b) = (Mat::new(&[], 2, 0), Mat::new(&[], 0, 3));
                let (at, bt) = (Mat::new(&[], 0, 2), Mat::new(&[], 3, 0));
                let a = if form == Form::LeftTransposed { at } else { a };
                let right = matches!(form, Form::RightTransposed | Form::PackedTransposed);
                run(
                    isa,
                    form,
                    a,
                    if right { bt } else { b },
                    MatMut::new(&mut c, 2, 3),
                    accumulate,
                );
                let expected = if accumulate { 5.0 } else { 0.0 };
                assert!(
                    c.iter().all(|&c| c == expected),
                    "{form:?} on {isa:?}: {c:?}"
                );
            }
        }
    }
}

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
    let masks: Vec<Vec<bool>> = [0, 1, 2, 1 << 32, u64::MAX]
        .map(|key| (0..n).map(|i| Dropout::new(key, 0.5).keep(i)).collect())
        .to_vec();
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
