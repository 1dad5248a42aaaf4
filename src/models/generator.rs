//! What may be asked of a model, trained or not: a [`Request`] says what is given, a [`Generator`]
//! makes a [`Motion`] of it.
//!
//! ```
//! # #[cfg(feature = "papers")] {
//! use keydance::data::choreography::{ChoreographyConfig, generate};
//! use keydance::evaluation::transitions::window_request;
//! use keydance::models::{Generator as _, baselines::interpolation::Interpolation};
//! use keydance::motion::{FeatureConfig, features};
//! use ndarray::s;
//!
//! let dance = ChoreographyConfig { clips: 1, frames_per_clip: 60, seed: 1 };
//! let clip = generate(&dance)?.remove(0).clip;
//! // The poses of frames 0 and 30, and between them where the root is and how fast the body moves.
//! let recorded = features(&clip, &FeatureConfig::default())?;
//! let request = window_request(&clip, 0, recorded.slice(s![..=30, ..])).ok_or("too short")?;
//! let motion = Interpolation::default().generate(&[request])?.remove(0);
//! assert_eq!(motion.positions.shape(), [31, 24, 3]); // frames, joints, cm in the world
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A trained model: [`Subject::open`](crate::run::Subject::open) on its run's folder.

use std::ops::Range;

use ndarray::{Array1, Array2, Array3};
use thiserror::Error;

use super::settings::ValueError;
use crate::data::Recording;
use crate::motion::rest_pose::RestPose;
use crate::motion::{Clip, ContactRule, Mapping, Pose, Skeleton};
#[cfg(feature = "music")]
use crate::music::FeatureSet;

/// A pose that is given at a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Given {
    /// Frame of the result; below 0: the past.
    pub frame: i64,
    /// Local translations (cm) and rotations, one for each joint of the skeleton.
    pub pose: Pose,
    /// What [`crate::motion::features()`] measures at this frame of a recording, `[154]` (cm, rad,
    /// cm/frame): where the pose was recorded, its facing direction and velocities are known, too.
    pub features: Option<Array1<f64>>,
}

/// What is given for a dance of F frames, and nothing else: the truth never travels with the
/// question.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    pub skeleton: Skeleton,
    /// Seconds from one frame to the next.
    pub frame_time: f64,
    /// F: frames 0 to F - 1 are asked for.
    pub frames: usize,
    /// Poses at any frames, by ascending frame: keyframes, a seed, the past.
    pub given: Vec<Given>,
    /// Root positions wanted, `[F, 3]`, cm.
    pub root: Option<Array2<f64>>,
    /// Velocity factors wanted of trunk, left leg, right leg, right arm and left arm, `[F, 5]`,
    /// cm/frame.
    pub velocity_factors: Option<Array2<f64>>,
    /// Ground contacts wanted, 0 to 1, `[F, feet]`.
    pub contacts: Option<Array2<f64>>,
    /// Features of the music, `[F or more, numbers]`, frame 0 at frame 0 of the result.
    pub music: Option<Array2<f64>>,
    /// What every random number of the answer follows from.
    pub seed: u64,
}

/// What a model made of a request.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// World positions of the joints, `[F, joints, 3]`, cm.
    pub positions: Array3<f64>,
    /// The poses of a model that makes rotations, `[F]`; of others they are fitted to the
    /// positions.
    pub poses: Option<Vec<Pose>>,
    /// Facing angle, `[F]`, rad, unwrapped.
    pub facing: Option<Array1<f64>>,
    /// Ground contacts, 0 to 1, `[F, feet]`.
    pub contacts: Option<Array2<f64>>,
    /// What the network said before it became motion, in the numbers of the model, a row a frame
    /// that was not given.
    pub raw: Option<Array2<f64>>,
    /// First frames of the pieces that it was made in, where a model makes several frames at once.
    pub pieces: Vec<usize>,
}

/// Which poses a model must be given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NeededPoses {
    /// None.
    None,
    /// This many frames before frame 0.
    Past(usize),
    /// Frame 0 and the last frame, and no other but of the past. What lies between more keyframes
    /// is made piece by piece.
    Ends,
    /// All of the first so many frames, a seed that the dance goes on from; key poses at any frames
    /// after them are heeded.
    Seed(usize),
    /// Two or more, the first at frame 0 and the last at the last frame, and so many frames before
    /// frame 0.
    Keyframes { past: usize },
}

