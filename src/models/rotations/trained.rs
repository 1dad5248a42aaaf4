//! A network of rotations with its weights, as a generator.

use std::sync::{Arc, Mutex};

use glam::{DQuat, DVec3};
use ndarray::{Array2, Array3};

use super::{Batch, Body, GivenWindow, RootSource, RotationNetwork, RotationSettings};
use crate::autograd::{Parameters, Tape, Workspace};
use crate::counted::counted;
use crate::models::generator::{Condition, Given, Motion, NeededPoses, Needs, Request};
use crate::models::transition::RootFrame;
use crate::models::{Generator, ModelError};
use crate::motion::facing::FacingJoints;
use crate::motion::root_reconstruction::reconstruct_root;
use crate::motion::{ContactRule, Feet, Foot, Pose, Skeleton};

/// Windows that the network completes in one call. Bounds memory.
const CHUNK: usize = 64;

/// What the numbers of a network are about.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    pub body: Body,
    pub root_frame: RootFrame,
    rule: ContactRule,
    feet: Feet,
    facing: FacingJoints,
}

impl Reference {
    /// # Errors
    /// A body without feet or hips that could be told by their names.
    pub fn new<S: RotationSettings>(body: Body, settings: &S) -> Result<Self, ModelError> {
        Ok(Self {
            root_frame: settings.root_frame(),
            rule: settings.contact_rule(),
            feet: Feet::of(body.skeleton()).map_err(|error| ModelError::data(&error))?,
            facing: FacingJoints::of(body.skeleton()).map_err(|error| ModelError::data(&error))?,
            body,
        })
    }
}

/// A trained network, in f32.
pub struct TrainedRotations {
    name: String,
    network: Arc<dyn RotationNetwork<f32>>,
    parameters: Parameters<f32>,
    reference: Reference,
    workspaces: Mutex<Vec<Workspace<f32>>>,
}

/// Keyframes that the network completes at once: a request, or a part of a long one.
struct Piece {
    request: usize,
    window: GivenWindow,
    /// Rotations and root of each keyframe as they were given.
    keyframes: Vec<(usize, Pose)>,
}

/// A piece, completed: poses in the world, `[T]`.
struct Completed {
    poses: Vec<Pose>,
    contacts: Vec<Foot>,
    /// What the network said, `[T][4 J + 2]`.
    raw: Vec<Vec<f64>>,
}

