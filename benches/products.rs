//! Matrix products at the models' shapes in FLOP/s, beside the machine's peak and two libraries;
//! and the vectorised functions in elements a second.
//!
//! `cargo bench --bench products`; a filter such as `-- 112x256x512` picks one shape `m x k x n`.

use std::{hint::black_box, time::Duration};

use criterion::{
    BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main, measurement::WallTime,
};
use keydance::autograd::kernels::{
    Isa, Mat, MatMut, Packed, Real, dropout_into, product, product_at, product_bt, product_packed,
};

/// Columns (k, n) of the weights that activations are multiplied with.
const WEIGHTS: [(usize, usize); 10] = [
    (256, 256),
    (256, 512),
    (256, 768),
    (512, 256),
    (1024, 1024),
    (512, 1024),
    (256, 1024),
    (77, 512),
    (256, 142),
    (10, 1024),
];
const ROWS: [usize; 7] = [1, 7, 16, 32, 112, 224, 448];

fn numbers(len: usize) -> Vec<f32> {
    (0..len).map(|i| (i % 17) as f32 / 17.0 - 0.5).collect()
}

/// C (+)= A B by `matrixmultiply`; strides of A are (row, column).
fn with_matrixmultiply(
    (m, k, n): (usize, usize, usize),
    (a, a_row, a_col): (&[f32], usize, usize),
    b: &[f32],
    beta: f32,
    c: &mut [f32],
) {
    let (a_row, a_col, row) = (a_row as isize, a_col as isize, n as isize);
    let (a, b, c) = (a.as_ptr(), b.as_ptr(), c.as_mut_ptr());
    // SAFETY: the slices hold m x k, k x n and m x n numbers.
    unsafe { matrixmultiply::sgemm(m, k, n, 1.0, a, a_row, a_col, b, row, 1, beta, c, row, 1) }
}

/// C (+)= A B by `gemm`; strides of A are (row, column).
fn with_gemm(
    (m, k, n): (usize, usize, usize),
    (a, a_row, a_col): (&[f32], usize, usize),
    b: &[f32],
    beta: f32,
    c: &mut [f32],
) {
    let (a_row, a_col, row) = (a_row as isize, a_col as isize, n as isize);
    // SAFETY: the slices hold m x k, k x n and m x n numbers.
    unsafe {
        gemm::gemm(
            m,
            n,
            k,
            c.as_mut_ptr(),
            1,
            row,
            beta != 0.0,
            a.as_ptr(),
            a_col,
            a_row,
            b.as_ptr(),
            1,
            row,
            beta,
            1.0,
            false,
            false,
            false,
            gemm::Parallelism::None,
        );
    }
}

fn short<'a>(criterion: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group
        .sample_size(20)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(400));
    group
}

/// Fused multiply-adds in registers: what no product can exceed.
fn peak(criterion: &mut Criterion) {
    let mut group = short(criterion, "peak");
    let rounds = 4096;
    match Isa::detected() {
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => {
            group.throughput(Throughput::Elements(2 * 16 * 12 * rounds));
            // SAFETY: the CPU has AVX-512.
            group.bench_function("AVX-512", |b| {
                b.iter(|| unsafe { chains512(black_box(rounds)) })
            });
        }
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => {
            group.throughput(Throughput::Elements(2 * 8 * 12 * rounds));
            // SAFETY: the CPU has AVX2 and FMA.
            group.bench_function("AVX2", |b| {
                b.iter(|| unsafe { chains256(black_box(rounds)) })
            });
        }
        _ => {}
    }
    group.finish();
}

/// Twelve independent chains of multiply-adds on 16 lanes.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn chains512(rounds: u64) -> f32 {
    use std::arch::x86_64::*;
    let mut sums = [_mm512_set1_ps(0.5); 12];
    let (factor, summand) = (_mm512_set1_ps(0.999), _mm512_set1_ps(1e-3));
    for _ in 0..rounds {
        for sum in &mut sums {
            *sum = _mm512_fmadd_ps(*sum, factor, summand);
        }
    }
    sums.iter().map(|&sum| _mm512_reduce_add_ps(sum)).sum()
}

/// Twelve independent chains of multiply-adds on 8 lanes.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn chains256(rounds: u64) -> f32 {
    use std::arch::x86_64::*;
    let mut sums = [_mm256_set1_ps(0.5); 12];
    let (factor, summand) = (_mm256_set1_ps(0.999), _mm256_set1_ps(1e-3));
    for _ in 0..rounds {
        for sum in &mut sums {
            *sum = _mm256_fmadd_ps(*sum, factor, summand);
        }
    }
    sums.iter().map(|&sum| _mm256_cvtss_f32(sum)).sum()
}

