//! The scores of a model, and their JSON.

use std::fmt;

use serde::de::{Error as _, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The column of a mean over the others.
pub const AVERAGE: &str = "avg";
/// The key of the numbers of windows among those of metrics.
const WINDOWS: &str = "windows";

/// One metric's score in each column of its table, such as a transition length and the mean over
/// all: `{"10": .., "avg": ..}`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ScoreRow {
    #[serde(serialize_with = "as_map", deserialize_with = "in_order")]
    columns: Vec<(String, f64)>,
}

impl ScoreRow {
    /// Scores by column, in their order.
    pub fn new(columns: impl IntoIterator<Item = (impl fmt::Display, f64)>) -> Self {
        let columns = columns.into_iter();
        let columns = columns.map(|(column, score)| (column.to_string(), score));
        Self {
            columns: columns.collect(),
        }
    }

    /// The same, and after them [`AVERAGE`], their plain mean (NaN for none).
    #[must_use]
    pub fn with_average(mut self) -> Self {
        let sum: f64 = self.columns.iter().map(|(_, score)| score).sum();
        let average = sum / self.columns.len() as f64;
        self.columns.push((AVERAGE.into(), average));
        self
    }

    /// The score in a column.
    pub fn at(&self, column: impl fmt::Display) -> Option<f64> {
        let name = column.to_string();
        let found = self.columns.iter().find(|(column, _)| *column == name);
        found.map(|&(_, score)| score)
    }

    /// The columns, in their order.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|(column, _)| column.as_str())
    }

    /// The mean over the other columns; NaN where there is none.
    pub fn average(&self) -> f64 {
        self.at(AVERAGE).unwrap_or(f64::NAN)
    }
}

/// The scores of a model by a protocol, a row a metric, and how many windows stand behind each
/// column, as written to JSON: `{"lrp": {"10": .., "avg": ..}, .., "windows": {"10": ..}}`.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Scores {
    #[serde(flatten, serialize_with = "as_map")]
    rows: Vec<(String, ScoreRow)>,
    /// Number of windows of each column that has its own.
    #[serde(serialize_with = "as_map")]
    windows: Vec<(String, usize)>,
}

impl Scores {
    /// Scores by the metrics' keys, and numbers of windows by column.
    pub fn new(
        rows: impl IntoIterator<Item = (&'static str, ScoreRow)>,
        windows: impl IntoIterator<Item = (impl fmt::Display, usize)>,
    ) -> Self {
        let rows = rows.into_iter().map(|(key, row)| (key.to_string(), row));
        let windows = windows.into_iter();
        let windows = windows.map(|(column, count)| (column.to_string(), count));
        Self {
            rows: rows.collect(),
            windows: windows.collect(),
        }
    }

    /// The row of a metric; none where the model has no score by it.
    pub fn row(&self, metric: &str) -> Option<&ScoreRow> {
        let found = self.rows.iter().find(|(key, _)| key == metric);
        found.map(|(_, row)| row)
    }

    /// The rows by metric, in their order.
    pub fn rows(&self) -> impl Iterator<Item = (&str, &ScoreRow)> {
        self.rows.iter().map(|(key, row)| (key.as_str(), row))
    }

    /// Number of windows behind a column.
    pub fn windows_of(&self, column: &str) -> Option<usize> {
        let found = self.windows.iter().find(|(name, _)| name == column);
        found.map(|&(_, count)| count)
    }

    /// Numbers of windows by column.
    pub fn windows(&self) -> &[(String, usize)] {
        &self.windows
    }
}

/// The scores of a model by each protocol that it was scored by, as written to JSON: `{"equations":
/// {"lrp": ..}, "published": ..}`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ProtocolScores {
    #[serde(serialize_with = "as_map", deserialize_with = "in_order")]
    protocols: Vec<(String, Scores)>,
}

impl ProtocolScores {
    /// Scores by the protocols' names.
    pub fn new(protocols: impl IntoIterator<Item = (impl Into<String>, Scores)>) -> Self {
        let protocols = protocols.into_iter();
        Self {
            protocols: protocols.map(|(name, of)| (name.into(), of)).collect(),
        }
    }

    /// The scores by a protocol.
    pub fn by(&self, protocol: &str) -> Option<&Scores> {
        let found = self.protocols.iter().find(|(name, _)| name == protocol);
        found.map(|(_, scores)| scores)
    }

    /// The largest number of windows behind a column.
    pub fn most_windows(&self) -> usize {
        let scores = self.iter().flat_map(|(_, scores)| scores.windows());
        scores.map(|&(_, count)| count).max().unwrap_or(0)
    }

    /// All scores by protocol, in their order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Scores)> {
        let protocols = self.protocols.iter();
        protocols.map(|(name, scores)| (name.as_str(), scores))
    }
}

/// Writes a map in its own order.
fn as_map<V: Serialize, S: Serializer>(
    entries: &[(String, V)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(entries.iter().map(|(key, value)| (key, value)))
}

/// Reads a map and keeps its order.
fn in_order<'de, D: Deserializer<'de>, V: Deserialize<'de>>(
    deserializer: D,
) -> Result<Vec<(String, V)>, D::Error> {
    struct Entries<V>(std::marker::PhantomData<V>);
    impl<'de, V: Deserialize<'de>> Visitor<'de> for Entries<V> {
        type Value = Vec<(String, V)>;
        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a map")
        }
        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
            let mut entries = Vec::new();
            while let Some(entry) = map.next_entry()? {
                entries.push(entry);
            }
            Ok(entries)
        }
    }
    deserializer.deserialize_map(Entries(std::marker::PhantomData))
}

impl<'de> Deserialize<'de> for Scores {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let entries: Vec<(String, ScoreRow)> = in_order(deserializer)?;
        let mut scores = Self::default();
        for (key, row) in entries {
            if key == WINDOWS {
                let counts = row.columns.into_iter();
                let counts = counts.map(|(column, count)| (column, count as usize));
                scores.windows = counts.collect();
            } else {
                scores.rows.push((key, row));
            }
        }
        if scores.rows.is_empty() || scores.windows.is_empty() {
            let expected = "scores have rows by metric, and \"windows\"";
            return Err(D::Error::custom(expected));
        }
        Ok(scores)
    }
}
