//! The linear Gaussian baseline: the likelihoods that are known of the Motorica dances, and the
//! laws of what is fitted.

use keydance::data::{DataPart, Dataset};
use keydance::evaluation::sampled_dance::Likelihood;
use keydance::evaluation::{EvaluationOptions, Protocol as _};
use keydance::experiment::ExperimentConfig;
use keydance::models::Generator;
use keydance::models::generator::{Given, Request};

use crate::motorica_data::motorica_folder;
use crate::sampled_training::{config, dances};

const SMALL: &str = r#"
name = "gaussian"
[data]
fps = 20.0
music = true
split = { share = 0.7 }
validation_share = 0.3
[model]
kind = "linear_gaussian"
motion_context = 12
audio_past = 10
audio_future = 4
"#;

fn fitted(config: &ExperimentConfig, data: &Dataset) -> Box<dyn Generator> {
    let mut model = config.model.untrained(&config.data).unwrap();
    model.look_up_in(&data.train).unwrap();
    model
}

fn bits(config: &ExperimentConfig, data: &Dataset, part: DataPart) -> f64 {
    let protocol = Likelihood::new(&EvaluationOptions::default());
    let scored = protocol.evaluate(&*fitted(config, data), data, part);
    let scores = scored.unwrap().scores;
    scores.row("bits").unwrap().at("all").unwrap()
}

#[test]
fn likelihoods_on_motorica_are_those_of_the_specification() {
    let Some(folder) = motorica_folder() else {
        return;
    };
    let motorica = r#"
name = "gaussian"
[data]
split = "motorica"
fps = 20.0
[features]
audio = "as_given"
[augmentation]
mirror = false
[model]
kind = "linear_gaussian"
motion_context = 60
audio_past = 60
audio_future = 20
"#;
    let mut data = None;
    for (base, covariance, expected) in [
        ("zero", "unit", 115.0),
        ("mean", "diagonal", 107.5),
        ("mean", "full", 6.4),
        ("last_frame", "diagonal", 47.8),
        ("last_frame", "full", -30.9),
        ("last_frames", "diagonal", 21.4),
        ("last_frames", "full", -47.4),
        ("own_frames", "diagonal", -28.3),
        ("own_frames", "full", -47.2),
    ] {
        let sets = [
            format!("model.base={base}"),
            format!("model.covariance={covariance}"),
        ];
        let config = config(motorica, &[&sets[0], &sets[1]]);
        let data = data.get_or_insert_with(|| Dataset::load(&folder, &config.data).unwrap());
        let found = bits(&config, data, DataPart::Validation);
        // Whether windows overlap where it estimated covariances the specification does not say.
        let tolerance = if covariance == "full" { 1.0 } else { 0.1 };
        assert!(
            (found - expected).abs() < tolerance,
            "{base}, {covariance}: {found}"
        );
    }
}

#[test]
fn what_is_fitted_more_freely_is_likelier_on_what_it_was_fitted_to() {
    let of = |base: &str, covariance: &str| {
        let sets = [
            format!("model.base={base}"),
            format!("model.covariance={covariance}"),
        ];
        let config = config(SMALL, &[&sets[0], &sets[1], "augmentation.mirror=false"]);
        bits(&config, &dances(&config), DataPart::Train)
    };
    let standard = of("zero", "unit");
    let [mean, own] = ["mean", "own_frames"].map(|base| {
        let [diagonal, full] = ["diagonal", "full"].map(|covariance| of(base, covariance));
        assert!(
            full < diagonal && diagonal < standard,
            "{base}: {full}, {diagonal}"
        );
        diagonal
    });
    assert!(own < mean);
}

#[test]
fn a_dance_follows_from_its_seed_and_without_temperature_from_its_past_alone() {
    let config = config(SMALL, &[]);
    let data = dances(&config);
    let model = fitted(&config, &data);
    let clip = &data.test[0].clip;
    let given = clip.poses.iter().take(12).enumerate();
    let request = |seed| Request {
        given: given
            .clone()
            .map(|(frame, pose)| Given {
                frame: frame as i64,
                pose: pose.clone(),
                features: None,
            })
            .collect(),
        seed,
        ..Request::new(clip.skeleton.clone(), clip.frame_time, 30)
    };
    let of = |model: &dyn Generator, seed| model.generate(&[request(seed)]).unwrap().remove(0);
    assert_eq!(of(&*model, 1), of(&*model, 1));
    assert_ne!(of(&*model, 1), of(&*model, 2));
    let still = crate::sampled_training::config(SMALL, &["generation.temperature=0"]);
    let still = fitted(&still, &data);
    assert_eq!(of(&*still, 1), of(&*still, 2));
}

#[test]
fn without_training_clips_it_says_what_to_give() {
    let config = config(SMALL, &[]);
    let data = dances(&config);
    let model = config.model.untrained(&config.data).unwrap();
    let protocol = Likelihood::new(&EvaluationOptions::default());
    let error = protocol
        .evaluate(&*model, &data, DataPart::Test)
        .unwrap_err();
    let cause = std::error::Error::source(&error).unwrap().to_string();
    assert!(cause.contains("--data"), "{cause}");
}
