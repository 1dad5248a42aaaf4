//! A trained network as a generator: windows slide over a song (spec, section 7).

use std::sync::{Arc, Mutex};

use ndarray::{Array2, Array3, Axis, aview1};

use super::batch::{Batch, GivenWindow};
use super::clips::MusicStatistics;
use super::config::{LossConfig, Pu2022Settings, WindowConfig};
use super::network::Pu2022;
use super::window::{WindowFrame, pose_of};
use crate::autograd::{Parameters, Tape, Workspace};
use crate::models::generator::{Condition, Motion, NeededPoses, Needs, Request};
use crate::models::rotations::Body;
use crate::models::{Generator, ModelError, Statistics};
use crate::motion::Pose;
use crate::motion::facing::FacingJoints;
use crate::motion::rest_pose::RestPose;
use crate::music::FeatureSet;

/// Windows that the network completes in one call. Bounds memory.
const CHUNK: usize = 16;

pub(super) const MEAN: &str = "music.mean";
pub(super) const DEVIATION: &str = "music.deviation";

/// What the numbers of a network are about.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    body: Body,
    facing: FacingJoints,
    music: MusicStatistics,
    features: FeatureSet,
    /// Whether the model hears.
    hears: bool,
    window: WindowConfig,
    loss: LossConfig,
}

impl Reference {
    /// # Errors
    /// A body without hips and arms that could be told by their names.
    pub fn new(
        body: Body,
        music: MusicStatistics,
        settings: &Pu2022Settings,
    ) -> Result<Self, ModelError> {
        let facing = FacingJoints::of(body.skeleton());
        Ok(Self {
            facing: facing.map_err(|error| ModelError::data(&error))?,
            body,
            music,
            features: settings.music.features,
            hears: settings.model.music,
            window: settings.window.clone(),
            loss: settings.loss.clone(),
        })
    }

    pub fn statistics(&self) -> Statistics {
        self.body
            .statistics(Statistics::default())
            .with(MEAN, self.music.mean.clone().into_dyn())
            .with(DEVIATION, self.music.deviation.clone().into_dyn())
    }
}

/// A trained network, in f32.
pub struct TrainedPu2022 {
    name: String,
    network: Arc<Pu2022>,
    parameters: Parameters<f32>,
    reference: Reference,
    workspaces: Mutex<Vec<Workspace<f32>>>,
}

/// Frames that a window has before its first key pose, where that is not in the window before it.
const ROOM: usize = 30;

/// A dance as far as it is made.
struct Dance<'r> {
    request: &'r Request,
    /// Standardised, `[F, numbers]`.
    music: Array2<f64>,
    /// Key poses by frame, after the seed.
    keys: Vec<(usize, &'r Pose)>,
    /// The seed, and what followed.
    poses: Vec<Pose>,
    /// What the network said of the frames after the seed, in the world.
    raw: Vec<Vec<f64>>,
    /// First frames of what was made of each window.
    pieces: Vec<usize>,
}

impl TrainedPu2022 {
    pub(super) fn new(
        name: &str,
        network: Arc<Pu2022>,
        parameters: Parameters<f32>,
        reference: Reference,
    ) -> Self {
        Self {
            name: name.into(),
            network,
            parameters,
            reference,
            workspaces: Mutex::new(Vec::new()),
        }
    }

    fn refused(&self, reason: String) -> ModelError {
        ModelError::Model {
            model: self.name.clone(),
            reason,
        }
    }

