//! The tables of one protocol: a paper's values, ours and the difference.

use std::collections::BTreeSet;

use super::scores::{AVERAGE, ScoreRow, Scores};
use super::{Metric, PrintedRow, PrintedTable, PrintedTables, Protocol, TableRow};

/// The cell of a model that has no scores yet.
const ABSENT: &str = "—";
/// Least width of a cell on a terminal.
const CELL: usize = 9;

/// The tables of a protocol's metrics.
pub(super) struct ProtocolTable<'a> {
    protocol: &'a dyn Protocol,
    /// Its values are shown where they were counted by this protocol.
    printed: &'a PrintedTables,
    /// All but those that were scored by other protocols only.
    rows: Vec<&'a TableRow>,
}

impl<'a> ProtocolTable<'a> {
    pub(super) fn new(
        protocol: &'a dyn Protocol,
        printed: &'a PrintedTables,
        rows: &'a [TableRow],
    ) -> Self {
        let by_it = |row: &&TableRow| match &row.scores {
            Some(scores) => scores.by(protocol.name()).is_some(),
            None => true,
        };
        Self {
            protocol,
            printed,
            rows: rows.iter().filter(by_it).collect(),
        }
    }

    /// Whether it is the one that the paper's numbers stand in.
    pub(super) fn is_compared(&self) -> bool {
        self.printed.compares(self.protocol.name())
    }

    /// Whether there is anything of ours to show; the paper's alone has rows of its own.
    pub(super) fn has_rows(&self) -> bool {
        match self.is_compared() {
            true => !self.rows.is_empty(),
            false => self.rows.iter().any(|row| row.scores.is_some()),
        }
    }

    /// How its scores were counted.
    pub(super) fn counted(&self) -> String {
        let (name, about) = (self.protocol.name(), self.protocol.about());
        format!("By `{name}`, {about}")
    }

    pub(super) fn markdown(&self, subject: &str) -> String {
        let tables = self.tables().into_iter();
        let text = |(table, metric)| self.markdown_table(table, metric, subject);
        tables.map(text).collect::<Vec<String>>().join("\n")
    }

