//! What is kept of every frame of the training clips: in memory while it is little, then in a file
//! that has no name and is gone with the process.

use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use tempfile::SpooledTempFile;

use crate::data::DataError;

/// Bytes that stay in memory.
const IN_MEMORY: usize = 64 << 20;

/// Bytes that are written once and read in parts.
pub(super) struct Scratch(Mutex<SpooledTempFile>);

/// Where in a [`Scratch`] something lies, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place(u64);

impl Scratch {
    pub fn new() -> Self {
        Self::holding(IN_MEMORY)
    }

    /// One of which so many bytes stay in memory.
    pub fn holding(bytes: usize) -> Self {
        Self(Mutex::new(SpooledTempFile::new(bytes)))
    }

    /// Keeps bytes.
    ///
    /// # Errors
    /// The temporary file cannot be made or written.
    pub fn keep(&self, bytes: &[u8]) -> Result<Place, DataError> {
        self.with(|file| {
            let place = file.seek(SeekFrom::End(0))?;
            file.write_all(bytes)?;
            Ok(Place(place))
        })
    }

    /// Some of the bytes that lie at a place.
    ///
    /// # Errors
    /// The temporary file cannot be read, or has not so many.
    pub fn bytes(&self, Place(place): Place, part: Range<usize>) -> Result<Vec<u8>, DataError> {
        self.with(|file| {
            file.seek(SeekFrom::Start(place + part.start as u64))?;
            let mut bytes = vec![0; part.len()];
            file.read_exact(&mut bytes)?;
            Ok(bytes)
        })
    }

    /// Keeps numbers.
    ///
    /// # Errors
    /// Those of [`keep`](Self::keep).
    pub fn keep_numbers(&self, numbers: &[f64]) -> Result<Place, DataError> {
        let bytes: Vec<u8> = numbers.iter().flat_map(|it| it.to_le_bytes()).collect();
        self.keep(&bytes)
    }

    /// Some of the numbers that lie at a place.
    ///
    /// # Errors
    /// Those of [`bytes`](Self::bytes).
    pub fn numbers(&self, place: Place, part: Range<usize>) -> Result<Vec<f64>, DataError> {
        const NUMBER: usize = size_of::<f64>();
        let bytes = self.bytes(place, NUMBER * part.start..NUMBER * part.end)?;
        let numbers = bytes.as_chunks::<NUMBER>().0.iter();
        Ok(numbers.map(|it| f64::from_le_bytes(*it)).collect())
    }

    fn with<T>(
        &self,
        act: impl FnOnce(&mut SpooledTempFile) -> io::Result<T>,
    ) -> Result<T, DataError> {
        let mut file = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        act(&mut file).map_err(|source| DataError::Scratch {
            folder: std::env::temp_dir(),
            source,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_was_kept_is_read_again_in_memory_as_in_a_file(
            kept in prop::collection::vec(prop::collection::vec(any::<f64>(), 1..20), 1..10),
            in_memory in 0usize..600, start in 0usize..20, count in 0usize..20,
        ) {
            let scratch = Scratch::holding(in_memory);
            let places: Vec<_> = kept.iter().map(|it| scratch.keep_numbers(it).unwrap()).collect();
            for (numbers, &place) in kept.iter().zip(&places) {
                let start = start.min(numbers.len());
                let part = start..(start + count).min(numbers.len());
                let read = scratch.numbers(place, part.clone()).unwrap();
                let bits = |numbers: &[f64]| numbers.iter().map(|it| it.to_bits()).collect::<Vec<_>>();
                prop_assert_eq!(bits(&read), bits(&numbers[part]));
            }
        }
    }

    #[test]
    fn what_was_never_kept_is_an_error_that_names_the_folder() {
        let scratch = Scratch::holding(0);
        let place = scratch.keep(&[1, 2, 3]).unwrap();
        let error = scratch.bytes(place, 1..4).unwrap_err().to_string();
        assert!(
            error.contains(&*std::env::temp_dir().to_string_lossy()),
            "{error}"
        );
    }
}
