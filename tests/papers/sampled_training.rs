//! Transflower and MoGlow on generated dances: trained, resumed, fine-tuned, sampled from.

use std::ops::ControlFlow;

use keydance::data::choreography::{
    ChoreographyConfig, by_name, dataset_with_music, generate_with_music,
};
use keydance::data::{DataPart, Dataset};
use keydance::evaluation::sampled_dance::{Likelihood, SampledDance};
use keydance::evaluation::{EvaluationOptions, Protocol as _};
use keydance::experiment::ExperimentConfig;
use keydance::models::generator::{Given, Request};
use keydance::models::weights::SavedWeights;
use keydance::models::{Generator, ModelError};
use keydance::music::FeatureSet;
use keydance::run::RunFolder;
use keydance::training::Trainer;

pub const SMALL: &str = r#"
name = "small"
[data]
fps = 20.0
music = true
split = { share = 0.7 }
validation_share = 0.3
[model]
kind = "valleperez2021"
width = 16
heads = 2
feed_forward = 16
motion_layers = 1
audio_layers = 1
cross_layers = 1
motion_context = 12
audio_past = 10
audio_future = 4
blocks = 2
flow_width = 8
flow_heads = 2
flow_feed_forward = 8
coupling_layers = 1
[schedule]
steps = 9
batch_size = 8
[augmentation]
target_noise = 0.02
[optimiser]
learning_rate = 1e-3
clip_norm = 0.5
[checkpoint]
every_steps = 4
"#;

pub const MOGLOW: &str = r#"
name = "small_moglow"
[data]
fps = 20.0
music = true
split = { share = 0.7 }
validation_share = 0.3
[model]
kind = "moglow2020"
blocks = 2
hidden = 12
motion_context = 12
motion_past = 6
audio_past = 5
audio_future = 4
sequence = 8
[schedule]
steps = 9
batch_size = 6
shards = 2
[optimiser]
learning_rate = 1e-3
[checkpoint]
every_steps = 4
"#;

pub fn config(text: &str, sets: &[&str]) -> ExperimentConfig {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("config.toml");
    std::fs::write(&file, text).unwrap();
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    ExperimentConfig::load(&file, &sets).unwrap()
}

pub fn dances(config: &ExperimentConfig) -> Dataset {
    let dances = generate_with_music(&ChoreographyConfig {
        clips: 8,
        frames_per_clip: 150,
        seed: 4,
    });
    dataset_with_music(&by_name(dances.unwrap()), &config.data).unwrap()
}

/// Trains to the end, or until so many steps are done.
fn train(trainer: &mut Trainer<'_>, run: Option<&RunFolder>, until: u64) {
    let outcome = trainer.run(run, &mut |report| match report.step < until {
        true => ControlFlow::Continue(()),
        false => ControlFlow::Break(()),
    });
    outcome.unwrap();
}

#[test]
fn a_training_that_was_stopped_ends_at_the_same_bits() {
    for (text, sets) in [
        (SMALL, vec![]),
        (SMALL, vec!["schedule.shards=3"]),
        (SMALL, vec!["model.norm=act", "schedule.shards=3"]),
        (
            SMALL,
            vec![
                "model.norm=act",
                "model.target=linear",
                "model.linear_init=whitening",
            ],
        ),
        (SMALL, vec!["model.head=deterministic"]),
        (MOGLOW, vec![]),
    ] {
        let config = config(text, &sets);
        let data = dances(&config);
        let mut whole = Trainer::new(config.clone(), &data, 1).unwrap();
        let begun = whole.weights_digest();
        train(&mut whole, None, u64::MAX);
        assert_ne!(whole.weights_digest(), begun, "{sets:?}");

        let folder = tempfile::tempdir().unwrap();
        let run = RunFolder::create(&folder.path().join("run"), &config).unwrap();
        let mut first = Trainer::new(config.clone(), &data, 2).unwrap();
        train(&mut first, Some(&run), 5);
        let mut second = Trainer::new(config.clone(), &data, 2).unwrap();
        assert_eq!(second.resume(&run).unwrap().steps, 5);
        train(&mut second, Some(&run), u64::MAX);
        assert_eq!(second.weights_digest(), whole.weights_digest(), "{sets:?}");

        // The saved model is the trained one.
        let saved = run.trained_model(&config).unwrap();
        let asked = [request(&*saved, &data, 3)];
        let of = |model: &dyn Generator| model.generate(&asked).unwrap().remove(0);
        let (saved, trained) = (of(&*saved), of(&*second.model()));
        let apart = &saved.positions - &trained.positions;
        assert!(apart.iter().all(|it| it.abs() < 1e-2), "{sets:?}");
    }
}

