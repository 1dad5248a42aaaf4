//! Tables 2 to 4 of the paper with our scores beside the paper's: as Markdown, and as plain text for the terminal.

use std::collections::BTreeSet;

use super::paper::{self, PaperRow};
use super::scores::{Evaluation, LengthScores};

/// One of our models in the tables.
#[derive(Debug, Clone, PartialEq)]
pub struct TableRow {
    /// The model's name in its config, such as `whole_model`; finds the paper's row.
    pub name: String,
    /// The seed of its training. Rows that differ in it only are shown with their mean and spread.
    pub seed: Option<u64>,
    /// None where it is not trained yet: the row stands there all the same.
    pub evaluation: Option<Evaluation>,
    /// The schedule that it was trained on, such as "0.002 of the paper's schedule, 1.2e6 frame-steps"; "not trained" for
    /// interpolation.
    pub schedule_note: String,
}

/// The cell of a model that has no scores yet.
const ABSENT: &str = "—";

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
/// All rows of the paper are there, in its order, then our models that it does not have. Rows of one model that differ in their seed
/// only have their mean, standard deviation and range too; a row without scores has "—" in every cell. `subject` says in the caption what ours were
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
        let mut title = group.title.clone();
        for (kind, cells) in group_lines(&group, score, paper.as_deref(), &lengths) {
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
    for (note, models) in notes(rows) {
        out += &format!("- {}: {note}\n", models.join(", "));
    }
    out
}

/// The lines of one model: what each shows, and its cells.
fn group_lines(
    group: &Group<'_>,
    score: &Score,
    paper: Option<&[Option<f64>]>,
    lengths: &[usize],
) -> Vec<(String, Vec<String>)> {
    let mut lines = Vec::new();
    if let Some(paper) = paper {
        lines.push(("paper".to_string(), cells(paper, false)));
    }
    let compared = |ours: &[Option<f64>], of: &TableRow| {
        let same_lengths = of
            .evaluation
            .as_ref()
            .is_some_and(|evaluation| evaluation.lrp.lengths().eq(paper::LENGTHS));
        paper.map(|paper| cells(&difference(ours, paper, same_lengths), true))
    };
    let values = |row: &TableRow| {
        row.evaluation
            .as_ref()
            .map(|evaluation| our_values((score.ours)(evaluation), lengths))
    };
    let absent = || vec![ABSENT.to_string(); lengths.len() + 1];
    let by_seed = group.differ_in_seed_only();
    for (index, row) in group.ours.iter().enumerate() {
        let kind = match row.seed {
            Some(seed) if by_seed => format!("ours, seed {seed}"),
            _ if group.ours.len() > 1 => format!("ours ({})", index + 1),
            _ => "ours".to_string(),
        };
        let ours = values(row);
        let shown = ours.as_ref().map(|ours| cells(ours, false));
        lines.push((kind, shown.unwrap_or_else(absent)));
        if paper.is_some() && !by_seed {
            let difference = ours.and_then(|ours| compared(&ours, row));
            lines.push(("difference".into(), difference.unwrap_or_else(absent)));
        }
    }
    if by_seed {
        let measured: Vec<(&TableRow, Vec<Option<f64>>)> = group
            .ours
            .iter()
            .filter_map(|row| Some((*row, values(row)?)))
            .collect();
        let columns: Vec<Option<Spread>> = (0..=lengths.len())
            .map(|column| Spread::of(measured.iter().map(|(_, values)| values[column])))
            .collect();
        let shown = |text: &dyn Fn(&Spread) -> String| -> Vec<String> {
            let cell = |spread: &Option<Spread>| spread.as_ref().map(text);
            columns
                .iter()
                .map(|spread| cell(spread).unwrap_or(ABSENT.into()))
                .collect()
        };
        lines.push((
            "ours, mean ± sd".into(),
            shown(&|s| format!("{:.2} ± {:.2}", s.mean, s.deviation)),
        ));
        lines.push((
            "ours, min to max".into(),
            shown(&|s| format!("{:.2} to {:.2}", s.least, s.most)),
        ));
        if paper.is_some() {
            let means: Vec<Option<f64>> = columns
                .iter()
                .map(|spread| spread.as_ref().map(|spread| spread.mean))
                .collect();
            let difference = measured
                .first()
                .and_then(|(row, _)| compared(&means, row))
                .unwrap_or_else(absent);
            lines.push(("difference of the mean".into(), difference));
        }
    }
    lines
}

