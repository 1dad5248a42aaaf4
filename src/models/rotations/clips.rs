//! Clips as they are trained: with the foot in contact of every frame, as recorded, in the mirror,
//! at other tempi.

use std::ops::Range;

use rand::RngExt as _;
use rayon::prelude::*;

use super::{GivenWindow, WindowTruth};
use crate::data::ClipSource;
use crate::models::AugmentationConfig;
use crate::models::forms::ClipForm;
use crate::models::scratch::{Place, Scratch};
use crate::models::transition::{RootFrame, Window};
use crate::models::{ModelError, Streams};
use crate::motion::facing::FacingJoints;
use crate::motion::mirror::{mirrored_skeleton, partners};
use crate::motion::{Clip, ContactRule, Feet, Foot, Pose, Skeleton};

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
}

/// All forms in which clips are trained, their windows made when they are asked for; the labels of
/// all frames are kept, as some are drawn along the clip.
pub(super) struct Forms<'d> {
    recorded: Vec<RecordedClip<'d>>,
    /// `[form][clip]`, the recorded ones first.
    forms: Vec<Vec<LabelledForm>>,
    mirror: bool,
    /// The foot in contact of every frame, a byte each: its place in a label.
    contacts: Scratch,
}

struct RecordedClip<'d> {
    clip: ClipSource<'d>,
    facing: FacingJoints,
    /// The joint on the body's other side of each.
    partners: Vec<usize>,
    /// The skeleton in the mirror.
    mirrored: Skeleton,
}

struct LabelledForm {
    form: ClipForm,
    /// The foot in contact, `[frames]`.
    contacts: Place,
}

impl<'d> Forms<'d> {
    /// # Errors
    /// A clip that cannot be labelled, brought to a tempo or read.
    pub fn of(
        clips: Vec<ClipSource<'d>>,
        augmentation: &AugmentationConfig,
        rule: ContactRule,
        threshold: f64,
        streams: Streams,
    ) -> Result<Self, ModelError> {
        let recorded = clips.into_iter().map(RecordedClip::new);
        let recorded: Vec<RecordedClip<'d>> = recorded.collect::<Result<_, _>>()?;
        let all = augmentation.forms();
        let kept = Scratch::new();
        let labelled = |(index, recorded): (usize, &RecordedClip<'d>)| {
            let whole = recorded.clip.whole();
            let held = ClipSource::Held(whole.map_err(|error| ModelError::data(&error))?);
            let labelled = all.iter().enumerate().map(|(number, &form)| {
                let form = ClipForm::new(&held, form).map_err(|error| ModelError::data(&error))?;
                let clip = recorded.in_form(&held, &form, 0..form.frames())?;
                let stream = streams.stream("contact_foot", &[number as u64, index as u64]);
                let TrainingClip { contacts, .. } =
                    TrainingClip::new(clip, rule, threshold, stream)?;
                let contacts: Vec<u8> = contacts.iter().map(|foot| foot.index() as u8).collect();
                let contacts = kept.keep(&contacts);
                Ok(LabelledForm {
                    form,
                    contacts: contacts.map_err(|error| ModelError::data(&error))?,
                })
            });
            labelled.collect::<Result<Vec<_>, ModelError>>()
        };
        let of_clips: Vec<_> = recorded.par_iter().enumerate().map(labelled).collect();
        let mut forms: Vec<Vec<LabelledForm>> = all.iter().map(|_| Vec::new()).collect();
        for of_clip in of_clips {
            for (form, labelled) in forms.iter_mut().zip(of_clip?) {
                form.push(labelled);
            }
        }
        Ok(Self {
            recorded,
            forms,
            mirror: augmentation.mirror,
            contacts: kept,
        })
    }

    /// A clip as recorded.
    ///
    /// # Errors
    /// Poses cannot be read.
    pub fn recorded(&self, clip: usize) -> Result<TrainingClip, ModelError> {
        let frames = self.forms[0][clip].form.frames();
        self.cut(&self.forms[0][clip], clip, 0..frames)
    }

    fn cut(
        &self,
        LabelledForm { form, contacts }: &LabelledForm,
        clip: usize,
        frames: Range<usize>,
    ) -> Result<TrainingClip, ModelError> {
        let recorded = &self.recorded[clip];
        let contacts = self.contacts.bytes(*contacts, frames.clone());
        let contacts = contacts.map_err(|error| ModelError::data(&error))?;
        Ok(TrainingClip {
            clip: recorded.in_form(&recorded.clip, form, frames)?,
            contacts: contacts.into_iter().map(Foot::at).collect(),
            facing: recorded.facing,
        })
    }

    /// Draws the form in which a window of `frames` frames with `past` frames before it is seen,
    /// and cuts it out with these.
    ///
    /// # Errors
    /// Poses cannot be read.
    pub fn draw(
        &self,
        window: Window,
        frames: usize,
        past: usize,
        stream: &mut impl rand::Rng,
    ) -> Result<TrainingClip, ModelError> {
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
        let drawn = &self.forms[tempo * sides + side][window.clip];
        let (form, start) = match drawn.form.frames().checked_sub(past + frames) {
            Some(last) => {
                let place = window.start * drawn.form.frames() / recorded.form.frames();
                (drawn, place.clamp(past, past + last))
            }
            None => (recorded, window.start),
        };
        self.cut(form, window.clip, start - past..start + frames)
    }
}

impl<'d> RecordedClip<'d> {
    fn new(clip: ClipSource<'d>) -> Result<Self, ModelError> {
        let skeleton = clip.skeleton();
        let facing = FacingJoints::of(skeleton).map_err(|error| ModelError::Data {
            reason: format!("{}: {error}", clip.name()),
        })?;
        let partners = partners(skeleton);
        Ok(Self {
            mirrored: mirrored_skeleton(&partners, skeleton),
            facing,
            partners,
            clip,
        })
    }

    /// Frames of a form of it; `clip` has its poses.
    fn in_form(
        &self,
        clip: &ClipSource<'_>,
        form: &ClipForm,
        frames: Range<usize>,
    ) -> Result<Clip, ModelError> {
        let poses = form.poses(clip, &self.partners, frames);
        let skeleton = match form.is_mirrored() {
            true => &self.mirrored,
            false => self.clip.skeleton(),
        };
        Ok(Clip {
            name: self.clip.name().into(),
            skeleton: skeleton.clone(),
            frame_time: self.clip.frame_time(),
            poses: poses
                .map_err(|error| ModelError::data(&error))?
                .into_owned(),
        })
    }
}
