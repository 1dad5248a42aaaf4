//! Figures 5 and 6: scores of tables 1 to 4 over lambda, a line for each sigma and size.

use super::grid::{Grid, SIGMAS, equals, mean, score_of};
use crate::counted::counted;
use crate::evaluation::music_dance::MusicDance;
use crate::evaluation::{EvaluationOptions, Metric, PrintedTables, Protocol as _, TableRow};
use crate::report::ReportError;
use crate::report::chart::{Axis, Chart, Line, Scale};
use crate::report::figures::{Figure, Numbers};
use crate::report::score_figure::metric_axis;

/// Sizes of the models: ours, and the paper's that stands beside it.
const SIZES: [[&str; 2]; 2] = [["small", "light"], ["larger", "large"]];
/// Colours of a size: that of its seeds, then one for each sigma.
const COLOURS: usize = 1 + SIGMAS.len();

/// What one of the figures shows.
pub struct Plot {
    name: &'static str,
    pub number: u32,
    metric: &'static str,
    /// Numbers of the tables, by size.
    pub tables: [u32; 2],
    scale: Scale,
}

pub const FIGURE_5: Plot = Plot {
    name: "figure_5",
    number: 5,
    metric: "consistency",
    tables: [1, 3],
    scale: Scale::Logarithmic,
};

pub const FIGURE_6: Plot = Plot {
    name: "figure_6",
    number: 6,
    metric: "smoothness",
    tables: [2, 4],
    scale: Scale::Linear,
};

/// What is gathered of the sizes.
#[derive(Default)]
struct Drawing {
    lines: Vec<Line>,
    numbers: Numbers,
    /// For the caption: seeds at lambda 0, changes from there on, rows that there are not.
    seeds: Vec<String>,
    changes: Vec<String>,
    lacking: Vec<String>,
}

/// The figure; none where there is no row for it.
///
/// # Errors
/// A score is not finite.
pub fn figure(
    plot: &Plot,
    rows: &[TableRow],
    printed: &PrintedTables,
) -> Result<Option<Figure>, ReportError> {
    let protocol = MusicDance::new(&EvaluationOptions::default());
    let mut metrics = protocol.metrics().iter();
    let Some(metric) = metrics.find(|metric| metric.key == plot.metric) else {
        return Ok(None);
    };
    let mut drawing = Drawing::default();
    for (size, table) in plot.tables.into_iter().enumerate() {
        let grid = Grid::of(table, metric.key, rows, printed);
        drawing.add(size, &grid, metric);
    }
    if drawing.lines.is_empty() {
        return Ok(None);
    }
    let real = format!("{}_real", metric.key);
    let real = rows.iter().find_map(|row| score_of(row, &real));
    if let Some(real) = real {
        let numbers = &mut drawing.numbers;
        numbers.add("recorded dances", metric.key, real, metric.unit);
    }
    let caption = drawing.caption(plot, metric, real, printed.note.as_deref());
    let log = match plot.scale {
        Scale::Linear => "",
        Scale::Logarithmic => ", log scale",
    };
    let svg = Chart {
        title: format!(
            "Figure {}: {} over λ; dashed: the paper's",
            plot.number, metric.title
        ),
        caption: caption.clone(),
        x: Axis::linear("λ"),
        y: Axis {
            label: metric_axis(metric) + log,
            scale: plot.scale,
        },
        lines: drawing.lines,
    }
    .svg()?;
    Ok(Some(Figure {
        name: plot.name,
        caption,
        svg,
        numbers: drawing.numbers,
    }))
}

impl Drawing {
    fn add(&mut self, size: usize, grid: &Grid<'_>, metric: &Metric) {
        let [ours, papers] = SIZES[size];
        for (cell, score) in grid.known() {
            self.numbers.add(cell.row, metric.key, score, metric.unit);
        }
        self.lacking.extend(grid.lacking(ours));
        let seeds = grid.seeds();
        let start = mean(&seeds);
        for (index, sigma) in SIGMAS.into_iter().enumerate() {
            let later = grid.ours(sigma);
            let Some(&(lambda, end)) = later.last() else {
                continue;
            };
            if let Some(start) = start {
                let [from, to] = [start, end].map(|value| shown(metric, value));
                let sigma = equals("σ", sigma);
                let change = format!("{ours}, {sigma}: {from} to {to} at {}", equals("λ", lambda));
                self.changes.push(change);
            }
            let start = start.map(|start| (0.0, start)).into_iter();
            let colour = COLOURS * size + 1 + index;
            self.lines.push(Line {
                name: format!("{ours}, {}", equals("σ", sigma)),
                emphasised: true,
                dots: true,
                ..Line::plain(start.chain(later).collect(), colour)
            });
            self.lines.push(Line {
                name: format!("{papers}, {}, paper", equals("σ", sigma)),
                dashed: true,
                ..Line::plain(grid.paper(sigma), colour)
            });
        }
        if let Some(start) = start {
            self.add_seeds(size, &seeds, start, metric);
        }
    }

    /// Scores at lambda 0, ascending, and their mean: drawn over the lines that begin at it.
    fn add_seeds(&mut self, size: usize, seeds: &[f64], mean: f64, metric: &Metric) {
        let [ours, _] = SIZES[size];
        let count = counted(seeds.len(), "seed");
        let (least, most) = (seeds[0], seeds[seeds.len() - 1]);
        let row = format!("{ours}, lambda 0");
        for (of, value) in [("mean", mean), ("least", least), ("most", most)] {
            let measure = format!("{}_{of}", metric.key);
            self.numbers.add(&row, measure, value, metric.unit);
        }
        let [least, most] = [least, most].map(|value| shown(metric, value));
        self.seeds.push(match seeds {
            [_] => format!("{ours} {least}, {count}"),
            _ => format!("{ours} {least} to {most}, {count}"),
        });
        let points = seeds.iter().map(|&seed| (0.0, seed));
        self.lines.push(Line {
            name: format!("{ours}, {}, {count}", equals("λ", 0.0)),
            dots: true,
            ..Line::plain(points.collect(), COLOURS * size)
        });
    }

    fn caption(
        &self,
        plot: &Plot,
        metric: &Metric,
        real: Option<f64>,
        note: Option<&str>,
    ) -> String {
        let mut caption = format!(
            "Figure {}. The {} over λ, a line for each σ, dashed the paper's.",
            plot.number, metric.title
        );
        if !self.seeds.is_empty() {
            caption += &format!(
                " At {} the loss has no σ, so lines begin at the mean of its seeds ({}).",
                equals("λ", 0.0),
                self.seeds.join("; ")
            );
        }
        if !self.changes.is_empty() {
            caption += &format!(" From there: {}.", self.changes.join("; "));
        }
        if let Some(real) = real {
            caption += &format!(" The recorded dances have {}.", shown(metric, real));
        }
        if let Some(note) = note {
            caption += &format!(" {note}");
        }
        if !self.lacking.is_empty() {
            caption += &format!(" Rows that there are not: {}.", self.lacking.join("; "));
        }
        caption
    }
}

/// A score as tables show it.
fn shown(metric: &Metric, score: f64) -> String {
    format!("{score:.*}", metric.decimals)
}
