//! What the root's numbers in a window are measured from.

use std::convert::Infallible;

use ndarray::{Array2, ArrayView1, ArrayView2, ArrayViewMut1};
use serde::{Deserialize, Serialize};

use super::standardisation::{SMALLEST_STD, Standardisation};
use super::window::{window_features, wrap};
use super::windows::windows;
use crate::motion::features::{FACING, ROOT_POSITION, ROOT_VELOCITY};

/// The frame of reference of p^r, o^r and v^r in a window; heights are always above the floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RootFrame {
    /// The clip's own, as in the paper.
    #[default]
    World,
    /// From the place of keyframe k1 on the floor: the same motion elsewhere is the same to a
    /// network.
    Keyframe,
    /// From there, and turned so that k1 faces +Z: the same motion in another direction is the
    /// same, too.
    KeyframeFacing,
}

/// The frame of reference of one window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowFrame {
    /// Its origin in the clip's frame, cm.
    origin: [f64; 3],
    /// What is added to o^r, rad.
    turn: f64,
    /// Sine and cosine of the turn of directions about Y; none where they stay the world's.
    directions: Option<(f64, f64)>,
}

impl RootFrame {
    /// The frame of a window whose keyframe k1 has these features, `[149]` or more, not
    /// standardised.
    pub fn of_window(self, first: ArrayView1<f64>) -> WindowFrame {
        let facing = first[FACING.start];
        let place = [
            first[ROOT_POSITION.start],
            0.0,
            first[ROOT_POSITION.start + 2],
        ];
        // Where directions stay the world's, k1 still faces within [-pi, pi).
        let (origin, turn) = match self {
            Self::World => ([0.0; 3], wrap(facing) - facing),
            Self::Keyframe => (place, wrap(facing) - facing),
            Self::KeyframeFacing => (place, -facing),
        };
        WindowFrame {
            origin,
            turn,
            directions: (self == Self::KeyframeFacing).then(|| turn.sin_cos()),
        }
    }

    /// Features of a window as [`window_features`], in this frame.
    pub fn window_features(
        self,
        clip: &Array2<f64>,
        start: usize,
        transition: usize,
    ) -> Array2<f64> {
        let mut window = window_features(clip, start, transition);
        let frame = self.of_window(window.row(0));
        window
            .rows_mut()
            .into_iter()
            .for_each(|row| frame.enter(row));
        window
    }

    /// Columns whose statistics are other ones in this frame than in the clips.
    fn own_columns(self) -> Vec<usize> {
        let floor = |columns: std::ops::Range<usize>| [columns.start, columns.start + 2];
        match self {
            Self::World => Vec::new(),
            Self::Keyframe => floor(ROOT_POSITION).into(),
            Self::KeyframeFacing => [floor(ROOT_POSITION), floor(ROOT_VELOCITY)]
                .concat()
                .into_iter()
                .chain(FACING)
                .collect(),
        }
    }

    /// Statistics over training clips, each `[frames, 154]`, as windows show them in this frame.
    ///
    /// For [`RootFrame::World`] those of [`Standardisation::fit`]. In the others, mean and
    /// deviation of p^r on the floor (x and z), and where k1 faces +Z of o^r and of v^r on the
    /// floor too, are those of frames k1 + 1 .. k2 of all windows of `transition` frames, which
    /// start as [`windows`] says; all others, and the height, are those of the frames of the clips
    /// as ever.
    pub fn standardisation<'a>(
        self,
        clips: impl IntoIterator<Item = ArrayView2<'a, f64>> + Clone,
        transition: usize,
    ) -> Standardisation {
        let Ok(fitted) = self.standardisation_of(transition, |visit| {
            clips.clone().into_iter().for_each(visit);
            Ok::<(), Infallible>(())
        });
        fitted
    }

    /// The same of clips that `each` goes through, one after the other, as often as it is called.
    ///
    /// # Errors
    /// Those of `each`.
    pub fn standardisation_of<E>(
        self,
        transition: usize,
        each: impl Fn(&mut dyn FnMut(ArrayView2<'_, f64>)) -> Result<(), E>,
    ) -> Result<Standardisation, E> {
        let mut fitted = Standardisation::fit_visited(&each)?;
        let columns = self.own_columns();
        if columns.is_empty() {
            return Ok(fitted);
        }
        // Of what `measure` makes of a column's number in the windows.
        let mean_of = |measure: &dyn Fn(usize, f64) -> f64| -> Result<Vec<f64>, E> {
            let (mut sums, mut count) = (vec![0.0; columns.len()], 0);
            each(&mut |clip| {
                let clip = clip.to_owned();
                for window in windows(&[clip.nrows()], transition).windows {
                    let cut = self.window_features(&clip, window.start, transition);
                    count += transition;
                    for (k, (sum, &column)) in sums.iter_mut().zip(&columns).enumerate() {
                        for &x in cut.column(column).iter().skip(1) {
                            *sum += measure(k, x);
                        }
                    }
                }
            })?;
            let count = count.max(1) as f64;
            Ok(sums.into_iter().map(|sum| sum / count).collect())
        };
        let means = mean_of(&|_, x| x)?;
        let variances = mean_of(&|k, x| (x - means[k]).powi(2))?;
        for ((&column, mean), variance) in columns.iter().zip(&means).zip(variances) {
            fitted.mean[column] = *mean;
            fitted.std[column] = match variance.sqrt() {
                std if std < SMALLEST_STD => 1.0,
                std => std,
            };
        }
        Ok(fitted)
    }
}

impl WindowFrame {
    /// From the clip's frame into this one: p^r, o^r and v^r of a frame's numbers, `[149]` or more,
    /// not standardised.
    pub fn enter(&self, mut frame: ArrayViewMut1<f64>) {
        for (column, origin) in ROOT_POSITION.zip(self.origin) {
            frame[column] -= origin;
        }
        frame[FACING.start] += self.turn;
        if let Some((sin, cos)) = self.directions {
            turn_floor(&mut frame, sin, cos);
        }
    }

    /// The inverse of [`WindowFrame::enter`].
    pub fn leave(&self, mut frame: ArrayViewMut1<f64>) {
        if let Some((sin, cos)) = self.directions {
            turn_floor(&mut frame, -sin, cos);
        }
        frame[FACING.start] -= self.turn;
        for (column, origin) in ROOT_POSITION.zip(self.origin) {
            frame[column] += origin;
        }
    }
}

/// Turns p^r and v^r about Y.
fn turn_floor(frame: &mut ArrayViewMut1<f64>, sin: f64, cos: f64) {
    for columns in [ROOT_POSITION, ROOT_VELOCITY] {
        let (x, z) = (frame[columns.start], frame[columns.start + 2]);
        frame[columns.start] = cos * x + sin * z;
        frame[columns.start + 2] = cos * z - sin * x;
    }
}
