//! The columns of motion and music of a model, standardised: fitted to the training part, saved
//! beside the weights, read back.

use glam::DQuat;
use ndarray::{Array1, Array2, aview1};

use super::config::FeaturesConfig;
use super::joints::columns_of;
use super::music::{AudioColumns, heard};
use super::pieces::Piece;
use super::scale::Scale;
use crate::data::Recording;
use crate::models::weights::{SavedWeights, WeightsError};
use crate::models::{ModelError, Statistics};
use crate::motion::{Clip, MotionColumns, NamedRotation};
use crate::music::FeatureSet;

const JOINTS: &str = "motion.joints";
const TURNING: &str = "motion.turning";
const ROTATIONS: &str = "motion.rotations";
const MOTION_MEAN: &str = "motion.mean";
const MOTION_DEVIATION: &str = "motion.deviation";
const FRAME_TIME: &str = "motion.frame_time";
const AUDIO_MEAN: &str = "audio.mean";
const AUDIO_DEVIATION: &str = "audio.deviation";

/// Least deviation of a column by its unit (spec, section 2).
const FLOORS: [(&str, f64); 3] = [("rad", 0.01), ("rad/frame", 0.001), ("cm", 0.05)];
const FLOOR_OF_STEPS: f64 = 0.05;
const AUDIO_FLOOR: f64 = 1e-3;

/// What the numbers of a model are about.
#[derive(Debug, Clone, PartialEq)]
pub struct DanceFeatures {
    /// The columns of motion, D.
    pub columns: MotionColumns,
    pub motion: Scale,
    /// The columns of music, A.
    pub audio: AudioColumns,
    pub audio_scale: Scale,
    /// Seconds from one frame to the next.
    pub frame_time: f64,
}

impl DanceFeatures {
    /// Fitted to training recordings, and with `mirror` to their mirror images.
    ///
    /// # Errors
    /// There is no recording; one lacks music, or has another frame rate than the first.
    pub fn fit(
        recordings: &[Recording],
        config: &FeaturesConfig,
        mirror: bool,
    ) -> Result<Self, ModelError> {
        let clips: Vec<&Clip> = recordings.iter().map(|it| &it.clip).collect();
        let (columns, motion, _) = fit_motion(&clips, config.centre_rotations, mirror)?;
        let heard = recordings.iter().map(|it| heard(it, config.audio));
        let heard = heard.collect::<Result<Vec<_>, _>>()?;
        let audio = AudioColumns::fit(config.audio, recordings, &heard)?;
        let music = heard.iter().map(|heard| audio.columns(heard.view()));
        let music = music.collect::<Result<Vec<_>, _>>()?;
        let frame_time = clips.first().map_or(0.0, |clip| clip.frame_time);
        let features = Self {
            motion,
            audio_scale: Scale::of(&music, &vec![AUDIO_FLOOR; audio.width()]),
            columns,
            audio,
            frame_time: f64::from(frame_time as f32),
        };
        for clip in clips {
            features.check_frame_time(&clip.name, clip.frame_time)?;
        }
        Ok(features)
    }

    /// What it hears of a sound.
    pub fn music_features(&self) -> FeatureSet {
        self.audio.audio().feature_set().unwrap_or_default()
    }

    /// Whether its music is what a data set gives.
    pub fn reads_given_music(&self) -> bool {
        self.audio.audio().feature_set().is_none()
    }

    /// Numbers of a frame: D, A.
    pub fn widths(&self) -> (usize, usize) {
        (self.columns.width(), self.audio.width())
    }

    /// A recording in these numbers.
    ///
    /// # Errors
    /// It lacks joints or music, or has another frame rate.
    pub fn piece(&self, recording: &Recording) -> Result<Piece, ModelError> {
        let clip = &recording.clip;
        self.check_frame_time(&clip.name, clip.frame_time)?;
        let columns = measured(&self.columns, clip)?;
        let heard = heard(recording, self.audio.audio())?;
        Ok(Piece {
            name: clip.name.clone(),
            motion: self.motion.standardise(columns.view()),
            audio: self.standardised_music(&heard)?,
            flips: self.columns.flips(columns.view()),
            mirrored: false,
        })
    }

