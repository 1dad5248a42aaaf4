//! What a figure leaves: an SVG with its caption, its numbers as CSV beside it.

use std::path::Path;

use anyhow::Context as _;
use serde::Serialize;

use crate::motion::{PART_NAMES, PARTS};
use crate::report::MotionFigure;
use crate::run::replace_file;

/// A figure and the numbers behind it.
pub struct Figure {
    /// File name without extension, such as `figure_8`.
    pub name: &'static str,
    /// One line: what the figure shows and what was measured.
    pub caption: String,
    pub svg: String,
    pub numbers: Numbers,
}

impl Figure {
    /// A figure of dancers, with its caption.
    ///
    /// # Errors
    /// There is nothing that could be drawn.
    pub fn of_dancers(
        name: &'static str,
        drawing: MotionFigure,
        numbers: Numbers,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            name,
            svg: drawing.svg()?,
            caption: drawing.caption,
            numbers,
        })
    }

    /// Writes the SVG and the CSV.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let path = |extension: &str| folder.join(self.name).with_extension(extension);
        replace_file(&path("svg"), self.svg.as_bytes())?;
        replace_file(&path("csv"), &self.numbers.csv()?)?;
        Ok(())
    }
}

/// One number.
#[derive(Debug, Clone, Serialize)]
struct Number {
    row: String,
    measure: &'static str,
    /// Body part; empty for a number of the whole body.
    part: &'static str,
    /// Empty for a number of the whole motion.
    frame: Option<usize>,
    value: f64,
    unit: &'static str,
}

/// The numbers behind a figure, one a line: the figure's row, measure, body part, frame, value, unit.
///
/// Only series of generated motion stand here frame by frame; of recorded motion and of what is derived from it there are means, so that the files may be
/// passed on where the recordings may not.
#[derive(Debug, Clone, Default)]
pub struct Numbers {
    lines: Vec<Number>,
}

impl Numbers {
    /// One number of a row.
    pub fn add(&mut self, row: &str, measure: &'static str, value: f64, unit: &'static str) {
        self.push(row, measure, "", None, value, unit);
    }

    /// One number a body part.
    pub fn add_parts(
        &mut self,
        row: &str,
        measure: &'static str,
        values: [f64; PARTS],
        unit: &'static str,
    ) {
        for (part, value) in values.into_iter().enumerate() {
            self.add_part(row, measure, part, value, unit);
        }
    }

    /// One number of one body part.
    pub fn add_part(
        &mut self,
        row: &str,
        measure: &'static str,
        part: usize,
        value: f64,
        unit: &'static str,
    ) {
        self.push(row, measure, PART_NAMES[part], None, value, unit);
    }

    /// Velocity factors of a generated motion, frame by frame.
    pub fn add_factor_series(&mut self, row: &str, factors: &[[f64; PARTS]]) {
        for (frame, factors) in factors.iter().enumerate().skip(1) {
            for (part, &value) in PART_NAMES.into_iter().zip(factors) {
                let measure = "velocity_factor";
                self.push(row, measure, part, Some(frame), value, "cm/frame");
            }
        }
    }

    fn push(
        &mut self,
        row: &str,
        measure: &'static str,
        part: &'static str,
        frame: Option<usize>,
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

    fn csv(&self) -> anyhow::Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for line in &self.lines {
            writer.serialize(line)?;
        }
        writer.into_inner().context("the numbers of a figure")
    }
}

/// The page that shows all figures with their captions, Markdown.
pub fn index(figures: &[Figure], subject: &str) -> String {
    let mut text = format!("# The paper's figures\n\n{subject}\n");
    for Figure { name, caption, .. } in figures {
        let caption = caption.replace('[', "(").replace(']', ")");
        text +=
            &format!("\n![{caption}]({name}.svg)\n\n{caption} Numbers: [{name}.csv]({name}.csv)\n");
    }
    text
}
