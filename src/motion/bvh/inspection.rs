//! What is in a BVH document, as text.

use std::fmt;

use super::{Axis, Bvh};
use crate::counted::counted;
use crate::motion::frame_rate::meant_rate;
use crate::motion::{Measured, Unit, Up};

/// A document whose `Display` says its frames, rate, duration, channels, unit and upward axis, the
/// range of root heights, and its hierarchy; lengths in the file's own unit.
pub struct Inspection<'a> {
    pub document: &'a Bvh,
    /// The unit that is declared, or else recognised.
    pub unit: Unit,
    /// Likewise the axis.
    pub up: Up,
}

impl Inspection<'_> {
    fn unit(&self, measured: &Measured) -> String {
        let tall = measured.height.map_or_else(
            || "no head and feet by name".into(),
            |height| format!("the body is {height:.3} tall"),
        );
        match (self.unit, measured.unit) {
            (Unit::Auto, Some(unit)) => format!("{unit}, as {tall}"),
            (Unit::Auto, None) => format!("not recognised, taken as cm ({tall})"),
            (declared, _) => format!("{declared}, as declared ({tall})"),
        }
    }

    fn axis(&self, measured: &Measured) -> (Axis, String) {
        let as_it_is = match measured.along {
            Some(along) => format!("though the body is along {along} in most frames"),
            None => "as the body stands".into(),
        };
        match (self.up, measured.up) {
            (Up::Z, _) => (Axis::Z, "Z, as declared".into()),
            (Up::Y, _) => (Axis::Y, "Y, as declared".into()),
            (Up::Auto, Some(Up::Z)) => (Axis::Z, format!("Z, {as_it_is}")),
            (Up::Auto, Some(_)) => (Axis::Y, format!("Y, {as_it_is}")),
            (Up::Auto, None) => (Axis::Y, "not recognised, taken as Y".into()),
        }
    }
}

impl fmt::Display for Inspection<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let document = self.document;
        let joints = &document.skeleton().joints;
        let ends: usize = joints.iter().map(|joint| joint.end_sites.len()).sum();
        let (frames, frame_time) = (document.frames(), document.frame_time());
        let clip = document.to_clip();
        let measured = Measured::of(&clip);
        let (axis, up) = self.axis(&measured);
        let heights = clip
            .poses
            .iter()
            .filter_map(|pose| pose.translations.first())
            .map(|root| root[axis.index()]);
        let (lowest, highest) = heights
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
                (low.min(y), high.max(y))
            });
        writeln!(f, "{}", document.name())?;
        writeln!(f, "frames       {frames}")?;
        writeln!(
            f,
            "frame time   {frame_time} s ({:.3} fps{})",
            1.0 / frame_time,
            meant_rate(frame_time).map_or_else(String::new, |fps| format!(", taken as {fps:.3}"))
        )?;
        writeln!(f, "duration     {:.3} s", frames as f64 * frame_time)?;
        let ends = counted(ends, "End Site");
        writeln!(f, "joints       {} and {ends}", joints.len())?;
        writeln!(f, "channels     {}", document.motion().ncols())?;
        writeln!(f, "unit         {}", self.unit(&measured))?;
        writeln!(f, "up           {up}")?;
        writeln!(f, "root height  {lowest:.3} to {highest:.3}")?;
        writeln!(f, "hierarchy")?;
        let mut depths: Vec<usize> = Vec::with_capacity(joints.len());
        for (joint, channels) in joints.iter().zip(document.channels()) {
            let depth = joint.parent.map_or(1, |parent| depths[parent] + 1);
            depths.push(depth);
            let channels: Vec<String> = channels.iter().map(ToString::to_string).collect();
            let [x, y, z] = joint.offset.to_array();
            writeln!(
                f,
                "{}{}  offset {x} {y} {z}  [{}]",
                "  ".repeat(depth),
                joint.name,
                channels.join(" ")
            )?;
            for end in &joint.end_sites {
                writeln!(
                    f,
                    "{}End Site  offset {} {} {}",
                    "  ".repeat(depth + 1),
                    end.x,
                    end.y,
                    end.z
                )?;
            }
        }
        Ok(())
    }
}
