//! Harvey et al. 2020: what is built, what flows where, that gradients are right on both sides of
//! its critics, and that it trains.

use std::collections::BTreeMap;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use assert_cmd::Command;
use glam::{DQuat, DVec3};
use keydance::autograd::{Gradients, Parameters, Real, Tape, Workspace};
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::data::{Dataset, Split};
use keydance::experiment::ExperimentConfig;
use keydance::models::Shards;
use keydance::models::harvey2020::{Harvey2020, Harvey2020Config, RecurrentConfig};
use keydance::models::settings::GradientCheckOptions;
use keydance::models::transition::ModelConfig;
use keydance::models::transition::Standardisation;
use keydance::models::transition::gradient_check::{GradientCase, check_model, generated_batch};
use keydance::models::transition::{Batch, Forcing, Network, PoseWindows};
use keydance::motion::DANCE_PARENTS;
use keydance::motion::features::{
    BODY_POSITIONS, BODY_VELOCITIES, FACING, FRAME, ROOT_POSITION, ROOT_VELOCITY,
};
use keydance::motion::placement::world_positions;
use keydance::nn::Initialiser;
use keydance::optim::{Adam, AdamConfig};
use keydance::run::RunFolder;
use keydance::training::Trainer;
use ndarray::{Array2, Array3, Axis, s};
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::generated_data::write_clips;
use crate::small_training::settings;

fn adversarial() -> Harvey2020Config {
    Harvey2020Config::default()
}

fn without_critics() -> Harvey2020Config {
    Harvey2020Config {
        network: RecurrentConfig {
            adversarial: false,
            ..RecurrentConfig::default()
        },
        ..adversarial()
    }
}

struct Built<T> {
    network: Harvey2020,
    parameters: Parameters<T>,
}

fn build<T: Real>(config: &Harvey2020Config, standardisation: &Standardisation) -> Built<T> {
    let mut parameters = Parameters::new();
    let mut init = Initialiser::new(&mut parameters, ChaCha8Rng::seed_from_u64(3));
    let network = Harvey2020::new(&mut init, config, standardisation).unwrap();
    Built {
        network,
        parameters,
    }
}

fn shapes(config: &Harvey2020Config) -> BTreeMap<String, Vec<usize>> {
    let built: Built<f32> = build(config, &Standardisation::fit([]));
    let named = built.parameters.iter();
    named
        .map(|(name, value)| (name.to_owned(), value.shape().to_vec()))
        .collect()
}

#[test]
fn the_network_has_the_layers_and_inputs_of_the_paper() {
    let mut expected = BTreeMap::new();
    for (name, sizes) in [
        // 24 quaternions, root velocity, 4 contacts; root and quaternions to go; the target's
        // quaternions.
        ("state_encoder", vec![96 + 3 + 4, 512, 256]),
        ("offset_encoder", vec![3 + 96, 512, 256]),
        ("target_encoder", vec![96, 512, 256]),
        ("initial_state", vec![103 + 69, 512, 2 * 1024]),
        ("decoder", vec![1024, 512, 256, 103]),
        ("critics.short", vec![2 * 141, 512, 256, 1]),
        ("critics.long", vec![10 * 141, 512, 256, 1]),
    ] {
        for (layer, pair) in sizes.windows(2).enumerate() {
            let name = format!("{name}.{}", 2 * layer);
            expected.insert(format!("{name}.weight"), vec![pair[1], pair[0]]);
            expected.insert(format!("{name}.bias"), vec![pair[1]]);
        }
    }
    for (name, shape) in [
        ("weight_ih", vec![4096, 768]),
        ("weight_hh", vec![4096, 1024]),
        ("bias_ih", vec![4096]),
        ("bias_hh", vec![4096]),
    ] {
        expected.insert(format!("lstm.{name}_l0"), shape);
    }
    assert_eq!(shapes(&adversarial()), expected);
    expected.retain(|name, _| !name.starts_with("critics."));
    assert_eq!(shapes(&without_critics()), expected);
}

