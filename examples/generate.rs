//! A model, used from code: the motion between two poses of a clip, a second apart:
//! `cargo run --example generate -- RUN_OR_CONFIG CLIP.bvh`.

use std::error::Error;
use std::path::Path;

use keydance::evaluation::transitions::window_request;
use keydance::motion::bvh::read;
use keydance::motion::{FeatureConfig, features};
use keydance::run::Subject;
use ndarray::s;

const FRAMES: usize = 30;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [run, clip] = arguments.as_slice() else {
        return Err("give RUN_OR_CONFIG CLIP.bvh".into());
    };
    let subject = Subject::open(Path::new(run), &[])?;
    let clip = read(Path::new(clip))?.to_clip();
    // The first and the last pose, and where the root goes and how fast the body moves between.
    let recorded = features(&clip, &FeatureConfig::default())?;
    let window = recorded.slice(s![..=FRAMES.min(recorded.nrows() - 1), ..]);
    let request = window_request(&clip, 0, window).ok_or("the clip is too short")?;
    let motion = subject.model.generate(&[request])?.remove(0);
    let head = clip.skeleton.index_of("Head").ok_or("no joint Head")?;
    println!("{}: height of the head, cm", subject.what);
    for (frame, place) in motion.positions.outer_iter().enumerate().step_by(5) {
        println!("frame {frame:>3}: {:.1}", place[[head, 1]]);
    }
    Ok(())
}
