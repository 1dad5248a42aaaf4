//! The motion viewer: motions in 3D as one HTML page that opens from disk and needs no network.
//!
//! The page is `viewer.html` with its style and scripts put in; what the motions say goes in as
//! JSON. Nothing that a user wrote becomes markup: names are escaped in the page's title, and
//! inside the JSON no `<` is left that could end its element.

mod body;
#[cfg(feature = "papers")]
mod clips;
#[cfg(feature = "papers")]
mod generated;
mod page;
mod positions;
#[cfg(feature = "papers")]
mod song;

use glam::DVec3;
use ndarray::{ArrayView1, ArrayView2};
use serde::Serialize;

use super::FigureError;
use crate::counted::counted;
use crate::motion::Clip;
use crate::motion::contact::in_contact;
use crate::motion::placement::{vector, world_positions};
use crate::motion::velocity_factor::{PARTS, measured_velocity_factors};
use positions::Steps;

pub use body::ViewerBody;
#[cfg(feature = "papers")]
pub use clips::clips_page;
#[cfg(feature = "papers")]
pub use generated::dance_page;
#[cfg(feature = "papers")]
pub(in crate::report) use page::{SCENE_SCRIPTS, STYLE, embedded_json, filled};
#[cfg(feature = "papers")]
pub use song::{Sound, song_page};

/// The body parts as the page calls them.
const PART_LABELS: [&str; PARTS] = ["Trunk", "Left leg", "Right leg", "Right arm", "Left arm"];

/// Motions to be looked at together. All have the same number of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Viewer {
    /// Stands above, such as the name of the clip.
    pub title: String,
    /// Seconds a frame.
    pub frame_time: f64,
    /// Whose joints all positions are of.
    pub body: ViewerBody,
    /// In the order of their keys 1, 2, 3 ...; the first decides where the floor is.
    pub motions: Vec<ViewerMotion>,
    pub keyframes: Vec<ViewerKeyframe>,
    /// What the motions were made to follow, if anything.
    pub asked: Option<Asked>,
    /// What is played in step with them.
    pub music: Option<ViewerMusic>,
    /// The option by which frames that are picked on the page become keyframes; none where none are
    /// to be picked.
    pub picks: Option<&'static str>,
}

/// The song that motions dance to, from their first frame on.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct ViewerMusic {
    /// Its file's name.
    pub name: String,
    /// Where the page finds it: a file's path from the page, or a data URL.
    pub source: String,
    /// Frames of its beats, and of those that begin a bar.
    pub beats: Vec<usize>,
    pub downbeats: Vec<usize>,
}

/// What a model was asked for beside the keyframes, one row a frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Asked {
    /// Root positions, cm.
    pub root_trajectory: Vec<DVec3>,
    /// Velocity factors, cm/frame.
    pub velocity_factors: Vec<[f64; PARTS]>,
}

impl Asked {
    /// From arrays: root positions `[frames, 3]`, cm, and velocity factors `[frames, 5]`, cm/frame.
    /// Panics on fewer columns.
    pub fn new(root_trajectory: ArrayView2<f64>, velocity_factors: ArrayView2<f64>) -> Self {
        let factors = |row: ArrayView1<f64>| std::array::from_fn(|part| row[part]);
        Self {
            root_trajectory: root_trajectory.rows().into_iter().map(vector).collect(),
            velocity_factors: velocity_factors.rows().into_iter().map(factors).collect(),
        }
    }
}

/// Where a motion comes from, which decides its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MotionKind {
    /// Motion capture: blue-grey.
    Recorded,
    /// The model's, yellow as in the paper's figures.
    Model,
    /// A baseline's: violet, green, rose in this order.
    Other,
}

/// One motion.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewerMotion {
    pub name: String,
    pub kind: MotionKind,
    /// World positions of the joints, `[frames][joints]`, cm, Y up.
    pub positions: Vec<Vec<DVec3>>,
    /// Which of left ankle and toe, right ankle and toe stand, a row a frame.
    pub contacts: Vec<[bool; 4]>,
    /// Velocity factors as measured, a row a frame, cm/frame; empty in all motions where the body
    /// has no such parts.
    pub velocity_factors: Vec<[f64; PARTS]>,
}

