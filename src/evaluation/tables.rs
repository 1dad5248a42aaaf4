//! A paper's tables with our scores beside its own: as Markdown, and as plain text for the
//! terminal.

use super::protocol_table::{ProtocolTable, groups};
use super::{PrintedTables, Protocol, ProtocolScores};

/// One of our models in the tables.
#[derive(Debug, Clone, PartialEq)]
pub struct TableRow {
    /// The model's name in its config, such as `one_layer`; finds the paper's row.
    pub name: String,
    /// The seed of its training. Rows that differ in it only are shown with their mean and spread.
    pub seed: Option<u64>,
    /// None where it is not trained yet: the row stands there all the same.
    pub scores: Option<ProtocolScores>,
    /// The schedule that it was trained on, such as "0.002 of the paper's schedule, 1.2e6
    /// frame-steps"; "not trained" where nothing is learned.
    pub schedule_note: String,
}

/// Tables of these protocols' metrics, beside what a paper prints of one.
#[derive(Clone, Copy)]
pub struct Tables<'a> {
    pub protocols: &'a [Box<dyn Protocol>],
    pub printed: &'a PrintedTables,
}

impl Tables<'_> {
    /// The tables in Markdown: by the paper's protocol for each model the paper's value, ours and
    /// the difference (ours minus the paper's); by the others ours alone.
    ///
    /// All rows of the paper are there, in its order, then our models that it does not have. Rows
    /// of one model that differ in their seed only have their mean, standard deviation and range
    /// too; a row without scores has "—" in every cell, one that was scored by another protocol
    /// only is left out. `subject` says in the caption what ours were evaluated on, such as "25
    /// test clips of the dance data set". Where our columns are not the paper's, they are ours and
    /// their mean is not compared.
    pub fn markdown(&self, rows: &[TableRow], subject: &str) -> String {
        let tables = self.protocol_tables(rows).into_iter();
        let mut out: String = tables.map(|table| table.markdown(subject) + "\n").collect();
        if !rows.is_empty() {
            out += "## Training of ours\n\n";
        }
        for (note, models) in self.notes(rows) {
            out += &format!("- {}: {note}\n", models.join(", "));
        }
        out
    }

    /// The scores as plain text, for the terminal: a block for each metric, a line for each model,
    /// at last the numbers of windows.
    ///
    /// The paper's values stand under ours where it has them and the columns are its own.
    pub fn terminal(&self, rows: &[TableRow]) -> String {
        let tables = self.protocol_tables(rows).into_iter();
        let tables = tables.map(|table| match self.protocols.len() {
            1 => table.terminal(),
            _ => format!("{}:\n\n{}", table.counted(), table.terminal()),
        });
        tables.collect::<Vec<String>>().join("\n")
    }

    /// A table for each protocol that has anything to show, the paper's own first.
    fn protocol_tables<'r>(&'r self, rows: &'r [TableRow]) -> Vec<ProtocolTable<'r>> {
        let tables = self.protocols.iter();
        let tables = tables.map(|protocol| ProtocolTable::new(&**protocol, self.printed, rows));
        let mut tables: Vec<ProtocolTable> = tables.filter(ProtocolTable::has_rows).collect();
        tables.sort_by_key(|table| !table.is_compared());
        tables
    }

    /// Every note of the rows once, and the models that it is about.
    fn notes<'r>(&'r self, rows: &'r [TableRow]) -> Vec<(&'r str, Vec<String>)> {
        let mut notes: Vec<(&str, Vec<String>)> = Vec::new();
        for group in groups(self.printed, rows) {
            for row in group.ours {
                let model = match row.seed {
                    Some(seed) => format!("{} (seed {seed})", group.title),
                    None => group.title.clone(),
                };
                let mut known = notes.iter_mut();
                match known.find(|(note, _)| *note == row.schedule_note) {
                    Some((_, models)) => models.push(model),
                    None => notes.push((&row.schedule_note, vec![model])),
                }
            }
        }
        notes
    }
}
