//! Where root positions are measured from.

use ndarray::{Array2, ArrayView2};
use serde::{Deserialize, Serialize};

use super::standardise::{SMALLEST_STD, Standardisation};
use super::window::window_features;
use super::windows::windows;
use crate::motion::features::ROOT_POSITION;

/// The origin of p^r in a window; heights are always above the floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RootFrame {
    /// The clip's own, as in the paper.
    #[default]
    World,
    /// The place of keyframe k1 on the floor: the same motion elsewhere is the same to a network.
    Keyframe,
}

impl RootFrame {
    /// The origin of a window whose root is at `first` in k1, cm.
    pub fn origin(self, first: [f64; 3]) -> [f64; 3] {
        match self {
            Self::World => [0.0; 3],
            Self::Keyframe => [first[0], 0.0, first[2]],
        }
    }

    /// Features of a window as [`window_features`], with p^r from this origin.
    pub fn window_features(
        self,
        clip: &Array2<f64>,
        start: usize,
        transition: usize,
    ) -> Array2<f64> {
        let mut window = window_features(clip, start, transition);
        let first = std::array::from_fn(|axis| window[[0, ROOT_POSITION.start + axis]]);
        for (column, origin) in ROOT_POSITION.zip(self.origin(first)) {
            window
                .column_mut(column)
                .iter_mut()
                .for_each(|x| *x -= origin);
        }
        window
    }

    /// Statistics over training clips, each `[frames, 154]`, as windows show them from this origin.
    ///
    /// For [`RootFrame::World`] those of [`Standardisation::fit`]. For [`RootFrame::Keyframe`] mean and deviation of p^r on the floor
    /// (x and z) are those of frames k1 + 1 .. k2 of all windows of `transition` frames, which start as [`windows`] says; all
    /// others, and the height, are those of the frames of the clips as ever.
    pub fn standardisation<'a>(
        self,
        clips: impl IntoIterator<Item = ArrayView2<'a, f64>> + Clone,
        transition: usize,
    ) -> Standardisation {
        let mut fitted = Standardisation::fit(clips.clone());
        if self == Self::World {
            return fitted;
        }
        let clips: Vec<ArrayView2<f64>> = clips.into_iter().collect();
        let frames: Vec<usize> = clips.iter().map(ArrayView2::nrows).collect();
        let cut = windows(&frames, transition).windows;
        for column in [ROOT_POSITION.start, ROOT_POSITION.start + 2] {
            let steps = || {
                cut.iter().flat_map(|window| {
                    let path = clips[window.clip].column(column);
                    let first = path[window.start];
                    (1..=transition).map(move |t| path[window.start + t] - first)
                })
            };
            let count = (cut.len() * transition).max(1) as f64;
            let mean = steps().sum::<f64>() / count;
            let variance = steps().map(|step| (step - mean).powi(2)).sum::<f64>() / count;
            fitted.mean[column] = mean;
            fitted.std[column] = match variance.sqrt() {
                std if std < SMALLEST_STD => 1.0,
                std => std,
            };
        }
        fitted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::features::FEATURES;

    /// A root that walks 3 cm a frame along x and stands at a height and a z of its own.
    fn walk(frames: usize) -> Array2<f64> {
        Array2::from_shape_fn((frames, FEATURES), |(t, column)| match column {
            69 => 500.0 + 3.0 * t as f64,
            70 => 90.0 + (t % 2) as f64,
            71 => -200.0,
            _ => (t * (column + 1)) as f64 % 7.0,
        })
    }

    #[test]
    fn a_window_from_its_keyframe_begins_at_the_origin_at_its_own_height() {
        let clip = walk(30);
        let window = RootFrame::Keyframe.window_features(&clip, 11, 5);
        assert_eq!(window.column(69).to_vec(), [0.0, 3.0, 6.0, 9.0, 12.0, 15.0]);
        assert_eq!(window.column(70)[0], 91.0);
        assert!(window.column(71).iter().all(|&z| z == 0.0));
        let world = RootFrame::World.window_features(&clip, 11, 5);
        assert_eq!(world, window_features(&clip, 11, 5));
        for column in (0..FEATURES).filter(|column| ![69, 71].contains(column)) {
            assert_eq!(window.column(column), world.column(column));
        }
    }

    #[test]
    fn statistics_from_the_keyframe_are_those_of_the_steps_in_the_windows() {
        let clips = [walk(40), walk(25)];
        let views = || clips.iter().map(|clip| clip.view());
        let fitted = RootFrame::Keyframe.standardisation(views().collect::<Vec<_>>(), 10);
        // Steps of 3 .. 30 cm in every window: mean 16.5, variance 9 (10^2 - 1) / 12.
        assert!((fitted.mean[69] - 16.5).abs() < 1e-9);
        assert!((fitted.std[69] - (9.0 * 99.0 / 12.0f64).sqrt()).abs() < 1e-9);
        assert_eq!((fitted.mean[71], fitted.std[71]), (0.0, 1.0));
        let world = Standardisation::fit(views().collect::<Vec<_>>());
        for column in (0..FEATURES).filter(|column| ![69, 71].contains(column)) {
            assert_eq!(fitted.mean[column], world.mean[column]);
            assert_eq!(fitted.std[column], world.std[column]);
        }
        let same = RootFrame::World.standardisation(views().collect::<Vec<_>>(), 10);
        assert_eq!(same, world);
    }
}
