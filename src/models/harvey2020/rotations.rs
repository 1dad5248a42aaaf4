//! The network on windows of rotations of any skeleton, as Li et al. compare with it.

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::config::RecurrentConfig;
use super::given::{GivenState, GivenWindows, Recorded};
use super::losses::{Scales, constant, joints};
use super::network::RecurrentNetwork;
use crate::autograd::{AutogradError, Real, Tape};
use crate::data::DataConfig;
use crate::models::AugmentationConfig;
use crate::models::kind::KindOf;
use crate::models::rotations::{
    Batch, Body, Prediction, RootSource, RotationNetwork, RotationSettings, ScheduleConfig,
    WindowStatistics,
};
use crate::models::settings::ValueError;
use crate::models::transition::RootFrame;
use crate::models::{LossTerms, ModelError, li2023};
use crate::motion::rotation_window::Interpolation;
use crate::motion::{ContactRule, Feet};
use crate::nn::Initialiser;

/// The line of the registry.
pub const KIND: KindOf<Harvey2020RotationsSettings> =
    KindOf::new(Harvey2020RotationsSettings::KIND, || {
        li2023::PAPERS.to_vec()
    })
    .called("harvey");

/// All tables.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Harvey2020RotationsSettings {
    pub model: Harvey2020RotationsConfig,
    pub schedule: ScheduleConfig,
    pub augmentation: AugmentationConfig,
}

/// `[model]` of kind `harvey2020_rotations`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Harvey2020RotationsConfig {
    /// "harvey2020_rotations".
    pub kind: String,
    /// Frames before the first keyframe that the LSTM is run over.
    pub past: usize,
    /// Squared speed below which a foot is in contact, (cm/frame)^2: as `data.contact_threshold`.
    pub contact_threshold: f64,
    #[serde(flatten)]
    pub network: RecurrentConfig,
}

impl Default for Harvey2020RotationsConfig {
    fn default() -> Self {
        Self {
            kind: Harvey2020RotationsSettings::KIND.into(),
            past: 0,
            contact_threshold: DataConfig::default().contact_threshold,
            network: RecurrentConfig::default(),
        }
    }
}

impl RotationSettings for Harvey2020RotationsSettings {
    const KIND: &'static str = "harvey2020_rotations";

    fn schedule(&self) -> &ScheduleConfig {
        &self.schedule
    }

    fn augmentation(&self) -> &AugmentationConfig {
        &self.augmentation
    }

    fn root_frame(&self) -> RootFrame {
        RootFrame::KeyframeFacing
    }

    fn contact_rule(&self) -> ContactRule {
        ContactRule::LowerAnkle
    }

    fn past(&self) -> usize {
        self.model.past
    }

    fn check_own(&self, data: &DataConfig) -> Result<(), ValueError> {
        let Harvey2020RotationsConfig {
            past,
            contact_threshold: own,
            ..
        } = self.model;
        ValueError::unless(past <= 1000, "model.past", past, "0 to 1000")?;
        let threshold = data.contact_threshold;
        let expected =
            format!("{threshold}, the value of data.contact_threshold: contacts are told alike");
        ValueError::unless(own == threshold, "model.contact_threshold", own, expected)?;
        self.model.network.check()
    }

    fn network<T: Real, R: Rng>(
        &self,
        init: &mut Initialiser<'_, T, R>,
        body: &Body,
        statistics: &WindowStatistics,
    ) -> Result<Box<dyn RotationNetwork<T>>, ModelError> {
        Ok(Box::new(Harvey2020Rotations::new(
            init, self, body, statistics,
        )?))
    }

    fn small(&self) -> Self {
        let mut small = self.clone();
        small.model.network = small.model.network.small();
        small
    }
}

/// The network of Harvey et al. 2020 on windows of rotations. What is not given of k1 without a
/// past, its velocity and contacts, is 0.
#[derive(Debug, Clone)]
pub struct Harvey2020Rotations {
    network: RecurrentNetwork,
    parents: Vec<Option<usize>>,
    /// Left ankle and toe, right ankle and toe.
    feet: [usize; 4],
    contact_threshold: f64,
    past: usize,
    longest: usize,
}

