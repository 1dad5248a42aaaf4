//! Ranks over MPI.

use std::fmt;
use std::sync::{Mutex, PoisonError};

use mpi::datatype::PartitionMut;
use mpi::environment::Universe;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};
use mpi::{Count, Rank, Threading};

use super::{Ranks, RanksError};

/// Most values of one message, whose bytes MPI counts in 32 bits.
const MOST: usize = 1 << 26;

/// All processes that the launcher has started.
pub struct Mpi {
    rank: usize,
    count: usize,
}

/// MPI ends with it.
static UNIVERSE: Mutex<Option<Universe>> = Mutex::new(None);

/// Waits until all ranks leave, and ends MPI.
pub(super) fn leave() {
    let mut universe = UNIVERSE.lock().unwrap_or_else(PoisonError::into_inner);
    drop(universe.take());
}

impl fmt::Debug for Mpi {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "rank {} of {}", self.rank, self.count)
    }
}

impl Mpi {
    /// # Errors
    /// MPI is started already, or allows no threads beside the one that calls it.
    pub fn start() -> Result<Self, RanksError> {
        let started = mpi::initialize_with_threading(Threading::Serialized);
        let (universe, threading) = started.ok_or(RanksError::NoMpi)?;
        let world = universe.world();
        let (rank, count) = (world.rank() as usize, world.size() as usize);
        if threading < Threading::Serialized {
            return Err(RanksError::NoMpi);
        }
        let mut kept = UNIVERSE.lock().unwrap_or_else(PoisonError::into_inner);
        *kept = Some(universe);
        Ok(Self { rank, count })
    }
}

fn world() -> SimpleCommunicator {
    SimpleCommunicator::world()
}

impl Ranks for Mpi {
    fn rank(&self) -> usize {
        self.rank
    }

    fn count(&self) -> usize {
        self.count
    }

    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        let mut lengths = vec![0 as Count; self.count];
        world().all_gather_into(&(own.len() as Count), &mut lengths[..]);
        let starts: Vec<Count> = lengths
            .iter()
            .scan(0, |end, &length| {
                *end += length;
                Some(*end - length)
            })
            .collect();
        let total: Count = lengths.iter().sum();
        let mut all = vec![0; total as usize];
        let mut parts = PartitionMut::new(&mut all[..], &lengths[..], &starts[..]);
        world().all_gather_varcount_into(own, &mut parts);
        let ranges = starts.iter().zip(&lengths);
        ranges
            .map(|(&start, &length)| all[start as usize..(start + length) as usize].to_vec())
            .collect()
    }

    fn broadcast(&self, values: &mut [f32], from: usize) {
        for part in values.chunks_mut(MOST) {
            world().process_at_rank(from as Rank).broadcast_into(part);
        }
    }

    fn send(&self, values: &[f32], to: usize) {
        for part in values.chunks(MOST) {
            world().process_at_rank(to as Rank).send(part);
        }
    }

    fn receive(&self, values: &mut [f32], from: usize) {
        for part in values.chunks_mut(MOST) {
            world().process_at_rank(from as Rank).receive_into(part);
        }
    }
}
