//! Named random streams from one seed.
//!
//! A stream is found again from the seed, its name and its indices alone. So nothing of a
//! generator's state has to be saved: a training that resumes at step s draws what it would have
//! drawn there anyway.

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

    /// What all of them follow from.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Initial values of the weights.
    pub fn initialisation(&self) -> ChaCha8Rng {
        self.stream("initialisation", &[])
    }

    /// Key of the dropout masks of a shard at a step.
    pub fn dropout(&self, step: u64, shard: usize) -> u64 {
        self.stream("dropout", &[step, shard as u64]).next_u64()
    }

    /// The stream of this name and these indices, such as the shuffling of an epoch: each model
    /// names its own.
    pub fn stream(&self, name: &str, indices: &[u64]) -> ChaCha8Rng {
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
