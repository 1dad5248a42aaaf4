//! The music over rows of dancers: the strength of its onsets, its beats as dashed lines.

use super::svg::{Stroke, Svg};

/// Room that it takes over the rows, pixels.
pub(super) const HEIGHT: f64 = 70.0;
/// Height of the curve in it.
const CURVE: f64 = 52.0;
pub(super) const ONSET: &str = "#009e73";
pub(super) const BEAT: Stroke<'static> = Stroke {
    colour: "#8a8a8a",
    width: 1.1,
    dash: "4 3",
};

/// What is heard in some frames.
#[derive(Debug, Clone, PartialEq)]
pub struct MusicStrip {
    /// Onset strength, dB, `[frames]`.
    pub onset: Vec<f64>,
    /// Frames of the beats.
    pub beats: Vec<usize>,
}

impl MusicStrip {
    /// Draws the frames from the first to the last of `ends`; `place` is where a frame stands
    /// across.
    pub(super) fn draw(
        &self,
        svg: &mut Svg,
        top: f64,
        [first, last]: [usize; 2],
        place: impl Fn(usize) -> f64,
    ) {
        let (ceiling, floor) = (top + 4.0, top + 4.0 + CURVE);
        let onsets = || (first..).zip(self.onset.iter().skip(first).take(last + 1 - first));
        let most = onsets().map(|(_, onset)| *onset).fold(1e-9, f64::max);
        svg.begin_group("music");
        for &beat in self.beats.iter().filter(|it| (first..=last).contains(it)) {
            let x = place(beat);
            svg.line(&[[x, ceiling], [x, floor]], BEAT);
        }
        let curve = onsets().map(|(frame, onset)| [place(frame), floor - CURVE * onset / most]);
        let curve: Vec<[f64; 2]> = curve.collect();
        svg.line(&curve, Stroke::solid(ONSET, 1.5));
        svg.end_group();
    }
}
