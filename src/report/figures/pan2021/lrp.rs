//! LRP over the transition length, ours beside what the paper prints.

use crate::evaluation::TableRow;
use crate::evaluation::paper::{self, PaperRow};
use crate::report::{FigureError, LrpSeries, lrp_curve};

/// Models whose line in the figure has the paper's beside it; those of all would bury ours, and the
/// tables have them.
const REFERENCES: [&str; 2] = ["interpolation", "whole_model"];

/// The figure of the rows' scores on test clips, SVG.
///
/// # Errors
/// There is nothing to draw.
pub fn lrp_figure(rows: &[TableRow]) -> Result<String, FigureError> {
    lrp_curve(
        "LRP on the test clips; dashed: the paper's",
        &lrp_series(rows),
    )
}

/// LRP of every model with scores, the mean over its seeds, and of two the paper's; of the whole
/// model the paper's in any case.
fn lrp_series(rows: &[TableRow]) -> Vec<LrpSeries> {
    let mut series: Vec<LrpSeries> = Vec::new();
    for row in rows {
        let name = paper::row(&row.name).map_or(row.name.as_str(), |paper| paper.title);
        if series.iter().any(|known| known.name == name) {
            continue;
        }
        let seeds: Vec<_> = rows
            .iter()
            .filter(|other| other.name == row.name)
            .filter_map(|other| other.evaluation.as_ref())
            .collect();
        let Some(first) = seeds.first() else {
            continue;
        };
        let mean = |length: usize| {
            let sum: Option<f64> = seeds.iter().map(|seed| seed.lrp.at(length)).sum();
            Some((length as f64, sum? / seeds.len() as f64))
        };
        series.push(LrpSeries {
            name: name.into(),
            ours: first.lrp.lengths().filter_map(mean).collect(),
            paper: paper::row(&row.name)
                .filter(|paper| REFERENCES.contains(&paper.name))
                .map_or_else(Vec::new, papers_lrp),
        });
    }
    if let Some(goal) = paper::row("whole_model")
        && !series.iter().any(|known| known.name == goal.title)
    {
        series.push(LrpSeries {
            name: goal.title.into(),
            ours: Vec::new(),
            paper: papers_lrp(goal),
        });
    }
    series
}

/// `(N, LRP)` as printed.
fn papers_lrp(row: &PaperRow) -> Vec<(f64, f64)> {
    let lengths = paper::LENGTHS.iter().map(|&length| length as f64);
    lengths.zip(row.lrp).collect()
}
