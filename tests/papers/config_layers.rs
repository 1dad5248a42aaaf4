//! Configs in layers: files on a base, a budget, `--set` on top; errors name the layer.

use std::fs;

use keydance::data::Split;
use keydance::experiment::ExperimentConfig;
use keydance::models::Shards;
use keydance::models::moglow2020::MoglowSettings;
use keydance::models::transition::{ModelConfig, TransitionSettings};
use keydance::step::measure::MeasuredStep;

use crate::sampled_training::{MOGLOW, SMALL};

fn settings(config: &ExperimentConfig) -> &TransitionSettings {
    TransitionSettings::of(config).unwrap()
}

fn load(files: &[(&str, &str)], sets: &[&str]) -> Result<ExperimentConfig, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::create_dir_all(folder.path().join(name).parent().unwrap()).unwrap();
        fs::write(folder.path().join(name), text).unwrap();
    }
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    ExperimentConfig::load(&folder.path().join(files[0].0), &sets)
        .map_err(|error| error.to_string())
}

#[test]
fn an_empty_config_is_the_papers() {
    let config = load(&[("a.toml", "")], &[]).unwrap();
    assert_eq!(config, ExperimentConfig::default());
    assert_eq!(settings(&config).schedule.batch_size, 128);
    assert_eq!(config.optimiser.learning_rate, 1e-4);
    assert_eq!(settings(&config).scheduled_sampling.decay, 0.99995);
}

#[test]
fn a_file_overrides_its_base_and_the_command_line_overrides_both() {
    let config = load(
        &[
            (
                "sub/a.toml",
                "base = '../b.toml'\nseed = 3\nschedule.max_len = 9",
            ),
            (
                "b.toml",
                "name = 'b'\nseed = 2\n[schedule]\nmax_len = 8\nshards = 2\nfraction = 1",
            ),
        ],
        &["schedule.fraction=0.25", "name=c-1", "data.split.share=0.5"],
    )
    .unwrap();
    assert_eq!((config.seed, config.name.as_str()), (3, "c-1"));
    let schedule = &settings(&config).schedule;
    assert_eq!(
        (schedule.max_len, schedule.shards, schedule.fraction),
        (9, Shards::Fixed(2), 0.25)
    );
    assert_eq!(config.data.split, Split::Share(0.5));
}

#[test]
fn shards_follow_from_the_batch_where_they_are_not_given() {
    let pan = "model.kind = 'pan2021'";
    for (config, sets, batch, shards) in [
        (pan, vec![], 128, 4),
        (pan, vec!["schedule.batch_size=512"], 512, 16),
        (pan, vec![], 8, 1),
        (pan, vec!["schedule.shards=16"], 128, 16),
        ("model.kind = 'li2023'", vec![], 12, 2),
        ("model.kind = 'li2023'", vec!["schedule.shards=12"], 3, 3),
        ("model.kind = 'pu2022'", vec![], 20, 4),
        (SMALL, vec![], 64, 2),
        (MOGLOW, vec!["schedule.shards=from_batch"], 64, 2),
    ] {
        let config = load(&[("a.toml", config)], &sets).unwrap();
        let toml = config.to_toml().unwrap();
        let given = sets
            .iter()
            .find_map(|set| set.strip_prefix("schedule.shards="));
        let given = given.filter(|given| *given != "from_batch");
        let written = format!("shards = {}\n", given.unwrap_or("\"from_batch\""));
        assert!(toml.contains(&written), "{toml}");
        let step = MeasuredStep::new(&config, None, batch, 1).unwrap();
        assert_eq!(step.shards(), shards, "{}, {batch}", config.model.kind());
    }
}

#[test]
fn a_budget_overrides_the_file_and_the_command_line_both() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    };
    let config = file(
        "a.toml",
        "name = 'a'\nschedule.fraction = 1\nschedule.max_len = 9",
    );
    let budget = file("b.toml", "schedule = { fraction = 0.5, batch_size = 16 }");
    let set = "schedule.batch_size=32".to_string();
    let config = ExperimentConfig::load_under(&config, Some(&budget), &[set]).unwrap();
    let schedule = &settings(&config).schedule;
    assert_eq!(
        (schedule.max_len, schedule.fraction, schedule.batch_size),
        (9, 0.5, 32)
    );
}

