//! Pages of motions that were made from a request.

use ndarray::ArrayView2;

use super::song::{Sound, song_page};
use super::{Asked, MotionKind, Viewer, ViewerBody, ViewerKeyframe, ViewerMotion};
use crate::data::DataConfig;
use crate::models::ModelKind as _;
use crate::models::baselines::interpolation::Interpolation;
use crate::models::transition::Kind;
use crate::motion::placement::world_positions;
use crate::motion::{Clip, Foot, Pose};
use crate::report::{FigureError, ReportError};
use crate::run::Subject;
use crate::synthesis::{Completion, Dance, MadeSequence, Origin, SequenceRequest, synthesise};

impl Viewer {
    /// Motions with the keyframes and the controls of the request that they were made from.
    pub fn of_request(title: &str, request: &SequenceRequest, motions: Vec<ViewerMotion>) -> Self {
        let keyframes = request.keyframes.iter().map(|timed| ViewerKeyframe {
            frame: timed.time,
            positions: world_positions(timed.keyframe.features.view()).to_vec(),
        });
        Self {
            title: title.into(),
            frame_time: request.frame_time,
            body: ViewerBody::dance(),
            motions,
            keyframes: keyframes.collect(),
            asked: Some(Asked::new(
                request.root_trajectory.view(),
                request.velocity_factors.view(),
            )),
            music: None,
            picks: None,
        }
    }
}

/// The page of a dance, HTML; of several to one song, all of them.
///
/// # Errors
/// Interpolation cannot be asked, the song cannot be named, or the page has nothing to show.
pub fn dance_page(
    subject: &Subject,
    dances: &[Dance],
    data: &DataConfig,
    sound: Sound<'_>,
) -> Result<String, ReportError> {
    let name = &subject.config.name;
    let nothing = || ReportError::Refused("there is no dance to show".into());
    match &dances.first().ok_or_else(nothing)?.origin {
        Origin::Sequence(made) => generated_page(subject, made),
        Origin::Completion { keyframes, made } => Ok(completed_page(name, keyframes, made)?),
        Origin::Song { song, .. } => {
            let to_song = |dance| match dance {
                &Dance {
                    origin: Origin::Song { ref dance, .. },
                    ..
                } => Some(dance),
                _ => None,
            };
            let all: Vec<&Clip> = dances.iter().filter_map(to_song).collect();
            song_page(name, song, &all, data, sound)
        }
    }
}

/// The page of a completed dance, HTML: its keyframes where they were given, which is where its
/// root would go, and which foot stands.
fn completed_page(
    model: &str,
    keyframes: &[(usize, Pose)],
    made: &Completion,
) -> Result<String, FigureError> {
    let clip = &made.clip;
    let stands = |foot: Option<&Foot>| {
        let [left, right] = [Foot::Left, Foot::Right].map(|it| foot == Some(&it));
        [left, left, right, right]
    };
    let feet = |frame: usize| made.contacts.as_ref().and_then(|feet| feet.get(frame));
    let contacts = (0..clip.poses.len()).map(|frame| stands(feet(frame)));
    let motion = ViewerMotion::from_clip(model, MotionKind::Model, clip, contacts.collect());
    let keyframes = keyframes.iter().map(|(frame, pose)| ViewerKeyframe {
        frame: *frame,
        positions: pose.world_positions(&clip.skeleton),
    });
    Viewer {
        title: clip.name.clone(),
        frame_time: clip.frame_time,
        body: ViewerBody::of(&clip.skeleton),
        motions: vec![motion],
        keyframes: keyframes.collect(),
        asked: None,
        music: None,
        picks: None,
    }
    .html()
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
