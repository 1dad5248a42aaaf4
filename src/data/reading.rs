//! From a file's clip to a recording: rate, first frames, skeleton, unit and axis, once, where the
//! file is read.

use super::config::DataConfig;
use super::dataset::{DataError, Recording};
use crate::counted::counted;
use crate::motion::frame_rate::{is_whole, meant_rate};
use crate::motion::oddities::{oddities, swapped_sides};
use crate::motion::{Clip, Conversion, Mapping, Unit, Up, resample};

/// How many clips a warning names.
const NAMED: usize = 3;

/// A recording as it was read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct FileReading {
    /// In cm, with Y up, at the config's rate.
    pub recording: Recording,
    /// How it was brought there beside what a mapping does.
    pub conversion: Conversion,
    /// What is odd about the file, and what of it was recognised and converted, a sentence each.
    pub notices: Vec<String>,
}

impl FileReading {
    /// A clip as its file has it, in the unit and axis and at the rate that the config declares or
    /// that are recognised; on the dance skeleton where there is a mapping.
    ///
    /// # Errors
    /// The clip cannot be resampled or mapped, has too few frames, or the config declares what the
    /// mapping declares otherwise.
    pub fn of(
        clip: Clip,
        mapping: Option<&Mapping>,
        config: &DataConfig,
    ) -> Result<Self, DataError> {
        let (clip, mut notices) = at_its_rate(clip, config)?;
        notices.extend(oddities(&clip));
        let Recording { mut clip, .. } = Recording::new(clip, mapping, config)?;
        // What the mapping declares has been applied with it.
        let (unit, up) = match mapping {
            Some(mapping) => undeclared(mapping, config)?,
            None => (config.unit, config.up),
        };
        let (conversion, recognised) = Conversion::of(&clip, unit, up);
        conversion.apply(&mut clip);
        notices.extend(recognised);
        notices.extend(mapping.and_then(|_| swapped_sides(&clip)));
        Ok(Self {
            recording: Recording::of(clip),
            conversion,
            notices,
        })
    }
}

/// A rig's own clip, as its file has it but for rate, first frames, unit and axis.
#[derive(Debug, Clone, PartialEq)]
pub struct RigReading {
    /// In cm, with Y up, at the config's rate: frame by frame what a [`FileReading`] with the
    /// mapping has on the dance skeleton.
    pub clip: Clip,
    /// How it was brought there.
    pub conversion: Conversion,
}

impl RigReading {
    /// The rig's side of what [`FileReading::of`] reads.
    ///
    /// # Errors
    /// As [`FileReading::of`].
    pub fn of(clip: Clip, mapping: &Mapping, config: &DataConfig) -> Result<Self, DataError> {
        let (clip, _) = at_its_rate(clip, config)?;
        let mut clip = resample(clip, config.fps)?;
        undeclared(mapping, config)?;
        let up = match mapping.up() {
            Up::Auto => config.up,
            declared => declared,
        };
        let unit = match mapping.scale() {
            Some(_) => Unit::Cm,
            None => config.unit,
        };
        let mapped = mapping.without_units().apply(&clip)?;
        let (mut conversion, _) = Conversion::of(&mapped, unit, up);
        conversion.cm *= mapping.scale().unwrap_or(1.0);
        conversion.apply(&mut clip);
        Ok(Self { clip, conversion })
    }
}

/// A clip with the frame time that is declared or that its own one means, without the first frames
/// that the config leaves out; and a notice of such a rate.
///
/// # Errors
/// The declared rate is none, or the clip has too few frames.
pub fn at_its_rate(mut clip: Clip, config: &DataConfig) -> Result<(Clip, Vec<String>), DataError> {
    let notice = set_rate(&mut clip, config.source_fps, config.fps)?;
    skip_frames(&mut clip, config.skip_frames)?;
    Ok((clip, notice.into_iter().collect()))
}

/// Gives a clip the declared rate, or the one that its frame time rounds; a notice of that, or of
/// an odd rate that is brought to `rate`.
fn set_rate(
    clip: &mut Clip,
    declared: Option<f64>,
    rate: f64,
) -> Result<Option<String>, DataError> {
    if let Some(fps) = declared {
        if !(fps.is_finite() && fps > 0.0) {
            return Err(DataError::Config {
                key: "source_fps",
                value: fps.to_string(),
                expected: "a positive number of frames a second",
            });
        }
        clip.frame_time = 1.0 / fps;
        return Ok(None);
    }
    let Some(fps) = meant_rate(clip.frame_time) else {
        let fps = 1.0 / clip.frame_time;
        let other = !is_whole(fps) && !is_whole(fps / rate);
        return Ok(other.then(|| {
            format!(
                "the frame time of {} s is {fps:.3} frames a second: frames at {rate} are made \
                 between its own; data.source_fps in a config gives another rate",
                clip.frame_time
            )
        }));
    };
    let said = clip.frame_time;
    clip.frame_time = 1.0 / fps;
    Ok(Some(format!(
        "the frame time of {said} s is taken for {} frames a second, rounded; data.source_fps in a config gives another rate",
        (fps * 1000.0).round() / 1000.0
    )))
}

fn skip_frames(clip: &mut Clip, frames: usize) -> Result<(), DataError> {
    if frames > 0 && frames >= clip.poses.len() {
        return Err(DataError::Config {
            key: "skip_frames",
            value: format!(
                "{frames}, but {} has {}",
                clip.name,
                counted(clip.poses.len(), "frame")
            ),
            expected: "fewer frames than any clip has",
        });
    }
    clip.poses.drain(..frames);
    Ok(())
}

/// What a mapping leaves to the config to declare.
fn undeclared(mapping: &Mapping, config: &DataConfig) -> Result<(Unit, Up), DataError> {
    let twice = |key, value: String| DataError::DeclaredTwice {
        key,
        value,
        file: mapping.file().into(),
    };
    let unit = match (mapping.has_unit(), config.unit) {
        (false, unit) => unit,
        (true, Unit::Auto) => Unit::Cm,
        (true, unit) => return Err(twice("unit", unit.to_string())),
    };
    let up = match (mapping.has_up(), config.up) {
        (false, up) => up,
        (true, Up::Auto) => Up::Y,
        (true, up) => return Err(twice("up", up.to_string())),
    };
    Ok((unit, up))
}

/// The notices of several clips, one that several have said once.
pub(super) fn grouped<'a>(clips: impl Iterator<Item = (&'a str, &'a [String])>) -> Vec<String> {
    let mut groups: Vec<(&str, Vec<&str>)> = Vec::new();
    for (name, notices) in clips {
        for notice in notices {
            match groups.iter_mut().find(|(known, _)| known == notice) {
                Some((_, names)) => names.push(name),
                None => groups.push((notice, vec![name])),
            }
        }
    }
    let said = |(notice, names): (&str, Vec<&str>)| match names.len() {
        few if few <= NAMED => format!("{}: {notice}", names.join(", ")),
        many => format!(
            "{} and {} other clips: {notice}",
            names[..NAMED].join(", "),
            many - NAMED
        ),
    };
    groups.into_iter().map(said).collect()
}
