//! The windows of a batch of transitions in the frame of keyframe k1, facing +Z.

use glam::{DQuat, DVec3};
use ndarray::{Array1, Axis};

use super::given::{GivenState, GivenWindows, Recorded};
use crate::autograd::{AutogradError, Real};
use crate::models::transition::Batch;
use crate::models::transition::Standardisation;
use crate::models::transition::pose_windows::{PoseWindows, ROTATIONS};
use crate::motion::DANCE_PARENTS;
use crate::motion::features::{
    BODY_VELOCITIES, CONTACTS, FACING, FEATURES, ROOT_POSITION, ROOT_VELOCITY,
};

/// Where a window's frame lies in the world.
#[derive(Debug, Clone, Copy)]
struct WindowFrame {
    /// p^r of k1, cm.
    origin: DVec3,
    /// Turns the world to k1's facing.
    turn: DQuat,
    /// 1 or -1: which makes w of k1's turned root rotation positive.
    sign: f64,
}

/// The windows of a batch, from their features and poses.
pub(super) struct TransitionWindows<'b, T> {
    batch: &'b Batch<T>,
    poses: &'b PoseWindows<T>,
    standardisation: &'b Standardisation,
    places: Vec<WindowFrame>,
    pub(super) windows: usize,
    /// N
    pub(super) transition: usize,
}

impl<'b, T: Real> TransitionWindows<'b, T> {
    /// # Errors
    /// Features of another shape than documented, no poses or poses of another shape.
    pub(super) fn new(
        batch: &'b Batch<T>,
        standardisation: &'b Standardisation,
    ) -> Result<Self, AutogradError> {
        let complain = |shape: &[usize], argument: &str, expected| AutogradError::Argument {
            operation: "harvey2020",
            shape: shape.to_vec(),
            argument: argument.into(),
            expected,
        };
        let shape = batch.features.shape();
        let (frames, windows, numbers) = batch.features.dim();
        if frames < 2 || numbers != FEATURES {
            let expected = "[N + 1, windows, 154], N at least 1";
            return Err(complain(shape, "the features of a batch", expected));
        }
        let expected = "the poses of the same windows, [N + 1, windows, 96]";
        let Some(poses) = &batch.poses else {
            return Err(complain(shape, "a batch without poses", expected));
        };
        if poses.rotations.dim() != (frames, windows, ROTATIONS) {
            let shape = poses.rotations.shape();
            return Err(complain(shape, "the poses of a batch", expected));
        }
        let mut given = Self {
            batch,
            poses,
            standardisation,
            places: Vec::new(),
            windows,
            transition: frames - 1,
        };
        given.places = (0..windows)
            .map(|window| {
                let turn = DQuat::from_rotation_y(-given.number(0, window, FACING.start));
                let root = turn * given.quaternion(0, window, 0);
                WindowFrame {
                    origin: given.vector(0, window, ROOT_POSITION.start),
                    turn,
                    sign: if root.w < 0.0 { -1.0 } else { 1.0 },
                }
            })
            .collect();
        Ok(given)
    }

    /// What is given of them.
    pub(super) fn given(&self) -> GivenWindows<T> {
        GivenWindows {
            windows: self.windows,
            transition: self.transition,
            parents: DANCE_PARENTS.to_vec(),
            offsets: self.poses.offsets.iter().copied().collect(),
            lead: vec![GivenState {
                rotations: self.rotations(0),
                root: self.roots(0),
                velocity: self.root_velocities(),
                contacts: self.contacts(0),
            }],
            first: self.body_velocities(),
            target_rotations: self.target_rotations(),
            target_root: self.roots(self.transition),
        }
    }

    /// What was recorded of them.
    pub(super) fn recorded(&self) -> Recorded<T> {
        let rows = 0..=self.transition;
        Recorded {
            rotations: rows.clone().map(|row| self.rotations(row)).collect(),
            roots: rows.clone().map(|row| self.roots(row)).collect(),
            contacts: rows.map(|row| self.contacts(row)).collect(),
        }
    }

