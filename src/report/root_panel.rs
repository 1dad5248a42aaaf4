//! A row's root trajectories in a small panel: asked for in blue, generated in red, as in the
//! paper's figures.

use glam::DVec3;

use super::svg::{Anchor, Font, Stroke, Svg};

pub(super) const TARGET: &str = "#1f6fd1";
pub(super) const GENERATED: &str = "#d0342c";
const FRAME: &str = "#c9c9c9";
const NOTE: &str = "#666666";
/// Room around the paths, pixels.
const MARGIN: f64 = 14.0;
/// The target is drawn through every so manieth frame: enough to see the path.
const EVERY: usize = 10;
/// The least span of a panel, cm.
const LEAST_SPAN: f64 = 40.0;

/// How root trajectories are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PathView {
    /// x to the right, z downwards.
    Above,
    /// Time to the right, height upwards.
    Height,
}

/// Root trajectories of one row, cm.
#[derive(Debug, Clone, PartialEq)]
pub struct RootPaths {
    pub view: PathView,
    /// What the target is, such as "root asked for".
    pub target_label: &'static str,
    pub target: Vec<DVec3>,
    pub generated: Vec<DVec3>,
}

impl RootPaths {
    /// Points of a path as the panel shows them: right and down, cm; time counts as 1 cm a frame
    /// until it is scaled.
    fn flat(&self, path: &[DVec3]) -> Vec<[f64; 2]> {
        let flat = |(frame, place): (usize, &DVec3)| match self.view {
            PathView::Above => [place.x, place.z],
            PathView::Height => [frame as f64, -place.y],
        };
        path.iter().enumerate().map(flat).collect()
    }

    pub(super) fn is_finite(&self) -> bool {
        let places = self.target.iter().chain(&self.generated);
        places.into_iter().all(|place| place.is_finite())
    }

    /// The larger side of what the panel must show, cm; panels of one figure share the largest.
    pub(super) fn span(&self) -> f64 {
        let (low, high) = self.corners();
        let width = match self.view {
            PathView::Above => high[0] - low[0],
            PathView::Height => 0.0,
        };
        width.max(high[1] - low[1]).max(LEAST_SPAN)
    }

    fn corners(&self) -> ([f64; 2], [f64; 2]) {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let paths = [&self.target, &self.generated].map(|path| self.flat(path));
        for point in paths.iter().flatten() {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        (low, high)
    }

    /// Draws the panel, a square of `size` pixels that `span` cm fill.
    pub(super) fn draw(&self, svg: &mut Svg, corner: [f64; 2], size: f64, span: f64) {
        let (low, high) = self.corners();
        let scale = (size - 2.0 * MARGIN) / span;
        let across = match self.view {
            PathView::Above => scale,
            PathView::Height => (size - 2.0 * MARGIN) / (high[0] - low[0]).max(1.0),
        };
        let place = |point: [f64; 2]| {
            [
                corner[0] + size / 2.0 + across * (point[0] - (low[0] + high[0]) / 2.0),
                corner[1] + size / 2.0 + scale * (point[1] - (low[1] + high[1]) / 2.0),
            ]
        };
        svg.begin_group("root");
        let [left, top] = corner;
        let (right, bottom) = (left + size, top + size);
        let sides = [
            (left, top),
            (right, top),
            (right, bottom),
            (left, bottom),
            (left, top),
        ];
        svg.line(&sides.map(|(x, y)| [x, y]), Stroke::solid(FRAME, 1.0));
        let generated: Vec<_> = self.flat(&self.generated).into_iter().map(place).collect();
        svg.line(&generated, Stroke::solid(GENERATED, 1.8));
        let target = self.flat(&self.target);
        let kept = |frame: &usize| frame.is_multiple_of(EVERY) || frame + 1 == target.len();
        let kept = (0..target.len()).filter(kept);
        let target: Vec<_> = kept.map(|frame| place(target[frame])).collect();
        let dashed = Stroke {
            colour: TARGET,
            width: 1.4,
            dash: "4 3",
        };
        svg.line(&target, dashed);
        for &point in &target {
            svg.circle(point, 1.8, TARGET, Stroke::solid(TARGET, 0.5));
        }
        let note = match self.view {
            PathView::Above => format!("from above, {span:.0} cm wide"),
            PathView::Height => format!("height over time, {span:.0} cm high"),
        };
        let at = [left + size / 2.0, bottom + 13.0];
        svg.text(at, &note, Font::new(10.5, NOTE, Anchor::Middle));
        svg.end_group();
    }
}
