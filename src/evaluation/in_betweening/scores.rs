//! What is measured of windows, summed: means and shared weights are taken at the end.

use glam::DVec3;

use super::answer::Answer;
use super::posed::PosedFrames;
use super::recorded::RecordedWindow;
use super::{Deviations, Npss, l2p, l2q};
use crate::motion::contact::{CONTACT_LABEL, FootTravel, contacts, foot_travel};
use crate::motion::root_reconstruction::reconstruct_root;
use crate::motion::{ContactRule, Pose};

/// Sums over the windows of a length.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Sums {
    pub windows: usize,
    /// Scored frames.
    pub frames: usize,
    /// L2Q of local rotations and the world's.
    pub l2q: [f64; 2],
    /// L2P of positions relative to the root and in the world.
    pub l2p: [f64; 2],
    /// NPSS of local rotations and the world's.
    pub npss: [Npss; 2],
    /// Distance of the root from the recorded one and from the reconstructed one, cm.
    pub root: [f64; 2],
    /// The same at k2, which is not scored otherwise.
    pub root_at_end: [f64; 2],
    /// Of ankles and toes that stand in the recording.
    pub skate: FootTravel,
    /// Of the foot that is labelled to be in contact.
    pub labelled: FootTravel,
}

impl Sums {
    /// Measures an answer against its window. `threshold`: squared speed below which a recorded
    /// foot joint stands, (cm/frame)^2.
    pub fn of(
        window: &RecordedWindow<'_>,
        answer: &Answer,
        deviations: &Deviations,
        rule: ContactRule,
        threshold: f64,
    ) -> Self {
        let (skeleton, feet) = (&window.of.clip.skeleton, &window.of.feet);
        let place = |pose: &Pose| window.placement.pose(pose);
        let truth = PosedFrames::of(skeleton, window.poses.iter().map(place));
        // Frame 0 is the given k1: steps start from it, nothing else of it counts.
        let shown = window.poses[..1].iter().chain(&answer.poses);
        let shown = PosedFrames::of(skeleton, shown.map(place));
        let frames = 1..window.poses.len() - 1;
        let mut sums = Self {
            windows: 1,
            frames: frames.len(),
            npss: [
                Npss::of(&truth.local[frames.clone()], &shown.local[1..]),
                Npss::of(&truth.global[frames.clone()], &shown.global[1..]),
            ],
            ..Self::default()
        };
        let feet_joints = rule.joints(feet);
        let labels = window.contacts.iter().map(|foot| foot.one_hot());
        let labels: Vec<[f64; 2]> = labels.collect();
        let relative: Vec<Vec<DVec3>> = (0..truth.world.len()).map(|t| truth.relative(t)).collect();
        let soles = relative
            .iter()
            .map(|joints| feet_joints.map(|it| joints[it]));
        let soles: Vec<[DVec3; 2]> = soles.collect();
        let rebuilt = reconstruct_root(&soles, &labels, truth.world[0][0]);
        for frame in frames {
            let distances = [
                l2q(&truth.local[frame], &shown.local[frame]),
                l2q(&truth.global[frame], &shown.global[frame]),
            ];
            add(&mut sums.l2q, distances);
            let distances = [
                l2p(&relative[frame], &shown.relative(frame), deviations),
                l2p(&truth.world[frame], &shown.world[frame], deviations),
            ];
            add(&mut sums.l2p, distances);
            let root = shown.world[frame][0];
            let wanted = [truth.world[frame][0], rebuilt[frame]];
            add(&mut sums.root, wanted.map(|wanted| root.distance(wanted)));
            let foot = feet_joints[window.contacts[frame - 1].index()];
            let [before, now] = [frame - 1, frame].map(|frame| shown.world[frame][foot]);
            sums.labelled.step(before, now);
        }
        let end = window.poses.len() - 1;
        let root = window.placement.point(answer.last_root);
        let wanted = [truth.world[end][0], rebuilt[end]];
        sums.root_at_end = wanted.map(|wanted| root.distance(wanted));

        let [right, left] = [0, 1];
        let joints = [
            feet.ankles[left],
            feet.toes[left],
            feet.ankles[right],
            feet.toes[right],
        ];
        let stands = contacts(&truth.world[..end], joints, threshold).into_iter();
        let stands: Vec<[bool; 4]> = stands
            .map(|labels| labels.map(|label| label > CONTACT_LABEL))
            .collect();
        sums.skate = foot_travel(&shown.world, joints, &stands);
        sums
    }

    /// With those of another window.
    pub fn add(&mut self, other: &Self) {
        self.windows += other.windows;
        self.frames += other.frames;
        add(&mut self.l2q, other.l2q);
        add(&mut self.l2p, other.l2p);
        add(&mut self.root, other.root);
        add(&mut self.root_at_end, other.root_at_end);
        for (npss, other) in self.npss.iter_mut().zip(other.npss) {
            npss.add(other);
        }
        self.skate.add(other.skate);
        self.labelled.add(other.labelled);
    }
}

fn add(sums: &mut [f64; 2], numbers: [f64; 2]) {
    for (sum, number) in sums.iter_mut().zip(numbers) {
        *sum += number;
    }
}