#[test]
fn the_gradients_of_network_and_critics_are_those_of_central_differences_of_their_own_losses() {
    for config in [adversarial(), without_critics()] {
        for (transition, dropout) in [(12, true), (6, false)] {
            let case = GradientCase {
                transition,
                forcing: Forcing::FreeRunning,
                dropout,
            };
            let options = GradientCheckOptions {
                frames: None,
                full_size: false,
                windows: 2,
                per_parameter: 3,
                seed: 1,
            };
            let model = ModelConfig::Harvey2020(config.small());
            let report = check_model(&model, case, &options).unwrap().unwrap();
            assert!(report.error() < 1e-5, "{case:?}: {report:?}");
            assert!(50 * report.kinks() <= report.compared(), "{case:?}");
            let critics = |name: &str| name.starts_with("critics.");
            let checked = report.parameters.iter().filter(|p| critics(&p.parameter));
            assert_eq!(checked.count() > 0, config.network.adversarial);
        }
    }
}

/// Terms, total and gradients of a batch, by name.
struct Losses {
    values: BTreeMap<&'static str, f64>,
    gradients: BTreeMap<String, Vec<f64>>,
}

fn losses(built: &Built<f64>, batches: &[Batch<f64>], dropout: Option<u64>) -> Losses {
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&built.parameters);
    let mut values = BTreeMap::new();
    for batch in batches {
        let mut tape = Tape::recording(&built.parameters, &mut workspace);
        tape.set_dropout(dropout);
        let losses = built
            .network
            .losses(&mut tape, batch, Forcing::FreeRunning)
            .unwrap();
        for (name, var) in losses.terms.into_iter().chain([("total", losses.total)]) {
            *values.entry(name).or_insert(0.0) += tape.values(var)[0];
        }
        tape.backward(losses.total, &mut gradients).unwrap();
    }
    let named = built.parameters.iter().map(|(name, _)| name.to_owned());
    Losses {
        values,
        gradients: named.zip(gradients.iter().map(<[f64]>::to_vec)).collect(),
    }
}

#[test]
fn the_total_is_the_weighted_sum_and_critics_change_the_networks_gradient() {
    let (batch, standardisation) = generated_batch(12, 2, 5).unwrap();
    let with = build(&adversarial().small(), &standardisation);
    let without = build(&without_critics().small(), &standardisation);
    let batches = [batch];
    let (with, without) = (
        losses(&with, &batches, None),
        losses(&without, &batches, None),
    );
    let sum = |terms: &BTreeMap<&str, f64>| {
        terms["quaternion"] + terms["root"] + 0.5 * terms["position"] + 0.1 * terms["contact"]
    };
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12 * b, "{a} {b}");
    close(without.values["total"], sum(&without.values));
    let judged = 0.1 * with.values["adversarial"] + with.values["critics"];
    close(with.values["total"], sum(&with.values) + judged);
    assert_eq!(without.values["position"], with.values["position"]);
    assert_ne!(
        with.gradients["decoder.4.bias"],
        without.gradients["decoder.4.bias"]
    );
}

#[test]
fn a_critic_that_sees_more_frames_than_there_are_has_no_say() {
    let (batch, standardisation) = generated_batch(9, 2, 5).unwrap();
    let built = build(&adversarial().small(), &standardisation);
    let found = losses(&built, &[batch], None);
    let zero = |name: &str| found.gradients[name].iter().all(|&x| x == 0.0);
    assert!(zero("critics.long.0.weight"));
    assert!(!zero("critics.short.0.weight"));
    let (batch, _) = generated_batch(1, 2, 5).unwrap();
    let found = losses(&built, &[batch], None);
    assert_eq!(found.values["critics"], 0.0);
    assert!(found.values["total"] > 0.0);
}

