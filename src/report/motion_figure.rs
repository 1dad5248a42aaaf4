//! Dancers side by side: the same frames as recorded and as predicted by models, keyframes in red.

use glam::DVec3;

use super::FigureError;
use super::dancer::{Drawn, DrawnBody, GENERATED, KEYFRAME, MARKED, RECORDED};
use super::music_strip::{self, MusicStrip};
use super::root_panel::{self, RootPaths};
use super::svg::{Anchor, Font, Stroke, Svg, wrapped};
use crate::motion::{JOINTS, PARTS};

const LEFT: f64 = 118.0;
const TOP: f64 = 74.0;
const INK: &str = "#222222";
/// Room between the last dancer and a panel of root trajectories, pixels.
const GUTTER: f64 = 14.0;
/// Room between a dancer and its frame, pixels.
const FRAME_ROOM: f64 = 5.0;

/// One row: a motion over the frames of the figure.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionRow {
    /// What the row is, such as "Ground truth".
    pub label: String,
    /// Whose joints they are.
    pub body: DrawnBody,
    /// World positions of its joints, `[frames][joints]`, cm, Y up.
    pub frames: Vec<Vec<DVec3>>,
    /// Frames that were given, drawn red and always.
    pub keyframes: Vec<usize>,
    /// Whether the frames between keyframes were generated (amber) or recorded (blue-grey).
    pub generated: bool,
    /// So many frames at the beginning of a generated row are the recorded ones that it goes on
    /// from.
    pub seed: usize,
    /// Frames whose poses were wanted: as generated or recorded, in a red frame, drawn always.
    pub framed: Vec<usize>,
    /// Parts of the body in blue: those that were asked to move otherwise.
    pub marked: [bool; PARTS],
    /// Drawn in a panel at the end of the row.
    pub paths: Option<RootPaths>,
}

/// Which frames of a row are drawn, besides its keyframes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// Every few frames from the first on; 0 counts as 1.
    Every(usize),
    /// The same from another one on.
    From { first: usize, every: usize },
    /// So many, evenly from the first to the last.
    Count(usize),
}

/// Where dancers stand. Frames stand in equal distances, so the horizontal travel of a root is
/// taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placing {
    /// That of the first row's root is taken out of every row: a row whose root leaves the first
    /// row's path stands off its place. All rows have the same number of frames.
    OnFirstPath,
    /// Each row's own.
    OnOwnPath,
}

/// Rows of dancers, drawn every few frames from a fixed three-quarter view, left to right in time.
///
/// Heights are kept; the floor is at the lowest joint of the first row.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionFigure {
    pub title: String,
    /// One line under the figure; empty for none.
    pub caption: String,
    /// The first is the one that the others are compared with.
    pub rows: Vec<MotionRow>,
    pub shown: Shown,
    pub placing: Placing,
    /// What is heard in the frames of the first row, over it.
    pub music: Option<MusicStrip>,
}

impl MotionRow {
    /// A row of the dance skeleton from the first to the last frame, which were given; nothing
    /// marked.
    pub fn between_keyframes(
        label: impl Into<String>,
        frames: Vec<[DVec3; JOINTS]>,
        generated: bool,
    ) -> Self {
        let frames = frames.into_iter().map(Vec::from).collect();
        Self::of_body(label, DrawnBody::dance(), frames, generated)
    }

    /// The same of any skeleton; `frames`: `[frames][joints]`, cm.
    pub fn of_body(
        label: impl Into<String>,
        body: DrawnBody,
        frames: Vec<Vec<DVec3>>,
        generated: bool,
    ) -> Self {
        let last = frames.len().saturating_sub(1);
        Self {
            label: label.into(),
            body,
            frames,
            keyframes: vec![0, last],
            generated,
            seed: 0,
            framed: Vec::new(),
            marked: [false; PARTS],
            paths: None,
        }
    }