/// How a model samples a dance, frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampling {
    /// That a likelihood is of.
    pub predicted: usize,
    /// Of music behind a frame that it hears: a request may give them behind its last.
    pub look_ahead: usize,
}

/// What can be given beside the poses that a model [needs](NeededPoses).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    RootTrajectory,
    VelocityFactors,
    Contacts,
    Music,
    /// Poses behind a seed.
    KeyPoses,
}

/// What a model needs of a request, and what else it heeds: help, errors and warnings follow from
/// it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Needs {
    pub poses: NeededPoses,
    /// Without these there is no answer.
    pub conditions: &'static [Condition],
    /// These change the answer where they are given.
    pub heeds: &'static [Condition],
}

/// A model, trained or not.
pub trait Generator: Send + Sync {
    /// The model's name in tables and figures, that of its config.
    fn name(&self) -> &str;

    fn needs(&self) -> Needs;

    /// Hands over the training clips before the first request, to a model that looks motion up in
    /// them; others leave them alone. Clips to be scored on never come here.
    ///
    /// # Errors
    /// Clips that it cannot look up in.
    fn look_up_in(&mut self, _training: &[Recording]) -> Result<(), ModelError> {
        Ok(())
    }

    /// A motion for every request, in their order. Each depends on its own request alone; those of
    /// one call may differ in length.
    ///
    /// # Errors
    /// A request that does not fit together or to the model.
    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError>;

    /// Which features of the music it reads where it reads music.
    #[cfg(feature = "music")]
    fn music_features(&self) -> FeatureSet {
        FeatureSet::default()
    }

    /// Whether it reads the numbers that a data set gives of its music, in place of what is heard
    /// in a sound.
    fn reads_given_music(&self) -> bool {
        false
    }

    /// Most frames from one given pose to the next, both counted, that it answers; none where there
    /// is no bound.
    fn longest_span(&self) -> Option<usize> {
        None
    }

    /// How a recording's foot in contact is told where the model is given it.
    fn contact_rule(&self) -> ContactRule {
        ContactRule::default()
    }

    /// How it sees clips on another skeleton than its own: what it reads of a recording is measured
    /// on what this makes of it.
    fn mapping(&self) -> Option<&Mapping> {
        None
    }

    /// The joints and the rest pose that its rotations are of; none where it dances on any, or does
    /// not know.
    fn rest_pose(&self) -> Option<RestPose<'_>> {
        None
    }

    /// How it samples a dance frame by frame; none of a model that does not.
    fn sampling(&self) -> Option<Sampling> {
        None
    }

    /// [`Motion::raw`] of every request, without the rest.
    ///
    /// # Errors
    /// As [`Generator::generate`]; a model that has none.
    fn raw(&self, requests: &[Request]) -> Result<Vec<Array2<f64>>, ModelError> {
        let motions = self.generate(requests)?.into_iter();
        motions
            .map(|motion| motion.raw.ok_or_else(|| self.lacks("raw output")))
            .collect()
    }

    /// Natural logarithm of the density of each truth under its request, in the numbers of the
    /// model.
    ///
    /// # Errors
    /// As [`Generator::generate`]; a model that has none.
    fn log_likelihoods(
        &self,
        requests: &[Request],
        truths: &[Motion],
    ) -> Result<Vec<f64>, ModelError> {
        self.log_likelihoods_knowing(requests, requests, truths)
    }

    /// The same where what the network knows is that of other requests, one for each: how much it
    /// heeds what it knows.
    ///
    /// # Errors
    /// As [`Generator::log_likelihoods`].
    fn log_likelihoods_knowing(
        &self,
        _known: &[Request],
        _requests: &[Request],
        _truths: &[Motion],
    ) -> Result<Vec<f64>, ModelError> {
        Err(self.lacks("likelihood"))
    }

    /// The error of a model that is asked for what it does not have.
    fn lacks(&self, what: &'static str) -> ModelError {
        ModelError::Model {
            model: self.name().into(),
            reason: format!("gives no {what}"),
        }
    }
}