/// Every note of the rows once, and the models that it is about.
fn notes(rows: &[TableRow]) -> Vec<(&str, Vec<String>)> {
    let mut notes: Vec<(&str, Vec<String>)> = Vec::new();
    for group in groups(rows) {
        for row in group.ours {
            let model = match row.seed {
                Some(seed) => format!("{} (seed {seed})", group.title),
                None => group.title.clone(),
            };
            match notes
                .iter_mut()
                .find(|(note, _)| *note == row.schedule_note)
            {
                Some((_, models)) => models.push(model),
                None => notes.push((&row.schedule_note, vec![model])),
            }
        }
    }
    notes
}

/// The scores of several seeds at one length.
struct Spread {
    mean: f64,
    /// Standard deviation with n - 1; 0 for one seed.
    deviation: f64,
    least: f64,
    most: f64,
}

impl Spread {
    /// None where a seed has no score.
    fn of(scores: impl Iterator<Item = Option<f64>>) -> Option<Self> {
        let scores: Vec<f64> = scores.collect::<Option<_>>()?;
        if scores.is_empty() {
            return None;
        }
        let count = scores.len() as f64;
        let mean = scores.iter().sum::<f64>() / count;
        let squares: f64 = scores.iter().map(|score| (score - mean).powi(2)).sum();
        Some(Self {
            mean,
            deviation: (squares / (count - 1.0).max(1.0)).sqrt(),
            least: scores.iter().copied().fold(f64::INFINITY, f64::min),
            most: scores.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        })
    }
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
    let measured: Vec<(&TableRow, &Evaluation)> = rows
        .iter()
        .filter_map(|row| Some((row, row.evaluation.as_ref()?)))
        .collect();
    let mut out = String::new();
    for score in &SCORES {
        out += &line(&format!("{} ({})", score.name, score.unit), &header);
        for (row, evaluation) in &measured {
            let ours = our_values((score.ours)(evaluation), &lengths);
            out += &line(&row.name, &cells(&ours, false));
            let paper = paper::row(&row.name).and_then(score.paper);
            if let Some(values) = paper.filter(|_| lengths == paper::LENGTHS) {
                out += &line("  paper", &cells(&values.map(Some), false));
            }
        }
        out.push('\n');
    }
    if measured
        .iter()
        .any(|(_, evaluation)| evaluation.foot_skate.is_some())
    {
        out += &line("foot skate (cm/frame)", &header);
        for (row, evaluation) in &measured {
            let skate = evaluation.foot_skate.as_ref();
            let ours = skate.map_or(vec![None; header.len()], |skate| {
                our_values(skate, &lengths)
            });
            out += &line(&row.name, &cells(&ours, false));
        }
        out.push('\n');
    }
    for (row, evaluation) in &measured {
        let counts: Vec<String> = lengths
            .iter()
            .map(|length| evaluation.windows.get(length))
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
        .filter_map(|row| row.evaluation.as_ref())
        .flat_map(|evaluation| evaluation.lrp.lengths())
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

impl Group<'_> {
    /// Whether these are trainings of one model on one budget with several seeds.
    fn differ_in_seed_only(&self) -> bool {
        let Some((first, others)) = self.ours.split_first() else {
            return false;
        };
        let seeds: BTreeSet<_> = self.ours.iter().filter_map(|row| row.seed).collect();
        // A row that is not trained yet has no note of its budget.
        let measured = |row: &TableRow| row.evaluation.is_some();
        let same = |row: &&TableRow| {
            !measured(first) || !measured(row) || row.schedule_note == first.schedule_note
        };
        !others.is_empty() && seeds.len() == self.ours.len() && others.iter().all(same)
    }
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
