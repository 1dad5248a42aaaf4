//! Training on small data with a small network: the same bits however it is run, and nothing lost
//! when it stops.

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use keydance::autograd::{AutogradError, BlockId, Tape};
use keydance::experiment::ExperimentConfig;
use keydance::models::LossTerms;
use keydance::models::pan2021::{Controllers, Pan2021Config};
use keydance::models::transition::{Batch, Forcing, ModelConfig, Network, TransitionSettings};
use keydance::models::weights::SavedWeights;
use keydance::run::checkpoint::{STATE_FILE, WEIGHTS_FILE, list};
use keydance::run::state::decode;
use keydance::run::{RunFolder, RunState};
use keydance::training::{Outcome, StepReport, Trainer, TrainingError};
use ndarray::Array3;
use sha2::{Digest, Sha256};

use crate::small_training::{self, config, dataset, schedule, settings, trainer, trainer_of};

/// Trains until `stop` steps are done, or to the end.
fn train(trainer: &mut Trainer<'_>, run: Option<&RunFolder>, stop: Option<u64>) -> Vec<StepReport> {
    let mut reports = Vec::new();
    let outcome = trainer
        .run(run, &mut |report| {
            reports.push(report.clone());
            if Some(report.step) == stop {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .unwrap();
    let stopped = stop.is_some_and(|stop| stop < trainer.task().steps());
    assert_eq!(outcome == Outcome::Stopped, stopped);
    reports
}

/// A report without what the clock says.
fn numbers(report: &StepReport) -> StepReport {
    StepReport {
        seconds: 0.0,
        frame_steps_per_second: 0.0,
        ..report.clone()
    }
}

#[test]
fn weights_and_losses_are_the_same_to_the_bit_with_one_and_three_threads() {
    let data = dataset();
    let run = |threads| {
        let mut trainer = trainer(&data, threads);
        let reports = train(&mut trainer, None, Some(30));
        assert_eq!(reports.len(), 30);
        (
            reports.iter().map(numbers).collect::<Vec<_>>(),
            trainer.weights_file().unwrap(),
        )
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn the_learning_rate_rises_then_falls_to_its_final_share() {
    let data = dataset();
    let reports = train(&mut trainer(&data, 2), None, None);
    let rates: Vec<f64> = reports.iter().map(|r| r.learning_rate).collect();
    assert!((rates[0] - 0.01 / 3.0).abs() < 1e-15, "{rates:?}");
    assert_eq!(rates[2..4], [0.01, 0.01]);
    assert!(rates[3..].windows(2).all(|pair| pair[1] < pair[0]));
    let last = rates[rates.len() - 1];
    assert!((0.002..0.0021).contains(&last), "{last}");
}

#[test]
fn the_transformer_controllers_learn_at_their_own_rate_and_fully_connected_ones_at_the_others() {
    let data = dataset();
    let moved = |controllers| {
        let mut config = config();
        config.optimiser.rates.insert("transformers".into(), 1e-20);
        let ModelConfig::Pan2021(model) = ModelConfig::default().small() else {
            panic!("the default model is not the paper's");
        };
        settings(&mut config).model = ModelConfig::Pan2021(Pan2021Config {
            controllers,
            ..model
        });
        let mut trainer = Trainer::new(config, &data, 1).unwrap();
        let before = trainer.parameters().clone();
        train(&mut trainer, None, Some(2));
        let after = trainer.parameters();
        let far = |(b, a): (&f32, &f32)| (a - b).abs() > 1e-10;
        before
            .iter()
            .zip(after.iter())
            .map(|((name, b), (_, a))| (name.to_string(), b.iter().zip(a.iter()).any(far)))
            .collect::<Vec<_>>()
    };
    let controller =
        |name: &str| name.starts_with("root_traj") || name.starts_with("velocity_factor_");
    for (name, moved) in moved(Controllers::Transformer) {
        assert_eq!(moved, !controller(&name), "{name}");
    }
    for (name, moved) in moved(Controllers::FullyConnected) {
        assert!(moved, "{name}");
    }
}

#[test]
fn both_feeds_are_drawn_and_the_loss_falls() {
    let data = dataset();
    let reports = train(&mut trainer(&data, 2), None, None);
    let feeds = |beta: fn(f64) -> bool| {
        reports
            .iter()
            .filter(|r| beta(r.column("beta").unwrap().as_f64().unwrap()))
            .count()
    };
    assert!(feeds(|beta| beta > 0.5) > 5 && feeds(|beta| beta < 0.5) > 5);
    let predicted = reports
        .iter()
        .filter(|r| r.column("teacher_forcing").unwrap() == false);
    assert!((5..reports.len() - 5).contains(&predicted.count()));
    let mean = |reports: &[StepReport]| {
        reports.iter().map(|r| r.total).sum::<f64>() / reports.len() as f64
    };
    let (first, last) = (mean(&reports[..10]), mean(&reports[reports.len() - 10..]));
    assert!(last < 0.8 * first, "{first} became {last}");
}

#[test]
fn a_resumed_training_ends_at_the_same_bits_wherever_it_stopped() {
    let data = dataset();
    let mut whole = trainer(&data, 2);
    let expected: Vec<_> = train(&mut whole, None, None).iter().map(numbers).collect();
    let steps = whole.task().steps();
    let curriculum = schedule(whole.config(), &data);
    let epoch_starts: Vec<u64> = (0..steps)
        .filter(|&step| step > 0 && curriculum.place(step).1 == 0)
        .collect();
    // At the end of the first epoch, where the shortest length grows (every 2 epochs), and inside
    // epochs.
    let grows = epoch_starts
        .iter()
        .copied()
        .find(|&step| curriculum.place(step).0 == 2)
        .unwrap();
    for stop in [1, epoch_starts[0], grows, grows + 1, steps - 1, steps] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        let mut before = trainer(&data, 2);
        let run = RunFolder::create(&path, before.config()).unwrap();
        let mut reports = train(&mut before, Some(&run), Some(stop));
        drop((before, run));
        let mut after = trainer(&data, 1);
        let run = RunFolder::resume(&path, after.config()).unwrap();
        assert_eq!(after.resume(&run).unwrap().steps, stop);
        reports.extend(train(&mut after, Some(&run), None));
        let reports: Vec<_> = reports.iter().map(numbers).collect();
        assert_eq!(reports, expected, "stopped after step {stop}");
        assert_eq!(after.weights_file().unwrap(), whole.weights_file().unwrap());
        assert_eq!(
            fs::read(run.weights()).unwrap(),
            whole.weights_file().unwrap()
        );
        let manifest = run.manifest().unwrap().unwrap();
        assert_eq!(
            (manifest.state, manifest.steps_done),
            (RunState::Finished, steps)
        );
        assert_eq!(manifest.weights_digest, Some(whole.weights_digest()));
        assert_eq!(logged_steps(&path), (1..=steps).collect::<Vec<_>>());
    }
}

fn logged_steps(run: &Path) -> Vec<u64> {
    let text = fs::read_to_string(run.join("log.jsonl")).unwrap();
    text.lines()
        .map(|line| {
            let line: serde_json::Value = serde_json::from_str(line).unwrap();
            assert!(line["losses"]["reconstruction"].is_number(), "{line}");
            line["step"].as_u64().unwrap()
        })
        .collect()
}

/// A run with checkpoints after steps 10 and 20 that was killed after step 23.
fn killed_run(folder: &Path) -> PathBuf {
    let data = dataset();
    let mut trainer = trainer(&data, 2);
    let path = folder.join("run");
    let run = RunFolder::create(&path, trainer.config()).unwrap();
    let killed = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        trainer.run(Some(&run), &mut |report| {
            if report.step == 23 {
                std::panic::resume_unwind(Box::new("killed"));
            }
            ControlFlow::Continue(())
        })
    }));
    assert!(killed.is_err());
    assert_eq!(logged_steps(&path), (1..=23).collect::<Vec<_>>());
    path
}

fn finish(path: &Path) -> Result<(u64, Vec<String>, String), TrainingError> {
    let data = dataset();
    let mut trainer = trainer(&data, 2);
    let run = RunFolder::resume(path, trainer.config())?;
    let resumed = trainer.resume(&run)?;
    train(&mut trainer, Some(&run), None);
    assert_eq!(
        logged_steps(path),
        (1..=trainer.task().steps()).collect::<Vec<_>>()
    );
    Ok((resumed.steps, resumed.damaged, trainer.weights_digest()))
}

fn uninterrupted() -> String {
    let data = dataset();
    let mut trainer = trainer(&data, 2);
    train(&mut trainer, None, None);
    trainer.weights_digest()
}

#[test]
fn a_killed_training_goes_on_from_the_newest_whole_checkpoint() {
    let expected = uninterrupted();
    let folder = tempfile::tempdir().unwrap();
    let path = killed_run(folder.path());
    // What a kill in the middle of a checkpoint and of a log line leaves.
    let partial = path.join("checkpoints/step-00000030.partial");
    fs::create_dir(&partial).unwrap();
    fs::write(partial.join(STATE_FILE), "half").unwrap();
    let log = path.join("log.jsonl");
    fs::write(&log, fs::read_to_string(&log).unwrap() + "{\"step\": 2").unwrap();
    assert_eq!(finish(&path).unwrap(), (20, vec![], expected));
    assert!(!partial.exists());
    assert_eq!(list(&path.join("checkpoints")).unwrap().len(), 2);
}

#[test]
fn a_damaged_checkpoint_is_set_aside_for_the_one_before() {
    let expected = uninterrupted();
    for file in [STATE_FILE, WEIGHTS_FILE] {
        for damage in [cut_off as fn(&Path), flip_a_byte, fs_remove] {
            let folder = tempfile::tempdir().unwrap();
            let path = killed_run(folder.path());
            damage(&path.join("checkpoints/step-00000020").join(file));
            let (steps, damaged, digest) = finish(&path).unwrap();
            assert_eq!((steps, &digest), (10, &expected));
            assert!(
                damaged.len() == 1 && damaged[0].contains(file),
                "{damaged:?}"
            );
        }
    }
}

fn cut_off(path: &Path) {
    let content = fs::read(path).unwrap();
    fs::write(path, &content[..content.len() / 2]).unwrap();
}

fn flip_a_byte(path: &Path) {
    let mut content = fs::read(path).unwrap();
    let at = content.len() / 2;
    content[at] ^= 1;
    fs::write(path, content).unwrap();
}

fn fs_remove(path: &Path) {
    fs::remove_file(path).unwrap();
}

#[test]
fn a_run_without_a_whole_checkpoint_names_what_is_wrong_with_each() {
    let folder = tempfile::tempdir().unwrap();
    let path = killed_run(folder.path());
    flip_a_byte(&path.join("checkpoints/step-00000020").join(STATE_FILE));
    cut_off(&path.join("checkpoints/step-00000010").join(WEIGHTS_FILE));
    let text = finish(&path).unwrap_err().to_string();
    for words in [
        "no checkpoint",
        "step-00000020/state.bin",
        "checksum",
        "step-00000010/weights.safetensors",
    ] {
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn a_run_killed_before_its_first_checkpoint_begins_again() {
    let expected = uninterrupted();
    let folder = tempfile::tempdir().unwrap();
    let path = killed_run(folder.path());
    fs::remove_dir_all(path.join("checkpoints")).unwrap();
    assert_eq!(finish(&path).unwrap(), (0, vec![], expected.clone()));
    assert_eq!(
        finish(&folder.path().join("none")).unwrap(),
        (0, vec![], expected)
    );
}

#[test]
fn a_folder_with_a_run_is_not_begun_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = killed_run(folder.path());
    let text = RunFolder::create(&path, &config()).unwrap_err().to_string();
    assert!(text.contains("--resume") && text.contains("run"), "{text}");
}

#[test]
fn a_run_of_another_config_or_other_data_is_refused_with_both_sides() {
    let folder = tempfile::tempdir().unwrap();
    let path = killed_run(folder.path());
    let mut other = config();
    other.optimiser.learning_rate = 0.5;
    let text = RunFolder::resume(&path, &other).unwrap_err().to_string();
    assert!(
        text.contains("optimiser.learning_rate: 0.01, 0.5"),
        "{text}"
    );

    let mut data = dataset();
    data.digest = "other".into();
    let mut trainer = trainer(&data, 1);
    let run = RunFolder::resume(&path, trainer.config()).unwrap();
    let text = trainer.resume(&run).unwrap_err().to_string();
    assert!(
        text.contains("digest synthetic") && text.contains("digest other"),
        "{text}"
    );
}

#[test]
fn two_trainings_do_not_write_to_one_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let first = RunFolder::create(&path, &config()).unwrap();
    for second in [
        RunFolder::create(&path, &config()),
        RunFolder::resume(&path, &config()),
        RunFolder::replace(&path, &config()),
    ] {
        let text = second.unwrap_err().to_string();
        assert!(
            text.contains("another training writes to") && text.contains("run"),
            "{text}"
        );
    }
    assert_eq!(RunFolder::open(&path).config().unwrap(), config());
    drop(first);
    assert!(RunFolder::resume(&path, &config()).is_ok());
}

#[test]
fn a_run_whose_config_an_older_version_wrote_with_fewer_keys_goes_on_to_the_same_bits() {
    let expected = uninterrupted();
    let data = dataset();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let mut before = trainer(&data, 2);
    let run = RunFolder::create(&path, before.config()).unwrap();
    let text = fs::read_to_string(run.config_path()).unwrap();
    let fewer = text
        .replace("beta2 = 0.999\n", "")
        .replace("[log]\nevery_steps = 1\n", "");
    assert_eq!(fewer.lines().count() + 3, text.lines().count());
    fs::write(run.config_path(), fewer).unwrap();
    train(&mut before, Some(&run), Some(14));
    drop((before, run));
    // The state names the digest of what that version wrote.
    let state = path.join("checkpoints/step-00000014").join(STATE_FILE);
    let (mut header, moments) = decode(&fs::read(&state).unwrap(), &state).unwrap();
    header.config_digest = "of fewer keys".into();
    let format = bincode::config::standard();
    let mut content = b"KDSTATE\0\x01\0\0\0".to_vec();
    content.extend(bincode::serde::encode_to_vec(&header, format).unwrap());
    content.extend(bincode::serde::encode_to_vec(&moments, format).unwrap());
    let checksum = Sha256::digest(&content);
    content.extend_from_slice(&checksum);
    fs::write(&state, content).unwrap();
    assert_eq!(finish(&path).unwrap(), (14, vec![], expected));
}

#[test]
fn a_checkpoint_of_another_run_is_refused_with_both_digests() {
    let folder = tempfile::tempdir().unwrap();
    let path = killed_run(folder.path());
    let data = dataset();
    let mut other = config();
    other.seed = 5;
    let mut other = trainer_of(other, &data, 2);
    let run = RunFolder::create(&folder.path().join("other"), other.config()).unwrap();
    train(&mut other, Some(&run), Some(30));
    let newest = "checkpoints/step-00000030";
    fs::rename(run.path().join(newest), path.join(newest)).unwrap();
    let text = finish(&path).unwrap_err().to_string();
    assert!(
        text.contains("step-00000030 belongs to a config with digest"),
        "{text}"
    );
}

/// A loss of |w| that is finite where its gradient is not: sqrt(w^2) at 0.
struct Cusp(BlockId);

impl Network<f32> for Cusp {
    fn losses(
        &self,
        tape: &mut Tape<'_, f32>,
        _batch: &Batch<f32>,
        _forcing: Forcing,
    ) -> Result<LossTerms, AutogradError> {
        let weight = tape.block(self.0);
        let square = tape.square(weight);
        let size = tape.sqrt(square);
        let total = tape.sum(size);
        Ok(LossTerms {
            total,
            terms: vec![("size", total)],
            critics: None,
            buffers: Vec::new(),
            watched: Vec::new(),
        })
    }

    fn predict(
        &self,
        _tape: &mut Tape<'_, f32>,
        _batch: &Batch<f32>,
    ) -> Result<Array3<f32>, AutogradError> {
        Ok(Array3::zeros((0, 0, 0)))
    }
}

#[test]
fn a_gradient_that_is_not_finite_is_traced_to_its_operation_and_changes_no_weight() {
    let data = dataset();
    let folder = tempfile::tempdir().unwrap();
    let mut trainer = small_training::trainer_of_network(config(), &data, 2, |init| {
        Box::new(Cusp(init.constant("w".into(), &[3], 0.0).1))
    })
    .unwrap();
    let before = trainer.weights_digest();
    let run = RunFolder::create(&folder.path().join("run"), &config()).unwrap();
    let error = trainer
        .run(Some(&run), &mut |_| ControlFlow::Continue(()))
        .unwrap_err();
    let text = error.to_string();
    for words in ["step 1 (", "sqrt (operation", "gradient of shape [3]"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert_eq!(trainer.weights_digest(), before);
    assert_eq!(run.manifest().unwrap().unwrap().state, RunState::Diverged);
}

#[test]
fn weights_that_a_step_leaves_beyond_all_numbers_are_never_saved() {
    let data = dataset();
    let folder = tempfile::tempdir().unwrap();
    let mut config = config();
    // More than an f32 can hold: the first update is infinite, its loss was not.
    config.optimiser.learning_rate = 1e39;
    config.checkpoint.every_steps = 1;
    let mut trainer = trainer_of(config.clone(), &data, 2);
    let run = RunFolder::create(&folder.path().join("run"), &config).unwrap();
    let error = trainer
        .run(Some(&run), &mut |_| ControlFlow::Continue(()))
        .unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("step 1 ") && text.contains("it left hidden.weight [8, 154] with a NaN"),
        "{text}"
    );
    assert!(list(&run.checkpoints()).unwrap().is_empty());
    assert_eq!(run.manifest().unwrap().unwrap().state, RunState::Diverged);
}

#[test]
fn a_loss_that_is_not_finite_stops_the_training_and_leaves_the_checkpoints() {
    let data = dataset();
    let folder = tempfile::tempdir().unwrap();
    let mut config = config();
    config.optimiser.learning_rate = 1e30;
    config.checkpoint.every_steps = 1;
    let mut trainer = trainer_of(config.clone(), &data, 2);
    let run = RunFolder::create(&folder.path().join("run"), &config).unwrap();
    let error = trainer
        .run(Some(&run), &mut |_| ControlFlow::Continue(()))
        .unwrap_err();
    assert!(error.is_divergence(), "{error}");
    let text = error.to_string();
    let step = trainer.steps_done() + 1;
    assert!(text.contains(&format!("step {step} ")), "{text}");
    assert!(
        text.contains("operation") && text.contains("shape ["),
        "{text}"
    );
    assert_eq!(run.manifest().unwrap().unwrap().state, RunState::Diverged);
    let (newest, path) = list(&run.checkpoints()).unwrap().pop().unwrap();
    assert_eq!(newest, trainer.steps_done());
    assert!(SavedWeights::read(&path.join(WEIGHTS_FILE)).is_ok());
}

#[test]
fn weights_of_another_model_are_refused_with_both_shapes() {
    let data = dataset();
    let mut small = trainer(&data, 1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("w.safetensors");
    fs::write(&path, small.weights_file().unwrap()).unwrap();
    let saved = SavedWeights::read(&path).unwrap();
    assert_eq!(
        ExperimentConfig::parse(&saved.config, "metadata").unwrap(),
        *small.config()
    );
    let mut parameters = small_training::parameters(7);
    let statistics = trainer(&data, 1).task().statistics();
    let text = saved.load_into(&mut parameters, &statistics);
    let text = text.unwrap_err().to_string();
    assert!(
        text.contains("hidden.weight is [8, 154] in the file, [7, 154]"),
        "{text}"
    );

    train(&mut small, None, Some(3));
    let mut parameters = small_training::parameters(8);
    saved.load_into(&mut parameters, &statistics).unwrap();
    let digest = keydance::models::weights::digest(&parameters);
    assert_eq!(digest, trainer(&data, 1).weights_digest());
    assert_ne!(digest, small.weights_digest());
}

#[test]
fn mutated_weights_files_are_errors_or_whole_and_never_panic() {
    let data = dataset();
    let trainer = trainer(&data, 1);
    let statistics = trainer.task().statistics();
    let content = trainer.weights_file().unwrap();
    let path = Path::new("w.safetensors");
    assert!(SavedWeights::parse(&content, path).is_ok());
    for at in (0..content.len()).step_by(97).chain(0..600) {
        let mut changed = content.clone();
        changed[at] ^= 0x55;
        if let Ok(saved) = SavedWeights::parse(&changed, path) {
            let mut parameters = small_training::parameters(8);
            let _ = saved.load_into(&mut parameters, &statistics);
        }
        assert!(SavedWeights::parse(&content[..at], path).is_err());
    }
    let mut huge = content.clone();
    huge[..8].copy_from_slice(&(1u64 << 60).to_le_bytes());
    assert!(SavedWeights::parse(&huge, path).is_err());
}

#[test]
fn clips_shorter_than_every_window_are_an_error_that_says_what_to_do() {
    let data = dataset();
    let mut config = config();
    settings(&mut config).schedule.min_len = 1000;
    settings(&mut config).schedule.max_len = 1000;
    let error = small_training::try_trainer(config, &data, 1).err().unwrap();
    let text = error.to_string();
    assert!(
        text.contains("1000") && text.contains("schedule.min_len"),
        "{text}"
    );
}

#[test]
fn the_papers_configs_load_and_differ_from_the_whole_model_by_their_name_and_one_field() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/pan2021");
    let load = |name: &str| ExperimentConfig::load(&folder.join(name), &[]).unwrap();
    let whole = load("whole_model.toml");
    assert_eq!(whole, ExperimentConfig::default());
    for (name, field) in [
        ("one_lstm", "model.lstms: 2, 1"),
        (
            "condition_fc",
            "model.controllers: \"transformer\", \"fully_connected\"",
        ),
        ("one_decoder", "model.decoders: 2, 1"),
        (
            "without_velocity_factor",
            "model.velocity_factor: true, false",
        ),
        ("without_key_loss", "model.loss.key: 0.2, 0.0"),
    ] {
        let ablation = load(&format!("{name}.toml"));
        let named = format!("name: \"whole_model\", \"{name}\"");
        assert_eq!(
            whole.differences(&ablation).unwrap(),
            [field.to_string(), named]
        );
    }
    let data = dataset();
    let interpolation = load("interpolation.toml");
    assert_eq!(interpolation.name, "interpolation");
    let error = Trainer::new(interpolation, &data, 1)
        .err()
        .unwrap()
        .to_string();
    assert!(error.contains("no training"), "{error}");
}

#[test]
fn the_budget_goes_over_every_config_of_the_paper_and_leaves_its_model() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
    let budget = folder.join("budgets/pan2021.toml");
    for file in fs::read_dir(folder.join("pan2021")).unwrap() {
        let file = file.unwrap().path();
        if file.ends_with("paper.toml") {
            continue;
        }
        let plain = ExperimentConfig::load(&file, &[]).unwrap();
        let config = ExperimentConfig::load_under(&file, Some(&budget), &[]).unwrap();
        let model = |config| &TransitionSettings::of(config).unwrap().model;
        assert_eq!((&config.name, model(&config)), (&plain.name, model(&plain)));
        let batch = TransitionSettings::of(&config).unwrap().schedule.batch_size;
        assert_eq!(batch, 16, "{}", file.display());
    }
}

