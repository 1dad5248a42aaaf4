//! The rows of a table in tasks that may run at the same time, on machines that share a file
//! system.

use std::time::Duration;

use super::reproduce::is_finished;
use super::results::RowResults;
use super::{ExperimentConfig, ReproduceError, Reproduction, Row};
use crate::training::Trainer;

impl<'a> Reproduction<'a> {
    /// The chosen rows in tasks, in their order: rows that share a training, or of which one begins
    /// with another's weights, are one task.
    ///
    /// # Errors
    /// A row begins with the weights of one that is not there.
    pub fn tasks(&self) -> Result<Vec<Vec<&'a Row>>, ReproduceError> {
        let mut tasks: Vec<(usize, Vec<&'a Row>)> = Vec::new();
        for row in self.chosen {
            let mut first = *row;
            while let Some((_, start)) = self.start_of(first)? {
                first = start;
            }
            let training = self.trained_as(first)?;
            match tasks.iter_mut().find(|(other, _)| *other == training) {
                Some((_, rows)) => rows.push(row),
                None => tasks.push((training, vec![row])),
            }
        }
        Ok(tasks.into_iter().map(|(_, rows)| rows).collect())
    }

    /// About how long what is left to train of some rows takes on the reproduction's threads, as
    /// busy as the machine is: rows that are done or trained take nothing, one that was begun is
    /// counted whole. Scoring is left out.
    ///
    /// # Errors
    /// Results or a run cannot be read; a training cannot be built.
    pub fn expected(&self, rows: &[&Row]) -> Result<Duration, ReproduceError> {
        let (mut counted, mut sum) = (Vec::new(), Duration::ZERO);
        for row in rows.iter().filter(|row| row.is_trained()) {
            let training = self.trained_as(row)?;
            let is_done = RowResults::of(row, self.out)
                .read(row, self.dataset)?
                .is_some()
                || is_finished(self.run_of(row)?.manifest()?.as_ref());
            if is_done || counted.contains(&training) {
                continue;
            }
            counted.push(training);
            // Drawn weights take as long as those that it begins with.
            let config = ExperimentConfig {
                start: None,
                ..row.config.clone()
            };
            let mut trainer = Trainer::new(config, self.dataset, self.threads)?;
            sum += trainer.expected().unwrap_or_default();
        }
        Ok(sum)
    }
}