impl Condition {
    /// What it is called in a message.
    pub fn title(self) -> &'static str {
        match self {
            Self::RootTrajectory => "root trajectory",
            Self::VelocityFactors => "velocity factors",
            Self::Contacts => "contacts",
            Self::Music => "music",
            Self::KeyPoses => "key poses",
        }
    }
}

impl Needs {
    /// Whether the model reads this.
    pub fn reads(&self, condition: Condition) -> bool {
        self.conditions.contains(&condition) || self.heeds.contains(&condition)
    }
}

impl Request {
    /// A request for this many frames for which nothing is given.
    pub fn new(skeleton: Skeleton, frame_time: f64, frames: usize) -> Self {
        Self {
            skeleton,
            frame_time,
            frames,
            given: Vec::new(),
            root: None,
            velocity_factors: None,
            contacts: None,
            music: None,
            seed: 0,
        }
    }

    /// Whether this is given.
    pub fn has(&self, condition: Condition) -> bool {
        match condition {
            Condition::RootTrajectory => self.root.is_some(),
            Condition::VelocityFactors => self.velocity_factors.is_some(),
            Condition::Contacts => self.contacts.is_some(),
            Condition::Music => self.music.is_some(),
            Condition::KeyPoses => {
                let frames = self.given.iter().map(|given| given.frame);
                (0..).zip(frames).any(|(in_seed, frame)| frame != in_seed)
            }
        }
    }

    /// Refuses a request that lacks what a model needs, or whose parts have other lengths than F.
    ///
    /// # Errors
    /// [`ModelError::Missing`] that names what to give, [`ModelError::Shape`],
    /// [`ModelError::NotFinite`].
    pub fn check(&self, model: &str, needs: &Needs) -> Result<(), ModelError> {
        let model = model.to_string();
        let missing = |what| Err(ModelError::Missing { model, what });
        let at = |frame: i64| self.given.iter().any(|given| given.frame == frame);
        let last = self.frames as i64 - 1;
        let ends = at(0) && at(last);
        let own = self.given.iter().filter(|given| given.frame >= 0).count();
        match needs.poses {
            NeededPoses::Past(past) | NeededPoses::Keyframes { past }
                if (1..=past as i64).any(|before| !at(-before)) =>
            {
                return missing(format!("the {past} poses before frame 0"));
            }
            NeededPoses::Ends if !(ends && self.frames > 1 && own == 2) => {
                return missing(format!("two poses, at frame 0 and frame {last}"));
            }
            NeededPoses::Seed(frames) if (0..frames as i64).any(|frame| !at(frame)) => {
                return missing(format!("the poses of the first {frames} frames"));
            }
            NeededPoses::Keyframes { .. } if !ends => {
                return missing(format!("poses at frame 0 and frame {last}"));
            }
            _ => {}
        }
        if let Some(condition) = needs.conditions.iter().find(|&&it| !self.has(it)) {
            return missing(format!("the {}", condition.title()));
        }
        for (what, array) in [
            ("root trajectory", &self.root),
            ("velocity factors", &self.velocity_factors),
            ("contacts", &self.contacts),
            ("music", &self.music),
        ] {
            let Some(array) = array else { continue };
            let longer = what == "music" && array.nrows() > self.frames;
            let rows = if longer { array.nrows() } else { self.frames };
            check_shape(what, &[rows, array.ncols()], array.shape())?;
            check_finite(what, array)?;
        }
        Ok(())
    }
}

fn check_shape(what: &str, expected: &[usize], found: &[usize]) -> Result<(), ModelError> {
    match expected == found {
        true => Ok(()),
        false => Err(ModelError::Shape {
            what: what.into(),
            expected: expected.to_vec(),
            found: found.to_vec(),
        }),
    }
}

fn check_finite<'x>(
    what: &str,
    numbers: impl IntoIterator<Item = &'x f64>,
) -> Result<(), ModelError> {
    match numbers.into_iter().all(|x| x.is_finite()) {
        true => Ok(()),
        false => Err(ModelError::NotFinite { what: what.into() }),
    }
}

