//! The reader of mapping files, and what every mapping that it lets through does to a clip.
#![no_main]

use std::sync::LazyLock;

use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::motion::{Clip, Mapping};
use libfuzzer_sys::fuzz_target;

static CLIP: LazyLock<Clip> = LazyLock::new(|| {
    let config = ChoreographyConfig {
        clips: 1,
        frames_per_clip: 3,
        seed: 0,
    };
    generate(&config).expect("three frames").remove(0).clip
});

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    if let Ok(mapping) = Mapping::parse(text, "fuzzed.toml")
        && let Ok(clip) = mapping.apply(&CLIP)
    {
        let numbers = clip.poses.iter().flat_map(|pose| &pose.translations);
        assert!(numbers.copied().all(|point| point.is_finite()));
        assert!(clip.skeleton.is_dance_skeleton());
    }
});
