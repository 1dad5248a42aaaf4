//! Keyframes by the frames of their own file, whatever its rate: each becomes a whole frame at the
//! data's rate.

use super::SynthesisError;
use crate::motion::Clip;
use crate::motion::rig::{nearest_frames, spread};

/// A clip whose keyframes stand on whole frames.
pub(super) struct OnWholeFrames {
    /// At the rate that was asked for.
    pub clip: Clip,
    /// Its frames that are the keyframes.
    pub frames: Vec<usize>,
    /// When they are in the result, in frames of the file, from 0.
    pub own_times: Vec<usize>,
}

impl OnWholeFrames {
    /// A file's clip at `fps` frames a second with its frames `rows` (ascending) on whole ones.
    /// With `own_times`, the rows are as many frames of the file apart as these say, and nothing of
    /// the file is left but them and what is evenly between: poses made by hand.
    ///
    /// # Errors
    /// A row that the file does not have.
    pub fn of(
        clip: Clip,
        rows: &[usize],
        own_times: Option<Vec<usize>>,
        fps: f64,
    ) -> Result<Self, SynthesisError> {
        let last = clip.poses.len().saturating_sub(1);
        if let Some(&frame) = rows.iter().find(|&&row| row > last) {
            return Err(SynthesisError::NoFrame {
                clip: clip.name,
                frame,
                last,
                fps: 1.0 / clip.frame_time,
            });
        }
        let (frame_time, ratio) = (1.0 / fps, clip.frame_time * fps);
        if let Some(own_times) = own_times {
            let frames = nearest_frames(&own_times, ratio);
            return Ok(Self {
                clip: spread(clip, rows, &frames, frame_time),
                frames,
                own_times,
            });
        }
        let mut kept = rows.to_vec();
        kept.extend([0, last]);
        kept.sort_unstable();
        kept.dedup();
        let places = nearest_frames(&kept, ratio);
        let at = |row: &usize| places[kept.partition_point(|it| it < row)];
        let first = rows.first().copied().unwrap_or(0);
        Ok(Self {
            frames: rows.iter().map(at).collect(),
            own_times: rows.iter().map(|row| row - first).collect(),
            clip: spread(clip, &kept, &places, frame_time),
        })
    }
}