    /// A piece as seen in a mirror, with its music.
    ///
    /// # Errors
    /// It has other columns.
    pub fn mirrored(&self, piece: &Piece) -> Result<Piece, ModelError> {
        let columns = self.motion.restore(piece.motion.view());
        let image = mirrored(&self.columns, &columns)?;
        Ok(Piece {
            motion: self.motion.standardise(image.view()),
            mirrored: !piece.mirrored,
            ..piece.clone()
        })
    }

    /// Standardised columns `[frames, A]` of what is heard.
    ///
    /// # Errors
    /// It has other numbers than in training.
    pub fn standardised_music(&self, heard: &Array2<f64>) -> Result<Array2<f32>, ModelError> {
        let columns = self.audio.columns(heard.view())?;
        Ok(self.audio_scale.standardise(columns.view()))
    }

    /// # Errors
    /// A frame time is another than that of the training part.
    pub(super) fn check_frame_time(&self, what: &str, frame_time: f64) -> Result<(), ModelError> {
        match (frame_time / self.frame_time - 1.0).abs() < 1e-3 {
            true => Ok(()),
            false => Err(ModelError::Data {
                reason: format!(
                    "{what} has {:.3} frames a second, the model is of {:.3}; bring it to that rate \
                     (data.fps)",
                    1.0 / frame_time,
                    1.0 / self.frame_time
                ),
            }),
        }
    }

    /// As arrays that are saved beside the weights: names of the joints as UTF-8 bytes with a line
    /// end after each; which of them turn; their rotations, quaternions in the order x, y, z, w;
    /// means and deviations.
    pub fn statistics(&self, statistics: Statistics) -> Statistics {
        let joints = || self.columns.turning().iter().chain(self.columns.fixed());
        let names = joints().flat_map(|it| it.joint.bytes().chain([b'\n']));
        let names: Array1<f64> = names.map(f64::from).collect();
        let turning = self.columns.turning().len();
        let turns = (0..joints().count()).map(|joint| f64::from(u8::from(joint < turning)));
        let turns: Array1<f64> = turns.collect();
        let rotations: Array1<f64> = joints().flat_map(|it| it.rotation.to_array()).collect();
        let statistics = statistics
            .with(JOINTS, names.into_dyn())
            .with(TURNING, turns.into_dyn())
            .with(ROTATIONS, rotations.into_dyn())
            .with(MOTION_MEAN, self.motion.mean.clone().into_dyn())
            .with(MOTION_DEVIATION, self.motion.deviation.clone().into_dyn())
            .with(FRAME_TIME, aview1(&[self.frame_time]).to_owned().into_dyn())
            .with(AUDIO_MEAN, self.audio_scale.mean.clone().into_dyn())
            .with(
                AUDIO_DEVIATION,
                self.audio_scale.deviation.clone().into_dyn(),
            );
        self.audio.statistics(statistics)
    }

    /// Those that are saved beside weights.
    ///
    /// # Errors
    /// They are not there, or do not fit together.
    pub fn saved(saved: &SavedWeights, config: &FeaturesConfig) -> Result<Self, WeightsError> {
        let columns = saved_columns(saved)?;
        let audio = AudioColumns::saved(saved, config.audio)?;
        let frame_time = saved.statistic(FRAME_TIME, &[1])?[0];
        if !(frame_time.is_finite() && frame_time > 0.0) {
            return Err(refused(saved, FRAME_TIME, "is no frame time"));
        }
        Ok(Self {
            motion: saved_scale(saved, [MOTION_MEAN, MOTION_DEVIATION], columns.width())?,
            audio_scale: saved_scale(saved, [AUDIO_MEAN, AUDIO_DEVIATION], audio.width())?,
            columns,
            audio,
            frame_time,
        })
    }
}

