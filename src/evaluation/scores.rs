//! The scores of a model, and their JSON.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize, Serializer, ser::SerializeMap};

/// One score at each transition length and its mean over the lengths: `{"10": .., "50": .., "avg": ..}`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "BTreeMap<String, f64>")]
pub struct LengthScores {
    by_length: BTreeMap<usize, f64>,
    average: f64,
}

impl LengthScores {
    /// Scores by transition length N; AVG is their plain mean (NaN for none).
    pub fn new(by_length: BTreeMap<usize, f64>) -> Self {
        let average = by_length.values().sum::<f64>() / by_length.len() as f64;
        Self { by_length, average }
    }

    /// The score at transition length N.
    pub fn at(&self, length: usize) -> Option<f64> {
        self.by_length.get(&length).copied()
    }

    /// The lengths, ascending.
    pub fn lengths(&self) -> impl Iterator<Item = usize> + '_ {
        self.by_length.keys().copied()
    }

    /// AVG: the mean over the lengths.
    pub fn average(&self) -> f64 {
        self.average
    }
}

impl Serialize for LengthScores {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.by_length.len() + 1))?;
        for (length, score) in &self.by_length {
            map.serialize_entry(&length.to_string(), score)?;
        }
        map.serialize_entry("avg", &self.average)?;
        map.end()
    }
}

impl TryFrom<BTreeMap<String, f64>> for LengthScores {
    type Error = String;

    fn try_from(mut entries: BTreeMap<String, f64>) -> Result<Self, String> {
        let average = entries
            .remove("avg")
            .ok_or("scores by length have no entry \"avg\"")?;
        let by_length = entries
            .into_iter()
            .map(|(key, score)| match key.parse() {
                Ok(length) => Ok((length, score)),
                Err(_) => Err(format!(
                    "scores by length have the key {key:?}, expected a number of frames or \"avg\""
                )),
            })
            .collect::<Result<_, _>>()?;
        Ok(Self { by_length, average })
    }
}

/// LRP, AVF, ART and foot skate of a model by transition length, as written to JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluation {
    /// Mean distance of root-relative positions, cm (eq. 12).
    pub lrp: LengthScores,
    /// Share of windows with the velocity factors asked for (eq. 13).
    pub avf: LengthScores,
    /// Share of windows on the root trajectory asked for (eq. 15).
    pub art: LengthScores,
    /// Foot skate, cm/frame: how far a foot joint moves in a frame in which the recorded one is in contact (lower is better; below 0.45 in recorded
    /// motion, by the threshold of the labels). None in scores of earlier versions, or where some length has no contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub foot_skate: Option<LengthScores>,
    /// Number of windows at each length.
    pub windows: BTreeMap<usize, usize>,
}
