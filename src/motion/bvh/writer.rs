//! From a document to a file's text.

use std::path::Path;

use glam::DVec3;

use super::document::Bvh;
use super::error::BvhError;
use crate::run::replace_file;

/// Decimals of offsets, positions (cm) and angles (degrees); the step from one to the next is far
/// below what a recording resolves.
const DECIMALS: usize = 9;

/// Writes a document: numbers with nine decimals and never an exponent, which some importers
/// refuse; the frame time with as many digits as it takes to read the same number back.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, document: &Bvh) -> Result<(), BvhError> {
    Ok(replace_file(path, document.to_text())?)
}

impl Bvh {
    /// The document as the text of a BVH file. Joints are written depth first, whatever their order
    /// in the skeleton.
    pub fn to_text(&self) -> String {
        let order = self.depth_first();
        let mut text = String::from("HIERARCHY\n");
        let mut open = 0;
        for &(joint, depth) in &order {
            close(&mut text, open, depth);
            open = depth + 1;
            self.write_joint(&mut text, joint, depth);
        }
        close(&mut text, open, 0);
        text += &format!(
            "MOTION\nFrames: {}\nFrame Time: {}\n",
            self.frames(),
            self.frame_time
        );
        let first_columns = self.first_columns();
        for row in self.motion.rows() {
            let columns = order.iter().flat_map(|&(joint, _)| {
                first_columns[joint]..first_columns[joint] + self.channels[joint].len()
            });
            let numbers: Vec<String> = columns.map(|column| number(row[column])).collect();
            text += &numbers.join(" ");
            text.push('\n');
        }
        text
    }

    /// Joints with their depths, each before its children.
    fn depth_first(&self) -> Vec<(usize, usize)> {
        let joints = &self.skeleton.joints;
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); joints.len()];
        let mut waiting: Vec<(usize, usize)> = Vec::new();
        for (index, joint) in joints.iter().enumerate().rev() {
            match joint.parent {
                Some(parent) => children[parent].push(index),
                None => waiting.push((index, 0)),
            }
        }
        let mut order = Vec::with_capacity(joints.len());
        while let Some((joint, depth)) = waiting.pop() {
            order.push((joint, depth));
            waiting.extend(children[joint].iter().map(|&child| (child, depth + 1)));
        }
        order
    }

    /// A joint up to where its children begin.
    fn write_joint(&self, text: &mut String, index: usize, depth: usize) {
        let joint = &self.skeleton.joints[index];
        let indent = "  ".repeat(depth);
        let keyword = if joint.parent.is_none() {
            "ROOT"
        } else {
            "JOINT"
        };
        let channels: String = self.channels[index]
            .iter()
            .map(|channel| format!(" {channel}"))
            .collect();
        *text += &format!(
            "{indent}{keyword} {}\n{indent}{{\n{indent}  OFFSET {}\n",
            joint.name,
            vector(joint.offset)
        );
        *text += &format!(
            "{indent}  CHANNELS {}{channels}\n",
            self.channels[index].len()
        );
        for &end in &joint.end_sites {
            *text += &format!(
                "{indent}  End Site\n{indent}  {{\n{indent}    OFFSET {}\n{indent}  }}\n",
                vector(end)
            );
        }
    }
}

/// Closes the blocks from depth `open` down to `depth`.
fn close(text: &mut String, open: usize, depth: usize) {
    for level in (depth..open).rev() {
        *text += &format!("{}}}\n", "  ".repeat(level));
    }
}

fn vector(vector: DVec3) -> String {
    vector.to_array().map(number).join(" ")
}

fn number(number: f64) -> String {
    let text = format!("{number:.DECIMALS$}");
    match text.strip_prefix('-') {
        // What is rounded to 0 has no sign.
        Some(digits) if digits.bytes().all(|digit| matches!(digit, b'0' | b'.')) => digits.into(),
        _ => text,
    }
}
