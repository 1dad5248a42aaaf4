//! Dancers side by side: the same frames as recorded and as predicted by models, keyframes in red.

use glam::DVec3;

use super::FigureError;
use super::camera::Camera;
use super::svg::{Anchor, Font, Stroke, Svg};
use crate::motion::{DANCE_PARENTS, JOINTS};

/// Pixels a centimetre.
const SCALE: f64 = 0.85;
const LEFT: f64 = 118.0;
const TOP: f64 = 74.0;
const INK: &str = "#222222";
const KEYFRAME: Palette = Palette {
    fill: "#e03c31",
    outline: "#7d1410",
};
const GENERATED: Palette = Palette {
    fill: "#ffc21a",
    outline: "#8a5a00",
};
const RECORDED: Palette = Palette {
    fill: "#93acc6",
    outline: "#3d5570",
};

/// Colours of one figure.
#[derive(Clone, Copy)]
struct Palette {
    fill: &'static str,
    outline: &'static str,
}

/// One row: a motion over the frames of the figure.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionRow {
    /// What the row is, such as "Ground truth".
    pub label: String,
    /// World positions of the joints, `[frames][24]`, cm, Y up.
    pub frames: Vec<[DVec3; JOINTS]>,
    /// Whether the frames between keyframes were generated (amber) or recorded (blue-grey).
    pub generated: bool,
}

/// Rows of dancers, drawn every few frames from a fixed three-quarter view, left to right in time.
///
/// Frames stand in equal distances: the horizontal travel of the first row's root is taken out of every row, so a row whose root leaves the
/// first row's path stands off its place. Heights are kept; the floor is at the lowest joint of the first row.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionFigure {
    pub title: String,
    /// The first is the one that the others are compared with. All have the same number of frames.
    pub rows: Vec<MotionRow>,
    /// Frames that were given, drawn red in every row, whatever the step.
    pub keyframes: Vec<usize>,
    /// Every how many frames a dancer is drawn, from the first frame on; 0 counts as 1.
    pub every: usize,
}

impl MotionFigure {
    /// The figure as an SVG document.
    ///
    /// # Errors
    ///
    /// [`FigureError`]: no rows or frames, rows of different length, a NaN or infinity.
    pub fn svg(&self) -> Result<String, FigureError> {
        let first = self.check()?;
        let shown = self.shown(first.frames.len());
        let floor = first
            .frames
            .iter()
            .flatten()
            .fold(f64::INFINITY, |lowest, joint| lowest.min(joint.y));
        let placed: Vec<Vec<Drawn>> = self
            .rows
            .iter()
            .map(|row| {
                let place = |&frame: &usize| {
                    let path =
                        DVec3::new(first.frames[frame][0].x, floor, first.frames[frame][0].z);
                    Drawn::new(&row.frames[frame], path)
                };
                shown.iter().map(place).collect()
            })
            .collect();

        let drawn = || placed.iter().flatten();
        let reach = |measure: fn(&Drawn) -> f64| drawn().map(measure).fold(0.0, f64::max);
        let aside = reach(|drawn| drawn.left).max(reach(|drawn| drawn.right));
        let spacing = (1.2 * aside).clamp(60.0, 220.0);
        let above = reach(|drawn| drawn.above);
        let below = reach(|drawn| drawn.below);
        let row_height = above + below + 26.0;
        let start = LEFT + aside + 8.0;
        let end = start + spacing * (shown.len() - 1) as f64;
        let width = (end + aside + 16.0).max(640.0);
        let height = TOP + row_height * self.rows.len() as f64 + 34.0;

        let mut svg = Svg::new(width, height, &self.title);
        self.draw_heading(&mut svg);
        for (index, (row, dancers)) in self.rows.iter().zip(&placed).enumerate() {
            let ground = TOP + row_height * index as f64 + above + 10.0;
            svg.begin_group("row");
            svg.line(
                &[[LEFT, ground], [width - 12.0, ground]],
                Stroke::solid("#b8b8b8", 1.2),
            );
            draw_label(&mut svg, &row.label, ground - above / 2.0);
            for (column, (dancer, frame)) in dancers.iter().zip(&shown).enumerate() {
                let (class, palette) = match (self.keyframes.contains(frame), row.generated) {
                    (true, _) => ("keyframe", KEYFRAME),
                    (false, true) => ("generated", GENERATED),
                    (false, false) => ("recorded", RECORDED),
                };
                svg.begin_group(class);
                dancer.draw(&mut svg, [start + spacing * column as f64, ground], palette);
                svg.end_group();
            }
            svg.end_group();
        }
        let foot = height - 18.0;
        svg.text(
            [LEFT - 14.0, foot],
            "frame",
            Font::new(12.0, INK, Anchor::End),
        );
        for (column, frame) in shown.iter().enumerate() {
            let mut font = Font::new(12.0, INK, Anchor::Middle);
            if self.keyframes.contains(frame) {
                (font.colour, font.bold) = (KEYFRAME.fill, true);
            }
            svg.text(
                [start + spacing * column as f64, foot],
                &frame.to_string(),
                font,
            );
        }
        Ok(svg.finish())
    }