impl Harvey2020Rotations {
    /// Adds the weights, named as those of [`super::Harvey2020`].
    ///
    /// # Errors
    /// A body without feet that could be told by their names; fields that do not fit together.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        settings: &Harvey2020RotationsSettings,
        body: &Body,
        statistics: &WindowStatistics,
    ) -> Result<Self, ModelError> {
        let feet = Feet::of(body.skeleton()).map_err(|error| ModelError::data(&error))?;
        let ([right, left], [right_toe, left_toe]) = (feet.ankles, feet.toes);
        let config = &settings.model;
        let scales = scales(statistics, settings.schedule.window);
        Ok(Self {
            network: RecurrentNetwork::new(init, &config.network, body.joints(), 0, scales)?,
            parents: body.parents(),
            feet: [left, left_toe, right, right_toe],
            contact_threshold: config.contact_threshold,
            past: config.past,
            longest: settings.schedule.lengths.max,
        })
    }

    /// What is given of a batch, the first P frames the past.
    fn given<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<GivenWindows<T>, AutogradError> {
        if batch.past_frames != self.past {
            return Err(AutogradError::Misplaced {
                operation: "harvey2020",
                what: "windows with another number of past frames than model.past",
            });
        }
        let (windows, last) = (batch.windows, batch.frames - 1);
        let past = 0..self.past;
        let mut rotations: Vec<Vec<T>> = past
            .clone()
            .map(|frame| of_frame(&batch.past_rotations, frame, self.past))
            .collect();
        let mut roots: Vec<Vec<T>> = past
            .map(|frame| of_frame(&batch.past_root, frame, self.past))
            .collect();
        rotations.push(of_frame(&batch.input, 0, batch.frames));
        roots.push(of_frame(&batch.root, 0, batch.frames));
        let mut given = GivenWindows {
            windows,
            transition: last,
            parents: self.parents.clone(),
            offsets: of_frame(&batch.offsets, 0, batch.frames),
            lead: Vec::new(),
            first: Vec::new(),
            target_rotations: of_frame(&batch.input, last, batch.frames),
            target_root: of_frame(&batch.root, last, batch.frames),
        };
        let contacts = self.contacts(tape, &given, &rotations, &roots)?;
        let mut before: Option<&Vec<T>> = None;
        for ((rotations, root), contacts) in rotations.into_iter().zip(&roots).zip(contacts) {
            let velocity = match before {
                Some(before) => root.iter().zip(before).map(|(&a, &b)| a - b).collect(),
                None => vec![T::zero(); 3 * windows],
            };
            before = Some(root);
            given.lead.push(GivenState {
                rotations,
                root: root.clone(),
                velocity,
                contacts,
            });
        }
        Ok(given)
    }

    /// What was recorded of a batch. Signs are continuous along a window from k1 on, where the
    /// truth's are those that are nearer to the interpolation.
    fn recorded<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
        given: &GivenWindows<T>,
    ) -> Result<Recorded<T>, AutogradError> {
        let truth = batch.truth.as_ref().ok_or(AutogradError::Misplaced {
            operation: "losses",
            what: "the batch has no truth to compare with",
        })?;
        let start = given.lead.last().ok_or(AutogradError::Misplaced {
            operation: "harvey2020",
            what: "windows without their first keyframe",
        })?;
        let frames = 1..batch.frames;
        let mut rotations = vec![start.rotations.clone()];
        let mut roots = vec![start.root.clone()];
        for frame in frames {
            let mut own = of_frame(&truth.rotations, frame, batch.frames);
            follow(&mut own, &rotations[rotations.len() - 1]);
            rotations.push(own);
            roots.push(of_frame(&truth.root, frame, batch.frames));
        }
        let mut contacts = self.contacts(tape, given, &rotations, &roots)?;
        contacts[0].clone_from(&start.contacts);
        Ok(Recorded {
            rotations,
            roots,
            contacts,
        })
    }

    /// Contact labels of frames in a row, `[windows, 4]` each: 1 for a foot that has moved less
    /// than the threshold allows since the frame before. The first frame's are 0.
    fn contacts<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        given: &GivenWindows<T>,
        rotations: &[Vec<T>],
        roots: &[Vec<T>],
    ) -> Result<Vec<Vec<T>>, AutogradError> {
        let mut labels = vec![vec![T::zero(); 4 * given.windows]];
        let mut before: Option<Vec<T>> = None;
        let columns = 3 * self.parents.len();
        for (rotations, root) in rotations.iter().zip(roots) {
            let rotations = constant(tape, given.windows, rotations);
            let relative = joints(tape, given, rotations)?;
            let mut feet = Vec::with_capacity(12 * given.windows);
            for (joints, root) in tape.values(relative).chunks(columns).zip(root.chunks(3)) {
                for foot in self.feet {
                    let joint = &joints[3 * foot..3 * foot + 3];
                    feet.extend(joint.iter().zip(root).map(|(&x, &root)| x + root));
                }
            }
            if let Some(before) = before {
                let steps = feet.chunks(3).zip(before.chunks(3)).map(|(now, before)| {
                    let squared = now.iter().zip(before).map(|(&a, &b)| (a - b) * (a - b));
                    let squared: T = squared.sum();
                    match squared < T::from_f64(self.contact_threshold) {
                        true => T::one(),
                        false => T::zero(),
                    }
                });
                labels.push(steps.collect());
            }
            before = Some(feet);
        }
        Ok(labels)
    }
}

