//! Tables 2 to 4 of the paper with our scores beside the paper's: as Markdown, and as plain text for the terminal.

use std::collections::BTreeSet;

use super::paper::{self, PaperRow};
use super::scores::{Evaluation, LengthScores};

/// One of our models in the tables.
#[derive(Debug, Clone, PartialEq)]
pub struct TableRow {
    /// The model's name in its config, such as `whole_model`; finds the paper's row.
    pub name: String,
    pub evaluation: Evaluation,
    /// The schedule that it was trained on, such as "0.002 of the paper's schedule, 1.2e6 frame-steps"; "not trained" for
    /// interpolation.
    pub schedule_note: String,
}

/// One of the three scores: how it is called, measured and printed.
struct Score {
    table: u32,
    name: &'static str,
    unit: &'static str,
    what: &'static str,
    paper: fn(&PaperRow) -> Option<[f64; 5]>,
    ours: fn(&Evaluation) -> &LengthScores,
}

const SCORES: [Score; 3] = [
    Score {
        table: 2,
        name: "LRP",
        unit: "cm",
        what: "average L2 distance of root-relative positions (eq. 12), cm; lower is better",
        paper: |row| Some(row.lrp),
        ours: |evaluation| &evaluation.lrp,
    },
    Score {
        table: 3,
        name: "AVF",
        unit: "share of windows",
        what: "share of windows with the velocity factors asked for (eq. 13 and 14); higher is better",
        paper: |row| row.avf,
        ours: |evaluation| &evaluation.avf,
    },
    Score {
        table: 4,
        name: "ART",
        unit: "share of windows",
        what: "share of windows on the root trajectory asked for (eq. 15 and 16); higher is better",
        paper: |row| row.art,
        ours: |evaluation| &evaluation.art,
    },
];

/// Tables 2, 3 and 4 in Markdown: for each model the paper's value, ours and the difference (ours minus the paper's).
///
/// All rows of the paper are there, in its order, then our models that it does not have. `subject` says in the caption what ours were
/// evaluated on, such as "25 test clips of the dance data set". Where our lengths are not the paper's four, the columns
/// are ours and AVG is not compared.
pub fn markdown_tables(rows: &[TableRow], subject: &str) -> String {
    let tables: Vec<String> = SCORES
        .iter()
        .map(|score| markdown_table(score, rows, subject))
        .collect();
    tables.join("\n")
}

fn markdown_table(score: &Score, rows: &[TableRow], subject: &str) -> String {
    let lengths = lengths(rows);
    let mut header = vec!["Model".to_string(), String::new()];
    header.extend(lengths.iter().map(|length| format!("N = {length}")));
    header.push("AVG".into());
    let mut rule = vec!["---".to_string(); 2];
    rule.resize(header.len(), "---:".into());
    let mut lines = vec![header, rule];

    for group in groups(rows) {
        let paper = group.paper.and_then(score.paper);
        let paper = paper.map(|values| paper_values(&values, &lengths));
        let mut entries = Vec::new();
        if let Some(paper) = &paper {
            entries.push(("paper".to_string(), cells(paper, false)));
        }
        for (index, row) in group.ours.iter().enumerate() {
            let ours = our_values((score.ours)(&row.evaluation), &lengths);
            let kind = match group.ours.len() {
                1 => "ours".to_string(),
                _ => format!("ours ({})", index + 1),
            };
            entries.push((kind, cells(&ours, false)));
            if let Some(paper) = &paper {
                let same_lengths = row.evaluation.lrp.lengths().eq(paper::LENGTHS);
                let difference = difference(&ours, paper, same_lengths);
                entries.push(("difference".to_string(), cells(&difference, true)));
            }
        }
        let mut title = group.title;
        for (kind, cells) in entries {
            let mut line = vec![std::mem::take(&mut title), kind];
            line.extend(cells);
            lines.push(line);
        }
    }

    let mut out = format!("## Table {}: {}\n\n", score.table, score.name);
    for line in lines {
        out += &format!("| {} |\n", line.join(" | "));
    }
    out += &format!(
        "\n{}: {}. AVG is the mean over the lengths; the difference is ours minus the paper's. Ours on {subject}.\n",
        score.name, score.what
    );
    if !rows.is_empty() {
        out += "\nTraining of ours:\n\n";
    }
    for group in groups(rows) {
        for row in group.ours {
            out += &format!("- {}: {}\n", group.title, row.schedule_note);
        }
    }
    out
}

