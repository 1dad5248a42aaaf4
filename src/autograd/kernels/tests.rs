//! The kernels against plain formulas, on every instruction set of the machine.

use proptest::prelude::*;

use super::{matrix::Operand, product::product_on, *};

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