#[test]
fn target_noise_is_drawn_in_training_only_and_not_near_the_target() {
    let (batch, standardisation) = generated_batch(12, 2, 5).unwrap();
    let built = build(&adversarial().small(), &standardisation);
    let batches = [batch];
    let total = |key| losses(&built, &batches, key).values["total"];
    assert_eq!(total(Some(1)), total(Some(1)));
    assert_ne!(total(Some(1)), total(Some(2)));
    assert_ne!(total(Some(1)), total(None));
    let (batch, standardisation) = generated_batch(5, 2, 5).unwrap();
    let built = build(&adversarial().small(), &standardisation);
    let batches = [batch];
    let total = |key| losses(&built, &batches, key).values["total"];
    assert_eq!(total(Some(1)), total(None));
}

fn part(batch: &Batch<f64>, windows: std::ops::Range<usize>) -> Batch<f64> {
    let cut = |array: &Array3<f64>| {
        let part = array.slice(s![.., windows.clone(), ..]);
        part.as_standard_layout().into_owned()
    };
    let mut poses = batch.poses.clone().unwrap();
    poses.rotations = cut(&poses.rotations);
    poses.offsets = poses.offsets.slice(s![windows.clone(), ..]).to_owned();
    Batch {
        features: cut(&batch.features),
        poses: Some(poses),
        ..batch.clone()
    }
}

#[test]
fn shards_on_tapes_of_their_own_add_up_to_the_batch() {
    let (batch, standardisation) = generated_batch(12, 5, 19).unwrap();
    let built = build(&adversarial().small(), &standardisation);
    let shards = [part(&batch, 0..2), part(&batch, 2..3), part(&batch, 3..5)];
    let (whole, sum) = (
        losses(&built, &[batch], None),
        losses(&built, &shards, None),
    );
    for (name, value) in &whole.values {
        assert!((value - sum.values[name]).abs() < 1e-12 * value, "{name}");
    }
    for (name, gradient) in &whole.gradients {
        for (a, b) in gradient.iter().zip(&sum.gradients[name]) {
            assert!((a - b).abs() < 1e-12, "{name}: {a} {b}");
        }
    }
}

fn predict(built: &Built<f64>, batch: &Batch<f64>) -> Array3<f64> {
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&built.parameters, &mut workspace);
    built.network.predict(&mut tape, batch).unwrap()
}

/// A network whose outputs are small changes, as after some training, on windows of `transition`
/// frames.
fn calm(transition: usize, windows: usize) -> (Built<f64>, Batch<f64>, Standardisation) {
    let (batch, standardisation) = generated_batch(transition, windows, 13).unwrap();
    let mut built: Built<f64> = build(&adversarial().small(), &standardisation);
    for (name, mut value) in built.parameters.values_mut() {
        if name.starts_with("decoder.4") {
            value.mapv_inplace(|x| 0.5 * x);
        }
    }
    (built, batch, standardisation)
}

#[test]
fn a_prediction_reads_only_the_keyframes_and_is_deterministic() {
    let (built, batch, _) = calm(9, 3);
    let before = predict(&built, &batch);
    assert_eq!(predict(&built, &batch), before);
    let mut unread = batch.clone();
    // Not even the root trajectory and the velocity factors.
    unread.features.slice_mut(s![1..9, .., ..]).fill(1e6);
    unread.features.slice_mut(s![9, .., 0..69]).fill(1e6);
    unread.features.slice_mut(s![9, .., 73..]).fill(-1e6);
    let mut rotations = unread.poses.take().unwrap().rotations;
    rotations.slice_mut(s![1..9, .., ..]).fill(0.0);
    let poses = |rotations: &Array3<f64>| PoseWindows {
        rotations: rotations.clone(),
        offsets: batch.poses.clone().unwrap().offsets,
    };
    unread.poses = Some(poses(&rotations));
    assert_eq!(predict(&built, &unread), before);
    // The sign of the target's quaternions tells nothing.
    rotations.slice_mut(s![9, .., ..]).mapv_inplace(|x| -x);
    unread.poses = Some(poses(&rotations));
    assert_eq!(predict(&built, &unread), before);
}