    /// A request with its seed and nothing else made.
    fn begin<'r>(&self, request: &'r Request) -> Result<Dance<'r>, ModelError> {
        let Reference {
            body,
            music: statistics,
            window,
            ..
        } = &self.reference;
        request.check(&self.name, &self.needs())?;
        body.check("the clip that the dance goes on from", &request.skeleton)?;
        let own = request.given.iter().filter(|given| given.frame >= 0);
        let mut poses = Vec::new();
        let mut keys: Vec<(usize, &Pose)> = Vec::new();
        for given in own {
            let (frame, joints) = (given.frame as usize, body.joints());
            if given.pose.rotations.len() != joints || given.pose.translations.len() != joints {
                return Err(ModelError::Shape {
                    what: format!("the pose at frame {frame}"),
                    expected: vec![joints],
                    found: vec![given.pose.rotations.len()],
                });
            }
            if frame < window.seed {
                poses.push(given.pose.clone());
            } else if frame < request.frames {
                if keys.last().is_some_and(|(last, _)| *last >= frame) {
                    return Err(self.refused(format!(
                        "two key poses at frame {frame}, or frames out of order"
                    )));
                }
                keys.push((frame, &given.pose));
            } else {
                return Err(self.refused(format!(
                    "a key pose at frame {frame}, the result has {}",
                    request.frames
                )));
            }
        }
        let numbers = statistics.mean.len();
        let music = match &request.music {
            Some(music) if music.ncols() != numbers => {
                return Err(ModelError::Shape {
                    what: format!("the music ({})", self.reference.features),
                    expected: vec![request.frames, numbers],
                    found: music.shape().to_vec(),
                });
            }
            Some(music) => statistics.standardise(music),
            None => Array2::zeros((request.frames, numbers)),
        };
        Ok(Dance {
            request,
            music,
            keys,
            poses,
            raw: Vec::new(),
            pieces: Vec::new(),
        })
    }

    /// The window that goes on from the last T' frames of a dance, and its frame of reference.
    fn window(&self, dance: &Dance<'_>) -> (GivenWindow, WindowFrame) {
        let Reference { facing, window, .. } = &self.reference;
        let start = dance.poses.len() - window.seed;
        let seed = &dance.poses[start..];
        let frame = WindowFrame::of(&dance.request.skeleton, facing, &seed[window.seed - 1]);
        let rows: Vec<Vec<f64>> = seed.iter().map(|pose| frame.numbers(pose)).collect();
        let columns = rows.first().map_or(0, Vec::len);
        // Music that ends inside a window repeats its last frame.
        let last = dance.music.nrows() - 1;
        let heard: Vec<usize> = (start..start + window.length)
            .map(|it| it.min(last))
            .collect();
        let keys = dance.keys.iter().filter_map(|(at, pose)| {
            let inside = (dance.poses.len()..start + window.length).contains(at);
            inside.then(|| (at - start, frame.key_pose(pose)))
        });
        let given = GivenWindow {
            seed: Array2::from_shape_fn((rows.len(), columns), |(row, number)| rows[row][number]),
            music: dance.music.select(Axis(0), &heard),
            key_poses: keys.collect(),
        };
        (given, frame)
    }

    /// What the network says of windows, `[T - T'][6 J + 3]` each.
    fn predict(&self, windows: &[GivenWindow]) -> Result<Vec<Vec<Vec<f64>>>, ModelError> {
        let Reference { window, loss, .. } = &self.reference;
        let batch = Batch::of(windows, &[], window, loss);
        let kept = self.workspaces.lock().map(|mut free| free.pop());
        let mut workspace = kept.unwrap_or_default().unwrap_or_default();
        let said = {
            let mut tape = Tape::inference(&self.parameters, &mut workspace);
            let said = self.network.forward(&mut tape, &batch);
            said.map(|said| {
                let columns = tape.shape(said)[1];
                let rows = tape.values(said).chunks_exact(columns);
                let rows = rows.map(|row| row.iter().map(|&x| f64::from(x)).collect());
                rows.collect::<Vec<Vec<f64>>>()
            })
        };
        let said = said.map_err(|error| self.refused(error.to_string()))?;
        if let Ok(mut free) = self.workspaces.lock() {
            free.push(workspace);
        }
        let frames = window.generated();
        Ok(said.chunks(frames).map(<[Vec<f64>]>::to_vec).collect())
    }

    /// Adds what the network said of the next window to a dance: all of it; or where its last key
    /// pose lies near the end, the frames up to that one, so that windows join at a known pose; or
    /// where the next key pose would come soon after its end, fewer, so that the next window has
    /// frames to reach it in.
    fn go_on(&self, dance: &mut Dance<'_>, frame: WindowFrame, said: &[Vec<f64>]) {
        let window = &self.reference.window;
        let from = dance.poses.len();
        let end = from + window.generated();
        let inside = dance.keys.iter().filter(|(at, _)| (from..end).contains(at));
        let last = inside.map(|(at, _)| *at).next_back();
        let next = dance.keys.iter().map(|(at, _)| *at).find(|at| *at >= end);
        let room = ROOM.min(window.generated() / 2);
        let kept = match (last, next) {
            _ if end >= dance.request.frames => window.generated(),
            (Some(last), _) if last + window.seed >= end => last + 1 - from,
            (last, Some(next)) if next < end + room => {
                (next - room).max(last.map_or(0, |last| last + 1)) - from
            }
            _ => window.generated(),
        };
        let kept = kept.min(dance.request.frames - from);
        dance.pieces.push(from);
        for numbers in &said[..kept] {
            let world = frame.to_world(numbers);
            let pose = pose_of(&world, &dance.poses[from - 1]);
            dance.poses.push(pose);
            dance.raw.push(world);
        }
    }
}

impl Dance<'_> {
    fn motion(self) -> Motion {
        let Self {
            request,
            poses,
            raw,
            pieces,
            ..
        } = self;
        let world = request.skeleton.world_positions(&poses);
        let shape = (poses.len(), request.skeleton.len(), 3);
        let positions = Array3::from_shape_fn(shape, |(t, joint, axis)| world[t][joint][axis]);
        let columns = raw.first().map_or(0, Vec::len);
        let mut rows = Array2::zeros((raw.len(), columns));
        for (mut row, numbers) in rows.rows_mut().into_iter().zip(&raw) {
            row.assign(&aview1(numbers));
        }
        Motion {
            poses: Some(poses),
            raw: Some(rows),
            pieces,
            ..Motion::new(positions)
        }
    }
}

impl Generator for TrainedPu2022 {
    fn name(&self) -> &str {
        &self.name
    }

    fn needs(&self) -> Needs {
        Needs {
            poses: NeededPoses::Seed(self.reference.window.seed),
            conditions: match self.reference.hears {
                true => &[Condition::Music],
                false => &[],
            },
            heeds: &[Condition::KeyPoses],
        }
    }

    fn music_features(&self) -> FeatureSet {
        self.reference.features
    }

    fn rest_pose(&self) -> Option<RestPose<'_>> {
        self.reference.body.rest_pose()
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        let dances = requests.iter().map(|request| self.begin(request));
        let mut dances = dances.collect::<Result<Vec<_>, _>>()?;
        loop {
            let mut open: Vec<&mut Dance> = dances
                .iter_mut()
                .filter(|dance| dance.poses.len() < dance.request.frames)
                .collect();
            if open.is_empty() {
                break;
            }
            for chunk in open.chunks_mut(CHUNK) {
                let windows = chunk.iter().map(|dance| self.window(dance));
                let (windows, frames): (Vec<_>, Vec<_>) = windows.unzip();
                let said = self.predict(&windows)?;
                for ((dance, frame), said) in chunk.iter_mut().zip(frames).zip(&said) {
                    self.go_on(dance, frame, said);
                }
            }
        }
        Ok(dances.into_iter().map(Dance::motion).collect())
    }
}
