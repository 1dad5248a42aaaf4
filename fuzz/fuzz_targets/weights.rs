//! The reader of weights files: one part of a checkpoint.
#![no_main]

use std::path::Path;

use keydance::autograd::Parameters;
use keydance::models::weights::SavedWeights;
use keydance::nn::Initialiser;
use keydance::experiment::ExperimentConfig;
use keydance::models::Streams;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(saved) = SavedWeights::parse(data, Path::new("fuzzed.safetensors")) else {
        return;
    };
    let Ok(config) = ExperimentConfig::parse(&saved.config, "its config") else {
        return;
    };
    let mut parameters = Parameters::new();
    let rng = Streams::new(1).initialisation();
    let mut init = Initialiser::limited(&mut parameters, rng, saved.most_weights());
    if config.model.build(&mut init, &saved.standardisation).is_ok() {
        let _ = saved.load_into(&mut parameters);
    }
});
