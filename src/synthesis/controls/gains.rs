//! What velocity factors are multiplied by: "0.5" for all parts of the body, or
//! "right_arm=1.5,left_leg=1.5".

use std::str::FromStr;

use crate::motion::{PART_NAMES, PARTS};

/// A constant for each part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains(pub [f64; PARTS]);

impl FromStr for Gains {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
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
        Ok(Self(gains.map(|gain| gain.or(all).unwrap_or(1.0))))
    }
}
