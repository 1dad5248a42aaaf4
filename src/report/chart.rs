//! Line charts: axes with ticks and units, lines, a legend.

use super::FigureError;
use super::svg::{Anchor, Font, Stroke, Svg};

/// Width of a chart whose legend has short names; long ones widen it.
const WIDTH: f64 = 880.0;
/// Width of a letter of the legend, generously.
const LETTER: f64 = 7.4;
const HEIGHT: f64 = 480.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 680.0;
/// Where the names of the legend begin.
const LEGEND: f64 = RIGHT + 54.0;
const TOP: f64 = 56.0;
const BOTTOM: f64 = 416.0;
const INK: &str = "#222222";
const FAINT: &str = "#e3e3e3";

/// Colours of the lines in their order, most of them Okabe and Ito's, which stay apart for
/// colour-blind readers.
const COLOURS: [&str; 12] = [
    "#222222", "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f6a00",
    "#882255", "#6f6f6f", "#332288", "#8fbc3a",
];

/// How numbers become places along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// From 0.
    Linear,
    /// Base 10. Numbers that are not positive have no place and are left out.
    Logarithmic,
}

/// One axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What it shows, with the unit.
    pub label: String,
    pub scale: Scale,
}

/// One line of a chart.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Line {
    /// Its name in the legend.
    pub name: String,
    /// `(x, y)`, ascending in x.
    pub points: Vec<(f64, f64)>,
    pub emphasised: bool,
    pub dashed: bool,
    /// Whether each point is marked with a dot.
    pub dots: bool,
    /// Which of the colours it takes: lines of one number share one.
    pub colour: usize,
}

impl Line {
    /// A thin unbroken line without a name.
    pub(super) fn plain(points: Vec<(f64, f64)>, colour: usize) -> Self {
        Self {
            points,
            colour,
            ..Self::default()
        }
    }
}

/// A chart of lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    pub title: String,
    /// One line under the chart; empty for none.
    pub caption: String,
    pub x: Axis,
    pub y: Axis,
    pub lines: Vec<Line>,
}

impl Chart {
    /// The chart as an SVG document.
    ///
    /// # Errors
    ///
    /// [`FigureError`]: a NaN or infinity, or no point that has a place on both axes.
    pub fn svg(&self) -> Result<String, FigureError> {
        for line in &self.lines {
            let mut points = line.points.iter();
            if !points.all(|(x, y)| x.is_finite() && y.is_finite()) {
                return Err(FigureError::not_finite(&self.title, &line.name));
            }
        }
        let drawable = |&(x, y): &(f64, f64)| self.x.shows(x) && self.y.shows(y);
        let points = || {
            let points = self.lines.iter().flat_map(|line| &line.points);
            points.copied().filter(drawable)
        };
        if points().next().is_none() {
            let what = "no line has a point that its axes can show";
            return Err(FigureError::empty(&self.title, what));
        }
        let across = Range::of(&self.x, points().map(|point| point.0), LEFT, RIGHT);
        let up = Range::of(&self.y, points().map(|point| point.1), BOTTOM, TOP);

        let names = self.lines.iter().map(|line| line.name.chars().count());
        let legend = LEGEND + LETTER * names.max().unwrap_or(0) as f64;
        let mut svg = Svg::new(WIDTH.max(legend), HEIGHT, &self.title);
        svg.text([LEFT, 32.0], &self.title, Font::bold(17.0, INK));
        draw_axes(&mut svg, self, &across, &up);
        for (index, line) in self.lines.iter().enumerate() {
            let points = line.points.iter().filter(|point| drawable(point));
            let places = points.map(|&(x, y)| [across.place(x), up.place(y)]);
            draw_line(&mut svg, line, &places.collect::<Vec<_>>(), index);
        }
        svg.caption(&self.caption);
        Ok(svg.finish())
    }
}

impl Axis {
    /// A linear axis from 0.
    pub fn linear(label: &str) -> Self {
        Self {
            label: label.into(),
            scale: Scale::Linear,
        }
    }

    fn shows(&self, value: f64) -> bool {
        self.scale == Scale::Linear || value > 0.0
    }
}

fn draw_axes(svg: &mut Svg, chart: &Chart, across: &Range, up: &Range) {
    for (tick, label) in up.ticks() {
        let y = up.place(tick);
        svg.line(&[[LEFT, y], [RIGHT, y]], Stroke::solid(FAINT, 1.0));
        let font = Font::new(12.0, INK, Anchor::End);
        svg.text([LEFT - 8.0, y + 4.0], &label, font);
    }
    for (tick, label) in across.ticks() {
        let x = across.place(tick);
        svg.line(&[[x, BOTTOM], [x, BOTTOM + 5.0]], Stroke::solid(INK, 1.0));
        let font = Font::new(12.0, INK, Anchor::Middle);
        svg.text([x, BOTTOM + 20.0], &label, font);
    }
    let corner = [[LEFT, TOP], [LEFT, BOTTOM], [RIGHT, BOTTOM]];
    svg.line(&corner, Stroke::solid(INK, 1.2));
    let below = [(LEFT + RIGHT) / 2.0, BOTTOM + 44.0];
    svg.text(below, &chart.x.label, Font::new(13.0, INK, Anchor::Middle));
    let mut upright = Font::new(13.0, INK, Anchor::Middle);
    upright.turn = -90.0;
    svg.text([22.0, (TOP + BOTTOM) / 2.0], &chart.y.label, upright);
}

