//! Pages of motions that were made from a request.

use std::path::Path;

use ndarray::ArrayView2;

use super::song::{Sound, song_page};
use super::{Asked, MotionKind, Viewer, ViewerKeyframe, ViewerMotion};
use crate::data::DataConfig;
use crate::models::ModelKind as _;
use crate::models::baselines::interpolation::Interpolation;
use crate::models::generator::NeededPoses;
use crate::models::transition::Kind;
use crate::motion::placement::world_positions;
use crate::report::ReportError;
use crate::run::Subject;
use crate::synthesis::{Dance, DanceRequest, MadeSequence, Origin, SequenceRequest, synthesise};

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

/// Refuses a page of what a model makes on whatever skeleton: a page shows the dance skeleton.
/// `file`: where its motion goes.
///
/// # Errors
/// The model makes rotations between keyframes.
pub fn check_page(
    subject: &Subject,
    request: &DanceRequest,
    file: &Path,
) -> Result<(), ReportError> {
    match subject.model.needs().poses {
        NeededPoses::Keyframes { .. } if request.song.is_none() => {
            Err(ReportError::Refused(format!(
                "--viewer shows motions of the dance skeleton by models of transitions; leave it \
                 out and open {} in any viewer of BVH",
                file.display()
            )))
        }
        _ => Ok(()),
    }
}

/// The page of a dance, HTML; none of a model for which [`check_page`] refuses it.
///
/// # Errors
/// Interpolation cannot be asked, the song cannot be named, or the page has nothing to show.
pub fn dance_page(
    subject: &Subject,
    dance: &Dance,
    data: &DataConfig,
    sound: Sound<'_>,
) -> Result<Option<String>, ReportError> {
    Ok(match &dance.origin {
        Origin::Sequence(made) => Some(generated_page(subject, made)?),
        Origin::Completion => None,
        Origin::Song { song, dance } => {
            Some(song_page(&subject.config.name, song, dance, data, sound)?)
        }
    })
}

/// The page of what a subject made of a request with keyframes, HTML: beside the recorded motion,
/// where there is one, and interpolation, which is asked under the same options.
///
/// # Errors
/// Interpolation cannot be asked, or the page has nothing to show.
fn generated_page(subject: &Subject, made: &MadeSequence) -> Result<String, ReportError> {
    let MadeSequence {
        keyframes,
        request,
        sequence,
        options,
    } = made;
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
