//! Trainings on several ranks, which are threads here: the bits of one process, and what ends them.

use std::ops::ControlFlow;

use keydance::data::Dataset;
use keydance::experiment::ExperimentConfig;
use keydance::run::RunFolder;
use keydance::training::{Outcome, Trainer};

use crate::sampled_training::{MOGLOW, SMALL, config, dances};
use crate::thread_ranks::on_each;

/// The weights' digest and the losses of all steps of a training by itself.
fn alone(config: &ExperimentConfig, dataset: &Dataset) -> (String, Vec<f64>) {
    trained(Trainer::new(config.clone(), dataset, 2).unwrap())
}

fn trained(mut trainer: Trainer<'_>) -> (String, Vec<f64>) {
    let mut losses = Vec::new();
    let outcome = trainer.run(None, &mut |report| {
        losses.push(report.total);
        ControlFlow::Continue(())
    });
    assert_eq!(outcome.unwrap(), Outcome::Finished);
    (trainer.weights_digest(), losses)
}

#[test]
fn ranks_end_at_the_bits_and_losses_of_one_process_however_many_they_are() {
    for (text, sets) in [
        (SMALL, vec!["schedule.shards=4"]),
        (SMALL, vec!["schedule.shards=3", "model.norm=act"]),
        (SMALL, vec!["schedule.shards=2", "model.head=deterministic"]),
        (
            SMALL,
            vec!["validation.every_steps=4", "validation.keep_best=true"],
        ),
        (MOGLOW, vec!["schedule.shards=5"]),
    ] {
        let config = config(text, &sets);
        let dataset = dances(&config);
        let expected = alone(&config, &dataset);
        for count in [2, 3, 6] {
            let found = on_each(count, |rank| {
                let mut trainer =
                    Trainer::new(config.clone(), &dataset, 1 + rank.rank % 2).unwrap();
                trainer.join(rank).unwrap();
                trained(trainer)
            });
            assert_eq!(found[0], expected, "{sets:?} on {count} ranks");
            // The others end with the last weights, the first with the best where it keeps them.
            let rest = found.iter().skip(1);
            assert!(rest.clone().all(|(weights, _)| *weights == found[1].0));
        }
    }
}

#[test]
fn a_run_that_was_stopped_goes_on_with_another_number_of_ranks_to_the_same_bits() {
    let config = config(MOGLOW, &["schedule.shards=3"]);
    let dataset = dances(&config);
    let (expected, _) = alone(&config, &dataset);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    for (count, until, outcome) in [
        (2, 3, Outcome::Stopped),
        (3, 6, Outcome::Stopped),
        (1, u64::MAX, Outcome::Finished),
    ] {
        let found = on_each(count, |rank| {
            let mut trainer = Trainer::new(config.clone(), &dataset, 1).unwrap();
            let run = (rank.rank == 0).then(|| match until {
                3 => RunFolder::create(&path, &config).unwrap(),
                _ => {
                    let run = RunFolder::resume(&path, &config).unwrap();
                    trainer.resume(&run).unwrap();
                    run
                }
            });
            let last = rank.rank + 1 == count;
            trainer.join(rank).unwrap();
            // The last rank alone is asked to stop.
            let outcome = trainer.run(
                run.as_ref(),
                &mut |report| match last && report.step >= until {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                },
            );
            (outcome.unwrap(), trainer.weights_digest())
        });
        assert!(found.iter().all(|(found, _)| *found == outcome));
        if outcome == Outcome::Finished {
            assert_eq!(found[0].1, expected);
        }
    }
}

#[test]
fn a_rank_with_another_config_or_other_data_is_named_on_all() {
    let config = config(MOGLOW, &[]);
    let dataset = dances(&config);
    let mut other = config.clone();
    other.seed += 1;
    let mut elsewhere = dances(&config);
    elsewhere.digest = "0".repeat(64);
    let errors = |config_of_last: &ExperimentConfig, data_of_last: &Dataset| {
        on_each(3, |rank| {
            let (config, dataset) = match rank.rank {
                2 => (config_of_last, data_of_last),
                _ => (&config, &dataset),
            };
            let mut trainer = Trainer::new(config.clone(), dataset, 1).unwrap();
            trainer.join(rank).unwrap_err().to_string()
        })
    };
    for error in errors(&other, &dataset) {
        let (theirs, ours) = (other.seed, config.seed);
        let expected =
            format!("rank 2: its config is seed = {theirs}, that of rank 0 is seed = {ours}");
        assert!(error.starts_with(&expected), "{error}");
    }
    for error in errors(&config, &elsewhere) {
        assert!(error.starts_with("rank 2: its data is 000"), "{error}");
    }
}

#[test]
fn a_training_that_diverges_says_so_on_every_rank() {
    let config = config(
        MOGLOW,
        &["optimiser.learning_rate=1e30", "schedule.shards=3"],
    );
    let dataset = dances(&config);
    let ended = on_each(3, |rank| {
        let mut trainer = Trainer::new(config.clone(), &dataset, 1).unwrap();
        trainer.join(rank).unwrap();
        let outcome = trainer.run(None, &mut |_| ControlFlow::Continue(()));
        outcome.unwrap_err()
    });
    for error in ended {
        assert!(error.is_divergence(), "{error}");
    }
}
