//! Buffers that one step leaves behind for the next.

use std::collections::BTreeMap;
use std::fmt;

use super::kernels::Real;
use super::tape::Lists;

/// A pool of buffers by size class, so that after the first steps a training step allocates nothing
/// large.
///
/// A class spans an eighth of a power of two. A free buffer of up to twice the length asked for
/// will do, too: batches of one number of windows after the other must not each keep buffers of
/// their own.
#[derive(Default)]
pub struct Workspace<T: Real> {
    free: BTreeMap<usize, Vec<Vec<T>>>,
    lists: Lists<T>,
}

impl<T: Real> fmt::Debug for Workspace<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Workspace")
            .field("held", &self.held())
            .finish_non_exhaustive()
    }
}

/// Capacity of the class that holds `len` numbers.
fn class(len: usize) -> usize {
    if len <= 64 {
        return 64;
    }
    let step = (len.next_power_of_two() / 16).max(1);
    len.div_ceil(step) * step
}

impl<T: Real> Workspace<T> {
    pub fn new() -> Self {
        Self::default()
    }

    /// A buffer of `len` numbers, whose content is whatever an earlier step left there.
    pub fn take(&mut self, len: usize) -> Vec<T> {
        let class = class(len);
        let mut buffer = self
            .free(class)
            .unwrap_or_else(|| Vec::with_capacity(class));
        buffer.resize(len, T::zero());
        buffer
    }

    /// The same; none where memory does not hold it.
    pub(super) fn try_take(&mut self, len: usize) -> Option<Vec<T>> {
        let class = class(len);
        let mut buffer = match self.free(class) {
            Some(buffer) => buffer,
            None => {
                let mut buffer = Vec::new();
                buffer.try_reserve_exact(class).ok()?;
                buffer
            }
        };
        buffer.resize(len, T::zero());
        Some(buffer)
    }

    /// A free buffer of at least this class.
    fn free(&mut self, class: usize) -> Option<Vec<T>> {
        let mut fitting = self.free.range_mut(class..=2 * class);
        fitting.find_map(|(_, buffers)| buffers.pop())
    }

    /// Gives a buffer back. One that did not come from here is kept only if its capacity is that of
    /// a class.
    pub fn give(&mut self, buffer: Vec<T>) {
        let capacity = buffer.capacity();
        if capacity > 0 && class(capacity) == capacity {
            self.free.entry(capacity).or_default().push(buffer);
        }
    }

    /// Where a tape finds its lists and leaves them.
    pub(super) fn lists(&mut self) -> &mut Lists<T> {
        &mut self.lists
    }

    /// Numbers held by the free buffers.
    pub fn held(&self) -> usize {
        self.free
            .iter()
            .map(|(class, buffers)| class * buffers.len())
            .sum()
    }
}
