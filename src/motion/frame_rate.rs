//! The rate that a rounded frame time means.

/// Rates at which motion is recorded, frames a second.
const RATES: [f64; 19] = [
    12.0, 15.0, 24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 72.0, 75.0, 90.0, 100.0, 120.0, 144.0, 150.0,
    200.0, 240.0, 300.0, 360.0,
];
/// A television rate by the whole one beside it: 29.97 by 30.
const TELEVISION: f64 = 1000.0 / 1001.0;
/// Frame times with fewer decimals are no rounded ones: 0.04, 0.02 and 0.01 are exact.
const FEWEST_DECIMALS: usize = 3;
/// A frame time that is nearer to a rate than this needs no other, as a share.
const EXACT: f64 = 5e-5;

/// Whether a rate, or a television rate by the whole one beside it, has no fraction but that of a
/// rounded frame time.
pub fn is_whole(rate: f64) -> bool {
    let near = |rate: f64| (rate / rate.round() - 1.0).abs() <= 2.0 * EXACT;
    near(rate) || near(rate / TELEVISION)
}

/// The rate that a frame time of a file means, frames a second, where it is not the one that it
/// gives: 30 for 0.033 s, 120 for 0.0083 s, none for 0.0333333 s or 0.05 s.
///
/// The frame time is taken as rounded at its last decimal other than 0, or else as cut off there.
pub fn meant_rate(frame_time: f64) -> Option<f64> {
    let text = frame_time.to_string();
    let decimals = text.split_once('.').map_or(0, |(_, digits)| digits.len());
    if decimals < FEWEST_DECIMALS {
        return None;
    }
    let last = 10f64.powi(-i32::try_from(decimals).ok()?);
    let whole = || RATES.into_iter();
    let television = || RATES.into_iter().map(|rate| rate * TELEVISION);
    // A little more for the halves, a little less for the next value: neither is exact in binary.
    let rounded = |rate: &f64| (frame_time - 1.0 / rate).abs() <= 0.5 * last * (1.0 + 1e-9);
    let cut = |rate: &f64| {
        let lost = 1.0 / rate - frame_time;
        lost > 0.0 && lost < last * (1.0 - 1e-9)
    };
    let nearest = |rates: &mut dyn Iterator<Item = f64>| {
        rates.min_by(|a, b| {
            let apart = |rate: &f64| (frame_time - 1.0 / rate).abs();
            apart(a).total_cmp(&apart(b))
        })
    };
    let rate = nearest(&mut whole().filter(rounded))
        .or_else(|| nearest(&mut television().filter(rounded)))
        .or_else(|| nearest(&mut whole().filter(cut)))
        .or_else(|| nearest(&mut television().filter(cut)))?;
    ((frame_time * rate - 1.0).abs() > EXACT).then_some(rate)
}