#[test]
fn a_prediction_follows_everything_that_is_given() {
    let (built, batch, _) = calm(9, 3);
    let before = predict(&built, &batch);
    let moved = |changed: &Batch<f64>, what: &str| {
        let after = predict(&built, changed);
        for window in 0..3 {
            let [a, b] = [&before, &after].map(|x| x.index_axis(Axis(1), window));
            let moved = a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-9);
            assert_eq!(moved, window == 1, "{what}, window {window}");
        }
    };
    for (what, row, column) in [
        ("contact of k1", 0, 74),
        ("joint velocity of k1", 0, 100),
        ("root velocity of k1", 0, 147),
        ("root of k1", 0, 70),
        ("facing of k1", 0, 72),
        ("root of k2", 9, 69),
        ("facing of k2", 9, 72),
    ] {
        let mut changed = batch.clone();
        changed.features[[row, 1, column]] += 0.5;
        moved(&changed, what);
    }
    for (what, row, joint) in [
        ("root rotation of k1", 0, 0),
        ("arm of k1", 0, 15),
        ("root rotation of k2", 9, 0),
        ("leg of k2", 9, 2),
    ] {
        let mut changed = batch.clone();
        let rotations = &mut changed.poses.as_mut().unwrap().rotations;
        let mut slot = rotations.slice_mut(s![row, 1, 4 * joint..4 * joint + 4]);
        let before = DQuat::from_slice(slot.as_slice().unwrap());
        let turned = before * DQuat::from_rotation_x(0.3);
        slot.assign(&ndarray::aview1(&turned.to_array()));
        moved(&changed, what);
    }
    let mut changed = batch.clone();
    changed.poses.as_mut().unwrap().offsets[[1, 7]] *= 1.1;
    moved(&changed, "bone of k1");
}

#[test]
fn a_prediction_does_not_depend_on_where_the_dancer_is_and_looks() {
    let (built, batch, standardisation) = calm(9, 3);
    let restored = |frames: &Array3<f64>, t: usize, window: usize| {
        standardisation.restore(frames.slice(s![t..t + 1, window, ..]))
    };
    let before = predict(&built, &batch);
    let (turn, shift) = (0.7, DVec3::new(120.0, 0.0, -40.0));
    let turned = DQuat::from_rotation_y(turn);
    let mut elsewhere = batch.clone();
    for row in [0, 9] {
        for window in 0..3 {
            let mut frame = restored(&batch.features, row, window);
            for (first, shift) in [
                (ROOT_POSITION.start, shift),
                (ROOT_VELOCITY.start, DVec3::ZERO),
            ] {
                let mut part = frame.slice_mut(s![0, first..first + 3]);
                let moved = turned * DVec3::from_slice(part.as_slice().unwrap()) + shift;
                part.assign(&ndarray::aview1(&moved.to_array()));
            }
            frame[[0, FACING.start]] += turn;
            let frame = standardisation.standardise(frame.view());
            elsewhere
                .features
                .slice_mut(s![row, window, ..])
                .assign(&frame.row(0));
            let rotations = &mut elsewhere.poses.as_mut().unwrap().rotations;
            let mut root = rotations.slice_mut(s![row, window, 0..4]);
            let rotation = turned * DQuat::from_slice(root.as_slice().unwrap());
            root.assign(&ndarray::aview1(&rotation.to_array()));
        }
    }
    let after = predict(&built, &elsewhere);
    for t in 0..9 {
        for window in 0..3 {
            let (a, b) = (restored(&before, t, window), restored(&after, t, window));
            for column in BODY_POSITIONS {
                assert!((a[[0, column]] - b[[0, column]]).abs() < 1e-6);
            }
            let places = world_positions(a.row(0)).map(|p| turned * p + shift);
            for (a, b) in places.iter().zip(world_positions(b.row(0))) {
                assert!(a.distance(b) < 1e-6, "{a} {b}");
            }
        }
    }
}

