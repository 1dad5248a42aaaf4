//! What the root's numbers in a window are measured from.

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
        let mut fitted = Standardisation::fit(clips.clone());
        let columns = self.own_columns();
        if columns.is_empty() {
            return fitted;
        }
        let clips: Vec<Array2<f64>> = clips.into_iter().map(|clip| clip.to_owned()).collect();
        let frames: Vec<usize> = clips.iter().map(Array2::nrows).collect();
        let mut seen: Vec<Vec<f64>> = vec![Vec::new(); columns.len()];
        for window in windows(&frames, transition).windows {
            let cut = self.window_features(&clips[window.clip], window.start, transition);
            for (seen, &column) in seen.iter_mut().zip(&columns) {
                seen.extend(cut.column(column).iter().skip(1));
            }
        }
        for (seen, &column) in seen.iter().zip(&columns) {
            let count = seen.len().max(1) as f64;
            let mean = seen.iter().sum::<f64>() / count;
            let variance = seen.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
            fitted.mean[column] = mean;
            fitted.std[column] = match variance.sqrt() {
                std if std < SMALLEST_STD => 1.0,
                std => std,
            };
        }
        fitted
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
