//! Processes that train one model together: shards of a step are dealt to them, and what they
//! compute has the same bits as in one process.

mod identity;
#[cfg(feature = "mpi")]
mod mpi;
mod sum;
mod together;

use std::sync::Arc;

use thiserror::Error;

pub use identity::Identity;
pub use together::{Together, Traffic};

/// Processes that pass messages, numbered from 0. Each calls the same of these in the same order,
/// from one thread at a time.
pub trait Ranks: Send + Sync {
    /// The number of this one.
    fn rank(&self) -> usize;

    /// How many there are.
    fn count(&self) -> usize;

    /// What each gives, in the order of their numbers, for all.
    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>>;

    /// The values of one for all; they have as many everywhere.
    fn broadcast(&self, values: &mut [f32], from: usize);

    /// Values for another, which receives as many.
    fn send(&self, values: &[f32], to: usize);

    /// The values that another sends.
    fn receive(&self, values: &mut [f32], from: usize);
}

/// One process by itself.
#[derive(Debug, Clone, Copy)]
pub struct Alone;

impl Ranks for Alone {
    fn rank(&self) -> usize {
        0
    }

    fn count(&self) -> usize {
        1
    }

    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        vec![own.to_vec()]
    }

    fn broadcast(&self, _values: &mut [f32], _from: usize) {}

    fn send(&self, _values: &[f32], _to: usize) {}

    fn receive(&self, _values: &mut [f32], _from: usize) {}
}

/// Why ranks cannot go on together.
#[derive(Debug, Error)]
pub enum RanksError {
    /// Another rank cannot go on.
    #[error("rank {rank}: {cause}")]
    Other {
        /// The first of those.
        rank: usize,
        cause: String,
    },
    #[error(
        "this is rank {rank} of {count} of an MPI launcher, but the program was built without MPI: \
         build it by cargo build --release --features mpi"
    )]
    NotBuilt { rank: usize, count: usize },
    #[error("MPI does not start")]
    NoMpi,
}

/// Number of this process and of all, as an MPI launcher tells them to those that it starts.
pub fn launched() -> Option<(usize, usize)> {
    let number = |name: &str| std::env::var(name).ok()?.parse().ok();
    let of = |rank: &str, count: &str| Some((number(rank)?, number(count)?));
    of("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE").or_else(|| of("PMI_RANK", "PMI_SIZE"))
}

/// The ranks that an MPI launcher has started with this one, all for the same command; [`Alone`]
/// without one.
///
/// # Errors
/// MPI does not start, or the program was built without it; a rank has another command.
pub fn join(command: &str) -> Result<Arc<dyn Ranks>, RanksError> {
    let ranks: Arc<dyn Ranks> = match launched() {
        None | Some((_, 1)) => Arc::new(Alone),
        #[cfg(feature = "mpi")]
        Some(_) => Arc::new(mpi::Mpi::start()?),
        #[cfg(not(feature = "mpi"))]
        Some((rank, count)) => return Err(RanksError::NotBuilt { rank, count }),
    };
    let own = Identity(vec![("command".into(), command.into())]);
    Identity::agree(&Together::new(Arc::clone(&ranks)).share(own)?)?;
    Ok(ranks)
}

/// What a process does last where nothing failed: all wait here for each other.
pub fn leave() {
    #[cfg(feature = "mpi")]
    mpi::leave();
}
