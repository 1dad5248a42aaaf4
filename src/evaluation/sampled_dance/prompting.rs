//! Prompting (table 4): whether a seed of a style makes a dance of that style.

use ndarray::{Array2, ArrayView2, Axis};

/// A style's true dances, and the dances made from seeds of it, raw `[frames, columns]` each.
#[derive(Debug, Clone, PartialEq)]
pub struct Style<'a> {
    pub name: String,
    pub truth: Vec<ArrayView2<'a, f64>>,
    pub made: Vec<ArrayView2<'a, f64>>,
}

/// Distances of the dances from seeds of some styles from the true data of each.
#[derive(Debug, Clone, PartialEq)]
pub struct Prompting {
    pub styles: Vec<String>,
    /// `[true style, style of the seed]`, as in the paper.
    pub distances: Array2<f64>,
}

impl Prompting {
    /// By a distance of true and made dances, such as [`fmd`](super::frechet::fmd). None where it
    /// gives none.
    ///
    /// With true pieces in the place of made ones it says how well the distance tells styles apart
    /// at all; pieces must then not be part of their own style's truth.
    #[must_use]
    pub fn of(
        styles: &[Style<'_>],
        distance: impl Fn(&[ArrayView2<'_, f64>], &[ArrayView2<'_, f64>]) -> Option<f64>,
    ) -> Option<Self> {
        let pairs = styles
            .iter()
            .flat_map(|of| styles.iter().map(move |from| (of, from)));
        let distances = pairs.map(|(of, from)| distance(&of.truth, &from.made));
        let distances: Vec<f64> = distances.collect::<Option<_>>()?;
        Some(Self {
            styles: styles.iter().map(|style| style.name.clone()).collect(),
            distances: Array2::from_shape_vec((styles.len(), styles.len()), distances).ok()?,
        })
    }

    /// Seeds whose dances lie nearer to their own style than to any other: columns whose smallest
    /// row is their own.
    #[must_use]
    pub fn own(&self) -> usize {
        let columns = self.distances.axis_iter(Axis(1)).enumerate();
        let is_own = columns.filter(|(style, column)| {
            let rows = column.iter().enumerate();
            let mut others = rows.filter(|(row, _)| row != style);
            let own = column.get(*style);
            own.is_some_and(|own| others.all(|(_, other)| own < other))
        });
        is_own.count()
    }
}
