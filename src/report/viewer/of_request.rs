//! What was made from a request as a page of the viewer.

use ndarray::ArrayView2;

use super::{Asked, MotionKind, Viewer, ViewerKeyframe, ViewerMotion};
use crate::motion::placement::world_positions;
use crate::synthesis::SequenceRequest;

/// A motion of the page.
pub struct RequestMotion<'a> {
    pub name: &'a str,
    pub kind: MotionKind,
    /// `[F, 149 or 154]`, not standardised.
    pub frames: ArrayView2<'a, f64>,
}

impl Viewer {
    /// Motions with the keyframes and the controls of the request that they were made from.
    pub fn of_request(
        title: &str,
        request: &SequenceRequest,
        motions: &[RequestMotion<'_>],
    ) -> Self {
        let keyframes = request.keyframes.iter().map(|timed| ViewerKeyframe {
            frame: timed.time,
            positions: world_positions(timed.keyframe.features.view()),
        });
        let motions = motions
            .iter()
            .map(|motion| ViewerMotion::from_features(motion.name, motion.kind, motion.frames));
        Self {
            title: title.into(),
            frame_time: request.frame_time,
            motions: motions.collect(),
            keyframes: keyframes.collect(),
            asked: Some(Asked::new(
                request.root_trajectory.view(),
                request.velocity_factors.view(),
            )),
        }
    }
}
