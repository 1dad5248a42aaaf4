//! A few points that a root goes through, "x,z; x,z" or "x,y,z; x,y,z".

use std::str::FromStr;

use glam::DVec3;
use ndarray::Array2;

use super::{Speed, smooth_curve};
use crate::counted::counted;
use crate::synthesis::SequenceRequest;

/// Numbers beyond this are mistakes: 10 km in cm.
const FARTHEST: f64 = 1e6;

/// Points of a drawn trajectory, cm.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// y is 0 where no heights were given.
    pub points: Vec<DVec3>,
    pub with_heights: bool,
}

impl FromStr for Points {
    /// What was expected, and where.
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut points = Vec::new();
        let mut columns = None;
        for (index, point) in text.split(';').enumerate() {
            let numbers: Vec<f64> = point
                .split(',')
                .map(|number| {
                    let number = number.trim();
                    let value: f64 = number
                        .parse()
                        .map_err(|_| format!("point {}: {number:?} is no number", index + 1))?;
                    if value.abs() <= FARTHEST {
                        Ok(value)
                    } else {
                        Err(format!(
                            "point {}: {number} is not between -1000000 and 1000000 cm",
                            index + 1
                        ))
                    }
                })
                .collect::<Result<_, String>>()?;
            if *columns.get_or_insert(numbers.len()) != numbers.len() {
                return Err(format!(
                    "point {} has {}, those before it have another count",
                    index + 1,
                    counted(numbers.len(), "number")
                ));
            }
            points.push(match numbers[..] {
                [x, z] => DVec3::new(x, 0.0, z),
                [x, y, z] => DVec3::new(x, y, z),
                _ => {
                    return Err(format!(
                        "point {} has {}; expected x,z or x,y,z",
                        index + 1,
                        counted(numbers.len(), "number")
                    ));
                }
            });
        }
        if points.len() < 2 {
            return Err("expected two points or more, such as \"0,0; 100,50; 150,200\"".into());
        }
        Ok(Self {
            points,
            with_heights: columns == Some(3),
        })
    }
}

impl SequenceRequest {
    /// A root trajectory along a smooth curve through points, from the first frame to the last,
    /// `[F, 3]`, cm; the heights of the request where the points have none.
    pub fn trajectory_through(&self, points: &Points, speed: &Speed) -> Array2<f64> {
        let mut trajectory = self.root_trajectory.clone();
        let path = smooth_curve(&points.points, trajectory.nrows(), speed);
        for (mut row, point) in trajectory.rows_mut().into_iter().zip(path) {
            (row[0], row[2]) = (point.x, point.z);
            if points.with_heights {
                row[1] = point.y;
            }
        }
        trajectory
    }

    /// How fast the request's root goes along the floor, from each frame to the next.
    pub fn own_speed(&self) -> Speed {
        let rows = &self.root_trajectory;
        let step = |frame: usize, axis: usize| rows[[frame, axis]] - rows[[frame - 1, axis]];
        let (x, z) = (0, 2);
        let steps = 1..rows.nrows();
        Speed::Like(
            steps
                .map(|frame| step(frame, x).hypot(step(frame, z)))
                .collect(),
        )
    }
}
