//! Trainings on a prepared set, whose windows are read as they are needed.

use std::fs::OpenOptions;
use std::io::{Seek as _, SeekFrom, Write as _};
use std::ops::ControlFlow;

use keydance::data::choreography::{ChoreographyConfig, write_clips};
use keydance::data::{Dataset, Split, prepare};
use keydance::experiment::ExperimentConfig;
use keydance::training::Trainer;
use tempfile::TempDir;

/// The kinds whose tasks read windows, small, with all forms of clips and, where windows have one,
/// a past.
const MODELS: [&str; 3] = [
    "[model]\nkind = 'pan2021'\nhidden = 8\ncode = 8\nheads = 2\nfeed_forward = 8\n\
     [schedule]\nmin_len = 3\nmax_len = 6\nbatch_size = 8\nframe_steps = 400\n",
    "[model]\nkind = 'li2023'\nwidth = 4\nheads = 2\nlayers = 2\n\
     [schedule]\nfraction = 0.002\nbatch_size = 5\n",
    "[model]\nkind = 'harvey2020_rotations'\npast = 3\nhidden = 8\ncode = 8\nrecurrent = 8\n\
     [schedule]\nfraction = 0.002\nbatch_size = 5\n",
];
const FORMS: &str = "[augmentation]\nmirror = true\ntempi = [0.8, 1.3]\n";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let choreography = ChoreographyConfig {
        clips: 5,
        frames_per_clip: 60,
        seed: 4,
    };
    let files = write_clips(&choreography, false, folder.path()).unwrap();
    files.for_each(|file| drop(file.unwrap()));
    folder
}

fn go_on(_done: usize, _all: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn config(model: &str) -> ExperimentConfig {
    let mut config = ExperimentConfig::parse(&format!("{model}{FORMS}"), "test").unwrap();
    config.data.split = Split::Share(0.8);
    config
}

#[test]
fn a_training_on_a_prepared_set_ends_at_the_bits_of_one_on_the_folder() {
    let folder = folder();
    for model in MODELS {
        let config = config(model);
        let file = folder.path().join("dances.prepared");
        prepare(folder.path(), &config.data, &file, &mut go_on).unwrap();
        let [held, stored] = [folder.path(), &file].map(|data| {
            assert!(config.model.reads_stored_clips());
            let data = Dataset::load_to_train(data, &config.data).unwrap();
            let mut trainer = Trainer::new(config.clone(), &data, 2).unwrap();
            assert!(trainer.task().steps() > 1);
            trainer
                .run(None, &mut |_| ControlFlow::Continue(()))
                .unwrap();
            trainer.weights_digest()
        });
        assert_eq!(held, stored, "{}", config.model.kind());
    }
}

#[test]
fn a_clip_that_was_damaged_is_found_before_a_step_is_trained() {
    let folder = folder();
    for model in MODELS {
        let config = config(model);
        let file = folder.path().join("dances.prepared");
        prepare(folder.path(), &config.data, &file, &mut go_on).unwrap();
        let mut bytes = OpenOptions::new().write(true).open(&file).unwrap();
        bytes.seek(SeekFrom::Start(200)).unwrap();
        bytes.write_all(&[7; 8]).unwrap();
        let data = Dataset::load_to_train(&file, &config.data).unwrap();
        let error = Trainer::new(config, &data, 1).err().unwrap().to_string();
        assert!(error.contains("is damaged: prepare it again"), "{error}");
    }
}

#[test]
fn a_file_that_is_cut_off_while_a_training_goes_on_ends_it_with_an_error() {
    let folder = folder();
    for model in MODELS {
        let config = config(model);
        let file = folder.path().join("dances.prepared");
        prepare(folder.path(), &config.data, &file, &mut go_on).unwrap();
        let data = Dataset::load_to_train(&file, &config.data).unwrap();
        let mut trainer = Trainer::new(config, &data, 1).unwrap();
        let cut = OpenOptions::new().write(true).open(&file).unwrap();
        cut.set_len(100).unwrap();
        let error = trainer
            .run(None, &mut |_| ControlFlow::Continue(()))
            .err()
            .unwrap()
            .to_string();
        assert!(error.contains("step 1 ("), "{error}");
        assert!(error.contains("it was written to"), "{error}");
    }
}
