//! What all ranks have in common.

use serde::{Deserialize, Serialize};

use super::RanksError;

/// What a rank trains with, by name: a word, a digest or lines.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Identity(pub Vec<(String, String)>);

impl Identity {
    /// # Errors
    /// The first difference between a rank and the first.
    pub fn agree(all: &[Self]) -> Result<(), RanksError> {
        let Some((first, rest)) = all.split_first() else {
            return Ok(());
        };
        for (rank, other) in (1..).zip(rest) {
            let mut pairs = first.0.iter().zip(&other.0);
            if let Some(((name, ours), (_, theirs))) = pairs.find(|(one, other)| one != other) {
                let (theirs, ours) = differing(theirs, ours);
                return Err(RanksError::Other {
                    rank,
                    cause: format!("its {name} is {theirs}, that of rank 0 is {ours}"),
                });
            }
        }
        Ok(())
    }
}

/// The first lines in which two texts differ.
fn differing<'t>(one: &'t str, other: &'t str) -> (&'t str, &'t str) {
    let mut lines = one.lines().zip(other.lines());
    lines
        .find(|(one, other)| one != other)
        .unwrap_or((one, other))
}