/// Units from what was measured of the training windows. A root that reaches its displacement's
/// deviation over a window of `frames` frames at an even pace has the unit of velocities: its root
/// mean square displacement is frames / sqrt(3) times its speed.
fn scales(statistics: &WindowStatistics, frames: usize) -> Scales {
    let root_mean_square =
        |std: &[f64]| (std.iter().map(|x| x * x).sum::<f64>() / std.len() as f64).sqrt();
    let position = root_mean_square(&statistics.position_deviation);
    let root = root_mean_square(&statistics.root_deviation);
    let pace = frames as f64 / 3.0_f64.sqrt();
    Scales {
        position,
        velocity: position / pace,
        root,
        root_velocity: root / pace,
    }
}

/// The numbers of a frame of all windows, of `frames` rows each.
fn of_frame<T: Real>(rows: &ndarray::Array2<T>, frame: usize, frames: usize) -> Vec<T> {
    let own = rows.rows().into_iter().skip(frame).step_by(frames.max(1));
    own.flat_map(|row| row.to_vec()).collect()
}

/// Gives each quaternion the sign that is nearer to another.
fn follow<T: Real>(rotations: &mut [T], others: &[T]) {
    for (q, other) in rotations.chunks_exact_mut(4).zip(others.chunks_exact(4)) {
        let dot: T = q.iter().zip(other).map(|(&a, &b)| a * b).sum();
        if dot < T::zero() {
            q.iter_mut().for_each(|x| *x = -*x);
        }
    }
}

impl<T: Real> RotationNetwork<T> for Harvey2020Rotations {
    fn input(&self) -> Interpolation {
        Interpolation::Slerp
    }

    fn losses(&self, tape: &mut Tape<'_, T>, batch: &Batch<T>) -> Result<LossTerms, AutogradError> {
        let given = self.given(tape, batch)?;
        let recorded = self.recorded(tape, batch, &given)?;
        let total = batch.total_windows;
        self.network.losses(tape, &given, &recorded, total)
    }

    fn predict(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Prediction, AutogradError> {
        let given = self.given(tape, batch)?;
        let numbers = 4 * self.parents.len();
        let mut rotations = vec![T::zero(); batch.rows() * numbers];
        let mut roots = vec![T::zero(); batch.rows() * 3];
        let mut rollout = self.network.start(tape, &given)?;
        let mark = tape.mark();
        for t in 0..batch.frames {
            if t > 0 {
                rollout.step(tape, batch.frames - t)?;
            }
            for window in 0..batch.windows {
                let row = window * batch.frames + t;
                let own = &tape.values(rollout.state.rotations)[window * numbers..];
                rotations[row * numbers..][..numbers].copy_from_slice(&own[..numbers]);
                let own = &tape.values(rollout.state.root)[3 * window..];
                roots[3 * row..][..3].copy_from_slice(&own[..3]);
            }
            tape.forget_since(mark, &mut rollout.keep());
        }
        Ok(Prediction {
            rotations: constant(tape, batch.rows(), &rotations),
            contacts: None,
            root: Some(constant(tape, batch.rows(), &roots)),
        })
    }

    fn root(&self) -> RootSource {
        RootSource::Predicted
    }

    fn needs_contacts(&self) -> bool {
        false
    }

    fn longest(&self) -> usize {
        self.longest
    }

    fn past(&self) -> usize {
        self.past
    }

    fn most_keyframes(&self) -> usize {
        2
    }
}
