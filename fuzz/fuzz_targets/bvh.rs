//! The BVH reader, and what every clip that it lets through must survive.
#![no_main]

use keydance::models::transition::DanceClip;
use keydance::data::DataConfig;
use keydance::motion::bvh;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(document) = bvh::parse(data, "fuzzed.bvh") else {
        return;
    };
    assert!(document.motion().iter().all(|value| value.is_finite()));
    let written = document.to_text();
    let again = bvh::parse(written.as_bytes(), "fuzzed.bvh");
    assert_eq!(again.expect("what is written is read").to_text(), written);
    if let Ok(clip) = DanceClip::new(document.to_clip(), None, &DataConfig::default()) {
        assert!(clip.features.iter().all(|value| value.is_finite()));
    }
});