impl TrainedRotations {
    pub(super) fn new(
        name: &str,
        network: Arc<dyn RotationNetwork<f32>>,
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

    /// The joints that it makes motions of.
    pub fn body(&self) -> &Body {
        &self.reference.body
    }

    fn refused(&self, reason: String) -> ModelError {
        ModelError::Model {
            model: self.name.clone(),
            reason,
        }
    }

    /// The windows that a request is completed in: as many keyframes each as the longest holds.
    fn pieces(&self, index: usize, request: &Request) -> Result<Vec<Piece>, ModelError> {
        request.check(&self.name, &self.needs())?;
        self.reference
            .body
            .check("the request", &request.skeleton)?;
        for Given { frame, pose, .. } in &request.given {
            let joints = self.reference.body.joints();
            if pose.rotations.len() != joints || pose.translations.len() != joints {
                return Err(ModelError::Shape {
                    what: format!("the pose at frame {frame}"),
                    expected: vec![joints],
                    found: vec![pose.rotations.len()],
                });
            }
        }
        let given: Vec<(usize, &Pose)> = request
            .given
            .iter()
            .filter_map(|given| Some((usize::try_from(given.frame).ok()?, &given.pose)))
            .collect();
        if let Some(contacts) = &request.contacts
            && contacts.ncols() != 2
        {
            return Err(ModelError::Shape {
                what: "contacts, right and left foot".into(),
                expected: vec![request.frames, 2],
                found: contacts.shape().to_vec(),
            });
        }
        let longest = self.network.longest();
        for pair in given.windows(2) {
            let [from, to] = [pair[0].0, pair[1].0];
            if to < from + 2 {
                return Err(self.refused(format!(
                    "keyframes at frames {from} and {to} have no frame between them; give \
                     keyframes that are at least 2 frames apart"
                )));
            }
            if to - from >= longest {
                return Err(self.refused(format!(
                    "keyframes at frames {from} and {to} are {} frames apart, the longest that it \
                     was trained on is {}; give another keyframe between them, or train with a \
                     larger schedule.lengths.max",
                    to - from,
                    longest - 1
                )));
            }
        }
        let mut pieces = Vec::new();
        let mut first = 0;
        while first + 1 < given.len() {
            let start = given[first].0;
            let fits = |&(frame, _): &&(usize, &Pose)| frame - start < longest;
            let most = given[first..].iter().take(self.network.most_keyframes());
            let last = first + most.take_while(fits).count() - 1;
            pieces.push(self.piece(index, request, &given[first..=last]));
            first = last;
        }
        if pieces.len() > 1 && self.network.past() > 0 {
            return Err(self.refused(format!(
                "it goes on from {} to one keyframe, at most {longest} frames on; give no others",
                counted(self.network.past(), "pose")
            )));
        }
        Ok(pieces)
    }

    fn piece(&self, index: usize, request: &Request, given: &[(usize, &Pose)]) -> Piece {
        let (start, end) = (given[0].0, given[given.len() - 1].0);
        let contacts = (start..=end).map(|frame| match &request.contacts {
            Some(contacts) => [contacts[[frame, 0]], contacts[[frame, 1]]],
            None => Foot::Left.one_hot(),
        });
        let keyframes: Vec<(usize, &Pose)> = given
            .iter()
            .map(|&(frame, pose)| (frame - start, pose))
            .collect();
        let past = request.given.iter().filter(|given| {
            let nearest = -(self.network.past() as i64);
            (nearest..0).contains(&given.frame)
        });
        let past: Vec<&Pose> = past.map(|given| &given.pose).collect();
        let window = GivenWindow::new(
            &request.skeleton,
            &self.reference.facing,
            self.reference.root_frame,
            &keyframes,
            contacts.collect(),
        );
        Piece {
            request: index,
            window: window.with_past(&past),
            keyframes: keyframes
                .into_iter()
                .map(|(at, pose)| (at, pose.clone()))
                .collect(),
        }
    }

    /// Completes pieces of one length.
    fn complete(
        &self,
        pieces: &[&Piece],
        requests: &[Request],
    ) -> Result<Vec<Completed>, ModelError> {
        let windows: Vec<GivenWindow> = pieces.iter().map(|piece| piece.window.clone()).collect();
        let batch = Batch::of(&windows, &[], self.network.input());
        let kept = self.workspaces.lock().map(|mut free| free.pop());
        let mut workspace = kept.unwrap_or_default().unwrap_or_default();
        let said = {
            let mut tape = Tape::inference(&self.parameters, &mut workspace);
            self.network.predict(&mut tape, &batch).map(|said| {
                let values = |var| tape.values(var).iter().map(|&x| f64::from(x)).collect();
                let optional = |var: Option<_>| var.map(values);
                (
                    values(said.rotations),
                    optional(said.contacts),
                    optional(said.root),
                )
            })
        };
        let (rotations, contacts, root): (Vec<f64>, Option<Vec<f64>>, Option<Vec<f64>>) =
            said.map_err(|error| self.refused(error.to_string()))?;
        if let Ok(mut free) = self.workspaces.lock() {
            free.push(workspace);
        }
        let frames = batch.frames;
        let part = |values: &[f64], columns: usize, k: usize| {
            values[k * frames * columns..(k + 1) * frames * columns].to_vec()
        };
        let numbers = 4 * self.reference.body.joints();
        let completed = pieces.iter().enumerate().map(|(k, piece)| {
            self.finish(
                piece,
                &requests[piece.request].skeleton,
                &part(&rotations, numbers, k),
                contacts.as_ref().map(|contacts| part(contacts, 2, k)),
                root.as_ref().map(|root| part(root, 3, k)),
            )
        });
        Ok(completed.collect())
    }

    /// From what the network said of a window to its poses.
    fn finish(
        &self,
        piece: &Piece,
        skeleton: &Skeleton,
        rotations: &[f64],
        contacts: Option<Vec<f64>>,
        root: Option<Vec<f64>>,
    ) -> Completed {
        let (window, joints) = (&piece.window, self.reference.body.joints());
        let mut poses: Vec<Pose> = rotations
            .chunks_exact(4 * joints)
            .enumerate()
            .map(|(frame, numbers)| {
                let unit = |q: &[f64]| {
                    let q = DQuat::from_xyzw(q[0], q[1], q[2], q[3]);
                    match q.length_squared() > 0.0 {
                        true => q.normalize(),
                        false => DQuat::IDENTITY,
                    }
                };
                let rotations: Vec<DQuat> = numbers.chunks_exact(4).map(unit).collect();
                let root = root.as_ref().map_or(DVec3::ZERO, |root| {
                    DVec3::from_slice(&root[3 * frame..3 * frame + 3])
                });
                window.pose(&rotations, root)
            })
            .collect();
        let is_keyframe = |frame: usize| piece.keyframes.iter().find(|(at, _)| *at == frame);
        let raw = rotations
            .chunks_exact(4 * joints)
            .enumerate()
            .map(|(frame, numbers)| {
                let contacts = contacts.as_deref().unwrap_or_default();
                let own = contacts.chunks_exact(2).nth(frame).unwrap_or_default();
                [numbers, own].concat()
            });
        let raw = raw.collect();
        for (frame, pose) in poses.iter_mut().enumerate() {
            if let Some((_, given)) = is_keyframe(frame) {
                pose.rotations.clone_from(&given.rotations);
                if self.network.root() == RootSource::Predicted {
                    pose.translations[0] = given.translations[0];
                }
            }
        }
        let mut feet: Vec<Foot> = window.contacts.iter().map(|&it| Foot::larger(it)).collect();
        if let RootSource::Reconstructed {
            rule,
            given,
            meets_target,
        } = self.network.root()
        {
            if let Some(contacts) = contacts.filter(|_| !given) {
                let weights = contacts.chunks_exact(2);
                feet = weights
                    .map(|weights| Foot::larger([weights[0], weights[1]]))
                    .collect();
            }
            let joints = rule.joints(&self.reference.feet);
            let mut root = root_over(&poses, skeleton, joints, &feet);
            if meets_target {
                spread_gaps(&mut root, &piece.keyframes);
            }
            poses
                .iter_mut()
                .zip(root)
                .for_each(|(pose, root)| pose.translations[0] = root);
        }
        Completed {
            poses,
            contacts: feet,
            raw,
        }
    }

    /// One motion of the completed pieces of a request.
    fn motion(
        &self,
        request: &Request,
        pieces: Vec<(&Piece, Completed)>,
    ) -> Result<Motion, ModelError> {
        let (mut poses, mut feet, mut raw) = (Vec::<Pose>::new(), Vec::new(), Vec::new());
        for (piece, completed) in pieces {
            // The first frame is the last of the piece before: the root goes on from there.
            let seam = usize::from(!poses.is_empty());
            let on = match poses.last() {
                Some(last) => last.translations[0] - completed.poses[0].translations[0],
                None => DVec3::ZERO,
            };
            let keyframe = |frame: usize| piece.keyframes.iter().any(|(at, _)| *at == frame);
            let own = completed.raw.into_iter().enumerate();
            raw.extend(
                own.filter(|(frame, _)| !keyframe(*frame))
                    .flat_map(|(_, row)| row),
            );
            poses.extend(completed.poses.into_iter().skip(seam).map(|mut pose| {
                pose.translations[0] += on;
                pose
            }));
            feet.extend(completed.contacts.into_iter().skip(seam));
        }
        let world = request.skeleton.world_positions(&poses);
        let shape = (poses.len(), self.reference.body.joints(), 3);
        let positions = Array3::from_shape_fn(shape, |(t, joint, axis)| world[t][joint][axis]);
        let keyframes = request
            .given
            .iter()
            .filter(|given| given.frame >= 0)
            .count();
        let rows = poses.len() - keyframes;
        let columns = raw.len() / rows.max(1);
        let raw = Array2::from_shape_vec((rows, columns), raw)
            .map_err(|error| self.refused(error.to_string()))?;
        Ok(Motion {
            poses: Some(poses),
            contacts: Some(Array2::from_shape_fn((feet.len(), 2), |(t, k)| {
                feet[t].one_hot()[k]
            })),
            raw: Some(raw),
            ..Motion::new(positions)
        })
    }
}

/// The root so that the foot in contact stands still, from where it is at the first frame, `[T]`.
fn root_over(poses: &[Pose], skeleton: &Skeleton, joints: [usize; 2], feet: &[Foot]) -> Vec<DVec3> {
    let relative = poses.iter().map(|pose| {
        let world = pose.world_positions(skeleton);
        joints.map(|joint| world[joint] - world[0])
    });
    let relative: Vec<[DVec3; 2]> = relative.collect();
    let weights: Vec<[f64; 2]> = feet.iter().map(|foot| foot.one_hot()).collect();
    reconstruct_root(&relative, &weights, poses[0].translations[0])
}

/// Adds what the root misses each keyframe by, spread evenly over the frames that lead to it.
fn spread_gaps(root: &mut [DVec3], keyframes: &[(usize, Pose)]) {
    let mut added = DVec3::ZERO;
    for pair in keyframes.windows(2) {
        let ((from, _), (to, target)) = (&pair[0], &pair[1]);
        let gap = target.translations[0] - (root[*to] + added);
        let frames = (to - from) as f64;
        for (step, root) in root[from + 1..=*to].iter_mut().enumerate() {
            *root += added + gap * ((step + 1) as f64 / frames);
        }
        added += gap;
    }
}

impl Generator for TrainedRotations {
    fn name(&self) -> &str {
        &self.name
    }

