//! Clips as they are trained: with the foot in contact of every frame, as recorded, in the mirror,
//! at other tempi.

use rand::RngExt as _;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{GivenWindow, WindowTruth};
use crate::data::Recording;
use crate::models::transition::{RootFrame, Window};
use crate::models::{ModelError, Streams};
use crate::motion::facing::FacingJoints;
use crate::motion::{Clip, ContactRule, Feet, Foot, Pose, at_tempo, mirror_image};

/// What is trained beside the recorded windows; the papers train nothing else.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AugmentationConfig {
    /// Each window is with probability 1/2 the one that a mirror shows.
    pub mirror: bool,
    /// Each window is, with the same probability, of the recorded clip or of the same clip at one
    /// of these tempi (1.25: a quarter faster). 16 at most, each from 0.25 to 4.
    pub tempi: Vec<f64>,
}

/// A clip to train on.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainingClip {
    pub clip: Clip,
    /// The foot in contact, `[frames]`.
    pub contacts: Vec<Foot>,
    pub facing: FacingJoints,
}

impl TrainingClip {
    /// A recording with its labels; those that are drawn come from `stream`.
    ///
    /// # Errors
    /// A skeleton without feet or hips that could be told by their names.
    pub fn new(
        clip: Clip,
        rule: ContactRule,
        threshold: f64,
        mut stream: impl rand::Rng,
    ) -> Result<Self, ModelError> {
        let named = |error| ModelError::Data {
            reason: format!("{}: {error}", clip.name),
        };
        let feet = Feet::of(&clip.skeleton).map_err(named)?;
        let facing = FacingJoints::of(&clip.skeleton).map_err(named)?;
        let world = clip.skeleton.world_positions(&clip.poses);
        let draw = || match stream.random() {
            true => Foot::Right,
            false => Foot::Left,
        };
        let contacts = rule.labels(&world, &feet, threshold, draw);
        Ok(Self {
            clip,
            contacts,
            facing,
        })
    }

    /// The `frames` frames from `start` on, between the first and the last of them as keyframes,
    /// with the `past` frames before.
    ///
    /// # Panics
    /// They are not all in the clip, or fewer than two.
    pub fn window(
        &self,
        start: usize,
        frames: usize,
        past: usize,
        root_frame: RootFrame,
    ) -> (GivenWindow, WindowTruth) {
        let poses = &self.clip.poses[start..start + frames];
        let contacts = self.contacts[start..start + frames].iter();
        let given = GivenWindow::new(
            &self.clip.skeleton,
            &self.facing,
            root_frame,
            &[(0, &poses[0]), (frames - 1, &poses[frames - 1])],
            contacts.map(|foot| foot.one_hot()).collect(),
        );
        let truth = given.truth(poses);
        let past: Vec<&Pose> = self.clip.poses[start - past..start].iter().collect();
        (given.with_past(&past), truth)
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.clip.poses.len()
    }
}

/// All forms in which clips are trained: `[form][clip]`, the recorded ones first.
pub(super) struct Forms {
    forms: Vec<Vec<TrainingClip>>,
    mirror: bool,
}

impl Forms {
    /// # Errors
    /// A clip that cannot be labelled, or brought to a tempo.
    pub fn of(
        recordings: &[Recording],
        augmentation: &AugmentationConfig,
        rule: ContactRule,
        threshold: f64,
        streams: Streams,
    ) -> Result<Self, ModelError> {
        let tempi = [1.0].into_iter().chain(augmentation.tempi.iter().copied());
        let sides = [false, true]
            .into_iter()
            .take(1 + usize::from(augmentation.mirror));
        let forms: Vec<(f64, bool)> = tempi
            .flat_map(|tempo| sides.clone().map(move |mirrored| (tempo, mirrored)))
            .collect();
        let form = |(form, &(tempo, mirrored)): (usize, &(f64, bool))| {
            let clip = |(index, recording): (usize, &Recording)| {
                let mut clip = recording.clip.clone();
                if tempo != 1.0 {
                    clip = at_tempo(clip, tempo).map_err(|error| ModelError::data(&error))?;
                }
                if mirrored {
                    clip = mirror_image(&clip);
                }
                let stream = streams.stream("contact_foot", &[form as u64, index as u64]);
                TrainingClip::new(clip, rule, threshold, stream)
            };
            let clips: Vec<_> = recordings.par_iter().enumerate().map(clip).collect();
            clips.into_iter().collect::<Result<Vec<_>, _>>()
        };
        Ok(Self {
            forms: forms
                .iter()
                .enumerate()
                .map(form)
                .collect::<Result<_, _>>()?,
            mirror: augmentation.mirror,
        })
    }

    /// The clips as recorded.
    pub fn recorded(&self) -> &[TrainingClip] {
        &self.forms[0]
    }

    /// Draws the form in which a window of `frames` frames with `past` frames before it is seen,
    /// and where it then starts.
    pub fn draw(
        &self,
        window: Window,
        frames: usize,
        past: usize,
        stream: &mut impl rand::Rng,
    ) -> (&TrainingClip, usize) {
        let sides = 1 + usize::from(self.mirror);
        let tempo = match self.forms.len() / sides {
            1 => 0,
            tempi => stream.random_range(0..tempi),
        };
        let side = match self.mirror {
            true => stream.random_range(0..sides),
            false => 0,
        };
        let recorded = &self.forms[side][window.clip];
        let clip = &self.forms[tempo * sides + side][window.clip];
        match clip.frames().checked_sub(past + frames) {
            Some(last) => (
                clip,
                (window.start * clip.frames() / recorded.frames()).clamp(past, past + last),
            ),
            None => (recorded, window.start),
        }
    }
}
