//! A metric over the columns of its table, for several models, ours beside what a paper prints.

use super::FigureError;
use super::chart::{Axis, Chart, Line};
use crate::evaluation::scores::AVERAGE;
use crate::evaluation::{Metric, PrintedRow, PrintedTables, ScoreRow, TableRow};

/// The scores of one model by one metric.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreSeries {
    /// The model's name.
    pub name: String,
    /// `(N in frames, score)`, ascending in N: ours.
    pub ours: Vec<(f64, f64)>,
    /// Likewise what the paper prints of this model, drawn dashed in the same colour; empty where
    /// it prints nothing.
    pub paper: Vec<(f64, f64)>,
}

/// Draws a metric over the transition length N (frames).
///
/// # Errors
///
/// [`FigureError`]: no points, or a NaN or infinity.
pub fn score_curve(
    title: &str,
    metric: &Metric,
    models: &[ScoreSeries],
) -> Result<String, FigureError> {
    let mut lines = Vec::new();
    for (colour, model) in models.iter().enumerate() {
        for (points, dashed) in [(&model.ours, false), (&model.paper, true)] {
            if points.is_empty() {
                continue;
            }
            let paper = if dashed { ", paper" } else { "" };
            lines.push(Line {
                name: format!("{}{paper}", model.name),
                emphasised: !dashed,
                dashed,
                dots: true,
                ..Line::plain(points.clone(), colour)
            });
        }
    }
    Chart {
        title: title.to_string(),
        caption: String::new(),
        x: Axis::linear("transition length N (frames at 30 fps)"),
        y: Axis::linear(&metric_axis(metric)),
        lines,
    }
    .svg()
}

/// What stands along an axis of this metric.
pub(super) fn metric_axis(metric: &Metric) -> String {
    let better = metric.better.title();
    format!("{} ({}), {better}", metric.title, metric.unit)
}

/// The figure of the rows' scores by a protocol on test clips, SVG: the mean over a model's seeds,
/// and of the rows that the paper's file names the printed ones.
///
/// None where no column is a number that scores could be drawn over.
///
/// # Errors
/// A score is not finite.
pub fn score_figure(
    protocol: &str,
    metric: &Metric,
    printed: &PrintedTables,
    rows: &[TableRow],
) -> Result<Option<String>, FigureError> {
    let title = format!("{} on the test clips; dashed: the paper's", metric.title);
    let series = series(protocol, metric, printed, rows);
    match series.iter().all(|series| series.ours.is_empty()) {
        true => Ok(None),
        false => score_curve(&title, metric, &series).map(Some),
    }
}

fn series(
    protocol: &str,
    metric: &Metric,
    printed: &PrintedTables,
    rows: &[TableRow],
) -> Vec<ScoreSeries> {
    let of_paper = |row: &PrintedRow| -> Vec<(f64, f64)> {
        let values = row.values.get(metric.key).into_iter().flatten();
        let columns = printed.columns_of(metric.key).iter().map(String::as_str);
        numbered(columns.zip(values.copied()))
    };
    let mut series: Vec<ScoreSeries> = Vec::new();
    for row in rows {
        let paper = printed.row(&row.name);
        let name = paper.map_or(row.name.as_str(), |paper| &paper.title);
        if series.iter().any(|known| known.name == name) {
            continue;
        }
        let seeds = rows.iter().filter(|other| other.name == row.name);
        let scores = seeds.filter_map(|seed| seed.scores.as_ref()?.by(protocol)?.row(metric.key));
        let seeds: Vec<&ScoreRow> = scores.collect();
        let Some(first) = seeds.first() else {
            continue;
        };
        let mean = |column| {
            let sum: Option<f64> = seeds.iter().map(|seed| seed.at(column)).sum();
            Some((column, sum? / seeds.len() as f64))
        };
        series.push(ScoreSeries {
            name: name.into(),
            ours: numbered(first.columns().filter_map(mean)),
            paper: paper
                .filter(|paper| printed.dashed.contains(&paper.name))
                .map_or_else(Vec::new, of_paper),
        });
    }
    if let Some(goal) = printed.goal.as_ref().and_then(|goal| printed.row(goal))
        && !series.iter().any(|known| known.name == goal.title)
    {
        series.push(ScoreSeries {
            name: goal.title.clone(),
            ours: Vec::new(),
            paper: of_paper(goal),
        });
    }
    series
}

/// The columns that are numbers, as numbers.
fn numbered<'c>(values: impl Iterator<Item = (&'c str, f64)>) -> Vec<(f64, f64)> {
    values
        .filter(|(column, _)| *column != AVERAGE)
        .filter_map(|(column, value)| Some((column.parse().ok()?, value)))
        .collect()
}
