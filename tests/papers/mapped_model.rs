//! A model of the dance skeleton on clips of another, which it sees by `model.mapping`.

use std::ops::ControlFlow;

use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::data::{DataPart, Dataset};
use keydance::evaluation::Protocol as _;
use keydance::evaluation::in_betweening::InBetweening;
use keydance::experiment::ExperimentConfig;
use keydance::motion::{Clip, DANCE_JOINTS};
use keydance::training::{Outcome, Trainer};

const MODEL: &str = "name = 'pan'\npaper = 'li2023'\ndata.split = { share = 0.7 }\n\
    [model]\nkind = 'pan2021'\nhidden = 8\ncode = 8\nheads = 2\nencoder_layers = 1\n\
    decoder_layers = 1\nfeed_forward = 8\n\
    [schedule]\nmin_len = 4\nmax_len = 49\nmax_len_step = 9\nframe_steps = 600\nbatch_size = 4\n";

fn clips() -> Vec<Clip> {
    let choreography = ChoreographyConfig {
        clips: 4,
        frames_per_clip: 120,
        seed: 2,
    };
    let clips = generate(&choreography).unwrap().into_iter();
    clips.map(|it| it.clip).collect()
}

/// The same clips with the feet's last joints called as LaFAN1 calls them.
fn renamed() -> Vec<Clip> {
    let mut clips = clips();
    for joint in clips.iter_mut().flat_map(|it| &mut it.skeleton.joints) {
        joint.name = joint.name.replace("ToeBase", "Toe");
    }
    clips
}

fn trained(text: &str, clips: Vec<Clip>) -> (ExperimentConfig, Dataset) {
    let config = ExperimentConfig::parse(text, "test").unwrap();
    let data = Dataset::from_clips(clips, &config.data).unwrap();
    (config, data)
}

#[test]
fn a_model_sees_clips_through_its_mapping_as_it_sees_the_dance_skeleton() {
    let names = DANCE_JOINTS.iter();
    let lines = names.map(|name| format!("{name} = '{}'\n", name.replace("ToeBase", "Toe")));
    let mapping: String = lines.collect();
    let mapped = format!("{MODEL}\n[model.mapping.joints]\n{mapping}");
    let own = trained(MODEL, clips());
    let other = trained(&mapped, renamed());
    let mut scores = Vec::new();
    let mut digests = Vec::new();
    for (config, data) in [&own, &other] {
        let mut trainer = Trainer::new(config.clone(), data, 1).unwrap();
        let outcome = trainer.run(None, &mut |_| ControlFlow::Continue(()));
        assert_eq!(outcome.unwrap(), Outcome::Finished);
        digests.push(trainer.weights_digest());
        let protocol = InBetweening::dance(&config.data, &Default::default());
        let scored = protocol.evaluate(&*trainer.model(), data, DataPart::Test);
        scores.push(scored.unwrap().scores);
    }
    assert_eq!(digests[0], digests[1]);
    // The mapping goes through the world's rotations and back: to rounding.
    for metric in [
        "l2q_local",
        "l2p_global",
        "npss_global",
        "root_error",
        "foot_skate",
    ] {
        for length in [10, 30, 50] {
            let [own, mapped] = [0, 1].map(|k| scores[k].row(metric).unwrap().at(length).unwrap());
            assert!(
                (own - mapped).abs() < 1e-9 * own,
                "{metric} {length}: {own}, {mapped}"
            );
        }
    }
}

#[test]
fn a_mapping_that_declares_units_is_refused_where_the_model_has_it() {
    let text = format!("{MODEL}\n[model.mapping]\nscale = 2.0\n[model.mapping.joints]\n");
    let joints: String = DANCE_JOINTS
        .iter()
        .map(|it| format!("{it} = '{it}'\n"))
        .collect();
    let error = ExperimentConfig::parse(&(text + &joints), "test").unwrap_err();
    let error = error.to_string();
    assert!(
        error.contains("model.mapping") && error.contains("[data]"),
        "{error}"
    );
}
