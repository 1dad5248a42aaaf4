//! In how many parts a batch is computed.

use std::fmt;

use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::settings::ValueError;

/// What a config writes for [`Shards::FromBatch`].
const FROM_BATCH: &str = "from_batch";

/// `schedule.shards`: parts that a batch is computed in, each by one thread. The weights depend on
/// it, in the last bits; they do not on the number of threads, nor on the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shards {
    /// As many as the batch has use for: `"from_batch"`.
    #[default]
    FromBatch,
    /// So many.
    Fixed(usize),
}

impl Shards {
    /// Shards of a batch of `windows`, of a model for which fewer than `worthwhile` windows in a
    /// shard cost noticeably more each.
    pub fn count(self, windows: usize, worthwhile: usize) -> usize {
        let asked = match self {
            Self::FromBatch => windows / worthwhile.max(1),
            Self::Fixed(shards) => shards.min(windows),
        };
        asked.max(1)
    }

    /// # Errors
    /// None, or more than a batch of `windows` has.
    pub fn check(self, windows: usize) -> Result<(), ValueError> {
        let Self::Fixed(shards) = self else {
            return Ok(());
        };
        let expected = format!("a whole number from 1 to {windows}, or {FROM_BATCH}");
        let valid = (1..=windows).contains(&shards);
        ValueError::unless(valid, "schedule.shards", shards, expected)
    }
}

impl Serialize for Shards {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::FromBatch => serializer.serialize_str(FROM_BATCH),
            Self::Fixed(shards) => serializer.serialize_u64(*shards as u64),
        }
    }
}

impl<'de> Deserialize<'de> for Shards {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumberOrWord)
    }
}

struct NumberOrWord;

impl Visitor<'_> for NumberOrWord {
    type Value = Shards;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "a whole number or \"{FROM_BATCH}\"")
    }

    fn visit_i64<E: de::Error>(self, shards: i64) -> Result<Shards, E> {
        let unsigned = de::Unexpected::Signed(shards);
        let shards = usize::try_from(shards).map_err(|_| E::invalid_value(unsigned, &self))?;
        Ok(Shards::Fixed(shards))
    }

    fn visit_u64<E: de::Error>(self, shards: u64) -> Result<Shards, E> {
        let unsigned = de::Unexpected::Unsigned(shards);
        let shards = usize::try_from(shards).map_err(|_| E::invalid_value(unsigned, &self))?;
        Ok(Shards::Fixed(shards))
    }

    fn visit_str<E: de::Error>(self, word: &str) -> Result<Shards, E> {
        match word {
            FROM_BATCH => Ok(Shards::FromBatch),
            _ => Err(E::invalid_value(de::Unexpected::Str(word), &self)),
        }
    }
}
