//! The reader of experiment configs: a file's text, and after a 0 byte an override of the command line.
#![no_main]

use std::path::Path;

use keydance::experiment::ExperimentConfig;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    let config = match text.split_once('\0') {
        // An empty file.
        Some((_, set)) => ExperimentConfig::load(Path::new("/dev/null"), &[set.into()]),
        None => ExperimentConfig::parse(text, "fuzzed.toml"),
    };
    if let Ok(config) = config {
        let text = config.to_toml().expect("a valid config can be written");
        let again = ExperimentConfig::parse(&text, "written.toml");
        assert_eq!(again.expect("what is written is read"), config);
    }
});
