//! Figure 3: tempograms of the music and of dances to it, side by side.

use crate::evaluation::sampled_dance::tempogram::Tempogram;
use crate::report::figures::{Figure, Numbers};
use crate::report::svg::{Anchor, Font, Stroke, Svg};
use crate::report::{FigureError, ReportError};

const TITLE: &str = "Figure 3: tempograms";
const INK: &str = "#222222";
const LEFT: f64 = 66.0;
const TOP: f64 = 82.0;
/// Size of a panel, and the room to the next.
const WIDTH: f64 = 220.0;
const HEIGHT: f64 = 260.0;
const GAP: f64 = 18.0;
/// Labels of the tempi, beats a minute.
const TEMPI: [f64; 4] = [60.0, 120.0, 180.0, 240.0];
/// Labels along a panel, seconds: those of the least step that leaves no more than this many.
const LABELS: usize = 4;
const STEPS: [usize; 6] = [5, 10, 20, 30, 60, 120];
/// From no strength to the panel's most: steps that differ in lightness, so they survive grey.
const SHADES: [&str; 8] = [
    "#f7f7f7", "#dcecf4", "#b5d9ea", "#82bfdd", "#4e9fca", "#2a7bb3", "#115a91", "#083b66",
];

/// A panel of the figure.
#[derive(Debug, Clone, PartialEq)]
pub struct TempogramPanel {
    /// Such as "Music".
    pub name: String,
    pub tempogram: Tempogram,
}

/// The panels from the left, each from white, nothing, to its own darkest, its most; means over
/// time are the figure's numbers. The paper has five: music, fine-tuned, Transflower, MoGlow,
/// deterministic. `dance` says what is shown, a sentence of the caption.
///
/// # Errors
/// There is no panel, one has no window or tempo, or a NaN or an infinity.
pub fn figure_3(panels: &[TempogramPanel], dance: &str) -> Result<Figure, ReportError> {
    if panels.is_empty() {
        return Err(FigureError::empty(TITLE, "there is no tempogram").into());
    }
    let mut svg = Svg::new(
        LEFT + (WIDTH + GAP) * panels.len() as f64 + 12.0,
        TOP + HEIGHT + 54.0,
        TITLE,
    );
    svg.text([16.0, 32.0], TITLE, Font::bold(17.0, INK));
    let mut upright = Font::new(13.0, INK, Anchor::Middle);
    upright.turn = -90.0;
    svg.text([20.0, TOP + HEIGHT / 2.0], "beats a minute", upright);
    let mut numbers = Numbers::default();
    for (index, panel) in panels.iter().enumerate() {
        let left = LEFT + (WIDTH + GAP) * index as f64;
        panel.draw(&mut svg, left)?;
        if index == 0 {
            draw_tempi(&mut svg, &panel.tempogram);
        }
        let means = panel.tempogram.mean_strength();
        for (tempo, mean) in panel.tempogram.tempi.iter().zip(means) {
            numbers.add(&panel.name, format!("strength_at_{tempo}"), mean, "");
        }
    }
    let caption = format!(
        "Figure 3. {dance} How strongly onsets and kinematic beats, these weighted by how fast the \
         body falls, repeat themselves at each tempo, in windows of 8 s; a tempo shows at its half \
         and third, too. Each panel's darkest is its own most."
    );
    svg.caption(&caption);
    Ok(Figure {
        name: "figure_3",
        caption,
        svg: svg.finish(),
        numbers,
    })
}

impl TempogramPanel {
    fn draw(&self, svg: &mut Svg, left: f64) -> Result<(), FigureError> {
        let strength = &self.tempogram.strength;
        if strength.iter().any(|x| !x.is_finite()) {
            return Err(FigureError::not_finite(TITLE, &self.name));
        }
        let (windows, rows) = strength.dim();
        if windows == 0 || rows == 0 {
            return Err(FigureError::empty(TITLE, "a tempogram has no window"));
        }
        let most = strength.iter().copied().fold(1e-9, f64::max);
        let shade = |at: [usize; 2]| {
            let share = strength.get(at).copied().unwrap_or(0.0).max(0.0) / most;
            ((share * SHADES.len() as f64) as usize).min(SHADES.len() - 1)
        };
        let (width, height) = (WIDTH / windows as f64, HEIGHT / rows as f64);
        // Cells of one shade that follow in time are one rectangle.
        let mut cells = vec![Vec::new(); SHADES.len()];
        for row in 0..rows {
            let y = TOP + HEIGHT - height * (row + 1) as f64;
            let mut first = 0;
            while first < windows {
                let level = shade([first, row]);
                let same = (first..windows).take_while(|at| shade([*at, row]) == level);
                let count = same.count();
                if let Some(cells) = cells.get_mut(level) {
                    let corner = [left + width * first as f64, y];
                    cells.push((corner, [width * count as f64, height]));
                }
                first += count;
            }
        }
        svg.begin_group("tempogram");
        for (fill, cells) in SHADES.iter().zip(&cells) {
            svg.rectangles(cells, fill);
        }
        svg.text([left, TOP - 10.0], &self.name, Font::bold(13.0, INK));
        draw_seconds(svg, left, &self.tempogram.times);
        svg.end_group();
        Ok(())
    }
}

fn draw_tempi(svg: &mut Svg, of: &Tempogram) {
    let (Some(slowest), Some(fastest)) = (of.tempi.first(), of.tempi.last()) else {
        return;
    };
    // A row's tempo lies in its middle.
    let row = HEIGHT / of.tempi.len() as f64;
    let span = (fastest - slowest).max(1e-9);
    for tempo in TEMPI
        .iter()
        .filter(|tempo| (slowest..=fastest).contains(tempo))
    {
        let y = TOP + HEIGHT - row / 2.0 - (HEIGHT - row) * (tempo - slowest) / span;
        svg.line(&[[LEFT - 5.0, y], [LEFT, y]], Stroke::solid(INK, 1.0));
        let font = Font::new(12.0, INK, Anchor::End);
        svg.text([LEFT - 8.0, y + 4.0], &format!("{tempo}"), font);
    }
}

fn draw_seconds(svg: &mut Svg, left: f64, times: &[f64]) {
    let (bottom, last) = (TOP + HEIGHT, times.last().copied().unwrap_or(0.0));
    let cell = WIDTH / times.len().max(1) as f64;
    let fits = |step: &&usize| last / **step as f64 <= LABELS as f64;
    let longest = (last / LABELS as f64).ceil() as usize;
    let step = STEPS.iter().find(fits).copied().unwrap_or(longest.max(1));
    for seconds in (0..=last as usize).step_by(step) {
        // A window's middle lies in the middle of its cells.
        let x = left + cell / 2.0 + (WIDTH - cell) * seconds as f64 / last.max(1e-9);
        svg.line(&[[x, bottom], [x, bottom + 5.0]], Stroke::solid(INK, 1.0));
        let font = Font::new(12.0, INK, Anchor::Middle);
        svg.text([x, bottom + 20.0], &seconds.to_string(), font);
    }
    let below = [left + WIDTH / 2.0, bottom + 40.0];
    svg.text(below, "s", Font::new(12.0, INK, Anchor::Middle));
}
