//! Shapes that broadcast as numpy's do, for the elementwise operations of two operands.

use ndarray::{ArrayD, ArrayViewD, Axis, IxDyn, Zip};

use super::shapes_error;
use crate::autograd::error::AutogradError;
use crate::autograd::{Real, Target};

/// The common shape of two operands.
pub(super) fn broadcast_shape(
    operation: &'static str,
    a: &[usize],
    b: &[usize],
) -> Result<Vec<usize>, AutogradError> {
    let axes = a.len().max(b.len());
    let size = |shape: &[usize], axis: usize| {
        let missing = axes - shape.len();
        if axis < missing {
            1
        } else {
            shape[axis - missing]
        }
    };
    (0..axes)
        .map(|axis| match (size(a, axis), size(b, axis)) {
            (m, n) if m == n => Ok(m),
            (1, n) => Ok(n),
            (m, 1) => Ok(m),
            _ => Err(shapes_error(
                operation,
                a,
                b,
                "axes that are equal or 1, counted from the last",
            )),
        })
        .collect()
}

/// out = f(a, b), with both broadcast to `shape`.
pub(super) fn zip_into<T: Real>(
    out: &mut [T],
    shape: &[usize],
    a: ArrayViewD<'_, T>,
    b: ArrayViewD<'_, T>,
    f: impl Fn(T, T) -> T,
) {
    if let (Some(x), Some(y)) = (a.as_slice(), b.as_slice())
        && a.shape() == shape
        && b.shape() == shape
    {
        for ((o, &x), &y) in out.iter_mut().zip(x).zip(y) {
            *o = f(x, y);
        }
        return;
    }
    let (Ok(out), Some(a), Some(b)) = (
        ndarray::ArrayViewMutD::from_shape(IxDyn(shape), out),
        a.broadcast(IxDyn(shape)),
        b.broadcast(IxDyn(shape)),
    ) else {
        return;
    };
    Zip::from(out)
        .and(&a)
        .and(&b)
        .for_each(|o, &x, &y| *o = f(x, y));
}

/// Adds a gradient of the output's shape to that of an operand, summed over the axes along which the operand was broadcast.
pub(super) fn add_reduced<T: Real>(
    target: Target<'_, T>,
    operand: &[usize],
    shape: &[usize],
    gradient: Vec<T>,
) {
    if operand == shape {
        target.add(|i| gradient[i]);
        return;
    }
    let Ok(mut sum) = ArrayD::from_shape_vec(IxDyn(shape), gradient) else {
        return;
    };
    while sum.ndim() > operand.len() {
        sum = sum.sum_axis(Axis(0));
    }
    for (axis, &size) in operand.iter().enumerate() {
        if size == 1 && sum.shape()[axis] != 1 {
            sum = sum.sum_axis(Axis(axis)).insert_axis(Axis(axis));
        }
    }
    let sum = sum.as_standard_layout().into_owned();
    if let Some(values) = sum.as_slice() {
        target.add(|i| values[i]);
    }
}
