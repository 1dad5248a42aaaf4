//! Forward kinematics: where the joints of a hierarchy are, from the rotation of each in its
//! parent's frame.
//!
//! ```text
//! q [rows, 4 J] quaternions (x, y, z, w), o [bodies, 3 J] offsets in the parent's frame
//! -> p [rows, 3 J]; row r is of body r mod bodies and for joint j with parent k
//! (of a root: k is the world, R the identity, p_k = 0)
//! p_j = p_k + R(Q_k) o_j, Q_j = Q_k q_j (Hamilton product),
//! R(u, w) v = v + 2 w (u x v) + 2 u x (u x v);
//! from the last joint to the first, g = dp_j: dp_k += g, do_j = R(Q_k)^T g,
//! dQ_k += the gradient of g . R(Q_k) o_j and dQ_j conj(q_j), dq_j = conj(Q_k) dQ_j.
//! ```

use super::{argument_error, shapes_error};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var, Workspace};

const NAME: &str = "forward_kinematics";

type Vector<T> = [T; 3];
type Quaternion<T> = [T; 4];

struct ForwardKinematics<T> {
    rotations: Var,
    offsets: Var,
    parents: Vec<Option<usize>>,
    /// Q of every joint, `[rows, 4 J]`.
    world: Vec<T>,
}

impl<T: Real> Operation<T> for ForwardKinematics<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let joints = self.parents.len();
        let (local, offsets) = (context.values(self.rotations), context.values(self.offsets));
        let (rows, bodies) = (dy.len() / (3 * joints), offsets.len() / (3 * joints));
        let mut dlocal = context.take(local.len());
        let mut doffsets = context.take(offsets.len());
        doffsets.fill(T::zero());
        let mut dworld = context.take(4 * joints);
        for row in 0..rows {
            dworld.fill(T::zero());
            let local = &local[row * 4 * joints..];
            let world = &self.world[row * 4 * joints..];
            let body = (row % bodies) * 3 * joints;
            let dp = &mut dy[row * 3 * joints..(row + 1) * 3 * joints];
            for (joint, &parent) in self.parents.iter().enumerate().rev() {
                let g: Vector<T> = at(dp, joint);
                let dq: Quaternion<T> = at(&dworld, joint);
                let (g_offset, g_local) = match parent {
                    None => (g, dq),
                    Some(parent) => {
                        let above: Quaternion<T> = at(world, parent);
                        let offset: Vector<T> = at(&offsets[body..], joint);
                        add(&mut dp[3 * parent..], g);
                        let turned = rotation_gradient(above, offset, g);
                        add(&mut dworld[4 * parent..], turned);
                        let own: Quaternion<T> = at(local, joint);
                        add(&mut dworld[4 * parent..], product(dq, conjugate(own)));
                        (rotate(conjugate(above), g), product(conjugate(above), dq))
                    }
                };
                add(&mut doffsets[body + 3 * joint..], g_offset);
                let at = row * 4 * joints + 4 * joint;
                dlocal[at..at + 4].copy_from_slice(&g_local);
            }
        }
        for (input, gradient) in [(self.rotations, &dlocal), (self.offsets, &doffsets)] {
            if let Some(target) = context.target(input) {
                target.add(|i| gradient[i]);
            }
        }
        for buffer in [dlocal, doffsets, dworld] {
            context.give(buffer);
        }
    }

    fn release(&mut self, workspace: &mut Workspace<T>) {
        workspace.give(std::mem::take(&mut self.world));
    }
}