    /// The frames that are drawn.
    fn shown(&self, shown: Shown) -> Vec<usize> {
        let frames = self.frames.len();
        let mut list: Vec<usize> = match shown {
            Shown::Every(step) => (0..frames).step_by(step.max(1)).collect(),
            Shown::From { first, every } => (first..frames).step_by(every.max(1)).collect(),
            Shown::Count(count) => {
                let steps = count.saturating_sub(1).max(1);
                (0..count).map(|k| k * (frames - 1) / steps).collect()
            }
        };
        let always = self.keyframes.iter().chain(&self.framed);
        list.extend(always.filter(|frame| **frame < frames));
        list.sort_unstable();
        list.dedup();
        list
    }
}

/// A row with what is drawn of it.
struct PlacedRow<'f> {
    row: &'f MotionRow,
    shown: Vec<usize>,
    dancers: Vec<Drawn<'f>>,
}

/// Measures of the figure, pixels.
struct Layout {
    /// Place of the first dancer.
    start: f64,
    spacing: f64,
    above: f64,
    row_height: f64,
    width: f64,
    /// Left side of the panels of root trajectories, and their size.
    panel: (f64, f64),
}

impl MotionFigure {
    /// A figure whose rows each stand on their own root's path.
    pub fn on_own_paths(
        title: String,
        caption: String,
        rows: Vec<MotionRow>,
        shown: Shown,
    ) -> Self {
        Self {
            title,
            caption,
            rows,
            shown,
            placing: Placing::OnOwnPath,
            music: None,
        }
    }

    /// The figure as an SVG document.
    ///
    /// # Errors
    ///
    /// [`FigureError`]: no rows or frames, rows of different length on the first one's path, a NaN
    /// or infinity.
    pub fn svg(&self) -> Result<String, FigureError> {
        self.check()?;
        let rows = self.placed();
        let layout = Layout::of(&rows, &self.title);
        // Rows that show the same frames share one axis below.
        let shared = rows.iter().all(|row| row.shown == rows[0].shown);
        let axis = if shared { 0.0 } else { 18.0 };
        let step = layout.row_height + axis;
        let top = TOP + self.music.as_ref().map_or(0.0, |_| music_strip::HEIGHT);
        let height = top + step * rows.len() as f64 + if shared { 34.0 } else { 16.0 };
        let paths = self.rows.iter().filter_map(|row| row.paths.as_ref());
        let span = paths.map(RootPaths::span).fold(0.0, f64::max);

        let mut svg = Svg::new(layout.width, height, &self.title);
        self.draw_heading(&mut svg);
        if let Some(music) = &self.music {
            draw_label(&mut svg, "Music", TOP + music_strip::HEIGHT / 2.0);
            let ends = [rows[0].shown[0], rows[0].shown[rows[0].shown.len() - 1]];
            music.draw(&mut svg, TOP, ends, |frame| rows[0].place(&layout, frame));
        }
        for (index, placed) in rows.iter().enumerate() {
            let ground = top + step * index as f64 + layout.above + 10.0;
            svg.begin_group("row");
            let floor = layout.panel.0 - GUTTER;
            let line = [[LEFT, ground], [floor, ground]];
            svg.line(&line, Stroke::solid("#b8b8b8", 1.2));
            draw_label(&mut svg, &placed.row.label, ground - layout.above / 2.0);
            placed.draw(&mut svg, &layout, ground);
            if let Some(paths) = &placed.row.paths {
                let corner = [layout.panel.0, ground - layout.above];
                paths.draw(&mut svg, corner, layout.panel.1, span);
            }
            if !shared {
                placed.draw_frames(&mut svg, &layout, ground + step - layout.above - 18.0);
            }
            svg.end_group();
        }
        if shared {
            rows[0].draw_frames(&mut svg, &layout, height - 18.0);
        }
        svg.caption(&self.caption);
        Ok(svg.finish())
    }

