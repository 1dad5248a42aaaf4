//! f32 exponential, hyperbolic tangent and logistic function that a compiler can vectorise.
//!
//! No branches, no table, no fused operations: the same bits on every CPU. Bounds against the true
//! value, over all finite inputs: [`exp`] 1.5 ulp, [`tanh`] 2 ulp, [`sigmoid`] 2.5 ulp. Infinities
//! and NaN give what the functions' limits give; results below the normal range round correctly to
//! subnormals or 0 within the same bound.

/// 1.5 * 2^23: adding it rounds a small float to an integer and leaves that in the low bits.
const ROUND: f32 = 12_582_912.0;
/// ln 2 = `LN2_HIGH` - `LN2_LOW`; the first has so few bits that its products here are exact.
const LN2_HIGH: f32 = 0.693_359_4;
const LN2_LOW: f32 = 2.121_944_4e-4;

/// 2^n for `n` from -126 to 127.
#[inline(always)]
fn power_of_two(n: i32) -> f32 {
    f32::from_bits((n.wrapping_add(127) as u32) << 23)
}

/// e^x.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    // Beyond these bounds the result is 0 or infinite. Comparisons that are false for NaN keep it.
    let x = if x > 89.0 { 89.0 } else { x };
    // Not left to the product at the end: one that underflows takes a hundred cycles.
    let vanishes = x < -104.0;
    let x = if vanishes { 0.0 } else { x };
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let n = (shifted.to_bits() as i32).wrapping_sub(ROUND.to_bits() as i32);
    let whole = shifted - ROUND;
    let r = (x - whole * LN2_HIGH) + whole * LN2_LOW;
    // Minimax on [-ln2/2, ln2/2] (Cephes).
    let p = 1.987_569_1e-4;
    let p = p * r + 1.398_2e-3;
    let p = p * r + 8.333_452e-3;
    let p = p * r + 4.166_579_6e-2;
    let p = p * r + 1.666_666_5e-1;
    let p = p * r + 0.5;
    let p = p * (r * r) + r + 1.0;
    // Two factors, as 2^n alone leaves the exponent's range at both ends.
    let half = n >> 1;
    let y = p * power_of_two(half) * power_of_two(n.wrapping_sub(half));
    if vanishes { 0.0 } else { y }
}

/// Hyperbolic tangent.
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let size = x.abs();
    let large = 1.0 - 2.0 / (exp(size + size) + 1.0);
    // Minimax on [-0.625, 0.625] (Cephes).
    let z = size * size;
    let p = -5.704_988_7e-3;
    let p = p * z + 2.063_909e-2;
    let p = p * z - 5.373_971_5e-2;
    let p = p * z + 1.333_144_2e-1;
    let p = p * z - 3.333_328e-1;
    let small = p * z * size + size;
    (if size > 0.625 { large } else { small }).copysign(x)
}

/// Logistic function 1 / (1 + e^-x).
#[inline(always)]
pub fn sigmoid(x: f32) -> f32 {
    // e^-|x| cannot overflow, so that small results keep their digits.
    let e = exp(-x.abs());
    let numerator = if x < 0.0 { e } else { 1.0 };
    numerator / (1.0 + e)
}
