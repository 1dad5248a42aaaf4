//! The page of a study: `study.html` with the viewer's scripts, and the clips as JSON.

use glam::DVec3;
use serde::Serialize;

use super::{Question, StudyError};
use crate::motion::Clip;
use crate::report::viewer::{
    MotionKind, PageData, SCENE_SCRIPTS, STYLE, Viewer, ViewerBody, ViewerMotion, embedded_json,
    filled,
};

const TEMPLATE: &str = include_str!("study.html");
const OWN_STYLE: &str = include_str!("study.css");
const STAGE: &str = include_str!("stage.js");
const SCRIPTS: [&str; 3] = [
    include_str!("order.js"),
    include_str!("answers.js"),
    include_str!("study.js"),
];

/// What the page's scripts read.
#[derive(Serialize)]
pub(super) struct StudyPage<'s> {
    pub study: &'s str,
    /// Where songs begin, s.
    pub skip: f64,
    pub questions: Vec<PageQuestion>,
    /// Where the page finds each song.
    pub songs: Vec<String>,
    pub clips: Vec<PageClip>,
}

#[derive(Serialize)]
pub(super) struct PageQuestion {
    name: &'static str,
    text: &'static str,
    ends: [&'static str; 2],
    sound: bool,
    pair: bool,
}

/// What is shown of a dance: for questions about one clip, for those about two pieces.
#[derive(Serialize)]
pub(super) struct PageClip {
    pub id: String,
    pub song: Option<usize>,
    pub whole: Option<PageData>,
    pub pair: Option<PageData>,
}

impl From<Question> for PageQuestion {
    fn from(question: Question) -> Self {
        Self {
            name: question.name(),
            text: question.text(),
            ends: question.ends(),
            sound: question.has_sound(),
            pair: question.is_of_pairs(),
        }
    }
}

impl PageClip {
    /// Pieces of a dance side by side, each from a frame on and all of one length; `A`, `B` where
    /// there are several.
    pub(super) fn shown(dance: &Clip, pieces: &[(usize, usize)]) -> Result<PageData, StudyError> {
        let names: &[&str] = if pieces.len() > 1 { &["A", "B"] } else { &[""] };
        let motions = pieces.iter().zip(names).map(|(&(first, frames), name)| {
            let poses = dance.poses.iter().skip(first).take(frames);
            let clip = Clip {
                poses: poses.cloned().collect(),
                ..dance.clone()
            };
            let contacts = vec![[false; 4]; clip.poses.len()];
            let mut motion = ViewerMotion::from_clip(*name, MotionKind::Model, &clip, contacts);
            centre(&mut motion.positions);
            motion
        });
        let viewer = Viewer {
            title: dance.name.clone(),
            frame_time: dance.frame_time,
            body: ViewerBody::of(&dance.skeleton),
            motions: motions.collect(),
            keyframes: Vec::new(),
            asked: None,
            music: None,
            picks: None,
        };
        Ok(viewer.data()?)
    }
}

/// Moves a motion, `[frames][joints]`, so that the box round its root's path lies over the origin:
/// one view shows two pieces of a dance that wanders.
fn centre(frames: &mut [Vec<DVec3>]) {
    let roots = || frames.iter().filter_map(|joints| joints.first());
    let low = roots().fold(DVec3::INFINITY, |low, &root| low.min(root));
    let high = roots().fold(DVec3::NEG_INFINITY, |high, &root| high.max(root));
    let middle = (low + high) / 2.0 * DVec3::new(1.0, 0.0, 1.0);
    for place in frames.iter_mut().flatten() {
        *place -= middle;
    }
}

impl StudyPage<'_> {
    pub(super) fn html(&self) -> String {
        let scene = [&SCENE_SCRIPTS[..], &[STAGE]].concat().concat();
        let style = [STYLE, OWN_STYLE].concat();
        let (data, script) = (embedded_json(self), SCRIPTS.concat());
        filled(TEMPLATE, |place| match place {
            "style" => style.trim_end().into(),
            "data" => data.as_str().into(),
            "scene" => scene.trim_end().into(),
            _ => script.trim_end().into(),
        })
    }
}