    fn scores<'r>(&self, row: &'r TableRow) -> Option<&'r Scores> {
        row.scores.as_ref()?.by(self.protocol.name())
    }

    /// The metrics that have a table, with what the paper's file says of it: all where that prints
    /// none.
    fn tables(&self) -> Vec<(Option<&PrintedTable>, &Metric)> {
        let metrics = self.protocol.metrics();
        if self.printed.tables.is_empty() || !self.is_compared() {
            return metrics.iter().map(|metric| (None, metric)).collect();
        }
        let tables = self.printed.tables.iter().filter_map(|table| {
            let of_table = |metric: &&Metric| metric.key == table.metric;
            Some((Some(table), metrics.iter().find(of_table)?))
        });
        tables.collect()
    }

    fn markdown_table(
        &self,
        table: Option<&PrintedTable>,
        metric: &Metric,
        subject: &str,
    ) -> String {
        let (columns, title) = (&self.columns(metric), metric.title);
        let mut out = match table.and_then(|table| table.number) {
            Some(number) => format!("## Table {number}: {title}\n\n"),
            None if self.is_compared() => format!("## {title}\n\n"),
            None => format!("## {title} by `{}`\n\n", self.protocol.name()),
        };
        let mut add = |title: &str, kind: &str, cells: &[String]| {
            out += &format!("| {title} | {kind} | {} |\n", cells.join(" | "));
        };
        let of_number = format!("{} = ", self.protocol.number());
        let titles: Vec<String> = columns
            .iter()
            .map(|it| column_title(it, &of_number))
            .collect();
        add("Model", "", &titles);
        add("---", "---", &vec!["---:".into(); columns.len()]);
        let mut groups = groups(self.printed, self.rows.iter().copied());
        if let Some(rows) = table.and_then(|table| table.rows.as_ref()) {
            groups.retain(|group| group.names().any(|name| rows.iter().any(|row| row == name)));
        }
        for group in groups {
            let mut title = group.title.as_str();
            for (kind, cells) in self.group_lines(&group, metric, columns) {
                add(std::mem::take(&mut title), &kind, &cells);
            }
        }
        let (about, better) = (metric.about, metric.better.title());
        out += &format!("\n{title}: {about}; {better}. {}. ", self.counted());
        if columns.iter().any(|column| column == AVERAGE) {
            out += "AVG is the mean over the lengths. ";
        }
        if self.is_compared() && !self.printed.is_choice() {
            out += "The difference is ours minus the paper's. ";
            if let Some(note) = &self.printed.note {
                out += &format!("{note} ");
            }
        }
        out + &format!("Ours on {subject}.\n")
    }

    /// The lines of one model: what each shows, and its cells.
    fn group_lines(
        &self,
        group: &Group<'_>,
        metric: &Metric,
        columns: &[String],
    ) -> Vec<(String, Vec<String>)> {
        let known = self.printed.columns_of(metric.key);
        let prints = |row: &&PrintedRow| self.is_compared() && row.values.contains_key(metric.key);
        let paper = group.paper.filter(prints).map(|row| -> Vec<Option<f64>> {
            let value = |column: &String| row.value(metric.key, known, column);
            columns.iter().map(value).collect()
        });
        let mut lines = Vec::new();
        if let Some(paper) = &paper {
            lines.push(("paper".to_string(), cells(paper, metric)));
        }
        let scores = |row: &TableRow| -> Option<Vec<Option<f64>>> {
            let row = self.scores(row)?.row(metric.key);
            Some(our_values(row, columns))
        };
        let compared = |ours: &[Option<f64>], of: &TableRow| {
            let row = self.scores(of).and_then(|scores| scores.row(metric.key));
            let same = row.is_some_and(|row| row.columns().eq(known));
            // A mean is compared only if it is over the same columns.
            let values = ours.iter().zip(paper.as_ref()?).zip(columns);
            let differences = values.map(|((ours, paper), column)| {
                let compared = same || column != AVERAGE;
                Some((*ours)? - paper.filter(|_| compared)?)
            });
            Some(signed_cells(&differences.collect::<Vec<_>>(), metric))
        };
        let absent = || vec![ABSENT.to_string(); columns.len()];
        let by_seed = group.differ_in_seed_only();
        for (index, row) in group.ours.iter().enumerate() {
            let kind = match row.seed {
                Some(seed) if by_seed => format!("ours, seed {seed}"),
                _ if group.ours.len() > 1 => format!("ours ({})", index + 1),
                _ => "ours".to_string(),
            };
            let ours = scores(row);
            let shown = ours.as_ref().map(|ours| cells(ours, metric));
            lines.push((kind, shown.unwrap_or_else(absent)));
            if paper.is_some() && !by_seed {
                let difference = ours.and_then(|ours| compared(&ours, row));
                lines.push(("difference".into(), difference.unwrap_or_else(absent)));
            }
        }
        if !by_seed {
            return lines;
        }
        let measured = group.ours.iter();
        let measured = measured.filter_map(|row| Some((*row, scores(row)?)));
        let measured: Vec<(&TableRow, Vec<Option<f64>>)> = measured.collect();
        let spreads: Vec<Option<Spread>> = (0..columns.len())
            .map(|column| Spread::of(measured.iter().map(|(_, values)| values[column])))
            .collect();
        let digits = metric.decimals;
        let mut add = |kind: &str, text: &dyn Fn(&Spread) -> String| {
            let spreads = spreads.iter().map(Option::as_ref);
            let cells = spreads.map(|spread| spread.map_or(ABSENT.into(), text));
            lines.push((kind.into(), cells.collect()));
        };
        add("ours, mean ± sd", &|it| {
            format!("{:.digits$} ± {:.digits$}", it.mean, it.deviation)
        });
        add("ours, min to max", &|it| {
            format!("{:.digits$} to {:.digits$}", it.least, it.most)
        });
        if paper.is_some() {
            let means = spreads.iter().map(|spread| Some(spread.as_ref()?.mean));
            let means: Vec<Option<f64>> = means.collect();
            let of_first = measured.first().and_then(|(row, _)| compared(&means, row));
            let cells = of_first.unwrap_or_else(absent);
            lines.push(("difference of the mean".into(), cells));
        }
        lines
    }

    pub(super) fn terminal(&self) -> String {
        let all = self.all_columns();
        let metrics: Vec<&Metric> = match self.printed.is_choice() {
            true => self
                .tables()
                .into_iter()
                .map(|(_, metric)| metric)
                .collect(),
            false => self.protocol.metrics().iter().collect(),
        };
        let titles = metrics.iter().map(|metric| block_title(metric));
        let names = self.rows.iter().map(|row| row.name.clone());
        let widths = titles.chain(names).map(|name| name.chars().count());
        let width = widths.max().unwrap_or(0) + 1;
        let longest = all.iter().map(|column| column.chars().count()).max();
        let cell_width = longest.map_or(0, |longest| longest + 2).max(CELL);
        let line = |name: &str, cells: &[String]| {
            let cells = cells.iter().map(|cell| format!("{cell:>cell_width$}"));
            let cells: String = cells.collect();
            format!("{name:<width$}{cells}\n")
        };
        let header = |columns: &[String]| -> Vec<String> {
            columns.iter().map(|it| column_title(it, "")).collect()
        };
        let measured = self.rows.iter();
        let measured = measured.filter_map(|row| Some((*row, self.scores(row)?)));
        let measured: Vec<(&TableRow, &Scores)> = measured.collect();
        let (mut out, mut same_columns) = (String::new(), true);
        for metric in metrics {
            let mut rows = measured.iter().map(|(_, scores)| scores.row(metric.key));
            if rows.all(|row| row.is_none()) {
                continue;
            }
            let columns = &self.columns(metric);
            same_columns &= *columns == all;
            out += &line(&block_title(metric), &header(columns));
            for (row, scores) in &measured {
                let ours = our_values(scores.row(metric.key), columns);
                out += &line(&row.name, &cells(&ours, metric));
                let paper = self.printed.row(&row.name).filter(|_| self.is_compared());
                let paper = paper.filter(|paper| paper.values.contains_key(metric.key));
                let known = self.printed.columns_of(metric.key);
                // A mean over other lengths is not the paper's.
                let all = known.iter().all(|column| columns.contains(column));
                if let Some(paper) = paper.filter(|_| all) {
                    let value = |column: &String| match column == AVERAGE && columns != known {
                        true => None,
                        false => paper.value(metric.key, known, column),
                    };
                    let values: Vec<Option<f64>> = columns.iter().map(value).collect();
                    out += &line("  paper", &cells(&values, metric));
                }
            }
            out.push('\n');
        }
        let is_counted = |column: &&String| {
            let mut scores = measured.iter().map(|(_, scores)| scores);
            *column == AVERAGE || scores.any(|scores| scores.windows_of(column).is_some())
        };
        let all: Vec<String> = all.iter().filter(is_counted).cloned().collect();
        if !same_columns {
            out += &line("", &header(&all));
        }
        for (row, scores) in &measured {
            let counted = all.iter().filter(|column| *column != AVERAGE);
            let counts = counted.map(|column| scores.windows_of(column));
            let counts = counts.map(|count| count.map_or("-".into(), |count| count.to_string()));
            let name = format!("windows, {}", row.name);
            out += &line(&name, &counts.collect::<Vec<String>>());
        }
        out
    }

    /// The columns of a metric: those of its scores, all where it has none.
    fn columns(&self, metric: &Metric) -> Vec<String> {
        let rows = self.rows.iter().filter_map(|row| self.scores(row));
        let rows = rows.filter_map(|scores| scores.row(metric.key));
        let columns = ordered(rows.flat_map(ScoreRow::columns));
        match columns.is_empty() {
            true if self.is_compared() => match self.printed.columns_of(metric.key) {
                [] => self.all_columns(),
                printed => printed.to_vec(),
            },
            true => self.all_columns(),
            false => columns,
        }
    }

    /// The columns of all rows; the paper's where there are no rows.
    fn all_columns(&self) -> Vec<String> {
        let scores = self.rows.iter().filter_map(|row| self.scores(row));
        let rows = scores.flat_map(Scores::rows);
        let columns = ordered(rows.flat_map(|(_, row)| row.columns()));
        match columns.is_empty() {
            true => self.printed.columns.clone(),
            false => columns,
        }
    }
}

