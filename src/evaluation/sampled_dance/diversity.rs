//! Within-dance diversity, which the paper asks people for ("how different are the two dances from
//! each other?", section 5.2) and which is counted here (spec, section 9).

use ndarray::{Array2, ArrayView2, Axis};

use crate::evaluation::pair_distance::mean_pair_distance;

/// Length of a piece, seconds.
const PIECE: f64 = 3.0;

/// How different the pieces of a dance are, in standard deviations; 0 where all have the same means
/// and deviations.
///
/// `standardised`: by the training part, `[frames, D]`. A piece of 3 s, one after the other from the
/// first frame, is the means and population deviations of its columns, 2 D numbers; the answer is
/// the mean distance of two, over all pairs, / sqrt(2 D). None of fewer than two pieces.
#[must_use]
pub fn within_dance_diversity(standardised: ArrayView2<'_, f64>, fps: f64) -> Option<f64> {
    let frames = (PIECE * fps).round().max(1.0) as usize;
    let columns = standardised.ncols();
    let pieces = standardised.axis_chunks_iter(Axis(0), frames);
    let whole = pieces.filter(|piece| piece.nrows() == frames);
    let mut numbers = Vec::new();
    for piece in whole {
        numbers.extend(piece.mean_axis(Axis(0))?);
        numbers.extend(piece.std_axis(Axis(0), 0.0));
    }
    let pieces = standardised.nrows() / frames;
    let pieces = Array2::from_shape_vec((pieces, 2 * columns), numbers).ok()?;
    let distance = mean_pair_distance(pieces.view())?;
    (columns > 0).then(|| distance / (2.0 * columns as f64).sqrt())
}