/// The columns of training clips, and with `mirror` of their mirror images: which they are, their
/// means and deviations, and they themselves, not standardised, `[frames, D]` each. `centre`: see
/// [`columns_of`].
///
/// # Errors
/// There is no clip, or none with a joint.
pub fn fit_motion(
    clips: &[&Clip],
    centre: bool,
    mirror: bool,
) -> Result<(MotionColumns, Scale, Vec<Array2<f64>>), ModelError> {
    let columns = columns_of(clips, centre, mirror)?;
    let raw = clips.iter().map(|clip| measured(&columns, clip));
    let mut raw = raw.collect::<Result<Vec<_>, _>>()?;
    if mirror {
        let images = raw.iter().map(|own| mirrored(&columns, own));
        let images = images.collect::<Result<Vec<_>, _>>()?;
        raw.extend(images);
    }
    let scale = Scale::of(&raw, &floors(&columns));
    Ok((columns, scale, raw))
}

fn measured(columns: &MotionColumns, clip: &Clip) -> Result<Array2<f64>, ModelError> {
    columns
        .measure(clip)
        .map_err(|error| ModelError::data(&error))
}

fn mirrored(columns: &MotionColumns, motion: &Array2<f64>) -> Result<Array2<f64>, ModelError> {
    columns
        .mirrored(motion.view())
        .map_err(|error| ModelError::data(&error))
}

/// Least deviations of the columns, `[D]`.
fn floors(columns: &MotionColumns) -> Vec<f64> {
    let names = columns.names().into_iter();
    let floor = |unit: &str| FLOORS.iter().find(|(of, _)| *of == unit);
    names
        .map(|(_, unit)| floor(unit).map_or(FLOOR_OF_STEPS, |(_, floor)| *floor))
        .collect()
}

fn refused(saved: &SavedWeights, name: &str, problem: &str) -> WeightsError {
    WeightsError::Refused(format!("{}: {name} {problem}", saved.path.display()))
}

fn saved_columns(saved: &SavedWeights) -> Result<MotionColumns, WeightsError> {
    let bytes = saved.statistic_list(JOINTS)?.into_iter().map(|x| x as u8);
    let names = String::from_utf8(bytes.collect());
    let names = names.map_err(|_| refused(saved, JOINTS, "is no text"))?;
    let turns = saved.statistic_list(TURNING)?;
    let rotations = saved.statistic_list(ROTATIONS)?;
    let joints = names.lines().count();
    if turns.len() != joints || rotations.len() != 4 * joints {
        let problem = "is of another number of joints than what else is saved of them";
        return Err(refused(saved, JOINTS, problem));
    }
    let (mut turning, mut fixed) = (Vec::new(), Vec::new());
    for ((name, turns), numbers) in names.lines().zip(turns).zip(rotations.chunks_exact(4)) {
        let rotation = DQuat::from_slice(numbers);
        if !(rotation.is_finite() && rotation.length_squared() > 0.5) {
            return Err(refused(saved, ROTATIONS, "has one that is no rotation"));
        }
        let joint = NamedRotation {
            joint: name.into(),
            rotation: rotation.normalize(),
        };
        match turns > 0.0 {
            true => turning.push(joint),
            false => fixed.push(joint),
        }
    }
    let columns = MotionColumns::new(JOINTS, turning, fixed);
    columns.map_err(|error| refused(saved, JOINTS, &error.to_string()))
}

fn saved_scale(
    saved: &SavedWeights,
    [mean, deviation]: [&str; 2],
    width: usize,
) -> Result<Scale, WeightsError> {
    let list = |name| -> Result<Array1<f64>, WeightsError> {
        Ok(saved.statistic(name, &[width])?.into_iter().collect())
    };
    let scale = Scale {
        mean: list(mean)?,
        deviation: list(deviation)?,
    };
    let is_right = scale.mean.iter().all(|x| x.is_finite())
        && scale.deviation.iter().all(|x| x.is_finite() && *x > 0.0);
    match is_right {
        true => Ok(scale),
        false => Err(refused(
            saved,
            deviation,
            "has a number that is no deviation",
        )),
    }
}
