//! The encoder: motion and music each by a Transformer, both by a third (paper, section 4.1; spec,
//! section 4).

use rand::Rng;

use super::config::{CrossPositions, Head, ValleperezConfig};
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::nn::{
    Initialiser, Place, PositionedSizes, PositionedTransformer, Positions, TransformerSizes,
};

/// Motion encoder, audio encoder, cross-modal encoder.
#[derive(Debug, Clone)]
pub struct CrossModalEncoder {
    motion: PositionedTransformer,
    audio: PositionedTransformer,
    cross: PositionedTransformer,
    motion_tokens: usize,
    audio_tokens: usize,
    width: usize,
    frames: usize,
}

/// Tokens of one modality at the frames from `first` on.
fn places(first: i64, count: usize, modality: usize) -> impl Iterator<Item = Place> {
    (first..)
        .take(count)
        .map(move |time| Place { time, modality })
}

impl CrossModalEncoder {
    /// Adds `motion_encoder`, `audio_encoder` and `cross_encoder` for D numbers of motion and A of
    /// music a frame.
    ///
    /// # Errors
    /// Heads that do not divide the width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        config: &ValleperezConfig,
        motion: usize,
        audio: usize,
    ) -> Result<Self, AutogradError> {
        let width = config.width;
        let (known, heard) = (config.motion_context, config.audio_frames());
        let sizes = |inputs, outputs, layers| PositionedSizes {
            inputs,
            outputs,
            layers,
            layer: TransformerSizes {
                width,
                heads: config.heads,
                feed_forward: config.feed_forward,
                dropout: 0.0,
            },
            zero_output: false,
        };
        // Frame 0 is the first that is predicted.
        let of_motion: Vec<Place> = places(-(known as i64), known, 0).collect();
        let of_audio: Vec<Place> = places(-(config.audio_past as i64), heard, 0).collect();
        let of_both: Vec<Place> = match config.cross_positions {
            CrossPositions::Index => places(0, known + heard, 0).collect(),
            CrossPositions::Aligned => {
                let audio = of_audio.iter().map(|place| Place {
                    modality: 1,
                    ..*place
                });
                of_motion.iter().copied().chain(audio).collect()
            }
        };
        let outputs = match config.head {
            Head::Flow => width,
            Head::Deterministic => motion,
        };
        // The authors' program has no table in the cross-modal encoder.
        let of_cross = match config.positions {
            Positions::Table => Positions::None,
            others => others,
        };
        let mut stack = |name: &str, sizes, positions, places: &[Place]| {
            PositionedTransformer::new(init, name, sizes, positions, places)
        };
        Ok(Self {
            motion: stack(
                "motion_encoder",
                sizes(motion, width, config.motion_layers),
                config.positions,
                &of_motion,
            )?,
            audio: stack(
                "audio_encoder",
                sizes(audio, width, config.audio_layers),
                config.positions,
                &of_audio,
            )?,
            cross: stack(
                "cross_encoder",
                sizes(width, outputs, config.cross_layers),
                of_cross,
                &of_both,
            )?,
            motion_tokens: known,
            audio_tokens: heard,
            width,
            frames: config.predicted_frames,
        })
    }

    /// h: the first N outputs of the cross-modal encoder, `[windows * N, outputs]`, of
    /// `motion [windows * motion_context, D]` and `audio [windows * (past + future), A]`.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        motion: Var,
        audio: Var,
    ) -> Result<Var, AutogradError> {
        let motion = self.motion.forward(tape, motion, self.motion_tokens)?;
        let audio = self.audio.forward(tape, audio, self.audio_tokens)?;
        let windows = tape.shape(motion)[0] / self.motion_tokens;
        let motion = tape.reshape(motion, &[windows, self.motion_tokens * self.width])?;
        let audio = tape.reshape(audio, &[windows, self.audio_tokens * self.width])?;
        let both = tape.concat(&[motion, audio])?;
        let tokens = self.motion_tokens + self.audio_tokens;
        let both = tape.reshape(both, &[windows * tokens, self.width])?;
        self.cross.forward(tape, both, self.frames)
    }
}
