//! A folder of generated clips, for tests through the binary.

use std::path::Path;

use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::motion::bvh::{self, Axis, Bvh, channel_layout};

/// Writes six clips of `frames` frames as BVH files; with `split = { share = 0.8 }` four train and
/// two test.
pub fn write_clips(folder: &Path, frames: usize, seed: u64) {
    let config = ChoreographyConfig {
        clips: 6,
        frames_per_clip: frames,
        seed,
    };
    for generated in generate(&config).unwrap() {
        let clip = generated.clip;
        let channels = channel_layout(&clip, [Axis::Z, Axis::X, Axis::Y]);
        let document = Bvh::from_clip(&clip, channels).unwrap();
        bvh::write(&folder.join(&clip.name), &document).unwrap();
    }
}
