//! What ranks agree on.

use std::fmt::{self, Display};
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::sum::sum_in_order;
use super::{Alone, Ranks, RanksError};
use crate::autograd::Gradients;

const FORMAT: bincode::config::Configuration = bincode::config::standard();

/// What a rank has sent and how long it has waited for others, sending included.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Traffic {
    /// Numbers of gradients alone: the rest is a few hundred bytes a step.
    pub bytes_sent: u64,
    pub seconds: f64,
}

/// This rank among those that train one model.
#[derive(Clone)]
pub struct Together {
    ranks: Arc<dyn Ranks>,
    traffic: Traffic,
}

impl Default for Together {
    fn default() -> Self {
        Self::new(Arc::new(Alone))
    }
}

impl fmt::Debug for Together {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "rank {} of {}", self.ranks.rank(), self.ranks.count())
    }
}

impl Together {
    pub fn new(ranks: Arc<dyn Ranks>) -> Self {
        let traffic = Traffic::default();
        Self { ranks, traffic }
    }

    /// Whether there is one process only.
    pub fn is_alone(&self) -> bool {
        self.ranks.count() == 1
    }

    /// Whether this is the rank that writes the run.
    pub fn is_first(&self) -> bool {
        self.ranks.rank() == 0
    }

    /// The number of this rank, from 0.
    pub fn rank(&self) -> usize {
        self.ranks.rank()
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.ranks.count()
    }

    /// So far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// Those of a step's shards that this rank computes: runs of them, in the order of the ranks.
    pub fn own_shards(&self, shards: usize) -> Range<usize> {
        let (rank, active) = (self.ranks.rank(), self.active(shards));
        match rank < active {
            true => rank * shards / active..(rank + 1) * shards / active,
            false => shards..shards,
        }
    }

    /// Ranks that have a shard.
    fn active(&self, shards: usize) -> usize {
        self.count().min(shards).max(1)
    }

    /// What each rank says, in their order.
    ///
    /// # Errors
    /// A rank says what this one cannot read.
    pub fn share<M: Serialize + DeserializeOwned>(&mut self, own: M) -> Result<Vec<M>, RanksError> {
        if self.is_alone() {
            return Ok(vec![own]);
        }
        let begun = Instant::now();
        // Nothing that is shared here fails to be written; whoever reads nothing says so.
        let own = bincode::serde::encode_to_vec(own, FORMAT).unwrap_or_default();
        let all = self.ranks.gather(&own);
        self.traffic.seconds += begun.elapsed().as_secs_f64();
        let read = |(rank, said): (usize, &Vec<u8>)| {
            let read = bincode::serde::decode_from_slice(said, FORMAT);
            let (message, _) = read.map_err(|error| RanksError::Other {
                rank,
                cause: format!("what it says cannot be read ({error}); is it another version?"),
            })?;
            Ok(message)
        };
        all.iter().enumerate().map(read).collect()
    }

    /// This rank's result, where none failed.
    ///
    /// # Errors
    /// This rank's, or else that of the first rank that failed.
    pub fn agree<R, E: Display + From<RanksError>>(&mut self, own: Result<R, E>) -> Result<R, E> {
        let cause = own.as_ref().err().map(|error| format!("{error:#}"));
        let causes = self.share(cause)?;
        let own = own?;
        let mut failed = causes.into_iter().enumerate();
        match failed.find_map(|(rank, cause)| cause.map(|cause| (rank, cause))) {
            Some((rank, cause)) => Err(RanksError::Other { rank, cause }.into()),
            None => Ok(own),
        }
    }

    /// Whether it is so on any rank.
    ///
    /// # Errors
    /// As [`Together::share`].
    pub fn any(&mut self, own: bool) -> Result<bool, RanksError> {
        Ok(self.share(own)?.contains(&true))
    }

    /// The first rank's values for all.
    pub fn take_first(&self, values: &mut [f32]) {
        self.ranks.broadcast(values, 0);
    }

    /// The sum of all ranks' gradients of a step's shards, in the shards' order, in the first of
    /// `own`, on every rank; zeros in the others. A rank without a shard has one gradient of zeros.
    pub fn sum(&mut self, shards: usize, own: &mut [Gradients<f32>]) {
        let begun = Instant::now();
        self.traffic.bytes_sent += sum_in_order(&*self.ranks, self.active(shards), own);
        self.traffic.seconds += begun.elapsed().as_secs_f64();
    }
}