    fn placed(&self) -> Vec<PlacedRow<'_>> {
        let first = &self.rows[0];
        let heights = first.frames.iter().flatten().map(|joint| joint.y);
        let floor = heights.fold(f64::INFINITY, f64::min);
        let placed = |row| {
            let path = match self.placing {
                Placing::OnFirstPath => first,
                Placing::OnOwnPath => row,
            };
            let shown = row.shown(self.shown);
            let dancer = |&frame: &usize| {
                let root = path.frames[frame][0];
                Drawn::new(
                    &row.body,
                    &row.frames[frame],
                    DVec3::new(root.x, floor, root.z),
                )
            };
            PlacedRow {
                row,
                dancers: shown.iter().map(dancer).collect(),
                shown,
            }
        };
        self.rows.iter().map(placed).collect()
    }

    fn check(&self) -> Result<(), FigureError> {
        let empty = |what| FigureError::empty(&self.title, what);
        let first = self.rows.first().ok_or_else(|| empty("no rows"))?;
        for row in &self.rows {
            if row.frames.is_empty() || row.shown(self.shown).is_empty() {
                return Err(empty("no frames"));
            }
            if self.placing == Placing::OnFirstPath && row.frames.len() != first.frames.len() {
                let (found, expected) = (row.frames.len(), first.frames.len());
                return Err(FigureError::frames(
                    &self.title,
                    &row.label,
                    found,
                    expected,
                ));
            }
            let mut joints = row.frames.iter().flatten();
            if !(joints.all(|joint| joint.is_finite())
                && row.paths.iter().all(RootPaths::is_finite))
            {
                return Err(FigureError::not_finite(&self.title, &row.label));
            }
        }
        Ok(())
    }

    fn draw_heading(&self, svg: &mut Svg) {
        svg.text([16.0, 28.0], &self.title, Font::bold(17.0, INK));
        let any = |what: fn(&MotionRow) -> bool| self.rows.iter().any(what);
        let (given, marked) = (
            any(|row| !row.keyframes.is_empty()),
            any(|row| row.marked.contains(&true)),
        );
        let entries = [
            (KEYFRAME, "keyframe (given)", given),
            (
                RECORDED,
                "recorded",
                any(|row| !row.generated || row.seed > 0),
            ),
            (GENERATED, "generated", any(|row| row.generated)),
            (MARKED, "asked to move faster", marked),
        ];
        let font = Font::new(12.5, INK, Anchor::Start);
        let mut x = 22.0;
        for (palette, name, _) in entries.iter().filter(|entry| entry.2) {
            let outline = Stroke::solid(palette.outline, 1.2);
            svg.circle([x, 49.0], 6.0, palette.fill, outline);
            svg.text([x + 12.0, 53.0], name, font);
            x += 40.0 + 7.0 * name.len() as f64;
        }
        if any(|row| !row.framed.is_empty()) {
            draw_frame(svg, [x - 6.0, 43.0], [x + 6.0, 55.0]);
            let name = "key pose (given)";
            svg.text([x + 12.0, 53.0], name, font);
            x += 40.0 + 7.0 * name.len() as f64;
        }
        let paths = self.rows.iter().find_map(|row| row.paths.as_ref());
        if let Some(paths) = paths {
            for (colour, name, dash) in [
                (root_panel::TARGET, paths.target_label, "4 3"),
                (root_panel::GENERATED, "root generated", ""),
            ] {
                let stroke = Stroke {
                    colour,
                    width: 2.0,
                    dash,
                };
                svg.line(&[[x - 6.0, 49.0], [x + 14.0, 49.0]], stroke);
                svg.text([x + 20.0, 53.0], name, font);
                x += 48.0 + 7.0 * name.len() as f64;
            }
        }
    }
}

