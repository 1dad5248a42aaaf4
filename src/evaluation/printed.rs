//! The numbers that a paper prints, from its `paper.toml`.

use std::collections::BTreeMap;

use serde::Deserialize;
use thiserror::Error;
use toml::Table;

/// What a paper prints of a protocol's metrics.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintedTables {
    /// The paper, such as "Pan et al. 2021".
    pub title: String,
    /// What is to be known of its numbers, a sentence for every caption.
    #[serde(default)]
    pub note: Option<String>,
    /// The protocol that its numbers were counted by; none: the model's only one.
    #[serde(default)]
    pub protocol: Option<String>,
    /// Columns of all tables that name none of their own, as scores name them.
    #[serde(default)]
    pub columns: Vec<String>,
    /// One table a metric, in the order in which they are shown.
    #[serde(default)]
    pub tables: Vec<PrintedTable>,
    /// Rows whose printed values a figure draws beside ours; those of all would bury ours.
    #[serde(default)]
    pub dashed: Vec<String>,
    /// The row whose printed values a figure draws in any case.
    #[serde(default)]
    pub goal: Option<String>,
    /// Rows by the names of their configs, in the paper's order.
    #[serde(default, deserialize_with = "rows")]
    pub rows: Vec<PrintedRow>,
}

/// A table of a paper.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintedTable {
    /// Its number in the paper; none for a metric that the paper does not print.
    pub number: Option<u32>,
    /// Key of the metric.
    pub metric: String,
    /// Columns of the metric, said by its first table; left out: those of all tables.
    #[serde(default)]
    pub columns: Option<Vec<String>>,
    /// Names of the rows that it has; left out: all.
    #[serde(default)]
    pub rows: Option<Vec<String>>,
}

/// A row of a paper's tables.
#[derive(Debug, Clone, PartialEq)]
pub struct PrintedRow {
    /// Name of the config that it belongs to.
    pub name: String,
    /// As printed.
    pub title: String,
    /// Values by metric, one for each column; none where the paper has no such row in that table.
    pub values: BTreeMap<String, Vec<f64>>,
}

/// A `paper.toml` that holds something else.
#[derive(Debug, Error)]
#[error("{origin} is no file of a paper's numbers: {problem}")]
pub struct PrintedError {
    pub origin: String,
    pub problem: String,
}

#[derive(Deserialize)]
struct RowFields {
    title: String,
    #[serde(flatten)]
    values: BTreeMap<String, Vec<f64>>,
}

fn rows<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Vec<PrintedRow>, D::Error> {
    let table = Table::deserialize(deserializer)?;
    table
        .into_iter()
        .map(|(name, row)| {
            let RowFields { title, values } = row
                .try_into()
                .map_err(|cause| serde::de::Error::custom(format!("rows.{name}: {cause}")))?;
            Ok(PrintedRow {
                name,
                title,
                values,
            })
        })
        .collect()
}

impl PrintedTables {
    /// Reads the text of a `paper.toml`; `origin` is what errors call it.
    ///
    /// # Errors
    /// It is not TOML of this form, or a row has more or fewer values than its table has columns.
    pub fn parse(text: &str, origin: &str) -> Result<Self, PrintedError> {
        let bad = |problem: String| PrintedError {
            origin: origin.into(),
            problem,
        };
        let printed: Self =
            toml::from_str(text).map_err(|cause| bad(cause.to_string().trim_end().into()))?;
        for row in &printed.rows {
            for (metric, values) in &row.values {
                let columns = printed.columns_of(metric).len();
                let (name, found) = (&row.name, values.len());
                if found != columns {
                    return Err(bad(format!(
                        "rows.{name}.{metric} has {found} values for {columns} columns"
                    )));
                }
            }
        }
        Ok(printed)
    }

    /// No numbers: tables of these metrics, and of no others.
    pub fn of_metrics(metrics: &[&str]) -> Self {
        let table = |metric: &&str| PrintedTable {
            number: None,
            metric: (*metric).into(),
            columns: None,
            rows: None,
        };
        Self {
            tables: metrics.iter().map(table).collect(),
            ..Self::default()
        }
    }

    /// Whether its tables are those to show and it has no numbers of its own.
    pub(super) fn is_choice(&self) -> bool {
        self.rows.is_empty() && !self.tables.is_empty()
    }

    /// Whether its numbers stand beside scores by this protocol.
    pub fn compares(&self, protocol: &str) -> bool {
        self.protocol.as_deref().is_none_or(|own| own == protocol)
    }

    /// The columns of a metric's values.
    pub fn columns_of(&self, metric: &str) -> &[String] {
        let mut tables = self.tables.iter();
        let own = tables.find(|table| table.metric == metric);
        let own = own.and_then(|table| table.columns.as_ref());
        own.unwrap_or(&self.columns)
    }

    /// The row of a config's name.
    pub fn row(&self, name: &str) -> Option<&PrintedRow> {
        self.rows.iter().find(|row| row.name == name)
    }
}

impl PrintedRow {
    /// The value of a metric in a column.
    pub fn value(&self, metric: &str, columns: &[String], column: &str) -> Option<f64> {
        let at = columns.iter().position(|known| known == column)?;
        self.values.get(metric)?.get(at).copied()
    }
}