/// A pose that was given, drawn red.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewerKeyframe {
    pub frame: usize,
    /// World positions of the joints, cm.
    pub positions: Vec<DVec3>,
}

impl ViewerMotion {
    /// A motion from its frames' numbers, `[frames, 149 or 154]`, not standardised. Velocity
    /// factors are measured on the positions.
    pub fn from_features(
        name: impl Into<String>,
        kind: MotionKind,
        frames: ArrayView2<f64>,
    ) -> Self {
        Self {
            name: name.into(),
            kind,
            positions: frames
                .rows()
                .into_iter()
                .map(|frame| world_positions(frame).to_vec())
                .collect(),
            contacts: frames.rows().into_iter().map(in_contact).collect(),
            velocity_factors: measured_velocity_factors(frames),
        }
    }

    /// A motion on any skeleton, without velocity factors; `contacts` `[frames]`.
    pub fn from_clip(
        name: impl Into<String>,
        kind: MotionKind,
        clip: &Clip,
        contacts: Vec<[bool; 4]>,
    ) -> Self {
        Self {
            name: name.into(),
            kind,
            positions: clip.skeleton.world_positions(&clip.poses),
            contacts,
            velocity_factors: Vec::new(),
        }
    }
}

impl Viewer {
    /// The page.
    ///
    /// # Errors
    /// [`FigureError`]: no motions or frames, motions or what was asked for of different length,
    /// poses of other joints than the body's, a keyframe outside, a NaN or infinity.
    pub fn html(&self) -> Result<String, FigureError> {
        Ok(page::page(&self.title, &self.data()?))
    }

    /// What a page's scripts read.
    ///
    /// # Errors
    /// As [`Viewer::html`].
    pub(in crate::report) fn data(&self) -> Result<PageData, FigureError> {
        self.check()?;
        let frames = self.frames();
        let nothing = Asked::default();
        let asked = self.asked.as_ref().unwrap_or(&nothing);
        let place = |place: &DVec3| place.to_array().map(|x| rounded(x, 1));
        Ok(PageData {
            summary: self.summary(),
            frames,
            frame_time: self.frame_time,
            body: self.body.clone(),
            parts: if self.has_factors() {
                &PART_LABELS
            } else {
                &[]
            },
            motions: self.motions.iter().map(PageMotion::new).collect(),
            keyframes: self.keyframes.iter().map(PageKeyframe::new).collect(),
            trajectory: asked.root_trajectory.iter().map(place).collect(),
            asked: rounded_rows(&asked.velocity_factors),
            music: self.music.clone(),
            picks: self.picks,
        })
    }

    fn frames(&self) -> usize {
        let first = self.motions.first();
        first.map_or(0, |motion| motion.positions.len())
    }

    fn has_factors(&self) -> bool {
        let mut motions = self.motions.iter();
        motions.any(|motion| !motion.velocity_factors.is_empty())
    }

    /// "101 frames, 3.3 s at 30 fps, 2 keyframes".
    fn summary(&self) -> String {
        let frames = self.frames();
        let keyframes = match self.keyframes.len() {
            0 => String::new(),
            count => format!(", {}", counted(count, "keyframe")),
        };
        format!(
            "{}, {:.1} s at {:.0} fps{keyframes}",
            counted(frames, "frame"),
            (frames - 1) as f64 * self.frame_time,
            1.0 / self.frame_time
        )
    }