/// Columns, each once, numbers first and ascending, the mean last.
fn ordered<'c>(names: impl Iterator<Item = &'c str>) -> Vec<String> {
    let mut columns: Vec<String> = Vec::new();
    for column in names {
        if !columns.iter().any(|known| known == column) {
            columns.push(column.into());
        }
    }
    columns.sort_by_key(|column| {
        let number = column.parse::<u64>().unwrap_or(u64::MAX);
        (number, column == AVERAGE)
    });
    columns
}

/// The models of these rows: those of the paper in its order, then the others.
pub(super) fn groups<'r>(
    printed: &'r PrintedTables,
    rows: impl IntoIterator<Item = &'r TableRow>,
) -> Vec<Group<'r>> {
    let of_paper = printed.rows.iter().map(|paper| Group {
        title: paper.title.clone(),
        paper: Some(paper),
        ours: Vec::new(),
    });
    let mut groups: Vec<Group> = of_paper.collect();
    for row in rows {
        let title = printed
            .row(&row.name)
            .map_or(&row.name, |paper| &paper.title);
        match groups.iter_mut().find(|group| group.title == *title) {
            Some(group) => group.ours.push(row),
            None => groups.push(Group {
                title: title.clone(),
                paper: None,
                ours: vec![row],
            }),
        }
    }
    groups
}

