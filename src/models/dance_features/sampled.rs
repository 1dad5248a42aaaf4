//! A dance that grows frame by frame (spec, section 7).

use ndarray::{Array2, ArrayView1, ArrayView2};

use crate::models::ModelError;
use crate::motion::MotionColumns;

/// Deviations beyond which a dance has diverged.
pub const MOST_DEVIATIONS: f64 = 10.0;

/// Standardised frames of motion: a seed and what was sampled after it.
pub struct SampledFrames {
    frames: Vec<f32>,
    columns: usize,
    seed: usize,
}

impl SampledFrames {
    /// After a seed `[frames, D]`.
    pub fn after(seed: ArrayView2<'_, f32>) -> Self {
        Self {
            frames: seed.iter().copied().collect(),
            columns: seed.ncols(),
            seed: seed.nrows(),
        }
    }

    /// Frames so far, those of the seed among them.
    pub fn len(&self) -> usize {
        self.frames.len() / self.columns.max(1)
    }

    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    fn rows(&self, from: usize, to: usize) -> Array2<f32> {
        let values = &self.frames[from * self.columns..to * self.columns];
        Array2::from_shape_fn((to - from, self.columns), |(i, j)| {
            values[i * self.columns + j]
        })
    }

    /// The last `count` frames, the latest last; fewer where there are no more.
    pub fn last(&self, count: usize) -> Array2<f32> {
        let len = self.len();
        self.rows(len.saturating_sub(count), len)
    }

    /// Adds a frame `[D]`, between -`clamp` and `clamp` where there is one, to the dance of a
    /// `request` of a call to `model`.
    ///
    /// # Errors
    /// A number that is not finite or, without `clamp`, beyond 10 deviations: frame and channel.
    pub fn push(
        &mut self,
        (model, request): (&str, usize),
        frame: ArrayView1<'_, f64>,
        clamp: Option<f64>,
        columns: &MotionColumns,
    ) -> Result<(), ModelError> {
        let most = clamp.map_or(MOST_DEVIATIONS, |_| f64::INFINITY);
        let wrong = frame.iter().position(|x| !x.is_finite() || x.abs() > most);
        if let Some(column) = wrong {
            let name = columns.names().into_iter().nth(column);
            return Err(ModelError::Diverged {
                model: model.into(),
                request,
                frame: self.len(),
                channel: name.map_or_else(String::new, |(name, _)| name.to_string()),
                deviations: frame[column],
            });
        }
        let bounded = frame.iter().map(|&x| match clamp {
            Some(most) => x.clamp(-most, most) as f32,
            None => x as f32,
        });
        self.frames.extend(bounded);
        Ok(())
    }

    /// What was sampled after the seed, up to frame `end` of the dance, `[frames, D]`.
    pub fn generated(&self, end: usize) -> Array2<f32> {
        let end = end.min(self.len());
        self.rows(self.seed.min(end), end)
    }
}
