//! The reader of sound files, and what is heard in every file that it lets through.
#![no_main]

use keydance::music::{Analysis, FeatureSet, parse};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(sound) = parse(data, "fuzzed.wav") else {
        return;
    };
    assert!(sound.samples().iter().all(|sample| sample.is_finite()));
    // What is heard in half a minute is as good as in an hour, and found sooner.
    if sound.samples().len() < 30 * 22_050
        && let Ok(heard) = Analysis::of(&sound)
    {
        for set in [FeatureSet::Paper15, FeatureSet::Fact35, FeatureSet::Mel128] {
            assert!(heard.features(set).iter().all(|value| value.is_finite()));
        }
    }
});
