//! Recorded clips and their windows: what is asked of a model about each, and what it is scored
//! against.

use ndarray::Array2;
use rand::Rng as _;

use super::data_set::DataSet;
use super::placement::{Heading, Placement};
use crate::evaluation::transitions::window_request;
use crate::models::generator::{Condition, Given, NeededPoses, Needs, Request};
use crate::models::transition::window_features;
use crate::models::{Generator, ModelError, Streams};
use crate::motion::{Clip, ContactRule, FeatureConfig, Feet, Foot, MissingJoint, Pose, features};

/// A clip with what is told once of all its windows.
pub(super) struct RecordedClip<'d> {
    pub clip: &'d Clip,
    pub feet: Feet,
    heading: Heading,
    /// `[frames, 154]`, where a model is given some of them.
    features: Option<Array2<f64>>,
}

/// A window of a clip at a length.
pub(super) struct RecordedWindow<'d> {
    pub of: &'d RecordedClip<'d>,
    /// Frame of the clip that is the window's frame 0.
    window: usize,
    /// Frame of the clip that is k1.
    pub start: usize,
    /// Frames k1 to k2, `[F]`.
    pub poses: &'d [Pose],
    /// The foot in contact from k1 to k2, `[F]`.
    pub contacts: Vec<Foot>,
    pub placement: Placement,
}

impl<'d> RecordedClip<'d> {
    pub fn new(set: &DataSet, clip: &'d Clip) -> Result<Self, MissingJoint> {
        Ok(Self {
            clip,
            feet: Feet::of(&clip.skeleton)?,
            heading: set.heading(&clip.skeleton)?,
            features: None,
        })
    }

    /// The same with features, where the model reads what they hold and the clip has them: it does
    /// on the dance skeleton, or where the model's mapping brings it there.
    ///
    /// # Errors
    /// The clip cannot be mapped or measured.
    pub fn measured(
        mut self,
        model: &dyn Generator,
        config: &FeatureConfig,
    ) -> Result<Self, ModelError> {
        let (needs, own) = (model.needs(), self.clip.skeleton.is_dance_skeleton());
        let asks = [Condition::RootTrajectory, Condition::VelocityFactors];
        if !asks.iter().any(|&it| needs.reads(it)) {
            return Ok(self);
        }
        let measured = match model.mapping() {
            Some(mapping) if !own => {
                let mapped = mapping.apply(self.clip);
                features(&mapped.map_err(|error| ModelError::data(&error))?, config)
            }
            _ if own => features(self.clip, config),
            _ => return Ok(self),
        };
        self.features = Some(measured.map_err(|error| ModelError::data(&error))?);
        Ok(self)
    }

    /// The window of the data set from frame `window` on with `span` frames from k1 to k2. It must
    /// lie in the clip. `threshold`, (cm/frame)^2, is the contact rule's.
    pub fn window(
        &'d self,
        set: &DataSet,
        window: usize,
        span: usize,
        rule: ContactRule,
        threshold: f64,
    ) -> RecordedWindow<'d> {
        let (poses, skeleton) = (&self.clip.poses, &self.clip.skeleton);
        let whole = &poses[window..window + set.scored.frames];
        let start = window + set.start;
        RecordedWindow {
            of: self,
            window,
            start,
            poses: &poses[start..start + span],
            contacts: self.labels(start, span, rule, threshold),
            placement: Placement::of(&self.heading, skeleton, whole, set.start),
        }
    }

    /// The foot in contact in `span` frames from `start` on, `[span]`.
    pub fn labels(
        &self,
        start: usize,
        span: usize,
        rule: ContactRule,
        threshold: f64,
    ) -> Vec<Foot> {
        // The same draws whatever else is scored.
        let mut stream = Streams::new(0).stream(&self.clip.name, &[start as u64]);
        let draw = || match stream.next_u32() % 2 {
            0 => Foot::Right,
            _ => Foot::Left,
        };
        let poses = &self.clip.poses[start..start + span];
        let world = self.clip.skeleton.world_positions(poses);
        rule.labels(&world, &self.feet, threshold, draw)
    }

    /// What a model is given: the poses of k1, frame `start` of the clip, and of k2 (the first and
    /// the last frame of the request, which has as many as there are `contacts`), and of the
    /// recording only what the model needs or heeds.
    ///
    /// - The past, frames below 0 from the clip's frame `first` on: where it needs past poses.
    /// - Contacts, right and left, `[F, 2]`: where it reads them.
    /// - Root trajectory and velocity factors: where it reads them, the latter where the clip is on
    ///   the dance skeleton or the model's mapping brings it there; the poses have their features
    ///   then, too.
    pub fn request(&self, first: usize, start: usize, contacts: &[Foot], needs: &Needs) -> Request {
        let (clip, span) = (self.clip, contacts.len());
        let poses = &clip.poses[start..start + span];
        let with_features = self.features.as_ref().and_then(|features| {
            let features = window_features(features, start, span - 1);
            window_request(clip, start, features.view())
        });
        let mut request = with_features.unwrap_or_else(|| {
            let given = |frame: usize| Given {
                frame: frame as i64,
                pose: poses[frame].clone(),
                features: None,
            };
            let root = |(frame, axis): (usize, usize)| poses[frame].translations[0][axis];
            Request {
                given: vec![given(0), given(span - 1)],
                root: Some(Array2::from_shape_fn((span, 3), root)),
                ..Request::new(clip.skeleton.clone(), clip.frame_time, span)
            }
        });
        if !needs.reads(Condition::RootTrajectory) {
            request.root = None;
        }
        if !needs.reads(Condition::VelocityFactors) {
            request.velocity_factors = None;
        }
        if needs.reads(Condition::Contacts) {
            let label = |(frame, foot): (usize, usize)| contacts[frame].one_hot()[foot];
            request.contacts = Some(Array2::from_shape_fn((span, 2), label));
        }
        if let NeededPoses::Past(_) | NeededPoses::Keyframes { past: 1.. } = needs.poses {
            let past = (first..start).map(|frame| Given {
                frame: frame as i64 - start as i64,
                pose: clip.poses[frame].clone(),
                features: None,
            });
            request.given.splice(0..0, past);
        }
        request
    }
}

impl RecordedWindow<'_> {
    /// What a model is given of it, see [`RecordedClip::request`].
    pub fn request(&self, needs: &Needs) -> Request {
        let (first, start) = (self.window, self.start);
        self.of.request(first, start, &self.contacts, needs)
    }
}
