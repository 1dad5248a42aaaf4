//! How fast the parts of the body move: `--velocity`, `--velocity-from`, `--velocity-csv`.

use std::path::PathBuf;

use clap::Args;
use ndarray::s;

use super::keyframes::Keyframes;
use super::table;
use crate::motion::features::VELOCITY_FACTORS;
use crate::motion::{PART_NAMES, PARTS};
use crate::synthesis::SequenceRequest;

#[derive(Debug, Args)]
pub struct VelocityArgs {
    /// Velocity factors times a constant: 0.5 for all parts, or parts with one each, such as right_arm=1.5,left_leg=1.5; parts: trunk, left_leg, right_leg,
    /// right_arm, left_arm
    #[arg(long, value_name = "FACTORS", value_parser = parse_gains, allow_hyphen_values = true)]
    velocity: Option<Gains>,
    /// Velocity factors of another clip, from its frame FRAME (0 where left out) on [default: --motion's, else evenly from keyframe to keyframe]
    #[arg(long, value_name = "FILE.bvh[:FRAME]")]
    velocity_from: Option<String>,
    /// Velocity factors from a CSV file with the columns frame,trunk,left_leg,right_leg,right_arm,left_arm (cm/frame), a row for every frame of the
    /// result
    #[arg(long, value_name = "FILE.csv", conflicts_with = "velocity_from")]
    velocity_csv: Option<PathBuf>,
}

/// A constant for each part.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Gains([f64; PARTS]);

fn parse_gains(text: &str) -> Result<Gains, String> {
    let number = |text: &str| match text.trim().parse::<f64>() {
        Ok(value) if (0.0..=1e3).contains(&value) => Ok(value),
        _ => Err(format!(
            "{:?}: expected a number from 0 to 1000",
            text.trim()
        )),
    };
    let mut gains: [Option<f64>; PARTS] = [None; PARTS];
    let mut all = None;
    for entry in text.split(',') {
        match entry.split_once('=') {
            None if all.is_none() => all = Some(number(entry)?),
            None => {
                return Err(format!(
                    "{entry:?}: one constant for all parts was given already"
                ));
            }
            Some((name, value)) => {
                let name = name.trim();
                let part = PART_NAMES
                    .iter()
                    .position(|part| *part == name)
                    .ok_or_else(|| {
                        format!(
                            "{name:?} is no part of the body; parts: {}",
                            PART_NAMES.join(", ")
                        )
                    })?;
                if gains[part].replace(number(value)?).is_some() {
                    return Err(format!("{name} was given twice"));
                }
            }
        }
    }
    Ok(Gains(gains.map(|gain| gain.or(all).unwrap_or(1.0))))
}

impl VelocityArgs {
    /// The request under these controls.
    ///
    /// # Errors
    /// A file that cannot be used or is too short.
    pub fn apply(
        &self,
        mut request: SequenceRequest,
        keyframes: &Keyframes,
    ) -> anyhow::Result<SequenceRequest> {
        let frames = request.frames();
        if let Some(path) = &self.velocity_csv {
            let factors = table::read(path, &PART_NAMES, frames)?;
            if let Some((at, factor)) = factors.indexed_iter().find(|(_, factor)| **factor < 0.0) {
                anyhow::bail!(
                    "{}: {} is {factor} in frame {}; a velocity factor is 0 or more",
                    path.display(),
                    PART_NAMES[at.1],
                    at.0
                );
            }
            request = request.with_velocity_factors(factors)?;
        }
        if let Some(source) = &self.velocity_from {
            let (path, first) = match source.rsplit_once(':') {
                Some((path, frame)) if frame.parse::<usize>().is_ok() => {
                    (PathBuf::from(path), frame.parse()?)
                }
                _ => (PathBuf::from(source), 0),
            };
            let clip = keyframes.clip(&path)?;
            if clip.frames().saturating_sub(first) < frames {
                anyhow::bail!(
                    "{} has {} frames, the result needs velocity factors of {frames} from its frame {first} on; give a longer clip or an earlier frame",
                    path.display(),
                    clip.frames()
                );
            }
            let rows = clip
                .features
                .slice(s![first..first + frames, VELOCITY_FACTORS]);
            request = request.with_velocity_factors(rows.to_owned())?;
        }
        match self.velocity {
            Some(Gains(gains)) => Ok(request.velocity_times(gains)?),
            None => Ok(request),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_hold_for_all_parts_or_for_named_ones() {
        assert_eq!(parse_gains("0.5"), Ok(Gains([0.5; 5])));
        assert_eq!(
            parse_gains("right_arm=1.5, left_leg=2"),
            Ok(Gains([1.0, 2.0, 1.0, 1.5, 1.0]))
        );
        assert_eq!(
            parse_gains("0.5,trunk=1"),
            Ok(Gains([1.0, 0.5, 0.5, 0.5, 0.5]))
        );
        for (bad, message) in [
            ("", "expected a number"),
            ("fast", "expected a number"),
            ("-1", "expected a number"),
            ("head=2", "\"head\" is no part of the body; parts: trunk"),
            ("trunk=x", "expected a number"),
            ("trunk=1,trunk=2", "twice"),
            ("1,2", "already"),
        ] {
            let error = parse_gains(bad).unwrap_err();
            assert!(error.contains(message), "{bad}: {error}");
        }
    }
}
