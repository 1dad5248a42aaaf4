//! Onset peaks: the frames at which something begins.

/// How far a peak is above the mean around it, of an envelope from 0 to 1.
const ABOVE: f64 = 0.07;
/// Frames to both sides of which the mean is taken.
const AROUND: usize = 3;

/// The frames whose onset strength, scaled to 0..1 over the whole sound, is at least 0.07 above the
/// mean of the three frames to both sides and itself (librosa's `onset_detect`, whose distances of
/// 30 ms are no frame here).
#[must_use]
pub fn onset_peaks(onset: &[f64]) -> Vec<usize> {
    let least = onset.iter().copied().fold(f64::INFINITY, f64::min);
    let most = onset.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // A flat envelope has none, whatever it is divided by.
    if most <= least {
        return Vec::new();
    }
    let scaled: Vec<f64> = onset.iter().map(|x| (x - least) / (most - least)).collect();
    let is_peak = |&frame: &usize| {
        let end = (frame + AROUND + 1).min(scaled.len());
        let around = &scaled[frame.saturating_sub(AROUND)..end];
        let mean = around.iter().sum::<f64>() / around.len() as f64;
        scaled[frame] >= mean + ABOVE
    };
    (0..scaled.len()).filter(is_peak).collect()
}