#[test]
fn the_least_factors_of_a_flow_are_watched_and_out_of_bounds_they_alarm() {
    for text in [SMALL, MOGLOW] {
        let config = config(text, &[]);
        let data = dances(&config);
        let mut trainer = Trainer::new(config, &data, 1).unwrap();
        let mut reports = Vec::new();
        let outcome = trainer.run(None, &mut |report| {
            reports.push(report.clone());
            ControlFlow::Continue(())
        });
        outcome.unwrap();
        let mut last = reports.pop().unwrap();
        let names: Vec<&str> = last.watched.iter().map(|it| it.name).collect();
        assert_eq!(names, ["log_norm", "log_s", "log_scale"]);
        assert!(last.watched.iter().all(|it| it.least.is_finite()));
        assert_eq!(last.alarms().count(), 0);
        let line = serde_json::to_value(&last).unwrap();
        assert_eq!(line["watched"]["log_s"], last.watched[1].least);
        last.watched[1].least = last.watched[1].bound - 0.1;
        let alarms: Vec<&str> = last.alarms().map(|it| it.name).collect();
        assert_eq!(alarms, ["log_s"]);
    }
}

#[test]
fn threads_without_a_shard_are_told_before_a_training_begins() {
    let config = config(MOGLOW, &["schedule.shards=2"]);
    let data = dances(&config);
    let idle = |threads: usize| {
        let trainer = Trainer::new(config.clone(), &data, threads).unwrap();
        let warnings = trainer.warnings().into_iter();
        warnings
            .filter(|it| it.contains("to do"))
            .collect::<Vec<_>>()
    };
    assert!(idle(1).is_empty() && idle(2).is_empty());
    assert!(idle(3)[0].starts_with("1 thread has nothing to do: a step has 2 shards"));
    assert!(idle(5)[0].starts_with("3 threads have nothing to do"));
}

/// The beginning of the first test clip with its song, for a dance of 30 frames.
fn request(model: &dyn Generator, data: &Dataset, seed: u64) -> Request {
    let recording = &data.test[0];
    let clip = &recording.clip;
    let music = recording.music.as_ref().unwrap();
    let music = music.features(model.music_features()).mapv(f64::from);
    let given = clip.poses.iter().take(12).enumerate();
    Request {
        given: given
            .map(|(frame, pose)| Given {
                frame: frame as i64,
                pose: pose.clone(),
                features: None,
            })
            .collect(),
        music: Some(music),
        seed,
        ..Request::new(clip.skeleton.clone(), clip.frame_time, 30)
    }
}