#[test]
fn predicted_bones_keep_their_length_and_velocities_are_differences() {
    let (built, batch, standardisation) = calm(12, 2);
    let predicted = predict(&built, &batch);
    let offsets = &batch.poses.as_ref().unwrap().offsets;
    for window in 0..2 {
        let frames = standardisation.restore(predicted.slice(s![.., window, ..]));
        let start = standardisation.restore(batch.features.slice(s![0..1, window, ..FRAME]));
        let rows = ndarray::concatenate![Axis(0), start, frames];
        for (t, row) in rows.rows().into_iter().enumerate().skip(1) {
            let world = world_positions(row);
            for (joint, parent) in DANCE_PARENTS.iter().enumerate().skip(1) {
                let bone = offsets.slice(s![window, 3 * joint..3 * joint + 3]);
                let length = DVec3::from_slice(bone.as_slice().unwrap()).length();
                let found = world[joint].distance(world[parent.unwrap()]);
                assert!((found - length).abs() < 1e-5, "{joint}: {found} {length}");
            }
            let pairs = BODY_VELOCITIES.zip(BODY_POSITIONS);
            for (v, p) in pairs.chain(ROOT_VELOCITY.zip(ROOT_POSITION)) {
                assert!((row[v] - (row[p] - rows[[t - 1, p]])).abs() < 1e-9);
            }
        }
        let facing = [0, 12].map(|row| rows[[row, FACING.start]]);
        let number = |row| {
            let frame = standardisation.restore(batch.features.slice(s![row..=row, window, ..]));
            frame[[0, FACING.start]]
        };
        for (found, known) in facing.into_iter().zip([number(0), number(12)]) {
            let turns = (found - known) / std::f64::consts::TAU;
            assert!((turns - turns.round()).abs() < 1e-9, "{found} {known}");
        }
    }
}

#[test]
fn predictions_are_the_frames_whose_losses_training_takes() {
    let (built, batch, standardisation) = calm(12, 3);
    let predicted = predict(&built, &batch);
    let (mut root, mut position) = (0.0, 0.0);
    for window in 0..3 {
        let recorded = standardisation.restore(batch.features.slice(s![.., window, ..FRAME]));
        let frames = standardisation.restore(predicted.slice(s![.., window, ..]));
        // Losses are taken where k1 faces +Z.
        let turn = DQuat::from_rotation_y(-recorded[[0, FACING.start]]);
        for (t, frame) in frames.rows().into_iter().enumerate() {
            let truth = world_positions(recorded.row(t + 1));
            for (joint, (a, b)) in world_positions(frame).iter().zip(truth).enumerate() {
                let distance = (turn * (*a - b)).abs().element_sum();
                position += distance / 72.0;
                if joint == 0 {
                    root += distance / 3.0;
                }
            }
        }
    }
    let mean = 1.0 / (36.0 * standardisation.position_scale);
    let terms = losses(&built, &[batch], None).values;
    for (name, ours) in [("root", root * mean), ("position", position * mean)] {
        let term = terms[name];
        assert!((ours - term).abs() < 1e-9 * term, "{name}: {ours} {term}");
    }
}

#[test]
fn batches_without_poses_or_of_another_shape_are_refused_with_their_shape() {
    let (built, batch, _) = calm(4, 2);
    let without = Batch::of(batch.features.clone());
    let mut short = batch.clone();
    short.features = short.features.slice(s![..4, .., ..]).to_owned();
    let mut narrow = batch.clone();
    narrow.features = narrow.features.slice(s![.., .., ..FRAME]).to_owned();
    let mut workspace = Workspace::new();
    for (wrong, shape) in [
        (without, "[5, 2, 154]"),
        (short, "[5, 2, 96]"),
        (narrow, "[5, 2, 149]"),
    ] {
        let mut tape = Tape::inference(&built.parameters, &mut workspace);
        let error = built.network.predict(&mut tape, &wrong).unwrap_err();
        assert!(error.to_string().contains(shape), "{error}");
    }
}