impl Motion {
    /// World positions, `[F, joints, 3]`, cm, and nothing else.
    pub fn new(positions: Array3<f64>) -> Self {
        Self {
            positions,
            poses: None,
            facing: None,
            contacts: None,
            raw: None,
            pieces: Vec::new(),
        }
    }

    /// Frames of a recording: the truth that an answer is measured against.
    ///
    /// # Errors
    /// [`ModelError::Shape`] where the clip has no such frames.
    pub fn recorded(clip: &Clip, frames: Range<usize>) -> Result<Self, ModelError> {
        let poses = clip.poses.get(frames.clone());
        let poses = poses.ok_or_else(|| ModelError::Shape {
            what: clip.name.clone(),
            expected: vec![frames.end],
            found: vec![clip.poses.len()],
        })?;
        let world = clip.skeleton.world_positions(poses);
        let shape = (poses.len(), clip.skeleton.joints.len(), 3);
        let positions = Array3::from_shape_fn(shape, |(t, joint, axis)| world[t][joint][axis]);
        Ok(Self {
            poses: Some(poses.to_vec()),
            ..Self::new(positions)
        })
    }

    /// Refuses a motion that is no answer to a request: other numbers of frames or joints, numbers
    /// that are not finite.
    ///
    /// # Errors
    /// [`ModelError::Shape`], [`ModelError::NotFinite`].
    pub fn check(&self, request: &Request) -> Result<(), ModelError> {
        let (frames, joints) = (request.frames, request.skeleton.joints.len());
        let positions = self.positions.shape();
        check_shape("predicted positions", &[frames, joints, 3], positions)?;
        if let Some(poses) = &self.poses {
            check_shape("predicted poses", &[frames], &[poses.len()])?;
            for Pose {
                translations,
                rotations,
            } in poses
            {
                let found = [translations.len(), rotations.len()];
                check_shape("a predicted pose", &[joints, joints], &found)?;
            }
        }
        if let Some(facing) = &self.facing {
            check_shape("predicted facing angles", &[frames], facing.shape())?;
        }
        check_finite("predicted frames", &self.positions)
    }
}

/// Why a model cannot be built or cannot answer.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ModelError {
    #[error("{what} has shape {found:?}, expected {expected:?}")]
    Shape {
        what: String,
        expected: Vec<usize>,
        found: Vec<usize>,
    },
    /// The request lacks something that the model's [`Needs`] name.
    #[error("{model} needs {what}")]
    Missing { model: String, what: String },
    #[error(
        "a transition goes from one keyframe to a later one, so its root trajectory needs 2 rows or more, it has {rows}"
    )]
    NoFrames { rows: usize },
    #[error(
        "the request's skeleton ({joints} joints) is not the 24-joint dance skeleton; map the clip to it first"
    )]
    Skeleton { joints: usize },
    #[error("{what} has a NaN or an infinity")]
    NotFinite { what: String },
    #[error("{model}: {reason}")]
    Model { model: String, reason: String },
    /// A sampled dance that left all that is danced; the others of its call are not made either.
    #[error(
        "{model}: the dance diverges: frame {frame} has {channel} at {deviations:.1} deviations; \
         another seed may not, or generation.clamp bounds it"
    )]
    Diverged {
        model: String,
        /// Which request of the call.
        request: usize,
        frame: usize,
        channel: String,
        deviations: f64,
    },
    /// Whoever asked does not want the answer any more.
    #[error("stopped")]
    Stopped,
    /// The data cannot be brought into the model's numbers.
    #[error("{reason}")]
    Data { reason: String },
    #[error(transparent)]
    Value(#[from] ValueError),
    /// For a saved model: more than its file holds.
    #[error(
        "the model of the config has more than {most} weights; choose smaller sizes in [model]"
    )]
    TooLarge { most: usize },
}

impl ModelError {
    /// Data that cannot be used, and why.
    pub fn data(cause: &dyn std::error::Error) -> Self {
        Self::Data {
            reason: cause.to_string(),
        }
    }
}