#[test]
fn a_dance_follows_from_its_own_seed_alone_and_begins_with_what_is_given() {
    for text in [SMALL, MOGLOW] {
        let config = config(text, &["generation.clamp=3.0"]);
        let data = dances(&config);
        let model = Trainer::new(config, &data, 1).unwrap().model();
        assert_eq!(model.music_features(), FeatureSet::Transflower91);
        let asked: Vec<Request> = [1, 2, 3].map(|seed| request(&*model, &data, seed)).into();
        let together = model.generate(&asked).unwrap();
        for (request, motion) in asked.iter().zip(&together) {
            motion.check(request).unwrap();
            let alone = model
                .generate(std::slice::from_ref(request))
                .unwrap()
                .remove(0);
            assert_eq!(&alone, motion, "the others of a call change nothing");
            let poses = motion.poses.as_ref().unwrap();
            for given in &request.given {
                assert_eq!(poses[given.frame as usize], given.pose);
            }
        }
        assert_ne!(together[0], together[1], "other seeds, other dances");
        // A song that ends early is heard on, unless that is not allowed.
        let mut short = asked[0].clone();
        short.music = short
            .music
            .map(|it| it.slice(ndarray::s![..30, ..]).to_owned());
        model.generate(&[short]).unwrap();
    }
}

#[test]
fn music_behind_the_last_frame_is_asked_for_where_it_may_not_be_made_up() {
    let config = config(
        SMALL,
        &["generation.pad_audio=false", "generation.clamp=3.0"],
    );
    let data = dances(&config);
    let model = Trainer::new(config, &data, 1).unwrap().model();
    let mut asked = request(&*model, &data, 1);
    model.generate(std::slice::from_ref(&asked)).unwrap();
    asked.music = asked
        .music
        .map(|it| it.slice(ndarray::s![..30, ..]).to_owned());
    let error = model.generate(&[asked]).unwrap_err().to_string();
    assert!(error.contains("33 frames of music"), "{error}");
    assert!(error.contains("generation.pad_audio"), "{error}");
}

#[test]
fn a_dance_that_leaves_all_that_is_danced_names_its_frame_and_channel() {
    let config = config(SMALL, &["generation.temperature=1000.0"]);
    let data = dances(&config);
    let model = Trainer::new(config, &data, 1).unwrap().model();
    let asked = [request(&*model, &data, 1), request(&*model, &data, 2)];
    let error = model.generate(&asked).unwrap_err();
    match &error {
        ModelError::Diverged {
            request,
            frame,
            channel,
            deviations,
            ..
        } => {
            assert!(*request < 2 && *frame == 12 && !channel.is_empty());
            assert!(deviations.is_nan() || deviations.abs() > 10.0);
        }
        other => panic!("{other}"),
    }
    let text = error.to_string();
    assert!(
        text.contains("frame 12") && text.contains("generation.clamp"),
        "{text}"
    );
}

#[test]
fn likelihoods_tell_own_knowledge_from_that_of_other_windows() {
    for text in [SMALL, MOGLOW] {
        let config = config(text, &[]);
        let data = dances(&config);
        let model = Trainer::new(config, &data, 1).unwrap().model();
        let options = EvaluationOptions {
            most_windows: Some(12),
            ..EvaluationOptions::default()
        };
        let scored = Likelihood::new(&options).evaluate(&*model, &data, DataPart::Validation);
        let scores = scored.unwrap().scores;
        let score = |key: &str| scores.row(key).unwrap().at("all").unwrap();
        assert_eq!(scores.windows_of("all"), Some(12));
        let own = score("bits");
        assert!(own.is_finite());
        if text == SMALL {
            // Before any training MoGlow's couplings heed nothing.
            for key in [
                "bits_foreign_latent",
                "bits_foreign_music",
                "bits_without_music",
            ] {
                assert!(score(key).is_finite() && score(key) != own, "{key}");
            }
            let [latent, music] = ["bits_foreign_latent", "bits_foreign_music"].map(score);
            assert_ne!(
                latent, music,
                "past motion is known of the other window, too"
            );
        }
    }
}

#[test]
fn sampled_dances_of_the_test_part_are_scored_beside_the_recorded_ones() {
    let config = config(SMALL, &["generation.clamp=3.0"]);
    let data = dances(&config);
    let model = Trainer::new(config, &data, 1).unwrap().model();
    let protocol = SampledDance::new(&EvaluationOptions::default());
    let scores = protocol
        .evaluate(&*model, &data, DataPart::Test)
        .unwrap()
        .scores;
    let songs = data.test.len();
    assert_eq!(scores.windows_of("all"), Some(songs * songs.min(5)));
    assert_eq!(scores.windows_of("no music"), Some(songs));
    for key in ["fpd", "fpd_real", "fmd", "step", "step_real", "divergence"] {
        let score = scores.row(key).unwrap().at("all").unwrap();
        assert!(score.is_finite(), "{key}");
    }
    assert_eq!(scores.row("divergence").unwrap().at("all"), Some(0.0));
}

