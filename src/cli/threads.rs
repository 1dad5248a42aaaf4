//! `--threads`: how many threads a command computes on.

use clap::Args;
use rayon::ThreadPool;

use crate::step::{StepError, pool};

#[derive(Debug, Clone, Copy, Args)]
pub struct Threads {
    /// Threads to compute on [default: all cores]; no number in the result depends on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

impl Threads {
    /// The number asked for, or that of all cores.
    pub fn count(self) -> usize {
        match self.threads {
            Some(threads) => threads.into(),
            None => std::thread::available_parallelism().map_or(1, usize::from),
        }
    }

    /// Those of one of `jobs` that run at the same time, at least one.
    pub fn shared(self, jobs: u16) -> Self {
        let threads = (self.count() / usize::from(jobs)).clamp(1, u16::MAX.into());
        Self {
            threads: Some(threads as u16),
        }
    }

    /// Threads for rayon.
    ///
    /// # Errors
    /// The system gives no more threads.
    pub fn pool(self) -> Result<ThreadPool, StepError> {
        pool(self.count())
    }
}