#[test]
fn forward_kinematics_on_the_tape_are_those_of_the_clips() {
    let (batch, standardisation) = generated_batch(3, 4, 23).unwrap();
    let poses = batch.poses.unwrap();
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&parameters, &mut workspace);
    let rows = 4 * 4;
    let rotations = poses.rotations.into_shape_with_order((rows, 96)).unwrap();
    let rotations = tape.constant(rotations.into_dyn());
    let offsets = tape.constant(poses.offsets.into_dyn());
    let joints = tape
        .forward_kinematics(rotations, offsets, &DANCE_PARENTS)
        .unwrap();
    let joints = Array2::from_shape_vec((rows, 72), tape.values(joints).to_vec()).unwrap();
    for row in 0..rows {
        let frame = batch.features.slice(s![row / 4, row % 4..=row % 4, ..]);
        let world = world_positions(standardisation.restore(frame).row(0));
        for (joint, place) in world.iter().enumerate() {
            let found = DVec3::from_slice(&joints.row(row).to_vec()[3 * joint..]);
            assert!(found.distance(*place - world[0]) < 1e-9, "{row}, {joint}");
        }
    }
}

#[test]
fn the_network_learns_one_window_by_heart() {
    let (batch, standardisation) = generated_batch(10, 1, 29).unwrap();
    let config = Harvey2020Config {
        network: RecurrentConfig {
            hidden: 64,
            code: 32,
            recurrent: 64,
            target_noise: 0.0,
            ..RecurrentConfig::default()
        },
        ..adversarial()
    };
    let mut built: Built<f64> = build(&config, &standardisation);
    let settings = AdamConfig {
        learning_rate: 5e-3,
        ..AdamConfig::default()
    };
    let mut adam = Adam::new(settings, &built.parameters).unwrap();
    let mut gradients = Gradients::zeros(&built.parameters);
    let mut workspace = Workspace::new();
    let mut position = Vec::new();
    for _ in 0..600 {
        let mut tape = Tape::recording(&built.parameters, &mut workspace);
        let losses = built
            .network
            .losses(&mut tape, &batch, Forcing::FreeRunning)
            .unwrap();
        let term = losses.terms.iter().find(|(name, _)| *name == "position");
        position.push(tape.values(term.unwrap().1)[0]);
        tape.backward(losses.total, &mut gradients).unwrap();
        adam.step(&mut built.parameters, &mut gradients).unwrap();
    }
    let (first, last) = (position[0], position[599]);
    assert!(last < 0.05 * first, "{first} became {last}");
    let predicted = predict(&built, &batch);
    let lrp = |t: usize| {
        let [a, b] = [
            predicted.slice(s![t..=t, 0, ..69]),
            batch.features.slice(s![t + 1..t + 2, 0, ..69]),
        ]
        .map(|frame| standardisation.restore(frame));
        (&a - &b).mapv(|x| x * x).sum().sqrt()
    };
    let mean = (0..10).map(lrp).sum::<f64>() / 10.0;
    assert!(mean < 5.0, "LRP {mean} cm");
}

/// A training of a few steps on generated clips.
fn training() -> (ExperimentConfig, Dataset) {
    let mut config = ExperimentConfig::default();
    config.data.split = Split::Share(0.8);
    let own = settings(&mut config);
    own.model = ModelConfig::Harvey2020(adversarial().small());
    own.schedule.min_len = 9;
    own.schedule.max_len = 12;
    own.schedule.batch_size = 16;
    own.schedule.shards = Shards::Fixed(4);
    own.schedule.fraction = 0.1;
    let clips = generate(&ChoreographyConfig {
        clips: 5,
        frames_per_clip: 90,
        seed: 3,
    });
    let clips = clips.unwrap().into_iter().map(|clip| clip.clip).collect();
    let data = Dataset::from_clips(clips, &config.data).unwrap();
    (config, data)
}

