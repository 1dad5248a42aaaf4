//! Onset strength: how much louder the bands became.

use ndarray::ArrayView2;

/// Frames by which the envelope is late: one of the difference, one of the window's centring.
const LATE: usize = 2;

/// The onset strength of each frame of mel decibels [frames, bands]: frame k holds the mean over
/// the bands of what they rose from frame k - 2 to k - 1, falls left out; 0 in the first two frames
/// (librosa's `onset_strength` with a lag of 1, centred).
#[must_use]
pub fn onset_strength(decibels: ArrayView2<'_, f64>) -> Vec<f64> {
    let (frames, bands) = decibels.dim();
    let mut strength = vec![0.0; frames];
    let rows = decibels.rows().into_iter();
    let pairs = rows.clone().zip(rows.skip(1));
    for (onset, (before, now)) in strength.iter_mut().skip(LATE).zip(pairs) {
        let rises = now.iter().zip(before).map(|(now, before)| now - before);
        *onset = rises.map(|rise| rise.max(0.0)).sum::<f64>() / bands as f64;
    }
    strength
}