fn draw_line(svg: &mut Svg, line: &Line, places: &[[f64; 2]], index: usize) {
    let colour = COLOURS[line.colour % COLOURS.len()];
    let stroke = Stroke {
        colour,
        width: if line.emphasised { 2.8 } else { 1.6 },
        dash: if line.dashed { "6 5" } else { "" },
    };
    svg.begin_group("line");
    svg.line(places, stroke);
    let y = TOP + 10.0 + 22.0 * index as f64;
    svg.line(&[[RIGHT + 18.0, y - 4.0], [RIGHT + 46.0, y - 4.0]], stroke);
    if line.dots {
        for &place in places.iter().chain([&[RIGHT + 32.0, y - 4.0]]) {
            svg.circle(place, 3.6, colour, Stroke::solid("#ffffff", 1.0));
        }
    }
    svg.text([LEGEND, y], &line.name, Font::new(12.5, INK, Anchor::Start));
    svg.end_group();
}

/// The span of one axis, in its scale's own measure (logarithms on a logarithmic one), and where it
/// lies in the figure.
struct Range {
    scale: Scale,
    low: f64,
    high: f64,
    /// Places of `low` and `high` in the figure.
    from: f64,
    to: f64,
}

impl Range {
    fn of(axis: &Axis, values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let linear = axis.scale == Scale::Linear;
        let start = match linear {
            true => (0.0, 0.0),
            false => (f64::INFINITY, f64::NEG_INFINITY),
        };
        let measured = values.map(|value| measure(axis.scale, value));
        let (mut low, mut high) = measured.fold(start, |(low, high), value| {
            (low.min(value), high.max(value))
        });
        if high - low < 1e-9 * high.abs().max(1.0) {
            let room = 0.5 * high.abs().max(1.0);
            (low, high) = (low - room, high + room);
        }
        let margin = 0.04 * (high - low);
        Self {
            scale: axis.scale,
            low: match linear && low == 0.0 {
                true => 0.0,
                false => low - margin,
            },
            high: high + margin,
            from,
            to,
        }
    }

    fn place(&self, value: f64) -> f64 {
        let share = (measure(self.scale, value) - self.low) / (self.high - self.low);
        self.from + share * (self.to - self.from)
    }

    /// Values to label within the span, and their labels.
    fn ticks(&self) -> Vec<(f64, String)> {
        let span = self.high - self.low;
        let ticks: Vec<f64> = match self.scale {
            Scale::Linear => {
                let step = round_step(span / 8.0);
                let (first, last) = ((self.low / step).ceil(), (self.high / step).floor());
                let counts = first as i64..=last as i64;
                counts.map(|count| count as f64 * step).collect()
            }
            Scale::Logarithmic => {
                let decades = self.low.floor() as i32..=self.high.ceil() as i32;
                // Few decades need 1, 2 and 5 of each, many only the decade itself.
                let mantissas: &[f64] = match span {
                    span if span < 1.0 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0],
                    span if span < 3.5 => &[1.0, 2.0, 5.0],
                    _ => &[1.0],
                };
                decades
                    .flat_map(|decade| mantissas.iter().map(move |m| m * 10f64.powi(decade)))
                    .filter(|tick| (self.low..=self.high).contains(&tick.log10()))
                    .collect()
            }
        };
        ticks.into_iter().map(|tick| (tick, number(tick))).collect()
    }
}

fn measure(scale: Scale, value: f64) -> f64 {
    match scale {
        Scale::Linear => value,
        Scale::Logarithmic => value.log10(),
    }
}

/// The least of 1, 2 and 5 times a power of ten that is not below `step`.
fn round_step(step: f64) -> f64 {
    let decade = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|mantissa| mantissa * decade)
        .find(|rounded| *rounded >= step * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}

/// A number for an axis: thousands as k, millions as M, no trailing zeros.
fn number(value: f64) -> String {
    let (scaled, unit) = match value.abs() {
        size if size >= 1e6 => (value / 1e6, "M"),
        size if size >= 1e4 => (value / 1e3, "k"),
        _ => (value, ""),
    };
    let size = scaled.abs();
    if size != 0.0 && !(1e-3..1e6).contains(&size) {
        return format!("{value:.0e}");
    }
    let text = format!("{scaled:.4}");
    format!("{}{unit}", text.trim_end_matches('0').trim_end_matches('.'))
}
