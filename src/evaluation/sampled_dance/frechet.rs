//! Frechet pose and movement distance: how far the generated frames lie from the true ones (spec,
//! section 9).
//!
//! All take two sets of dances, raw `[frames, columns]` each, and give squared lengths, cm^2 and
//! rad^2 added up. None where moments cannot be told: too few frames, no or different columns,
//! numbers that are not finite. The order of the two sets does not matter.

use ndarray::{Array2, ArrayView2, Axis, concatenate, s};

use crate::evaluation::frechet::Moments;

/// Frames of a movement: pose, velocity and acceleration.
const MOVEMENT: usize = 3;

/// FPD: Frechet distance of the poses, one frame a vector, covariances with n - 1.
#[must_use]
pub fn fpd(reference: &[ArrayView2<'_, f64>], generated: &[ArrayView2<'_, f64>]) -> Option<f64> {
    distance(reference, generated, |dances| {
        Moments::of(end_to_end(dances)?.view())
    })
}

/// FMD: that of the movements, three consecutive frames of a dance a vector, every start.
#[must_use]
pub fn fmd(reference: &[ArrayView2<'_, f64>], generated: &[ArrayView2<'_, f64>]) -> Option<f64> {
    distance(reference, generated, |dances| {
        let movements: Vec<Array2<f64>> = dances.iter().map(|dance| movements(*dance)).collect();
        let movements: Vec<ArrayView2<'_, f64>> = movements.iter().map(|it| it.view()).collect();
        Moments::of(end_to_end(&movements)?.view())
    })
}

/// FPD as table 2 of the paper rests on it: the mean of x x^T stands for the covariance.
#[must_use]
pub fn fpd_as_published(
    reference: &[ArrayView2<'_, f64>],
    generated: &[ArrayView2<'_, f64>],
) -> Option<f64> {
    distance(reference, generated, |dances| {
        Moments::about_origin(end_to_end(dances)?.view())
    })
}

/// FMD as tables 2 and 4 of the paper rest on it: the mean of x x^T stands for the covariance, and
/// movements are cut without overlap from all dances laid end to end, so some join two dances.
#[must_use]
pub fn fmd_as_published(
    reference: &[ArrayView2<'_, f64>],
    generated: &[ArrayView2<'_, f64>],
) -> Option<f64> {
    distance(reference, generated, |dances| {
        let frames = end_to_end(dances)?;
        let (movements, columns) = (frames.nrows() / MOVEMENT, frames.ncols());
        let whole = frames.slice(s![..movements * MOVEMENT, ..]);
        let cut = whole.to_shape((movements, MOVEMENT * columns)).ok()?;
        Moments::about_origin(cut.view())
    })
}

/// A dance without one of its columns, such as the [root's height](super::HEIGHT), which in cm
/// rules these sums; the dance as it is where it has no such column.
#[must_use]
pub fn without(dance: ArrayView2<'_, f64>, column: usize) -> Array2<f64> {
    let kept: Vec<usize> = (0..dance.ncols()).filter(|at| *at != column).collect();
    dance.select(Axis(1), &kept)
}

fn distance(
    reference: &[ArrayView2<'_, f64>],
    generated: &[ArrayView2<'_, f64>],
    moments: impl Fn(&[ArrayView2<'_, f64>]) -> Option<Moments>,
) -> Option<f64> {
    moments(reference)?.distance(&moments(generated)?)
}

/// All frames of dances, in their order.
fn end_to_end(dances: &[ArrayView2<'_, f64>]) -> Option<Array2<f64>> {
    concatenate(Axis(0), dances).ok()
}

/// `[starts, 3 columns]`; no start in a dance of fewer than three frames.
fn movements(dance: ArrayView2<'_, f64>) -> Array2<f64> {
    let columns = dance.ncols();
    let starts = (dance.nrows() + 1).saturating_sub(MOVEMENT);
    Array2::from_shape_fn((starts, MOVEMENT * columns), |(start, at)| {
        dance[[start + at / columns, at % columns]]
    })
}
