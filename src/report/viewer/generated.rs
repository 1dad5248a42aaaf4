//! The page of a generated sequence: beside interpolation and, where there is one, the recorded
//! motion.

use super::{MotionKind, RequestMotion, Viewer};
use crate::models::ModelKind as _;
use crate::models::baselines::interpolation::Interpolation;
use crate::models::transition::Kind;
use crate::report::FigureError;
use crate::run::Subject;
use crate::synthesis::keyframes::Keyframes;
use crate::synthesis::{Sequence, SequenceRequest, SynthesisError, SynthesisOptions, synthesise};

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
pub enum PageError {
    #[error(transparent)]
    Synthesis(#[from] SynthesisError),
    #[error(transparent)]
    Figure(#[from] FigureError),
}

/// The page of what a subject made of a request with keyframes, HTML; interpolation is asked under
/// the same options.
///
/// # Errors
/// Interpolation cannot be asked, or the page has nothing to show.
pub fn generated_page(
    subject: &Subject,
    keyframes: &Keyframes,
    request: &SequenceRequest,
    sequence: &Sequence,
    options: &SynthesisOptions,
) -> Result<String, PageError> {
    let interpolation = Interpolation {
        contact_threshold: subject.config.data.contact_threshold,
    };
    let name = "Interpolation";
    let interpolated = match subject.config.model.kind() == Kind::Interpolation.name() {
        false => Some(synthesise(&interpolation, request, options, name)?),
        true => None,
    };
    let mut shown = Vec::new();
    if let Some(frames) = keyframes.recorded(request) {
        shown.push(RequestMotion {
            name: "Ground truth",
            kind: MotionKind::Recorded,
            frames,
        });
    }
    if let Some(interpolated) = &interpolated {
        shown.push(RequestMotion {
            name,
            kind: MotionKind::Other,
            frames: interpolated.features.view(),
        });
    }
    shown.push(RequestMotion {
        name: &subject.config.name,
        kind: MotionKind::Model,
        frames: sequence.features.view(),
    });
    Ok(Viewer::of_request(&sequence.clip.name, request, &shown).html()?)
}