impl Layout {
    fn of(rows: &[PlacedRow], title: &str) -> Self {
        let drawn = || rows.iter().flat_map(|row| &row.dancers);
        let reach = |measure: fn(&Drawn) -> f64| drawn().map(measure).fold(0.0, f64::max);
        let aside = reach(|drawn| drawn.left).max(reach(|drawn| drawn.right));
        let spacing = (1.2 * aside).clamp(60.0, 220.0);
        let above = reach(|drawn| drawn.above);
        let row_height = above + reach(|drawn| drawn.below) + 26.0;
        let start = LEFT + aside + 8.0;
        let columns = rows.iter().map(|row| row.shown.len()).max().unwrap_or(1);
        let end = start + spacing * (columns - 1) as f64;
        let edge = (end + aside + 16.0).max(640.0);
        let with_panels = rows.iter().any(|row| row.row.paths.is_some());
        let panel = if with_panels { above.min(190.0) } else { 0.0 };
        let width = edge + if with_panels { panel + GUTTER } else { 0.0 };
        // The title's bold letters take less than 11 pixels each.
        let width = width.max(32.0 + 11.0 * title.chars().count() as f64);
        Self {
            start,
            spacing,
            above,
            row_height,
            width,
            panel: (edge, panel),
        }
    }
}

impl PlacedRow<'_> {
    fn draw(&self, svg: &mut Svg, layout: &Layout, ground: f64) {
        for (column, (dancer, frame)) in self.dancers.iter().zip(&self.shown).enumerate() {
            let given = self.row.keyframes.contains(frame);
            let generated = self.row.generated && *frame >= self.row.seed;
            let (class, palette) = match (given, generated) {
                (true, _) => ("keyframe", KEYFRAME),
                (false, true) => ("generated", GENERATED),
                (false, false) => ("recorded", RECORDED),
            };
            let marked = self.row.marked.map(|marked| marked && !given);
            let place = [layout.start + layout.spacing * column as f64, ground];
            svg.begin_group(class);
            dancer.draw(svg, place, palette, marked);
            svg.end_group();
            if self.row.framed.contains(frame) {
                let [x, y] = place;
                let corner = [x - dancer.left, y - dancer.above].map(|it| it - FRAME_ROOM);
                let opposite = [x + dancer.right, y + dancer.below].map(|it| it + FRAME_ROOM);
                draw_frame(svg, corner, opposite);
            }
        }
    }

    /// Where a frame stands across, by the columns around it.
    fn place(&self, layout: &Layout, frame: usize) -> f64 {
        let last = self.shown.len() - 1;
        let next = self.shown.partition_point(|&it| it < frame).min(last);
        let before = next.saturating_sub(1);
        let [from, to] = [before, next].map(|column| self.shown[column] as f64);
        let share = (frame as f64 - from) / (to - from).max(1.0);
        layout.start + layout.spacing * (before as f64 + share)
    }

    /// The numbers of the frames under their dancers.
    fn draw_frames(&self, svg: &mut Svg, layout: &Layout, foot: f64) {
        let font = Font::new(12.0, INK, Anchor::End);
        svg.text([LEFT - 14.0, foot], "frame", font);
        for (column, frame) in self.shown.iter().enumerate() {
            let mut font = Font::new(12.0, INK, Anchor::Middle);
            if self.row.keyframes.contains(frame) || self.row.framed.contains(frame) {
                (font.colour, font.bold) = (KEYFRAME.fill, true);
            }
            let place = [layout.start + layout.spacing * column as f64, foot];
            svg.text(place, &frame.to_string(), font);
        }
    }
}

/// The red frame of a key pose.
fn draw_frame(svg: &mut Svg, [left, top]: [f64; 2], [right, bottom]: [f64; 2]) {
    let corners = [
        [left, top],
        [right, top],
        [right, bottom],
        [left, bottom],
        [left, top],
    ];
    svg.begin_group("framed");
    svg.line(&corners, Stroke::solid(KEYFRAME.fill, 1.8));
    svg.end_group();
}

/// A row's label, one line a word group of at most 14 characters.
fn draw_label(svg: &mut Svg, label: &str, middle: f64) {
    let lines = wrapped(label, 14);
    let font = Font::bold(13.0, INK);
    for (index, line) in lines.iter().enumerate() {
        let offset = index as f64 - (lines.len() as f64 - 1.0) / 2.0;
        svg.text([16.0, middle + 17.0 * offset], line, font);
    }
}
