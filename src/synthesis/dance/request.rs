//! What is asked for, whichever of it a model reads.

use std::path::PathBuf;

use crate::models::generator::{Condition, Needs};
use crate::synthesis::controls::{TrajectoryControls, VelocityControls};
use crate::synthesis::keyframes::KeyframeChoice;
use crate::synthesis::song::SongRequest;
use crate::synthesis::{ContactSequence, SynthesisOptions};

/// A dance as it is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct DanceRequest {
    /// The name of the result.
    pub name: String,
    /// Keyframes, or the key poses of a dance to a song.
    pub keyframes: KeyframeChoice,
    /// Frames from each keyframe to the next: none for their own distances, one for all, or one for
    /// each.
    pub lengths: Vec<u32>,
    pub trajectory: TrajectoryControls,
    pub velocity: VelocityControls,
    pub contacts: Option<ContactSequence>,
    /// What is drawn follows from it.
    pub seed: u64,
    pub song: Option<SongRequest>,
    pub options: SynthesisOptions,
}

impl DanceRequest {
    /// The files that it names.
    pub fn files(&self) -> Vec<&PathBuf> {
        let mut files = self.keyframes.files();
        files.extend(self.trajectory.table.iter().chain(&self.velocity.table));
        files.extend(self.song.iter().flat_map(SongRequest::files));
        files.extend(self.velocity.from.iter().map(|from| &from.file));
        files
    }

    /// What is asked for beside poses that a model with these needs does not read.
    pub(super) fn unread(&self, needs: &Needs) -> Vec<Condition> {
        let contacts = self.contacts.as_ref().map(|_| Condition::Contacts);
        let behind_seed = self.song.is_some() && !self.keyframes.further.is_empty();
        let key_poses = behind_seed.then_some(Condition::KeyPoses);
        let asked = [
            self.trajectory.asked(),
            self.velocity.asked(),
            contacts,
            key_poses,
        ];
        let asked = asked.into_iter().flatten();
        asked.filter(|&it| !needs.reads(it)).collect()
    }

    /// Warnings of what is asked for in vain of a model for which poses alone matter.
    pub(super) fn left_out(&self, needs: &Needs) -> Vec<String> {
        let unread = self.unread(needs).into_iter().map(Condition::title);
        let moved = self.trajectory.moves_keyframes();
        let moved =
            moved.then_some("--turn and --scale, which move keyframes with their trajectory");
        let in_vain = unread.chain(moved);
        in_vain
            .map(|what| format!("the model does not read {what}: left out"))
            .collect()
    }
}