/// The scores as plain text, for the terminal: a block for each score, a line for each model, at last the numbers of windows.
///
/// The paper's values stand under ours where it has them and the lengths are its own.
pub fn terminal_tables(rows: &[TableRow]) -> String {
    let lengths = lengths(rows);
    let names = rows.iter().map(|row| row.name.chars().count());
    let width = names.max().unwrap_or(0).max("AVF (share of windows)".len()) + 1;
    let line = |name: &str, cells: &[String]| {
        let cells: String = cells.iter().map(|cell| format!("{cell:>9}")).collect();
        format!("{name:<width$}{cells}\n")
    };
    let mut header: Vec<String> = lengths.iter().map(usize::to_string).collect();
    header.push("AVG".into());
    let mut out = String::new();
    for score in &SCORES {
        out += &line(&format!("{} ({})", score.name, score.unit), &header);
        for row in rows {
            let ours = our_values((score.ours)(&row.evaluation), &lengths);
            out += &line(&row.name, &cells(&ours, false));
            let paper = paper::row(&row.name).and_then(score.paper);
            if let Some(values) = paper.filter(|_| lengths == paper::LENGTHS) {
                out += &line("  paper", &cells(&values.map(Some), false));
            }
        }
        out.push('\n');
    }
    for row in rows {
        let counts: Vec<String> = lengths
            .iter()
            .map(|length| row.evaluation.windows.get(length))
            .map(|count| count.map_or("-".into(), usize::to_string))
            .collect();
        out += &line(&format!("windows, {}", row.name), &counts);
    }
    out
}

/// All lengths of the rows, ascending; the paper's where there are no rows.
fn lengths(rows: &[TableRow]) -> Vec<usize> {
    let lengths: BTreeSet<usize> = rows
        .iter()
        .flat_map(|row| row.evaluation.lrp.lengths())
        .collect();
    if lengths.is_empty() {
        return paper::LENGTHS.to_vec();
    }
    lengths.into_iter().collect()
}

/// A model in the tables: the paper's row and ours by its name (more than one where it was trained more than once).
struct Group<'a> {
    title: String,
    paper: Option<&'static PaperRow>,
    ours: Vec<&'a TableRow>,
}

fn groups(rows: &[TableRow]) -> Vec<Group<'_>> {
    let mut groups: Vec<Group> = paper::ROWS
        .iter()
        .map(|paper| Group {
            title: paper.title.to_string(),
            paper: Some(paper),
            ours: rows.iter().filter(|row| row.name == paper.name).collect(),
        })
        .collect();
    for row in rows.iter().filter(|row| paper::row(&row.name).is_none()) {
        match groups.iter_mut().find(|group| group.title == row.name) {
            Some(group) => group.ours.push(row),
            None => groups.push(Group {
                title: row.name.clone(),
                paper: None,
                ours: vec![row],
            }),
        }
    }
    groups
}

/// The paper's values at these lengths, where it has them, and its AVG.
fn paper_values(values: &[f64; 5], lengths: &[usize]) -> Vec<Option<f64>> {
    let column = |length: &usize| paper::LENGTHS.iter().position(|known| known == length);
    let by_length = lengths
        .iter()
        .map(|length| column(length).map(|at| values[at]));
    by_length
        .chain([Some(values[paper::LENGTHS.len()])])
        .collect()
}

/// Our scores at these lengths, and AVG.
fn our_values(scores: &LengthScores, lengths: &[usize]) -> Vec<Option<f64>> {
    let by_length = lengths.iter().map(|&length| scores.at(length));
    by_length.chain([Some(scores.average())]).collect()
}

/// Ours minus the paper's; AVG, which stands last, only if it is the mean of the same lengths.
fn difference(ours: &[Option<f64>], paper: &[Option<f64>], same_lengths: bool) -> Vec<Option<f64>> {
    let last = ours.len().saturating_sub(1);
    let pairs = ours.iter().zip(paper).enumerate();
    pairs
        .map(
            |(column, (ours, paper))| match same_lengths || column < last {
                true => ours.zip(*paper).map(|(ours, paper)| ours - paper),
                false => None,
            },
        )
        .collect()
}

fn cells(values: &[Option<f64>], signed: bool) -> Vec<String> {
    let text = |value: &Option<f64>| match value {
        None => "-".to_string(),
        Some(value) if signed => format!("{value:+.2}"),
        Some(value) => format!("{value:.2}"),
    };
    values.iter().map(text).collect()
}
