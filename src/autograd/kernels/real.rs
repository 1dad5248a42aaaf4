//! The number types of the engine.

use ndarray::NdFloat;
use serde::{Serialize, de::DeserializeOwned};

use super::{gemm::Gemm, isa::vectorised, math, normal};

/// A floating point type that the engine computes in: f32 or f64.
///
/// The functions on slices work in place and are vectorised for f32 (see the bounds at each); for
/// f64 they are those of the standard library. The `_lane` functions are the same for one number,
/// to be used in closures given to [`vectorised`].
pub trait Real:
    NdFloat + Default + std::iter::Sum + Serialize + DeserializeOwned + Gemm + 'static
{
    /// The nearest number of this type.
    fn from_f64(x: f64) -> Self;

    /// The number in f64, exactly.
    fn to_f64(self) -> f64;

    /// e^x; f32: within 1.5 ulp.
    fn exp_lane(self) -> Self;

    /// tanh x; f32: within 2 ulp.
    fn tanh_lane(self) -> Self;

    /// 1 / (1 + e^-x); f32: within 2.5 ulp.
    fn sigmoid_lane(self) -> Self;

    /// x Phi(x), Phi the distribution function of the standard normal; f32: within 2.1e-7 |x|.
    fn gelu_lane(self) -> Self;

    /// The derivative of [`Real::gelu_lane`]; f32: within 2.5e-7.
    fn gelu_slope_lane(self) -> Self;

    /// e^x of each element, as [`Real::exp_lane`].
    fn exp_slice(x: &mut [Self]) {
        vectorised(
            #[inline(always)]
            || x.iter_mut().for_each(|x| *x = x.exp_lane()),
        );
    }

    /// tanh x of each element, as [`Real::tanh_lane`].
    fn tanh_slice(x: &mut [Self]) {
        vectorised(
            #[inline(always)]
            || x.iter_mut().for_each(|x| *x = x.tanh_lane()),
        );
    }

    /// 1 / (1 + e^-x) of each element, as [`Real::sigmoid_lane`].
    fn sigmoid_slice(x: &mut [Self]) {
        vectorised(
            #[inline(always)]
            || x.iter_mut().for_each(|x| *x = x.sigmoid_lane()),
        );
    }

    /// x Phi(x) of each element, as [`Real::gelu_lane`].
    fn gelu_slice(x: &mut [Self]) {
        vectorised(
            #[inline(always)]
            || x.iter_mut().for_each(|x| *x = x.gelu_lane()),
        );
    }
}

impl Real for f32 {
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x as f32
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    #[inline(always)]
    fn exp_lane(self) -> Self {
        math::exp(self)
    }

    #[inline(always)]
    fn tanh_lane(self) -> Self {
        math::tanh(self)
    }

    #[inline(always)]
    fn sigmoid_lane(self) -> Self {
        math::sigmoid(self)
    }

    #[inline(always)]
    fn gelu_lane(self) -> Self {
        normal::gelu(self)
    }

    #[inline(always)]
    fn gelu_slope_lane(self) -> Self {
        normal::gelu_slope(self)
    }
}

impl Real for f64 {
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }

    #[inline(always)]
    fn exp_lane(self) -> Self {
        self.exp()
    }

    #[inline(always)]
    fn tanh_lane(self) -> Self {
        self.tanh()
    }

    #[inline(always)]
    fn sigmoid_lane(self) -> Self {
        // As for f32: e^-|x| cannot overflow.
        let e = (-self.abs()).exp();
        (if self < 0.0 { e } else { 1.0 }) / (1.0 + e)
    }

    #[inline(always)]
    fn gelu_lane(self) -> Self {
        normal::gelu_f64(self)
    }

    #[inline(always)]
    fn gelu_slope_lane(self) -> Self {
        normal::gelu_slope_f64(self)
    }
}