    fn needs(&self) -> Needs {
        Needs {
            poses: NeededPoses::Keyframes {
                past: self.network.past(),
            },
            conditions: match self.network.needs_contacts() {
                true => &[Condition::Contacts],
                false => &[],
            },
            heeds: &[],
        }
    }

    fn longest_span(&self) -> Option<usize> {
        Some(self.network.longest())
    }

    fn contact_rule(&self) -> ContactRule {
        self.reference.rule
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        let pieces = requests.iter().enumerate();
        let pieces = pieces.map(|(index, request)| self.pieces(index, request));
        let pieces: Vec<Piece> = pieces
            .collect::<Result<Vec<_>, _>>()?
            .into_iter()
            .flatten()
            .collect();
        let mut lengths: Vec<usize> = pieces.iter().map(|piece| piece.window.frames).collect();
        lengths.sort_unstable();
        lengths.dedup();
        let mut completed: Vec<Option<Completed>> = pieces.iter().map(|_| None).collect();
        for length in lengths {
            let of_length = (0..pieces.len()).filter(|&at| pieces[at].window.frames == length);
            let places: Vec<usize> = of_length.collect();
            for places in places.chunks(CHUNK) {
                let chunk: Vec<&Piece> = places.iter().map(|&at| &pieces[at]).collect();
                for (&at, done) in places.iter().zip(self.complete(&chunk, requests)?) {
                    completed[at] = Some(done);
                }
            }
        }
        let mut of_request: Vec<Vec<(&Piece, Completed)>> =
            requests.iter().map(|_| Vec::new()).collect();
        for (piece, done) in pieces.iter().zip(completed.into_iter().flatten()) {
            of_request[piece.request].push((piece, done));
        }
        let motions = requests.iter().zip(of_request);
        motions
            .map(|(request, pieces)| self.motion(request, pieces))
            .collect()
    }
}