    fn check(&self) -> Result<&MotionRow, FigureError> {
        let empty = |what| FigureError::Empty {
            figure: self.title.clone(),
            what,
        };
        let first = self.rows.first().ok_or_else(|| empty("no rows"))?;
        if first.frames.is_empty() {
            return Err(empty("no frames"));
        }
        for row in &self.rows {
            if row.frames.len() != first.frames.len() {
                return Err(FigureError::Frames {
                    figure: self.title.clone(),
                    row: row.label.clone(),
                    found: row.frames.len(),
                    expected: first.frames.len(),
                });
            }
            if !row.frames.iter().flatten().all(|joint| joint.is_finite()) {
                return Err(FigureError::NotFinite {
                    figure: self.title.clone(),
                    series: row.label.clone(),
                });
            }
        }
        Ok(first)
    }

    /// The frames that are drawn: every few, and all keyframes.
    fn shown(&self, frames: usize) -> Vec<usize> {
        let mut shown: Vec<usize> = (0..frames).step_by(self.every.max(1)).collect();
        shown.extend(self.keyframes.iter().filter(|frame| **frame < frames));
        shown.sort_unstable();
        shown.dedup();
        shown
    }

    fn draw_heading(&self, svg: &mut Svg) {
        let mut font = Font::new(17.0, INK, Anchor::Start);
        font.bold = true;
        svg.text([16.0, 28.0], &self.title, font);
        let recorded = self.rows.iter().any(|row| !row.generated);
        let generated = self.rows.iter().any(|row| row.generated);
        let entries = [
            (KEYFRAME, "keyframe (given)", !self.keyframes.is_empty()),
            (RECORDED, "recorded", recorded),
            (GENERATED, "generated", generated),
        ];
        let mut x = 22.0;
        for (palette, name, _) in entries.iter().filter(|entry| entry.2) {
            svg.ellipse(
                [x, 49.0],
                [6.0, 6.0],
                palette.fill,
                Stroke::solid(palette.outline, 1.2),
            );
            svg.text([x + 12.0, 53.0], name, Font::new(12.5, INK, Anchor::Start));
            x += 40.0 + 7.0 * name.len() as f64;
        }
    }
}

/// A row's label, one line a word group of at most 14 characters.
fn draw_label(svg: &mut Svg, label: &str, middle: f64) {
    let mut lines: Vec<String> = Vec::new();
    for word in label.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= 14 => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_string()),
        }
    }
    let mut font = Font::new(13.0, INK, Anchor::Start);
    font.bold = true;
    for (index, line) in lines.iter().enumerate() {
        let offset = index as f64 - (lines.len() as f64 - 1.0) / 2.0;
        svg.text([16.0, middle + 17.0 * offset], line, font);
    }
}

/// One dancer as seen by the camera, in pixels from the place on the floor under the path.
struct Drawn {
    joints: [([f64; 2], f64); JOINTS],
    left: f64,
    right: f64,
    above: f64,
    below: f64,
}

impl Drawn {
    fn new(frame: &[DVec3; JOINTS], path: DVec3) -> Self {
        let camera = Camera::three_quarter(SCALE);
        let joints = frame.map(|joint| camera.project(joint - path));
        let reach = |measure: &dyn Fn([f64; 2]) -> f64| {
            joints
                .iter()
                .map(|joint| measure(joint.0))
                .fold(0.0, f64::max)
        };
        Self {
            joints,
            left: reach(&|[x, _]| -x),
            right: reach(&|[x, _]| x),
            above: reach(&|[_, y]| -y) + HEAD,
            below: reach(&|[_, y]| y),
        }
    }

    /// Draws the bones from the farthest to the nearest, each outlined, then the head where it belongs among them.
    fn draw(&self, svg: &mut Svg, origin: [f64; 2], palette: Palette) {
        let at = |joint: usize| {
            let [x, y] = self.joints[joint].0;
            [origin[0] + x, origin[1] + y]
        };
        let mut bones: Vec<(f64, usize, usize)> = DANCE_PARENTS
            .iter()
            .enumerate()
            .filter_map(|(joint, parent)| parent.map(|parent| (joint, parent)))
            .map(|(joint, parent)| {
                let nearness = (self.joints[joint].1 + self.joints[parent].1) / 2.0;
                (nearness, joint, parent)
            })
            .collect();
        bones.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, joint, parent) in bones {
            let ends = [at(parent), at(joint)];
            let width = bone_width(joint);
            svg.line(&ends, Stroke::solid(palette.outline, width + 1.8));
            svg.line(&ends, Stroke::solid(palette.fill, width));
            if joint == HEAD_JOINT {
                svg.ellipse(
                    at(joint),
                    [HEAD, HEAD],
                    palette.fill,
                    Stroke::solid(palette.outline, 1.0),
                );
            }
        }
    }
}

/// Index of the joint that the head is drawn at.
const HEAD_JOINT: usize = 23;
/// Radius of the head, pixels.
const HEAD: f64 = 8.0;

/// Width of the bone that ends at this joint, pixels: the spine is thicker than the limbs, the ends of limbs thinner.
fn bone_width(joint: usize) -> f64 {
    match joint {
        9..=13 => 7.6,
        1 | 2 | 5 | 6 => 6.4,
        4 | 8 | 17 | 21 => 4.0,
        _ => 5.2,
    }
}