#[test]
fn a_budget_is_over_models_of_any_kind_but_the_command_line_over_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let (config, budget) = (folder.path().join("a.toml"), folder.path().join("b.toml"));
    fs::write(&config, "model.kind = 'slerp'").unwrap();
    fs::write(&budget, "seed = 4\nschedule.fraction = 0.5").unwrap();
    let read = ExperimentConfig::load_under(&config, Some(&budget), &[]).unwrap();
    assert_eq!(read.seed, 4);
    let set = "schedule.fraction=0.5".to_string();
    let error = ExperimentConfig::load_under(&config, None, &[set]).unwrap_err();
    assert!(error.to_string().contains("schedule"), "{error}");
    fs::write(&budget, "scedule.fraction = 0.5").unwrap();
    let error = ExperimentConfig::load_under(&config, Some(&budget), &[]).unwrap_err();
    assert!(error.to_string().contains("scedule"), "{error}");
}

#[test]
fn what_a_budget_says_of_keys_that_only_other_models_have_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let (config, budget) = (folder.path().join("a.toml"), folder.path().join("b.toml"));
    fs::write(&config, "model.kind = 'moglow2020'").unwrap();
    // Both models have blocks, Transflower alone a width.
    let text = "[model]\nwidth = 16\nblocks = 3\n[rows.moglow.model]\nhidden = 8";
    fs::write(&budget, text).unwrap();
    let read = ExperimentConfig::load_under(&config, Some(&budget), &[]).unwrap();
    let model = read.model.downcast_ref::<MoglowSettings>().unwrap();
    assert_eq!((model.model.blocks, model.model.hidden), (3, 8));
    fs::write(&budget, "[model]\nwidht = 16").unwrap();
    let error = ExperimentConfig::load_under(&config, Some(&budget), &[]).unwrap_err();
    assert!(error.to_string().contains("widht"), "{error}");
}

#[test]
fn what_a_budget_says_of_transformers_is_left_out_for_a_model_without_them() {
    let rate = "optimiser.transformer_learning_rate=2e-4";
    let of = |model: &str, sets: &[&str]| load(&[("a.toml", model)], sets).unwrap();
    let whole = of("", &[rate]).optimiser;
    assert_eq!(whole.rates["transformers"], 2e-4);
    for model in [
        "model.controllers = 'fully_connected'",
        "model.kind = 'harvey2020'",
    ] {
        assert_eq!(of(model, &[rate]), of(model, &[]));
    }
    let text = load(
        &[("a.toml", "")],
        &["optimiser.transformer_learning_rate=0"],
    );
    let text = text.unwrap_err();
    assert!(text.contains("= 0: expected a number above 0"), "{text}");
}

#[test]
fn the_resolved_config_reads_back_as_itself() {
    let config = load(
        &[("a.toml", "[data.split.list]\ntrain = ['a']\ntest = ['b']")],
        &[],
    );
    let config = config.unwrap();
    let text = config.to_toml().unwrap();
    assert_eq!(ExperimentConfig::parse(&text, "text").unwrap(), config);
}

#[test]
fn a_default_may_be_written_down() {
    let written = load(&[("a.toml", "[data]\nunit = 'auto'\nskip_frames = 0")], &[]);
    assert_eq!(written.unwrap(), load(&[("a.toml", "")], &[]).unwrap());
}

#[test]
fn an_unknown_key_is_named_with_its_file() {
    let base = ("b.toml", "[schedule]\nmax_length = 3");
    let text = load(&[("a.toml", "base = 'b.toml'"), base], &[]).unwrap_err();
    assert!(
        text.contains("b.toml") && text.contains("max_length"),
        "{text}"
    );
    let text = load(&[("a.toml", "")], &["optimiser.momentum=1"]).unwrap_err();
    assert!(
        text.contains("--set optimiser.momentum=1") && text.contains("`momentum`"),
        "{text}"
    );
    let text = load(
        &[("a.toml", "[model]\nkind = 'interpolation'\nlayers = 2")],
        &[],
    );
    let text = text.unwrap_err();
    assert!(text.contains("a.toml") && text.contains("layers"), "{text}");
}

#[test]
fn a_base_that_rests_on_itself_is_an_error() {
    let files = [("a.toml", "base = 'b.toml'"), ("b.toml", "base = 'a.toml'")];
    let text = load(&files, &[]).unwrap_err();
    assert!(
        text.contains("a.toml -> ") && text.contains("b.toml"),
        "{text}"
    );
}

