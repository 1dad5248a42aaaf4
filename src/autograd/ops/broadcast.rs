//! Shapes that broadcast as numpy's do, for the elementwise operations of two operands.

use ndarray::{ArrayViewD, IxDyn, Zip};

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

/// Adds a gradient of the output's shape, its numbers in row-major order, to that of an operand,
/// summed over the axes along which the operand was broadcast.
pub(super) fn add_reduced<T: Real>(
    target: Target<'_, T>,
    operand: &[usize],
    shape: &[usize],
    gradient: impl Iterator<Item = T>,
) {
    let data = target.so_far();
    if operand == shape {
        data.iter_mut().zip(gradient).for_each(|(d, g)| *d += g);
        return;
    }
    let strides = broadcast_strides(operand, shape);
    let mut index = vec![0; shape.len()];
    let mut place = 0;
    for g in gradient {
        data[place] += g;
        // On to the next number of the output, the last axis running fastest.
        for axis in (0..shape.len()).rev() {
            index[axis] += 1;
            place += strides[axis];
            if index[axis] < shape[axis] {
                break;
            }
            index[axis] = 0;
            place -= strides[axis] * shape[axis];
        }
    }
}

/// How far apart in an operand neighbours along each axis of `shape` lie: 0 where the operand was
/// broadcast.
fn broadcast_strides(operand: &[usize], shape: &[usize]) -> Vec<usize> {
    let mut strides = vec![0; shape.len()];
    let mut stride = 1;
    for (strides, &size) in strides.iter_mut().rev().zip(operand.iter().rev()) {
        if size != 1 {
            *strides = stride;
        }
        stride *= size;
    }
    strides
}