#[test]
fn training_is_the_same_to_the_bit_on_any_threads_and_after_a_resume() {
    let (config, data) = training();
    let mut whole = Trainer::new(config.clone(), &data, 1).unwrap();
    let mut feeds = Vec::new();
    whole
        .run(None, &mut |report| {
            assert!(report.losses.iter().any(|(name, _)| *name == "critics"));
            feeds.push(report.column("teacher_forcing").unwrap() == false);
            ControlFlow::Continue(())
        })
        .unwrap();
    // Whatever scheduled sampling draws, which is nearly always the truth in so short a training.
    assert!(feeds.len() > 5 && feeds.iter().all(|&fed_back| fed_back));
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("run");
    let run = RunFolder::create(&path, &config).unwrap();
    let mut before = Trainer::new(config.clone(), &data, 3).unwrap();
    let stop = |step| {
        if step == 4 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    before
        .run(Some(&run), &mut |report| stop(report.step))
        .unwrap();
    drop(run);
    let run = RunFolder::resume(&path, &config).unwrap();
    let mut after = Trainer::new(config, &data, 2).unwrap();
    assert_eq!(after.resume(&run).unwrap().steps, 4);
    after
        .run(Some(&run), &mut |_| ControlFlow::Continue(()))
        .unwrap();
    assert_eq!(after.weights_file().unwrap(), whole.weights_file().unwrap());
}

fn keydance(arguments: &[&str], paths: [(&str, &Path); 2]) -> Command {
    let mut command = Command::cargo_bin("keydance").unwrap();
    command.args(arguments);
    for (flag, path) in paths {
        command.arg(flag).arg(path);
    }
    command
}

#[test]
fn the_papers_config_trains_and_is_evaluated_through_the_binary() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::create_dir(path("data")).unwrap();
    write_clips(&path("data"), 180, 3);
    let config = "experiments/pan2021/harvey.toml";
    let mut train = keydance(
        &["train", config],
        [("--data", &path("data")), ("--out", &path("run"))],
    );
    for set in [
        "data.split={ share = 0.8 }",
        "model.hidden=8",
        "model.code=8",
        "model.recurrent=8",
        "schedule.max_len=6",
        "schedule.fraction=0.05",
        "schedule.batch_size=8",
    ] {
        train.args(["--set", set]);
    }
    train
        .assert()
        .success()
        .stdout(contains("harvey2020").and(contains("adversarial = true")));
    let run = path("run").display().to_string();
    keydance(
        &["evaluate", &run],
        [("--data", &path("data")), ("--json", &path("scores.json"))],
    )
    .assert()
    .success()
    .stdout(contains("LRP (cm)"));
    let scores = fs::read_to_string(path("scores.json")).unwrap();
    let scores: serde_json::Value = serde_json::from_str(&scores).unwrap();
    assert!(
        scores["equations"]["lrp"]["150"].as_f64().unwrap() > 1.0,
        "{scores}"
    );
    // Nothing holds the root to the trajectory.
    assert!(
        scores["equations"]["art"]["150"].as_f64().unwrap() < 1.0,
        "{scores}"
    );
}

#[test]
fn settings_that_do_not_fit_are_refused_by_name() {
    for (set, words) in [
        ("model.code=7", "model.code = 7: expected an even number"),
        ("model.noise_from=30", "model.noise_from = 30"),
        ("model.loss.root=-1", "model.loss.root = -1"),
        ("model.facing_sigma=0", "model.facing_sigma = 0"),
        ("model.recurrent=0", "model.recurrent = 0"),
    ] {
        Command::cargo_bin("keydance")
            .unwrap()
            .args([
                "gradcheck",
                "experiments/pan2021/harvey.toml",
                "--full-size",
            ])
            .args(["--set", set])
            .assert()
            .failure()
            .stderr(contains(words));
    }
}
