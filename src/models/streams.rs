//! Named random streams from one seed.
//!
//! A stream is found again from the seed, its name and its indices alone. So nothing of a generator's state has to be saved: a
//! training that resumes at step s draws what it would have drawn there anyway.

use rand::Rng;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use sha2::{Digest, Sha256};

/// The random streams of one training.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Streams {
    seed: u64,
}

impl Streams {
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// Initial values of the weights.
    pub fn initialisation(&self) -> ChaCha8Rng {
        self.stream("initialisation", &[])
    }

    /// Choice and order of the windows of an epoch.
    pub fn shuffling(&self, epoch: usize) -> ChaCha8Rng {
        self.stream("shuffling", &[epoch as u64])
    }

    /// The draw between ground truth and predictions at a step.
    pub fn sampling(&self, step: u64) -> ChaCha8Rng {
        self.stream("sampling", &[step])
    }

    /// Which windows of a step's batch are seen in a mirror.
    pub fn mirroring(&self, step: u64) -> ChaCha8Rng {
        self.stream("mirroring", &[step])
    }

    /// At which tempi a step's windows are seen.
    pub fn tempi(&self, step: u64) -> ChaCha8Rng {
        self.stream("tempi", &[step])
    }

    /// The frames that a step trains one by one.
    pub fn single_frames(&self, step: u64) -> ChaCha8Rng {
        self.stream("single_frames", &[step])
    }

    /// Key of the dropout masks of a shard at a step.
    pub fn dropout(&self, step: u64, shard: usize) -> u64 {
        self.stream("dropout", &[step, shard as u64]).next_u64()
    }

    fn stream(&self, name: &str, indices: &[u64]) -> ChaCha8Rng {
        let mut hash = Sha256::new();
        hash.update(self.seed.to_le_bytes());
        // The length keeps a name and its indices apart.
        hash.update((name.len() as u64).to_le_bytes());
        hash.update(name);
        for index in indices {
            hash.update(index.to_le_bytes());
        }
        ChaCha8Rng::from_seed(hash.finalize().into())
    }
}

#[cfg(test)]
mod tests {
    use crate::models::streams::*;
    use std::collections::HashSet;

    #[test]
    fn every_name_and_index_has_a_stream_of_its_own() {
        let mut firsts = HashSet::new();
        for seed in 0..3 {
            let streams = Streams::new(seed);
            assert!(firsts.insert(streams.initialisation().next_u64()));
            for index in 0..4 {
                assert!(firsts.insert(streams.shuffling(index).next_u64()));
                assert!(firsts.insert(streams.sampling(index as u64).next_u64()));
                assert!(firsts.insert(streams.mirroring(index as u64).next_u64()));
                assert!(firsts.insert(streams.tempi(index as u64).next_u64()));
                assert!(firsts.insert(streams.single_frames(index as u64).next_u64()));
                for shard in 0..4 {
                    assert!(firsts.insert(streams.dropout(index as u64, shard)));
                }
            }
        }
    }

    #[test]
    fn a_stream_is_the_same_on_every_machine() {
        // Recorded: a change of it changes every trained model.
        assert_eq!(Streams::new(7).dropout(2, 1), 2_358_994_433_055_209_379);
    }
}
