//! `keydance bvh`: reads a BVH file, prints what is in it.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::motion::bvh::{self, Bvh};

#[derive(Debug, Args)]
pub struct BvhArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Print hierarchy, frames, rate, duration, channels and the range of root heights
    Inspect {
        /// BVH file
        file: PathBuf,
    },
}

/// # Errors
/// The file cannot be read as BVH, or the output cannot be written.
pub fn run(args: BvhArgs) -> anyhow::Result<()> {
    let Action::Inspect { file } = args.action;
    let document = bvh::read(&file)?;
    Ok(inspect(&document, &mut io::stdout().lock())?)
}

fn inspect(document: &Bvh, out: &mut impl Write) -> io::Result<()> {
    let joints = &document.skeleton().joints;
    let ends: usize = joints.iter().map(|joint| joint.end_sites.len()).sum();
    let (frames, frame_time) = (document.frames(), document.frame_time());
    let heights = document
        .to_clip()
        .poses
        .into_iter()
        .filter_map(|pose| pose.translations.first().map(|root| root.y));
    let (lowest, highest) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
        (low.min(y), high.max(y))
    });
    writeln!(out, "{}", document.name())?;
    writeln!(out, "frames       {frames}")?;
    writeln!(
        out,
        "frame time   {frame_time} s ({:.3} fps)",
        1.0 / frame_time
    )?;
    writeln!(out, "duration     {:.3} s", frames as f64 * frame_time)?;
    writeln!(out, "joints       {} and {ends} End Sites", joints.len())?;
    writeln!(out, "channels     {}", document.motion().ncols())?;
    writeln!(out, "root height  {lowest:.3} to {highest:.3}")?;
    writeln!(out, "hierarchy")?;
    let mut depths: Vec<usize> = Vec::with_capacity(joints.len());
    for (joint, channels) in joints.iter().zip(document.channels()) {
        let depth = joint.parent.map_or(1, |parent| depths[parent] + 1);
        depths.push(depth);
        let channels: Vec<String> = channels.iter().map(ToString::to_string).collect();
        let [x, y, z] = joint.offset.to_array();
        writeln!(
            out,
            "{}{}  offset {x} {y} {z}  [{}]",
            "  ".repeat(depth),
            joint.name,
            channels.join(" ")
        )?;
        for end in &joint.end_sites {
            writeln!(
                out,
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