/// What heads a metric's block on the terminal.
fn block_title(metric: &Metric) -> String {
    format!("{} ({})", metric.title, metric.unit)
}

/// A column as a table heads it.
fn column_title(column: &str, of_number: &str) -> String {
    match column {
        AVERAGE => "AVG".into(),
        number if number.parse::<u64>().is_ok() => format!("{of_number}{number}"),
        other => other.into(),
    }
}

/// The scores of several seeds in one column.
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

/// A model in the tables: the paper's row and ours by its name (more than one where it was trained
/// more than once).
pub(super) struct Group<'a> {
    pub(super) title: String,
    paper: Option<&'a PrintedRow>,
    pub(super) ours: Vec<&'a TableRow>,
}

impl Group<'_> {
    /// The names of its configs.
    fn names(&self) -> impl Iterator<Item = &str> {
        let paper = self.paper.iter().map(|row| row.name.as_str());
        paper.chain(self.ours.iter().map(|row| row.name.as_str()))
    }

    /// Whether these are trainings of one model on one budget with several seeds.
    fn differ_in_seed_only(&self) -> bool {
        let Some((first, others)) = self.ours.split_first() else {
            return false;
        };
        let seeds: BTreeSet<_> = self.ours.iter().filter_map(|row| row.seed).collect();
        // A row that is not trained yet has no note of its budget.
        let measured = |row: &TableRow| row.scores.is_some();
        let same = |row: &&TableRow| {
            !measured(first) || !measured(row) || row.schedule_note == first.schedule_note
        };
        !others.is_empty() && seeds.len() == self.ours.len() && others.iter().all(same)
    }
}

/// Our scores in these columns.
fn our_values(row: Option<&ScoreRow>, columns: &[String]) -> Vec<Option<f64>> {
    let value = |column: &String| row.and_then(|row| row.at(column));
    columns.iter().map(value).collect()
}

fn cells(values: &[Option<f64>], metric: &Metric) -> Vec<String> {
    let digits = metric.decimals;
    let text = |value: f64| format!("{value:.digits$}");
    values
        .iter()
        .map(|it| it.map_or("-".into(), text))
        .collect()
}

fn signed_cells(values: &[Option<f64>], metric: &Metric) -> Vec<String> {
    let digits = metric.decimals;
    let text = |value: f64| format!("{value:+.digits$}");
    values
        .iter()
        .map(|it| it.map_or("-".into(), text))
        .collect()
}