    /// One number of a frame, restored from its standardised value.
    fn number(&self, row: usize, window: usize, number: usize) -> f64 {
        let value = Real::to_f64(self.batch.features[[row, window, number]]);
        value * self.standardisation.std[number] + self.standardisation.mean[number]
    }

    fn vector(&self, row: usize, window: usize, first: usize) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| self.number(row, window, first + axis)))
    }

    fn quaternion(&self, row: usize, window: usize, joint: usize) -> DQuat {
        let rotations = &self.poses.rotations;
        DQuat::from_array(
            [0, 1, 2, 3].map(|k| Real::to_f64(rotations[[row, window, 4 * joint + k]])),
        )
    }

    /// All 154 numbers of a frame, restored.
    pub(super) fn features(&self, row: usize, window: usize) -> Array1<f64> {
        (0..FEATURES)
            .map(|number| self.number(row, window, number))
            .collect()
    }

    /// Local rotations of frame `row`, the root's in the window's frame, `[windows, 96]`.
    fn rotations(&self, row: usize) -> Vec<T> {
        let mut rotations: Vec<T> = self
            .poses
            .rotations
            .index_axis(Axis(0), row)
            .iter()
            .copied()
            .collect();
        for (window, place) in self.places.iter().enumerate() {
            let root = place.turn * self.quaternion(row, window, 0) * place.sign;
            for (slot, x) in rotations[window * ROTATIONS..]
                .iter_mut()
                .zip(root.to_array())
            {
                *slot = T::from_f64(x);
            }
        }
        rotations
    }

    /// The target's rotations, each the nearer of two to k1's, `[windows, 96]`.
    fn target_rotations(&self) -> Vec<T> {
        let start = self.rotations(0);
        let mut target = self.rotations(self.transition);
        for (target, start) in target.chunks_exact_mut(4).zip(start.chunks_exact(4)) {
            let dot: T = target.iter().zip(start).map(|(&a, &b)| a * b).sum();
            if dot < T::zero() {
                target.iter_mut().for_each(|x| *x = -*x);
            }
        }
        target
    }

    /// Root positions of frame `row`, `[windows, 3]`, cm.
    fn roots(&self, row: usize) -> Vec<T> {
        self.vectors(|window, place| {
            place.turn * (self.vector(row, window, ROOT_POSITION.start) - place.origin)
        })
    }

    /// Root velocities of k1, `[windows, 3]`, cm/frame.
    fn root_velocities(&self) -> Vec<T> {
        self.vectors(|window, place| place.turn * self.vector(0, window, ROOT_VELOCITY.start))
    }

    fn vectors(&self, of: impl Fn(usize, &WindowFrame) -> DVec3) -> Vec<T> {
        let places = self.places.iter().enumerate();
        places
            .flat_map(|(window, place)| of(window, place).to_array().map(T::from_f64))
            .collect()
    }

    /// Contact labels of frame `row`, `[windows, 4]`.
    fn contacts(&self, row: usize) -> Vec<T> {
        (0..self.windows)
            .flat_map(|window| CONTACTS.map(move |number| (window, number)))
            .map(|(window, number)| T::from_f64(self.number(row, window, number)))
            .collect()
    }

    /// v^b of k1, standardised, `[windows, 69]`; p^b is in the window's frame already.
    fn body_velocities(&self) -> Vec<T> {
        (0..self.windows)
            .flat_map(|window| BODY_VELOCITIES.map(move |number| [0, window, number]))
            .map(|at| self.batch.features[at])
            .collect()
    }

    /// A place in the window's frame, cm, as one in the world.
    pub(super) fn in_world(&self, window: usize, place: DVec3) -> DVec3 {
        let WindowFrame { origin, turn, .. } = self.places[window];
        origin + turn.conjugate() * place
    }
}
