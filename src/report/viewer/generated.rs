//! Pages of motions that were made from a request.

use ndarray::ArrayView2;

use super::{Asked, MotionKind, Viewer, ViewerKeyframe, ViewerMotion};
use crate::models::ModelKind as _;
use crate::models::baselines::interpolation::Interpolation;
use crate::models::transition::Kind;
use crate::motion::placement::world_positions;
use crate::report::ReportError;
use crate::run::Subject;
use crate::synthesis::keyframes::Keyframes;
use crate::synthesis::{Sequence, SequenceRequest, SynthesisOptions, synthesise};

impl Viewer {
    /// Motions with the keyframes and the controls of the request that they were made from.
    pub fn of_request(title: &str, request: &SequenceRequest, motions: Vec<ViewerMotion>) -> Self {
        let keyframes = request.keyframes.iter().map(|timed| ViewerKeyframe {
            frame: timed.time,
            positions: world_positions(timed.keyframe.features.view()),
        });
        Self {
            title: title.into(),
            frame_time: request.frame_time,
            motions,
            keyframes: keyframes.collect(),
            asked: Some(Asked::new(
                request.root_trajectory.view(),
                request.velocity_factors.view(),
            )),
            music: None,
        }
    }
}

/// The page of what a subject made of a request with keyframes, HTML: beside the recorded motion,
/// where there is one, and interpolation, which is asked under the same options.
///
/// # Errors
/// Interpolation cannot be asked, or the page has nothing to show.
pub fn generated_page(
    subject: &Subject,
    keyframes: &Keyframes,
    request: &SequenceRequest,
    sequence: &Sequence,
    options: &SynthesisOptions,
) -> Result<String, ReportError> {
    let config = &subject.config;
    let motion = |name: &str, kind, frames: ArrayView2<'_, f64>| {
        ViewerMotion::from_features(name, kind, frames)
    };
    let mut shown = Vec::new();
    if let Some(frames) = keyframes.recorded(request) {
        shown.push(motion("Ground truth", MotionKind::Recorded, frames));
    }
    if config.model.kind() != Kind::Interpolation.name() {
        let interpolation = Interpolation {
            contact_threshold: config.data.contact_threshold,
        };
        let name = "Interpolation";
        let interpolated = synthesise(&interpolation, request, options, name)?;
        let frames = interpolated.features.view();
        shown.push(motion(name, MotionKind::Other, frames));
    }
    let frames = sequence.features.view();
    shown.push(motion(&config.name, MotionKind::Model, frames));
    Ok(Viewer::of_request(&sequence.clip.name, request, shown).html()?)
}
