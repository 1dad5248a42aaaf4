//! Dance and music on one axis of time: curves one above the other, beats of a motion as dots on
//! its speed, beats of the music as dashed lines through all.

use super::FigureError;
use super::music_strip::{BEAT, ONSET};
use super::svg::{Anchor, Font, Stroke, Svg};

const LEFT: f64 = 150.0;
const RIGHT: f64 = 1040.0;
const TOP: f64 = 82.0;
/// Height of a curve's panel, and the room to the next.
const PANEL: f64 = 110.0;
const GAP: f64 = 22.0;
const INK: &str = "#222222";
const DOT: &str = "#e03c31";
/// Behind the frames that were given.
const SEED: &str = "#f0f0f0";
/// Frames from one label of the axis to the next, and most labels.
const TICK: usize = 30;
const TICKS: usize = 20;

/// What a curve is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BeatCurveKind {
    Recorded,
    Generated,
    Music,
}

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct BeatCurve {
    pub kind: BeatCurveKind,
    pub label: String,
    /// Curves of one unit share their scale.
    pub unit: &'static str,
    /// By frame.
    pub values: Vec<f64>,
    /// Frames with a dot.
    pub dots: Vec<usize>,
}

/// Curves over the same frames.
#[derive(Debug, Clone, PartialEq)]
pub struct BeatFigure {
    pub title: String,
    /// One line under the figure; empty for none.
    pub caption: String,
    /// From above.
    pub curves: Vec<BeatCurve>,
    /// Frames of the music's beats.
    pub beats: Vec<usize>,
    /// So many frames at the beginning were given.
    pub seed: usize,
}

impl BeatFigure {
    /// The figure as an SVG document.
    ///
    /// # Errors
    /// A NaN or infinity, or no curve with two frames.
    pub fn svg(&self) -> Result<String, FigureError> {
        let curves = self.curves.iter();
        let bad = curves
            .clone()
            .find(|it| it.values.iter().any(|x| !x.is_finite()));
        if let Some(bad) = bad {
            return Err(FigureError::not_finite(&self.title, &bad.label));
        }
        let frames = curves.clone().map(|it| it.values.len()).max().unwrap_or(0);
        if frames < 2 {
            return Err(FigureError::empty(&self.title, "no curve has two frames"));
        }
        let across = |frame: usize| LEFT + (RIGHT - LEFT) * frame as f64 / (frames - 1) as f64;
        let step = PANEL + GAP;
        let bottom = TOP + step * self.curves.len() as f64 - GAP;
        let mut svg = Svg::new(RIGHT + 30.0, bottom + 58.0, &self.title);
        svg.text([16.0, 28.0], &self.title, Font::bold(17.0, INK));
        if self.seed > 0 {
            let end = across(self.seed.min(frames - 1));
            svg.rectangle([LEFT, TOP], [end - LEFT, bottom - TOP], SEED);
        }
        self.draw_legend(&mut svg);
        for &beat in self.beats.iter().filter(|beat| **beat < frames) {
            let x = across(beat);
            svg.begin_group("music_beat");
            svg.line(&[[x, TOP], [x, bottom]], BEAT);
            svg.end_group();
        }
        for (index, curve) in curves.enumerate() {
            let floor = TOP + step * index as f64 + PANEL;
            let most = self.most(curve.unit);
            curve.draw(&mut svg, floor, most, across);
        }
        draw_axis(&mut svg, bottom, frames, across);
        svg.caption(&self.caption);
        Ok(svg.finish())
    }

    /// The largest value of the curves of a unit.
    fn most(&self, unit: &str) -> f64 {
        let curves = self.curves.iter().filter(|it| it.unit == unit);
        let values = curves.flat_map(|it| &it.values);
        values.copied().fold(1e-9, f64::max)
    }

    fn draw_legend(&self, svg: &mut Svg) {
        let font = Font::new(12.5, INK, Anchor::Start);
        let (mut x, y) = (22.0, 52.0);
        draw_dot(svg, [x, y - 4.0]);
        svg.text([x + 12.0, y], "beat of the motion", font);
        x += 160.0;
        svg.line(&[[x - 8.0, y - 4.0], [x + 16.0, y - 4.0]], BEAT);
        svg.text([x + 24.0, y], "beat of the music", font);
        x += 166.0;
        if self.seed > 0 {
            svg.rectangle([x - 6.0, y - 11.0], [14.0, 14.0], SEED);
            svg.text([x + 14.0, y], "seed (given)", font);
        }
    }
}

impl BeatCurve {
    fn draw(&self, svg: &mut Svg, floor: f64, most: f64, across: impl Fn(usize) -> f64) {
        let colour = match self.kind {
            BeatCurveKind::Recorded => "#d55e00",
            BeatCurveKind::Generated => "#0072b2",
            BeatCurveKind::Music => ONSET,
        };
        // A little room over the highest point.
        let up = |value: f64| floor - 0.94 * PANEL * value / most;
        let place = |(frame, value): (usize, &f64)| [across(frame), up(*value)];
        let places: Vec<[f64; 2]> = self.values.iter().enumerate().map(place).collect();
        svg.begin_group("curve");
        let corner = [[LEFT, floor - PANEL], [LEFT, floor], [RIGHT, floor]];
        svg.line(&corner, Stroke::solid(INK, 1.0));
        for value in [0.0, most] {
            let font = Font::new(11.5, INK, Anchor::End);
            svg.text([LEFT - 7.0, up(value) + 4.0], &format!("{value:.0}"), font);
        }
        let middle = floor - PANEL / 2.0;
        svg.text([16.0, middle - 4.0], &self.label, Font::bold(13.0, colour));
        let font = Font::new(12.0, INK, Anchor::Start);
        svg.text([16.0, middle + 14.0], self.unit, font);
        svg.line(&places, Stroke::solid(colour, 1.8));
        for place in self.dots.iter().filter_map(|dot| places.get(*dot)) {
            draw_dot(svg, *place);
        }
        svg.end_group();
    }
}

fn draw_dot(svg: &mut Svg, place: [f64; 2]) {
    svg.circle(place, 4.0, DOT, Stroke::solid("#ffffff", 1.0));
}

fn draw_axis(svg: &mut Svg, bottom: f64, frames: usize, across: impl Fn(usize) -> f64) {
    let every = TICK * frames.div_ceil(TICK * TICKS);
    for frame in (0..frames).step_by(every) {
        let x = across(frame);
        svg.line(&[[x, bottom], [x, bottom + 5.0]], Stroke::solid(INK, 1.0));
        let font = Font::new(12.0, INK, Anchor::Middle);
        svg.text([x, bottom + 20.0], &frame.to_string(), font);
    }
    let below = [(LEFT + RIGHT) / 2.0, bottom + 42.0];
    let font = Font::new(13.0, INK, Anchor::Middle);
    svg.text(below, "frame (30 a second)", font);
}