impl<T: Real> Tape<'_, T> {
    /// Positions `[rows, 3 J]` of J joints from unit quaternions (x, y, z, w)
    /// `rotations [rows, 4 J]` and `offsets [bodies, 3 J]`, both in the parent's frame; `parents`
    /// has J entries, a parent before its children. The rows run through the bodies again and
    /// again.
    ///
    /// # Errors
    /// Shapes that do not fit; a parent that does not stand before its child.
    pub fn forward_kinematics(
        &mut self,
        rotations: Var,
        offsets: Var,
        parents: &[Option<usize>],
    ) -> Result<Var, AutogradError> {
        self.own(NAME, &[rotations, offsets])?;
        let joints = parents.len();
        let before = |(joint, parent): (usize, &Option<usize>)| parent.is_none_or(|p| p < joint);
        if joints == 0 || !parents.iter().enumerate().all(before) {
            let (shape, argument) = (self.shape(rotations), format!("parents {parents:?}"));
            let expected = "at least one joint, each after its parent";
            return Err(argument_error(NAME, shape, argument, expected));
        }
        let (left, right) = (self.shape(rotations), self.shape(offsets));
        let (rows, bodies) = match (left, right) {
            (&[rows, four], &[bodies, three])
                if four == 4 * joints
                    && three == 3 * joints
                    && (rows == 0 || (bodies > 0 && rows.is_multiple_of(bodies))) =>
            {
                (rows, bodies)
            }
            _ => {
                let expected = "rotations [n * bodies, 4 J] and offsets [bodies, 3 J]";
                return Err(shapes_error(NAME, left, right, expected));
            }
        };
        let mut positions = self.take(rows * 3 * joints);
        let mut world = self.take(rows * 4 * joints);
        let (local, all_offsets) = (self.values(rotations), self.values(offsets));
        for row in 0..rows {
            let local = &local[row * 4 * joints..];
            let offsets = &all_offsets[(row % bodies) * 3 * joints..];
            let positions = &mut positions[row * 3 * joints..(row + 1) * 3 * joints];
            let world = &mut world[row * 4 * joints..(row + 1) * 4 * joints];
            for (joint, &parent) in parents.iter().enumerate() {
                let (own, offset): (Quaternion<T>, Vector<T>) =
                    (at(local, joint), at(offsets, joint));
                let (position, rotation) = match parent {
                    None => (offset, own),
                    Some(parent) => {
                        let above: Quaternion<T> = at(world, parent);
                        let mut position = rotate(above, offset);
                        add(&mut position, at::<T, 3>(positions, parent));
                        (position, product(above, own))
                    }
                };
                positions[3 * joint..3 * joint + 3].copy_from_slice(&position);
                world[4 * joint..4 * joint + 4].copy_from_slice(&rotation);
            }
        }
        // Without a gradient to take the operation is not kept.
        if !self.needs_gradient(rotations) && !self.needs_gradient(offsets) {
            self.give(std::mem::take(&mut world));
        }
        let (inputs, shape) = ([rotations, offsets], [rows, 3 * joints]);
        let operation = || ForwardKinematics {
            rotations,
            offsets,
            parents: parents.to_vec(),
            world,
        };
        Ok(self.put(NAME, &inputs, &shape, positions, operation))
    }
}

/// Number `index` of vectors of W numbers in a row.
fn at<T: Real, const W: usize>(values: &[T], index: usize) -> [T; W] {
    std::array::from_fn(|i| values[W * index + i])
}

/// Adds to the first W numbers.
fn add<T: Real, const W: usize>(values: &mut [T], x: [T; W]) {
    values.iter_mut().zip(x).for_each(|(v, x)| *v += x);
}

fn cross<T: Real>(a: Vector<T>, b: Vector<T>) -> Vector<T> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn dot<T: Real>(a: Vector<T>, b: Vector<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn conjugate<T: Real>([x, y, z, w]: Quaternion<T>) -> Quaternion<T> {
    [-x, -y, -z, w]
}

/// a b, the rotation b followed by a.
fn product<T: Real>(a: Quaternion<T>, b: Quaternion<T>) -> Quaternion<T> {
    [
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] + a[1] * b[3] + a[2] * b[0] - a[0] * b[2],
        a[3] * b[2] + a[2] * b[3] + a[0] * b[1] - a[1] * b[0],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

/// R(q) v; R(conj(q)) is the transpose of R(q).
fn rotate<T: Real>([x, y, z, w]: Quaternion<T>, v: Vector<T>) -> Vector<T> {
    let u = [x, y, z];
    let across = cross(u, v);
    let twice = cross(u, across);
    std::array::from_fn(|i| v[i] + (w * across[i] + twice[i]) + (w * across[i] + twice[i]))
}

/// The gradient of g . R(q) v with respect to q.
fn rotation_gradient<T: Real>(
    [x, y, z, w]: Quaternion<T>,
    v: Vector<T>,
    g: Vector<T>,
) -> Quaternion<T> {
    let u = [x, y, z];
    let (uv, gu, gv, vg) = (dot(u, v), dot(g, u), dot(g, v), cross(v, g));
    let half = [0, 1, 2].map(|i| w * vg[i] + g[i] * uv + v[i] * gu - (u[i] + u[i]) * gv);
    let half_w = dot(g, cross(u, v));
    [
        half[0] + half[0],
        half[1] + half[1],
        half[2] + half[2],
        half_w + half_w,
    ]
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn};

    /// Trees of drawn parents, two roots among them, on quaternions that need not have length 1.
    pub fn cases() -> Cases {
        let parents = prop::collection::vec(any::<Option<prop::sample::Index>>(), 1..5);
        let inputs = (parents, 0usize..3, 1usize..3);
        drawn(inputs, |(drawn, frames, bodies), seed| {
            let parents: Vec<Option<usize>> = drawn
                .iter()
                .enumerate()
                .map(|(joint, parent)| parent.filter(|_| joint > 0).map(|p| p.index(joint)))
                .collect();
            let joints = parents.len();
            let shapes: [&[usize]; 2] = [&[frames * bodies, 4 * joints], &[bodies, 3 * joints]];
            case(&shapes, seed, 0.0, move |tape, v| {
                let positions = tape.forward_kinematics(v[0], v[1], &parents)?;
                // Deep trees of long quaternions grow large.
                Ok(tape.affine(positions, 0.01, 0.0))
            })
        })
    }
}
