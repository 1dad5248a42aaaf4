//! The numbers behind a figure.

use serde::Serialize;

use crate::motion::{PART_NAMES, PARTS};

/// One number.
#[derive(Debug, Clone, Serialize)]
struct Number {
    row: String,
    measure: String,
    /// Body part; empty for a number of the whole body.
    part: &'static str,
    /// Empty for a number of the whole motion.
    frame: Option<usize>,
    value: f64,
    unit: &'static str,
}

/// The numbers behind a figure, one a line: the figure's row, measure, body part, frame, value,
/// unit.
///
/// Only series of generated motion stand here frame by frame; of recorded motion and of what is
/// derived from it there are means, so that the files may be passed on where the recordings may
/// not.
#[derive(Debug, Clone, Default)]
pub struct Numbers {
    lines: Vec<Number>,
}

impl Numbers {
    /// One number of a row.
    pub fn add(&mut self, row: &str, measure: impl Into<String>, value: f64, unit: &'static str) {
        self.push(row, measure.into(), ("", None), value, unit);
    }

    /// One number a body part.
    pub fn add_parts(
        &mut self,
        row: &str,
        measure: impl Into<String>,
        values: [f64; PARTS],
        unit: &'static str,
    ) {
        let measure = measure.into();
        for (part, value) in PART_NAMES.into_iter().zip(values) {
            self.push(row, measure.clone(), (part, None), value, unit);
        }
    }

    /// One number of one body part.
    pub fn add_part(&mut self, row: &str, measure: &str, part: usize, value: f64) {
        let place = (PART_NAMES[part], None);
        self.push(row, measure.into(), place, value, "");
    }

    /// A measure of a generated motion, frame by frame from `first` on.
    pub fn add_series(
        &mut self,
        row: &str,
        measure: &str,
        first: usize,
        values: &[f64],
        unit: &'static str,
    ) {
        for (frame, &value) in (first..).zip(values) {
            self.push(row, measure.into(), ("", Some(frame)), value, unit);
        }
    }

    /// Velocity factors of a generated motion, frame by frame.
    pub fn add_factor_series(&mut self, row: &str, factors: &[[f64; PARTS]]) {
        for (frame, factors) in factors.iter().enumerate().skip(1) {
            for (part, &value) in PART_NAMES.into_iter().zip(factors) {
                let measure = "velocity_factor".into();
                self.push(row, measure, (part, Some(frame)), value, "cm/frame");
            }
        }
    }

    fn push(
        &mut self,
        row: &str,
        measure: String,
        (part, frame): (&'static str, Option<usize>),
        value: f64,
        unit: &'static str,
    ) {
        self.lines.push(Number {
            row: row.into(),
            measure,
            part,
            frame,
            value: (value * 1e4).round() / 1e4,
            unit,
        });
    }

    /// The numbers as the content of a CSV file.
    pub(super) fn csv(&self) -> Result<Vec<u8>, csv::Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for line in &self.lines {
            writer.serialize(line)?;
        }
        Ok(writer
            .into_inner()
            .map_err(csv::IntoInnerError::into_error)?)
    }
}
