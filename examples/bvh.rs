//! Reads a BVH file, plays its motion backwards and writes it again:
//! `cargo run --example bvh -- IN.bvh OUT.bvh`.

use std::error::Error;
use std::path::Path;

use keydance::motion::bvh::{Bvh, read, write};

fn main() -> Result<(), Box<dyn Error>> {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    let [from, to] = paths.as_slice() else {
        return Err("give two files: IN.bvh OUT.bvh".into());
    };
    let document = read(Path::new(from))?;
    let mut clip = document.to_clip();
    clip.poses.reverse();
    let backwards = Bvh::from_clip(&clip, document.channels().to_vec())?;
    write(Path::new(to), &backwards)?;
    let (joints, frames) = (clip.skeleton.len(), clip.poses.len());
    println!("{to}: {joints} joints, {frames} frames backwards");
    Ok(())
}