#[test]
fn the_overfit_check_trains_on_one_clip_and_tests_on_none() {
    let file = "experiments/checks/overfit.toml";
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    let config = ExperimentConfig::load(&file, &[]).unwrap();
    let keydance::data::Split::List { train, test, .. } = config.data.split else {
        panic!("{:?}", config.data.split);
    };
    assert_eq!((train.len(), test.len()), (1, 0));
}

#[test]
fn the_check_on_unseen_dancers_trains_the_preferred_control_path_and_nothing_else() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
    let load =
        |file: &str, sets: &[String]| ExperimentConfig::load(&folder.join(file), sets).unwrap();
    let check = load("checks/unseen_dancers.toml", &[]);
    let no_other_loss =
        ["rec", "con", "root", "key", "vfac"].map(|loss| format!("model.loss.{loss}=0"));
    let preferred = load("preferred/whole_model.toml", &no_other_loss);
    let own = |config| TransitionSettings::of(config).unwrap();
    let (ours, theirs) = (own(&check), own(&preferred));
    assert_eq!(
        (&ours.model, &ours.augmentation),
        (&theirs.model, &theirs.augmentation)
    );
    assert!(matches!(
        check.data.split,
        keydance::data::Split::UnseenDancers(_)
    ));
}

#[test]
fn a_finished_run_of_a_model_in_the_registry_loads_with_its_weights() {
    let data = dataset();
    let sets = [
        "hidden=8",
        "code=4",
        "heads=2",
        "feed_forward=4",
        "encoder_layers=1",
        "decoder_layers=1",
    ];
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("small.toml");
    fs::write(
        &file,
        "schedule = { min_len = 3, max_len = 4, fraction = 0.1, batch_size = 8 }",
    )
    .unwrap();
    let sets: Vec<String> = sets.iter().map(|set| format!("model.{set}")).collect();
    let config = ExperimentConfig::load(&file, &sets).unwrap();
    let mut trainer = Trainer::new(config.clone(), &data, 2).unwrap();
    let run = RunFolder::create(&folder.path().join("run"), &config).unwrap();
    let none = run.trained_model(&config).err().unwrap().to_string();
    assert!(none.contains("keydance train"), "{none}");
    train(&mut trainer, Some(&run), None);
    let own = TransitionSettings::of(&config).unwrap();
    let saved = run.saved_weights(&config).unwrap();
    let loaded = own.load(&config.name, &saved).unwrap();
    let digest = keydance::models::weights::digest(loaded.parameters());
    assert_eq!(digest, trainer.weights_digest());
}