#[test]
fn the_best_validation_score_decides_the_weights_also_after_a_break() {
    let sets = [
        "validation.every_steps=2",
        "validation.windows=6",
        "validation.keep_best=true",
        // So large a rate that the last weights are not the best.
        "optimiser.learning_rate=0.03",
        "schedule.steps=12",
    ];
    let config = config(SMALL, &sets);
    let data = dances(&config);
    let mut bits = Vec::new();
    let mut whole = Trainer::new(config.clone(), &data, 1).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let run = RunFolder::create(&folder.path().join("whole"), &config).unwrap();
    let outcome = whole.run(Some(&run), &mut |report| {
        if let Some(scores) = &report.validation {
            bits.push((scores.row("bits").unwrap().at("all").unwrap(), report.step));
        }
        ControlFlow::Continue(())
    });
    outcome.unwrap();
    let best = bits.iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1;
    let manifest = run.manifest().unwrap().unwrap();
    assert_eq!(manifest.best_step, Some(best), "{bits:?}");
    assert_eq!(manifest.weights_digest, Some(whole.weights_digest()));

    let run = RunFolder::create(&folder.path().join("broken"), &config).unwrap();
    let mut first = Trainer::new(config.clone(), &data, 1).unwrap();
    train(&mut first, Some(&run), 9);
    let mut second = Trainer::new(config, &data, 1).unwrap();
    second.resume(&run).unwrap();
    train(&mut second, Some(&run), u64::MAX);
    assert_eq!(second.weights_digest(), whole.weights_digest());
}

#[test]
fn fine_tuning_starts_from_trained_weights_and_their_numbers() {
    let base = config(SMALL, &[]);
    let data = dances(&base);
    let folder = tempfile::tempdir().unwrap();
    let run = RunFolder::create(&folder.path().join("base"), &base).unwrap();
    let mut trained = Trainer::new(base.clone(), &data, 1).unwrap();
    train(&mut trained, Some(&run), u64::MAX);
    let start = SavedWeights::read(&run.newest_weights().unwrap()).unwrap();

    let name = &data.train[0].clip.name[..16];
    let clips = format!("schedule.clips=[\"{name}\"]");
    let tuned = config(
        SMALL,
        &["name=tuned", "start=small", &clips, "schedule.batch_size=4"],
    );
    let trainer = Trainer::from_weights(tuned.clone(), &data, 1, Some(&start)).unwrap();
    assert_eq!(trainer.weights_digest(), trained.weights_digest());
    assert_eq!(trainer.task().statistics(), {
        let again = Trainer::from_weights(tuned.clone(), &data, 1, Some(&start)).unwrap();
        again.task().statistics()
    });
    let windows = |trainer: &Trainer<'_>| trainer.task().facts()["training_windows"].clone();
    assert!(windows(&trainer).as_u64() < windows(&trained).as_u64());

    let error = Trainer::new(tuned, &data, 1).err().unwrap().to_string();
    assert!(
        error.contains("--start") && error.contains("small"),
        "{error}"
    );
    let error = Trainer::from_weights(base, &data, 1, Some(&start))
        .err()
        .unwrap();
    assert!(error.to_string().contains("key start"), "{error}");
    let unknown = config(SMALL, &["start=small", "schedule.clips=[\"waltz\"]"]);
    let error = Trainer::from_weights(unknown, &data, 1, Some(&start))
        .err()
        .unwrap();
    assert!(error.to_string().contains("waltz"), "{error}");
}
