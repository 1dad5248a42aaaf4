//! A paper from outside this crate is added by one call and goes through the paths that the
//! commands run. With the feature of the papers left out, too: the rooms that all papers share need
//! none.

mod rooms;
#[path = "../common/thread_ranks.rs"]
mod thread_ranks;
mod toy;

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Once};

use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::data::{DataPart, Dataset};
use keydance::evaluation::EvaluationRecord;
use keydance::experiment::{Ending, ExperimentConfig, Observer, Reproduction, rows};
use keydance::models::settings::GradientCheckOptions;
use keydance::models::{Request, registry};
use keydance::ranks::Alone;
use keydance::run::{RunFolder, Subject};
use keydance::step::measure::step_speed;
use keydance::training::{Outcome, Trainer};
use tempfile::TempDir;
use thread_ranks::on_each;
use toy::{TOY, question};

const CONFIG: &str = "name = 'toy'\n[data]\nsplit = { share = 0.7 }\n[model]\nkind = 'toy'\n\
    [optimiser]\nlearning_rate = 0.1\n[checkpoint]\nevery_steps = 7\n";

/// A folder of configs with the toy's, which is added to the registry.
fn configs() -> TempDir {
    static ADDED: Once = Once::new();
    ADDED.call_once(|| registry::add(TOY));
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("toy.toml"), CONFIG).unwrap();
    folder
}

fn load(folder: &Path, sets: &[&str]) -> ExperimentConfig {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    ExperimentConfig::load(&folder.join("toy.toml"), &sets).unwrap()
}

fn dataset(config: &ExperimentConfig) -> Dataset {
    let choreography = ChoreographyConfig {
        clips: 4,
        frames_per_clip: 60,
        seed: 2,
    };
    let clips = generate(&choreography).unwrap().into_iter();
    Dataset::from_clips(clips.map(|it| it.clip).collect(), &config.data).unwrap()
}

fn train(trainer: &mut Trainer<'_>, run: &RunFolder, stop: u64) -> Outcome {
    let outcome = trainer.run(Some(run), &mut |report| match report.step == stop {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    });
    outcome.unwrap()
}

/// A finished run in `folder`.
fn trained(folder: &Path, config: &ExperimentConfig, data: &Dataset) -> (PathBuf, String) {
    let path = folder.join("run");
    let run = RunFolder::create(&path, config).unwrap();
    let mut trainer = Trainer::new(config.clone(), data, 2).unwrap();
    assert_eq!(train(&mut trainer, &run, u64::MAX), Outcome::Finished);
    (path, trainer.weights_digest())
}

#[test]
fn its_config_is_read_and_checked_by_itself() {
    let folder = configs();
    let config = load(folder.path(), &["model.steps=5"]);
    assert!(config.to_toml().unwrap().contains("steps = 5"));
    let error = |set: &str| {
        let error = ExperimentConfig::load(&folder.path().join("toy.toml"), &[set.into()]);
        error.unwrap_err().to_string()
    };
    let text = error("model.windows=0");
    assert!(
        text.contains("--set model.windows=0: model.windows = 0"),
        "{text}"
    );
    assert!(error("model.hidden=3").contains("--set model.hidden=3"));
    assert!(error("schedule.fraction=0.5").contains("schedule"));
}

#[test]
fn it_is_trained_and_resumed_to_the_bit_with_its_running_mean() {
    let folder = configs();
    let config = load(folder.path(), &[]);
    let data = dataset(&config);
    let (path, digest) = trained(folder.path(), &config, &data);
    let weights = fs::read(path.join("weights.safetensors")).unwrap();
    assert!(String::from_utf8_lossy(&weights).contains("running_mean"));
    let path = folder.path().join("stopped");
    let run = RunFolder::create(&path, &config).unwrap();
    let mut first = Trainer::new(config.clone(), &data, 1).unwrap();
    assert_eq!(train(&mut first, &run, 17), Outcome::Stopped);
    drop(run);
    let run = RunFolder::resume(&path, &config).unwrap();
    let mut second = Trainer::new(config, &data, 3).unwrap();
    assert_eq!(second.resume(&run).unwrap().steps, 17);
    assert_ne!(second.weights_digest(), digest);
    train(&mut second, &run, u64::MAX);
    assert_eq!(second.weights_digest(), digest);
}

