//! The arithmetic under the engine: matrix products, those of attention's small windows, vectorised
//! exponentials, the normal distribution, dropout masks.
//!
//! The only place of the crate with `unsafe` code. Everything public here is safe: operands are
//! slices with a shape, and a shape that does not fit its slice or its partners panics.
//!
//! An instruction set is chosen once, at run time ([`Isa`]); `KEYDANCE_ISA` in the environment
//! overrules the choice. f32 products have kernels of their own for AVX-512 and for AVX2 with FMA;
//! f64 products, and f32 products on other CPUs, go to `matrixmultiply`.
#![allow(unsafe_code)]

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod blocked;
mod buffer;
mod dropout;
mod gemm;
mod isa;
mod math;
mod matrix;
mod normal;
mod packed;
mod product;
mod real;
mod windows;

#[cfg(test)]
mod tests;

pub use dropout::{drop_in_place, dropout_into, dropped_into};
pub use isa::{Isa, IsaError, vectorised};
pub use matrix::{Mat, MatMut};
pub use packed::{Packed, Repacked};
pub use product::{product, product_at, product_bt, product_packed};
pub use real::Real;
pub use windows::{
    CHUNK, WindowRows, WindowWeights, scratch_len, window_scores, window_softmax,
    window_softmax_backward, window_sums,
};