    fn check(&self) -> Result<(), FigureError> {
        let empty = |what| FigureError::empty(&self.title, what);
        if self.motions.is_empty() {
            return Err(empty("no motions"));
        }
        let frames = self.frames();
        if frames == 0 {
            return Err(empty("no frames"));
        }
        if !(self.frame_time.is_finite() && self.frame_time > 0.0) {
            return Err(self.not_finite("the frame time"));
        }
        let motions = self.motions.iter().flat_map(|motion| {
            let factors = match self.has_factors() {
                true => motion.velocity_factors.len(),
                false => frames,
            };
            let rows = [motion.positions.len(), motion.contacts.len(), factors];
            rows.map(|rows| (motion.name.as_str(), rows))
        });
        let asked = self.asked.iter();
        let places = asked.map(|asked| ("the root trajectory", asked.root_trajectory.len()));
        let asked = self.asked.iter();
        let factors = asked.map(|asked| ("the velocity factors", asked.velocity_factors.len()));
        let asked = places.chain(factors);
        if let Some((row, found)) = motions.chain(asked).find(|(_, count)| *count != frames) {
            return Err(FigureError::frames(&self.title, row, found, frames));
        }
        if let Some(keyframe) = self.keyframes.iter().find(|key| key.frame >= frames) {
            return Err(FigureError::Unfit(format!(
                "{:?}: keyframe {} lies outside its {frames} frames, which are numbered from 0",
                self.title, keyframe.frame
            )));
        }
        let bodies = self.motions.iter().flat_map(|motion| &motion.positions);
        let mut bodies = bodies.chain(self.keyframes.iter().map(|key| &key.positions));
        if let Some(body) = bodies.find(|body| body.len() != self.body.joints()) {
            return Err(FigureError::Unfit(format!(
                "{:?}: a pose of {} joints is none of a body of {}",
                self.title,
                body.len(),
                self.body.joints()
            )));
        }
        self.check_numbers()
    }

    fn check_numbers(&self) -> Result<(), FigureError> {
        let factors = |rows: &[[f64; PARTS]]| rows.iter().flatten().all(|x| x.is_finite());
        let places = |places: &[DVec3]| places.iter().all(|place| place.is_finite());
        for motion in &self.motions {
            let mut bodies = motion.positions.iter();
            if !(bodies.all(|body| places(body)) && factors(&motion.velocity_factors)) {
                return Err(self.not_finite(&motion.name));
            }
        }
        if !self.keyframes.iter().all(|key| places(&key.positions)) {
            return Err(self.not_finite("a keyframe"));
        }
        let mut asked = self.asked.iter();
        match asked.all(|it| places(&it.root_trajectory) && factors(&it.velocity_factors)) {
            true => Ok(()),
            false => Err(self.not_finite("what was asked for")),
        }
    }

    fn not_finite(&self, series: &str) -> FigureError {
        FigureError::not_finite(&self.title, series)
    }
}

/// What the page's scripts read (`data.js`).
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::report) struct PageData {
    summary: String,
    frames: usize,
    frame_time: f64,
    #[serde(flatten)]
    body: ViewerBody,
    parts: &'static [&'static str],
    motions: Vec<PageMotion>,
    keyframes: Vec<PageKeyframe>,
    trajectory: Vec<[f64; 3]>,
    asked: Vec<[f64; PARTS]>,
    music: Option<ViewerMusic>,
    picks: Option<&'static str>,
}

#[derive(Serialize)]
struct PageMotion {
    name: String,
    kind: MotionKind,
    positions: Steps,
    /// Bit k of a frame's number is foot joint k.
    contacts: Vec<u8>,
    factors: Vec<[f64; PARTS]>,
}

#[derive(Serialize)]
struct PageKeyframe {
    frame: usize,
    positions: Steps,
}

impl PageKeyframe {
    fn new(keyframe: &ViewerKeyframe) -> Self {
        Self {
            frame: keyframe.frame,
            positions: Steps::new(std::slice::from_ref(&keyframe.positions)),
        }
    }
}

impl PageMotion {
    fn new(motion: &ViewerMotion) -> Self {
        let bits = |feet: &[bool; 4]| {
            let bits = feet.iter().enumerate();
            bits.map(|(foot, &stands)| u8::from(stands) << foot).sum()
        };
        Self {
            name: motion.name.clone(),
            kind: motion.kind,
            positions: Steps::new(&motion.positions),
            contacts: motion.contacts.iter().map(bits).collect(),
            factors: rounded_rows(&motion.velocity_factors),
        }
    }
}

fn rounded_rows(rows: &[[f64; PARTS]]) -> Vec<[f64; PARTS]> {
    rows.iter().map(|row| row.map(|x| rounded(x, 2))).collect()
}

fn rounded(value: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    (value * unit).round() / unit
}
