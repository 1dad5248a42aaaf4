//! Epochs: all windows of the training pieces, shuffled; a last batch that is not whole is left out
//! (spec, section 1).

use std::sync::{Arc, Mutex};

use rand::seq::SliceRandom as _;

use super::windows::Contexts;
use crate::models::{ModelError, Streams};

/// A window of a training piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PieceWindow {
    pub piece: usize,
    /// i, the first frame that is predicted.
    pub frame: usize,
}

/// The batches of a training.
pub struct Epochs {
    windows: Vec<PieceWindow>,
    batch: usize,
    streams: Streams,
    /// The order of an epoch that was asked for last: shuffling is for each epoch, not for each
    /// step.
    order: Mutex<Option<(u64, Arc<[PieceWindow]>)>>,
}

impl Epochs {
    /// Of pieces of these numbers of frames.
    ///
    /// # Errors
    /// Fewer windows than a batch has.
    pub fn new(
        frames: &[usize],
        contexts: Contexts,
        batch: usize,
        streams: Streams,
    ) -> Result<Self, ModelError> {
        let of_piece = |(piece, &frames): (usize, &usize)| {
            let starts = contexts.starts(frames);
            starts.map(move |frame| PieceWindow { piece, frame })
        };
        let windows: Vec<PieceWindow> = frames.iter().enumerate().flat_map(of_piece).collect();
        if batch == 0 || windows.len() < batch {
            let longest = frames.iter().max().copied().unwrap_or(0);
            return Err(ModelError::Data {
                reason: format!(
                    "the training clips have {} windows, fewer than a batch of {batch} \
                     (schedule.batch_size): a window has {} frames, the longest clip {longest}; \
                     give more or longer clips, or choose smaller contexts or batches",
                    windows.len(),
                    contexts.past() + contexts.future(),
                ),
            });
        }
        Ok(Self {
            windows,
            batch,
            streams,
            order: Mutex::new(None),
        })
    }

    /// Windows of all pieces.
    pub fn windows(&self) -> usize {
        self.windows.len()
    }

    /// Batches of an epoch.
    pub fn batches(&self) -> usize {
        self.windows.len() / self.batch
    }

    /// Epoch and batch in it of a step.
    pub fn place(&self, step: u64) -> [u64; 2] {
        let batches = self.batches() as u64;
        [step / batches, step % batches]
    }

    /// The windows of a step.
    pub fn batch(&self, step: u64) -> Vec<PieceWindow> {
        let [epoch, batch] = self.place(step);
        let order = self.order(epoch);
        let start = batch as usize * self.batch;
        order[start..start + self.batch].to_vec()
    }

    fn order(&self, epoch: u64) -> Arc<[PieceWindow]> {
        let mut kept = self
            .order
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        match &*kept {
            Some((of, order)) if *of == epoch => order.clone(),
            _ => {
                let mut order = self.windows.clone();
                order.shuffle(&mut self.streams.stream("windows", &[epoch]));
                let order: Arc<[PieceWindow]> = order.into();
                *kept = Some((epoch, order.clone()));
                order
            }
        }
    }
}
