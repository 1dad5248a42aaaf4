//! A table of Pu and Shan as a grid: lambda over sigma, of one size of the model.

use crate::evaluation::{PrintedTables, TableRow};

use super::PROTOCOL;

/// Columns of a table. At the first the loss has no sigma: its rows are seeds of one experiment.
pub const LAMBDAS: [f64; 4] = [0.0, 1.0, 3.0, 5.0];
/// Rows of a table.
pub const SIGMAS: [f64; 3] = [0.05, 0.1, 0.2];
/// The column of a score over all windows.
const ALL: &str = "all";

/// A cell of a table.
pub struct Cell<'p> {
    /// Name of its row of ours.
    pub row: &'p str,
    pub lambda: f64,
    pub sigma: f64,
    /// A mean over the row's seeds; none of a row that is not there.
    pub ours: Option<f64>,
    pub paper: Option<f64>,
}

/// All cells of a table, sigma by sigma.
pub struct Grid<'p> {
    cells: Vec<Cell<'p>>,
}

impl<'p> Grid<'p> {
    /// The paper's table of this number; empty where it has none.
    pub fn of(table: u32, metric: &str, rows: &[TableRow], printed: &'p PrintedTables) -> Self {
        let mut tables = printed.tables.iter();
        let names = tables.find(|it| it.number == Some(table));
        let names = names.and_then(|it| it.rows.as_deref()).unwrap_or_default();
        let places = SIGMAS
            .into_iter()
            .flat_map(|sigma| LAMBDAS.map(|lambda| (sigma, lambda)));
        let cell = |(row, (sigma, lambda)): (&'p String, (f64, f64))| {
            let columns = printed.columns_of(metric);
            let paper = printed.row(row);
            Cell {
                row,
                lambda,
                sigma,
                ours: score(row, metric, rows),
                paper: paper.and_then(|it| it.value(metric, columns, ALL)),
            }
        };
        Self {
            cells: names.iter().zip(places).map(cell).collect(),
        }
    }

    /// Those cells that there is a row of ours for, with its score.
    pub fn known(&self) -> impl Iterator<Item = (&Cell<'p>, f64)> {
        let cells = self.cells.iter();
        cells.filter_map(|cell| Some((cell, cell.ours?)))
    }

    /// Our scores at lambda 0, ascending.
    pub fn seeds(&self) -> Vec<f64> {
        let seeds = self.known().filter(|(cell, _)| cell.lambda == 0.0);
        let mut seeds: Vec<f64> = seeds.map(|(_, score)| score).collect();
        seeds.sort_by(f64::total_cmp);
        seeds
    }

    /// `(lambda, score)` of ours at a sigma, after lambda 0.
    pub fn ours(&self, sigma: f64) -> Vec<(f64, f64)> {
        let of_sigma = self.known().filter(|(cell, _)| cell.sigma == sigma);
        let later = of_sigma.filter(|(cell, _)| cell.lambda > 0.0);
        later.map(|(cell, score)| (cell.lambda, score)).collect()
    }

    /// `(lambda, score)` as the paper prints them at a sigma.
    pub fn paper(&self, sigma: f64) -> Vec<(f64, f64)> {
        let of_sigma = self.cells.iter().filter(|cell| cell.sigma == sigma);
        let printed = of_sigma.filter_map(|cell| Some((cell.lambda, cell.paper?)));
        printed.collect()
    }

    /// Which rows there are not, in words; none where all are there.
    pub fn lacking(&self, size: &str) -> Option<String> {
        let names = |there: bool| {
            let cells = self
                .cells
                .iter()
                .filter(|cell| cell.ours.is_some() == there);
            let names = cells.map(|cell| {
                let (lambda, sigma) = (equals("λ", cell.lambda), equals("σ", cell.sigma));
                format!("{lambda} with {sigma}")
            });
            names.collect::<Vec<_>>()
        };
        let (there, not) = (names(true), names(false));
        match (there.len(), not.len()) {
            (_, 0) => None,
            (0, _) => Some(format!("all of the {size} size")),
            (some, most) if some < most => {
                Some(format!("all of the {size} size but {}", there.join(", ")))
            }
            _ => Some(format!("of the {size} size {}", not.join(", "))),
        }
    }
}

/// The score of the row of this name, a mean over its seeds.
fn score(name: &str, metric: &str, rows: &[TableRow]) -> Option<f64> {
    let of_name = rows.iter().filter(|row| row.name == name);
    let scores: Vec<f64> = of_name.filter_map(|row| score_of(row, metric)).collect();
    mean(&scores)
}

/// The score of a row over all windows.
pub fn score_of(row: &TableRow, metric: &str) -> Option<f64> {
    row.scores.as_ref()?.by(PROTOCOL)?.row(metric)?.at(ALL)
}

/// "λ = 5", which no line breaks.
pub fn equals(symbol: &str, value: f64) -> String {
    format!("{symbol}\u{a0}=\u{a0}{value}")
}

/// None of nothing.
pub fn mean(values: &[f64]) -> Option<f64> {
    let sum: f64 = values.iter().sum();
    (!values.is_empty()).then(|| sum / values.len() as f64)
}
