//! `--viewer`: what was generated from a request as a page of the motion viewer.

use ndarray::ArrayView2;

use crate::motion::placement::world_positions;
use crate::report::{Asked, FigureError, MotionKind, Viewer, ViewerKeyframe, ViewerMotion};
use crate::synthesis::SequenceRequest;

/// A motion of the page.
pub struct Shown<'a> {
    pub name: &'a str,
    pub kind: MotionKind,
    /// `[F, 149 or 154]`, not standardised.
    pub frames: ArrayView2<'a, f64>,
}

/// The page that shows motions with the keyframes and the controls of the request that they were made from.
///
/// # Errors
/// The motions do not have the request's number of frames.
pub fn viewer_page(
    title: &str,
    request: &SequenceRequest,
    shown: &[Shown<'_>],
) -> Result<String, FigureError> {
    let keyframes = request.keyframes.iter().map(|timed| ViewerKeyframe {
        frame: timed.time,
        positions: world_positions(timed.keyframe.features.view()),
    });
    let motions = shown
        .iter()
        .map(|motion| ViewerMotion::from_features(motion.name, motion.kind, motion.frames));
    Viewer {
        title: title.into(),
        frame_time: request.frame_time,
        motions: motions.collect(),
        keyframes: keyframes.collect(),
        asked: Some(Asked::new(
            request.root_trajectory.view(),
            request.velocity_factors.view(),
        )),
    }
    .html()
}