#[test]
fn a_bad_value_names_key_and_remedy() {
    for (set, words) in [
        (
            "schedule.fraction=0",
            ["schedule.fraction = 0", "above 0 and at most 1"],
        ),
        (
            "schedule.fraction=nan",
            ["schedule.fraction = NaN", "above 0"],
        ),
        (
            "schedule={ fraction = 0.5, frame_steps = 1000 }",
            [
                "schedule.frame_steps = 1000",
                "schedule.fraction = 1 leaves",
            ],
        ),
        (
            "schedule.frame_steps=0",
            ["schedule.frame_steps = 0", "at least 1"],
        ),
        (
            "schedule.shards=129",
            ["schedule.shards = 129", "from 1 to 128, or from_batch"],
        ),
        (
            "schedule.shards=many",
            ["schedule.shards=many", "from_batch"],
        ),
        ("schedule.max_len=4", ["schedule.max_len = 4", "from 5 to"]),
        (
            "optimiser.learning_rate=-1",
            ["optimiser.learning_rate = -1", "above 0"],
        ),
        (
            "optimiser.rate_schedule.final_share=1.5",
            [
                "optimiser.rate_schedule.final_share = 1.5",
                "at least 0 and at most 1",
            ],
        ),
        (
            "optimiser.rate_schedule.shape=step",
            ["--set optimiser.rate_schedule.shape=step", "cosine"],
        ),
        ("seed=-1", ["--set seed=-1", "-1"]),
        ("seed", ["--set seed", "no '='"]),
        ("a..b=1", ["--set a..b=1", "dotted key"]),
        ("name=[1", ["--set name=[1", "not TOML"]),
        ("name=../x", ["name = ../x", "letters"]),
        ("schedule=3", ["--set schedule=3", "schedule"]),
        (
            "checkpoint.every_steps=0",
            ["every_steps = 0", "at least 1"],
        ),
        ("checkpoint.keep=0", ["checkpoint.keep = 0", "from 1 to"]),
        ("log.every_steps=0", ["log.every_steps = 0", "at least 1"]),
        (
            "scheduled_sampling.decay=1.5",
            ["scheduled_sampling.decay = 1.5", "at most 1"],
        ),
        ("optimiser.beta1=1", ["optimiser.beta1 = 1", "below 1"]),
        (
            "optimiser.clip_norm=0",
            ["optimiser.clip_norm = 0", "a number above 0"],
        ),
        (
            "seed=9223372036854775808",
            ["seed=9223372036854775808", "seed"],
        ),
        (
            "validation={ every_steps = 0 }",
            ["validation.every_steps = 0", "at least 1"],
        ),
        (
            "validation={ every_steps = 9, lengths = [] }",
            ["validation.lengths = []", "at least one length"],
        ),
    ] {
        let text = load(&[("a.toml", "")], &[set]).unwrap_err();
        assert!(
            words.iter().all(|word| text.contains(word)),
            "{set}: {text}"
        );
    }
    let text = load(&[("a.toml", "seed = = 3")], &[]).unwrap_err();
    assert!(text.contains("a.toml") && text.contains("line 1"), "{text}");
}

#[test]
fn differences_name_the_key_and_both_values() {
    let other = load(&[("a.toml", "schedule.fraction = 0.5")], &[]).unwrap();
    let found = ExperimentConfig::default().differences(&other).unwrap();
    assert_eq!(found, ["schedule.fraction: 1.0, 0.5"]);
}

#[test]
fn a_budgets_table_of_a_row_is_over_the_experiment_of_that_name_alone() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    };
    let budget = file(
        "b.toml",
        "schedule.batch_size = 32\n[rows.pan]\nschedule.batch_size = 16\nmodel.loss.key = 2\n\
         [rows.other]\nschedule.batch_size = 8",
    );
    let of = |name: &str| {
        let config = file("a.toml", &format!("name = '{name}'"));
        ExperimentConfig::load_under(&config, Some(&budget), &[])
    };
    let keys = |name: &str| {
        let config = of(name).unwrap();
        let own = settings(&config);
        let ModelConfig::Pan2021(model) = &own.model else {
            panic!("not the default kind");
        };
        (own.schedule.batch_size, model.loss.key)
    };
    let default = keys("any").1;
    assert_eq!(keys("any"), (32, default));
    assert_eq!(keys("pan"), (16, 2.0));
    assert_eq!(keys("other"), (8, default));

    fs::write(&budget, "[rows.pan]\nschedule.bach_size = 16").unwrap();
    assert_eq!(keys("any"), (128, default));
    let error = of("pan").unwrap_err().to_string();
    assert!(
        error.contains("b.toml: unknown") && error.contains("bach_size"),
        "{error}"
    );
}
