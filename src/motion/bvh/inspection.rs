//! What is in a BVH document, as text.

use std::fmt;

use super::Bvh;

/// A document whose `Display` says its frames, rate, duration, channels, the range of root heights,
/// and its hierarchy.
pub struct Inspection<'a>(pub &'a Bvh);

impl fmt::Display for Inspection<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let document = self.0;
        let joints = &document.skeleton().joints;
        let ends: usize = joints.iter().map(|joint| joint.end_sites.len()).sum();
        let (frames, frame_time) = (document.frames(), document.frame_time());
        let heights = document
            .to_clip()
            .poses
            .into_iter()
            .filter_map(|pose| pose.translations.first().map(|root| root.y));
        let (lowest, highest) = heights
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
                (low.min(y), high.max(y))
            });
        writeln!(f, "{}", document.name())?;
        writeln!(f, "frames       {frames}")?;
        writeln!(
            f,
            "frame time   {frame_time} s ({:.3} fps)",
            1.0 / frame_time
        )?;
        writeln!(f, "duration     {:.3} s", frames as f64 * frame_time)?;
        writeln!(f, "joints       {} and {ends} End Sites", joints.len())?;
        writeln!(f, "channels     {}", document.motion().ncols())?;
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