#[test]
fn its_running_mean_and_weights_are_those_of_one_process_on_ranks_too() {
    let folder = configs();
    let config = load(folder.path(), &[]);
    let data = dataset(&config);
    let (_, digest) = trained(folder.path(), &config, &data);
    let ended = on_each(2, |rank| {
        let mut trainer = Trainer::new(config.clone(), &data, 1).unwrap();
        trainer.join(rank).unwrap();
        let outcome = trainer.run(None, &mut |_| ControlFlow::Continue(()));
        assert_eq!(outcome.unwrap(), Outcome::Finished);
        trainer.weights_digest()
    });
    assert_eq!(ended, [digest.clone(), digest]);
}

#[test]
fn it_is_evaluated_by_its_own_metrics_and_generates_from_a_seed() {
    let folder = configs();
    let config = load(folder.path(), &[]);
    let data = dataset(&config);
    let (path, _) = trained(folder.path(), &config, &data);
    let subject = Subject::open(&path, &[]).unwrap();
    let protocol = subject.config.protocols().remove(0);
    let evaluate = |model| protocol.evaluate(model, &data, DataPart::Test).unwrap();
    let scores = evaluate(&*subject.model).scores;
    let untrained = Trainer::new(config, &data, 1).unwrap().model();
    let nll = |scores: &keydance::evaluation::Scores| scores.row("nll").unwrap().at("all").unwrap();
    assert!(nll(&scores) < nll(&evaluate(&*untrained).scores));
    assert!(scores.row("spread").unwrap().at("all").unwrap() > 0.1);

    let (request, _) = question(&data.test[0], 30, 25);
    let dance = |seed| {
        let request = Request {
            seed,
            ..request.clone()
        };
        let motion = subject
            .model
            .generate(std::slice::from_ref(&request))
            .unwrap()
            .remove(0);
        motion.check(&request).unwrap();
        motion
    };
    assert_eq!(dance(1), dance(1));
    assert_ne!(dance(1), dance(2));
    let silent = Request {
        music: None,
        ..request
    };
    let error = subject.model.generate(&[silent]).unwrap_err().to_string();
    assert_eq!(error, "toy needs the music");
}

/// Says nothing.
struct Silent;

impl Observer for Silent {}

#[test]
fn its_rows_are_reproduced_into_tables_beside_what_it_prints() {
    let folder = configs();
    fs::write(folder.path().join("paper.toml"), "title = 'none'").unwrap();
    let without = rows::read(folder.path(), None, &[], &[], &[]).unwrap();
    assert_eq!((without.0.len(), without.1.rows.len()), (1, 0));
    fs::remove_file(folder.path().join("paper.toml")).unwrap();
    let (rows, printed) = rows::read(folder.path(), None, &[], &[], &[]).unwrap();
    let data = dataset(&rows[0].config);
    let out = folder.path().join("out");
    let reproduction = Reproduction {
        rows: &rows,
        chosen: &[&rows[0]],
        dataset: &data,
        printed: &printed,
        out: &out,
        runs: &folder.path().join("runs"),
        threads: 2,
        jobs: 1,
        no_training: false,
        tables: true,
        observer: &Silent,
    };
    assert!(matches!(reproduction.run().unwrap(), Ending::Finished));
    let record = EvaluationRecord::read(&out.join("toy")).unwrap();
    let scores = record.scores.by("likelihood").unwrap();
    let ours = scores.row("nll").unwrap().at("all").unwrap();
    let tables = fs::read_to_string(out.join("tables.md")).unwrap();
    for line in [
        "## Table 1: NLL".to_string(),
        "| Toy | paper | 2.50 |".into(),
        format!("|  | ours | {ours:.2} |"),
    ] {
        assert!(tables.contains(&line), "{line}: {tables}");
    }
}

#[test]
fn what_it_does_not_have_is_said() {
    let folder = configs();
    let config = load(folder.path(), &[]);
    let error = step_speed(&config, Some(20), 3, 1, 1, Arc::new(Alone))
        .unwrap_err()
        .to_string();
    assert!(error.contains("toy: has no made-up step"), "{error}");
    let options = GradientCheckOptions {
        frames: None,
        full_size: false,
        windows: 1,
        per_parameter: 1,
        seed: 1,
    };
    let error = config.model.check_gradients(&options).unwrap_err();
    assert!(error.to_string().contains("toy: has no gradient check"));
}