fn activations(criterion: &mut Criterion) {
    for (k, n) in WEIGHTS {
        let b = numbers(k * n);
        let packed = Packed::new(Mat::new(&b, k, n));
        for m in ROWS {
            let a = numbers(m * k);
            let mut c = vec![0.0; m * n];
            let mut group = short(criterion, &format!("product {m}x{k}x{n}"));
            group.throughput(Throughput::Elements((2 * m * k * n) as u64));
            let shape = (m, k, n);
            let left = Mat::new(&a, m, k);
            group.bench_function("packed", |bench| {
                bench.iter(|| product_packed(left, &packed, MatMut::new(&mut c, m, n), false));
            });
            group.bench_function("plain", |bench| {
                let b = Mat::new(&b, k, n);
                bench.iter(|| product(left, b, MatMut::new(&mut c, m, n), false));
            });
            group.bench_function("transposed", |bench| {
                let b = Mat::new(&b, n, k);
                bench.iter(|| product_bt(left, b, MatMut::new(&mut c, m, n), false));
            });
            group.bench_function("matrixmultiply", |bench| {
                bench.iter(|| with_matrixmultiply(shape, (&a, k, 1), &b, 0.0, &mut c));
            });
            group.bench_function("gemm", |bench| {
                bench.iter(|| with_gemm(shape, (&a, k, 1), &b, 0.0, &mut c));
            });
            group.finish();
        }
    }
}

fn weight_gradients(criterion: &mut Criterion) {
    let k = 512;
    for (m, n) in [
        (256, 256),
        (256, 768),
        (512, 256),
        (512, 1024),
        (1024, 1024),
    ] {
        let (a, b) = (numbers(k * m), numbers(k * n));
        let mut c = vec![0.0; m * n];
        let mut group = short(criterion, &format!("gradient {m}x{k}x{n}"));
        group.throughput(Throughput::Elements((2 * m * k * n) as u64));
        group.bench_function("ours", |bench| {
            let (a, b) = (Mat::new(&a, k, m), Mat::new(&b, k, n));
            bench.iter(|| product_at(a, b, MatMut::new(&mut c, m, n), true));
        });
        group.bench_function("matrixmultiply", |bench| {
            bench.iter(|| with_matrixmultiply((m, k, n), (&a, 1, m), &b, 1.0, &mut c));
        });
        group.bench_function("gemm", |bench| {
            bench.iter(|| with_gemm((m, k, n), (&a, 1, m), &b, 1.0, &mut c));
        });
        group.finish();
    }
}

fn packing(criterion: &mut Criterion) {
    let (k, n) = (512, 1024);
    let b = numbers(k * n);
    let mut group = short(criterion, "packing 512x1024");
    group.throughput(Throughput::Elements((k * n) as u64));
    group.bench_function("plain", |bench| {
        bench.iter(|| Packed::new(Mat::new(&b, k, n)))
    });
    group.bench_function("transposed", |bench| {
        bench.iter(|| Packed::transposed(Mat::new(&b, n, k)));
    });
    group.finish();
}

fn functions(criterion: &mut Criterion) {
    let x: Vec<f32> = numbers(4096).iter().map(|x| 10.0 * x).collect();
    let mut y = x.clone();
    let mut group = short(criterion, "functions");
    group.throughput(Throughput::Elements(x.len() as u64));
    let mut vectorised = |name: &str, function: fn(&mut [f32])| {
        group.bench_function(name, |bench| {
            bench.iter(|| {
                y.copy_from_slice(&x);
                function(black_box(&mut y));
            });
        });
    };
    vectorised("exp", f32::exp_slice);
    vectorised("tanh", f32::tanh_slice);
    vectorised("sigmoid", f32::sigmoid_slice);
    let mut standard = |name: &str, function: fn(f32) -> f32| {
        group.bench_function(name, |bench| {
            bench.iter(|| y.iter_mut().zip(&x).for_each(|(y, x)| *y = function(*x)));
        });
    };
    standard("std exp", f32::exp);
    standard("std tanh", f32::tanh);
    group.bench_function("dropout", |bench| {
        bench.iter(|| dropout_into(black_box(5), 0.1, &x, black_box(&mut y)));
    });
    group.finish();
}

criterion_group!(
    benches,
    peak,
    activations,
    weight_gradients,
    packing,
    functions
);
criterion_main!(benches);
