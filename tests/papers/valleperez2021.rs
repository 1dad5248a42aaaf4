//! Transflower: a block by the numbers of an independent implementation, the flow's laws, the sizes
//! of the paper's models.

use std::f64::consts::LN_2;

use keydance::autograd::{Gradients, Parameters, Tape, Var, Workspace};
use keydance::models::flow::NormKind;
use keydance::models::moglow2020::{Moglow2020, MoglowConfig, SequenceBatch};
use keydance::models::valleperez2021::{
    Flow, Head, Target, TargetKind, Valleperez2021, ValleperezConfig,
};
use keydance::nn::{Initialiser, Positions, t5_bucket};
use ndarray::{Array2, ArrayD, IxDyn, s};
use proptest::prelude::*;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// Numbers of a PyTorch implementation in f64, of inputs that were drawn.
const EXAMPLE: &str = include_str!("flow_example.json");

fn example() -> Value {
    serde_json::from_str(EXAMPLE).expect("the example is JSON")
}

/// All numbers of nested lists, in their order, and the lists' lengths.
fn numbers(value: &Value) -> ArrayD<f64> {
    fn collect(value: &Value, shape: &mut Vec<usize>, depth: usize, out: &mut Vec<f64>) {
        match value {
            Value::Array(list) => {
                if shape.len() == depth {
                    shape.push(list.len());
                }
                list.iter()
                    .for_each(|it| collect(it, shape, depth + 1, out));
            }
            number => out.push(number.as_f64().expect("a number")),
        }
    }
    let (mut shape, mut out) = (Vec::new(), Vec::new());
    collect(value, &mut shape, 0, &mut out);
    ArrayD::from_shape_vec(IxDyn(&shape), out).expect("whole rows")
}

/// The numbers `[a, b, c]` as `[a b, c]`.
fn rows(value: &Value) -> Array2<f64> {
    let all = numbers(value);
    let columns = *all.shape().last().expect("an axis");
    let rows = all.len() / columns;
    all.into_shape_with_order((rows, columns)).expect("rows")
}

#[track_caller]
fn assert_close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        let error = (found - expected).abs();
        assert!(
            error <= tolerance,
            "{what}[{i}] = {found}, expected {expected}"
        );
    }
}

fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// The block of the example with its weights.
fn example_flow(example: &Value) -> (Flow, Parameters<f64>) {
    let config = ValleperezConfig {
        predicted_frames: 3,
        blocks: 1,
        flow_width: 4,
        flow_heads: 2,
        flow_feed_forward: 6,
        coupling_layers: 1,
        norm: NormKind::Act,
        ..ValleperezConfig::default()
    };
    let mut parameters = Parameters::new();
    let mut init = Initialiser::new(&mut parameters, rng(1));
    let flow = Flow::new(&mut init, &config, 5, 4, None).expect("sizes that fit");
    let weights = example["weights"].as_object().expect("weights by name");
    let mut set = 0;
    for (name, mut value) in parameters.saved_mut() {
        let given = numbers(&weights[name]);
        assert_eq!(value.shape(), given.shape(), "{name}");
        value.assign(&given);
        set += 1;
    }
    assert_eq!(
        set,
        weights.len(),
        "every weight of the example has its place"
    );
    (flow, parameters)
}

#[test]
fn a_block_has_the_values_and_gradients_of_an_independent_implementation() {
    let example = example();
    let (flow, parameters) = example_flow(&example);
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let x = tape.input(rows(&example["x"]));
    let h = tape.input(rows(&example["h"]));
    let output = flow
        .forward(&mut tape, x, h, true)
        .expect("a batch that fits");
    let [normed, mixed, coupled, shift] = output.stages[0];
    for (name, var) in [
        ("after_norm", normed),
        ("after_linear", mixed),
        ("out", coupled),
        ("out", output.z),
        ("scale", output.scales[0]),
        ("shift", shift),
    ] {
        let expected = rows(&example[name]);
        assert_close(tape.values(var), expected.as_slice().unwrap(), 1e-9, name);
    }
    let frames = 3.0;
    let norm = frames * tape.values(output.norms)[0];
    let linear = frames * tape.values(output.linears)[0];
    assert_close(
        &[norm; 2],
        numbers(&example["logdet_norm"]).as_slice().unwrap(),
        1e-9,
        "norm",
    );
    let expected = numbers(&example["logdet_linear"]);
    assert_close(&[linear; 2], expected.as_slice().unwrap(), 1e-9, "linear");
    let logs: Vec<f64> = tape
        .values(output.scales[0])
        .iter()
        .map(|it| it.ln())
        .collect();
    let coupling: Vec<f64> = logs.chunks_exact(9).map(|it| it.iter().sum()).collect();
    let expected = numbers(&example["logdet_coupling"]);
    assert_close(&coupling, expected.as_slice().unwrap(), 1e-9, "coupling");

    // Bits a frame of the batch, from the parts.
    let loss = bits_a_frame(&mut tape, &output, 2, 3, 5);
    let expected = example["nll_bits_per_frame"].as_f64().unwrap();
    assert_close(tape.values(loss), &[expected], 1e-9, "bits a frame");
    let mut gradients = Gradients::zeros(&parameters);
    let inputs = tape
        .backward_from(loss, &[1.0], &[x, h], &mut gradients)
        .expect("a loss of one number");
    let expected = &example["gradients_of_nll"];
    for ((name, _), gradient) in parameters.iter().zip(gradients.iter()) {
        let expected = numbers(&expected[name]);
        assert_close(gradient, expected.as_slice().unwrap(), 1e-9, name);
    }
    for (name, gradient) in ["x", "h"].iter().zip(&inputs) {
        let expected = numbers(&expected[*name]);
        assert_close(
            gradient.as_slice().unwrap(),
            expected.as_slice().unwrap(),
            1e-9,
            name,
        );
    }
}

fn bits_a_frame(
    tape: &mut Tape<'_, f64>,
    output: &keydance::models::valleperez2021::FlowOutput,
    windows: usize,
    frames: usize,
    channels: usize,
) -> Var {
    let rows = (windows * frames) as f64;
    let squares = tape.square(output.z);
    let squares = tape.sum(squares);
    let normal = rows * channels as f64 * std::f64::consts::TAU.ln() / 2.0;
    let mut nats = tape.affine(squares, 0.5, normal);
    for fixed in [output.norms, output.linears] {
        let part = tape.affine(fixed, -rows, 0.0);
        nats = tape.add(nats, part).unwrap();
    }
    for &scale in &output.scales {
        let logs = tape.ln(scale);
        let sum = tape.sum(logs);
        nats = tape.sub(nats, sum).unwrap();
    }
    tape.affine(nats, 1.0 / (rows * LN_2), 0.0)
}

#[test]
fn the_inverse_of_the_example_is_that_of_an_independent_implementation() {
    let example = example();
    let (flow, parameters) = example_flow(&example);
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&parameters, &mut workspace);
    let h = tape.constant(rows(&example["h"]));
    let z = rows(&example["inverse"]["z"]);
    let x = flow
        .inverse(&mut tape, &z, h)
        .expect("weights with an inverse");
    let expected = rows(&example["inverse"]["x"]);
    assert_close(
        x.as_slice().unwrap(),
        expected.as_slice().unwrap(),
        1e-9,
        "x",
    );
}

#[test]
fn buckets_of_relative_positions_are_those_of_t5() {
    for (delta, bucket) in example()["t5_buckets"].as_object().unwrap() {
        let delta: i64 = delta.parse().unwrap();
        assert_eq!(t5_bucket(delta) as u64, bucket.as_u64().unwrap(), "{delta}");
    }
    assert_eq!((t5_bucket(i64::MIN), t5_bucket(i64::MAX)), (15, 31));
}

/// A flow in small, with weights that are all noisy.
fn small_flow(
    config: &ValleperezConfig,
    channels: usize,
    seed: u64,
) -> (Flow, Parameters<f64>, Array2<f64>) {
    let mut rng = rng(seed);
    let mut parameters = Parameters::new();
    let mut init = Initialiser::new(&mut parameters, &mut rng);
    let flow = Flow::new(&mut init, config, channels, 3, None).expect("sizes that fit");
    for (_, mut value) in parameters.values_mut() {
        value.mapv_inplace(|x| x + rng.random_range(-0.3..0.3));
    }
    let h =
        Array2::from_shape_simple_fn((config.predicted_frames, 3), || rng.random_range(-1.0..1.0));
    (flow, parameters, h)
}

fn small_config(norm: NormKind, positions: Positions, frames: usize) -> ValleperezConfig {
    ValleperezConfig {
        predicted_frames: frames,
        blocks: 3,
        flow_width: 4,
        flow_heads: 2,
        flow_feed_forward: 5,
        coupling_layers: 2,
        norm,
        positions,
        ..ValleperezConfig::default()
    }
}

fn norm_kind() -> impl Strategy<Value = NormKind> {
    prop_oneof![Just(NormKind::Batch), Just(NormKind::Act)]
}

fn positions() -> impl Strategy<Value = Positions> {
    prop_oneof![
        Just(Positions::T5),
        Just(Positions::Table),
        Just(Positions::None)
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn log_determinants_are_those_of_the_numerical_jacobian(
        norm in norm_kind(), positions in positions(), d in 2usize..5, frames in 1usize..4, seed: u64
    ) {
        let config = small_config(norm, positions, frames);
        let (flow, mut parameters, h) = small_flow(&config, d, seed);
        let x = Array2::from_shape_fn((frames, d), |(i, j)| ((i * 7 + j * 3) as f64).sin());
        let first = Array2::from_shape_fn((8 * frames, d), |(i, j)| ((i * 5 + j * 2) as f64).cos());
        let latent = Array2::from_shape_fn((8 * frames, 3), |(i, j)| ((i + j) as f64).sin());
        flow.start(&mut parameters, first, &latent).unwrap();
        let mut workspace = Workspace::new();
        let mut forward = |x: &Array2<f64>| {
            let mut tape = Tape::inference(&parameters, &mut workspace);
            let (x, h) = (tape.constant(x.clone()), tape.constant(h.clone()));
            let output = flow.forward(&mut tape, x, h, false).unwrap();
            let mut log_det = frames as f64
                * (tape.values(output.norms)[0] + tape.values(output.linears)[0]);
            for &scale in &output.scales {
                log_det += tape.values(scale).iter().map(|it| it.ln()).sum::<f64>();
            }
            (tape.values(output.z).to_vec(), log_det)
        };
        let n = frames * d;
        let mut jacobian = nalgebra::DMatrix::<f64>::zeros(n, n);
        let step = 2e-5;
        for k in 0..n {
            let mut moved = |by: f64| {
                let mut x = x.clone();
                x.as_slice_mut().unwrap()[k] += by;
                forward(&x).0
            };
            let near = [moved(step), moved(-step)];
            let far = [moved(2.0 * step), moved(-2.0 * step)];
            for i in 0..n {
                let near = near[0][i] - near[1][i];
                let far = far[0][i] - far[1][i];
                // Beside a kink of a ReLU there is no derivative to compare with.
                let slopes = [near / (2.0 * step), far / (4.0 * step)];
                prop_assume!((slopes[0] - slopes[1]).abs() < 1e-6 * (1.0 + slopes[0].abs()));
                jacobian[(i, k)] = (8.0 * near - far) / (12.0 * step);
            }
        }
        let expected = jacobian.determinant().abs().ln();
        let (_, found) = forward(&x);
        prop_assert!((found - expected).abs() < 1e-8, "{} {}", found, expected);
    }

    #[test]
    fn noise_and_back_is_the_identity(
        norm in norm_kind(), positions in positions(), d in 2usize..7, frames in 1usize..4, seed: u64
    ) {
        let config = small_config(norm, positions, frames);
        let (flow, parameters, h) = small_flow(&config, d, seed);
        let x = Array2::from_shape_fn((frames, d), |(i, j)| ((i * 5 + j * 11) as f64).cos() * 2.0);
        let mut workspace = Workspace::new();
        let mut tape = Tape::inference(&parameters, &mut workspace);
        let (given, h) = (tape.constant(x.clone()), tape.constant(h));
        let output = flow.forward(&mut tape, given, h, false).unwrap();
        let z = Array2::from_shape_vec(x.dim(), tape.values(output.z).to_vec()).unwrap();
        let back = flow.inverse(&mut tape, &z, h).unwrap();
        prop_assert!((&back - &x).iter().all(|it| it.abs() < 1e-9), "{}", &back - &x);
    }

    #[test]
    fn targets_and_back_are_the_identity(seed: u64, d in 1usize..5, frames in 1usize..5, linear: bool) {
        let mut rng = rng(seed);
        let piece = Array2::from_shape_simple_fn((40, d), || rng.random_range(-2.0f32..2.0));
        let kind = if linear { TargetKind::Linear } else { TargetKind::Difference };
        let target = Target::fitted(kind, &[piece.view()]);
        let x = piece.slice(s![..3 + frames, ..]).mapv(f64::from);
        let y = target.forward(x.view());
        let back = target.inverse(x.slice(s![..3, ..]), y.view());
        prop_assert!((&back - &x.slice(s![3.., ..])).iter().all(|it| it.abs() < 1e-9));
    }
}

#[test]
fn after_the_start_every_channel_has_mean_0_and_deviation_1_and_training_keeps_statistics() {
    for norm in [NormKind::Batch, NormKind::Act] {
        let config = small_config(norm, Positions::T5, 2);
        let mut rng = rng(3);
        let (flow, mut parameters, _) = small_flow(&config, 4, 3);
        for (name, mut value) in parameters.values_mut() {
            if name.contains(".norm.beta") || name.contains(".norm.log_gamma") {
                value.fill(0.0);
            }
        }
        let mut draw = |rows, columns| {
            Array2::from_shape_simple_fn((rows, columns), || rng.random_range(-1.0..3.0))
        };
        let (x, h) = (draw(20, 4), draw(20, 3));
        flow.start(&mut parameters, x.clone(), &h).unwrap();
        let mut workspace = Workspace::new();
        let mut tape = Tape::inference(&parameters, &mut workspace);
        let (x, h) = (tape.constant(x), tape.constant(h));
        for training in [false, true] {
            let output = flow.forward(&mut tape, x, h, training).unwrap();
            for stage in &output.stages {
                let y = tape
                    .array(stage[0])
                    .into_dimensionality::<ndarray::Ix2>()
                    .unwrap();
                for column in y.columns() {
                    let (mean, deviation) = (column.mean().unwrap(), column.std(0.0));
                    assert!(
                        mean.abs() < 1e-9 && (deviation - 1.0).abs() < 1e-4,
                        "{norm:?}"
                    );
                }
            }
            let kept = if training && norm == NormKind::Batch {
                6
            } else {
                0
            };
            assert_eq!(output.buffers.len(), kept);
        }
    }
}

/// Weights of a network at these sizes, counted without making them.
fn weights(config: &ValleperezConfig, motion: usize, audio: usize) -> usize {
    let mut parameters = Parameters::<f32>::new();
    let mut init = Initialiser::limited(&mut parameters, rng(1), 0);
    Valleperez2021::new(&mut init, config, motion, audio, None).expect("sizes that fit");
    init.asked_for()
}

/// Buffers, and those halves of l and u that do not count, which a plain matrix does not have.
fn weights_of_the_code(config: &ValleperezConfig, d: usize) -> usize {
    let all = weights(config, d, 85);
    if config.head == Head::Deterministic {
        return all;
    }
    // P, sign_s, running mean and variance.
    all - config.blocks * (d * d + 3 * d)
}

#[test]
fn models_of_the_papers_sizes_have_the_papers_weights() {
    let published = ValleperezConfig {
        positions: Positions::Table,
        ..ValleperezConfig::default()
    };
    let counted = weights_of_the_code(&published, 69);
    assert_eq!(counted, 122_356_736);
    let deterministic = ValleperezConfig {
        head: Head::Deterministic,
        ..published
    };
    assert_eq!(weights_of_the_code(&deterministic, 69), 63_704_469);
    let text = ValleperezConfig::default();
    assert_eq!(weights_of_the_code(&text, 67), 122_292_624);
}

/// Weights of MoGlow with a plain matrix in the place of its factors, as in the authors' program.
#[test]
fn moglow_of_the_papers_size_has_the_papers_weights() {
    let config = MoglowConfig::default();
    let (d, audio) = (69, 85);
    let mut parameters = Parameters::<f32>::new();
    let mut init = Initialiser::limited(&mut parameters, rng(1), 0);
    Moglow2020::new(&mut init, &config, d, config.condition(d, audio));
    // Of l, u, p, log_s and sign_s one matrix stays.
    let counted = init.asked_for() - config.blocks * (2 * d * d + 2 * d);
    assert_eq!(counted, 281_933_456);
}

/// MoGlow in small, all weights noisy, and a batch for it.
fn small_moglow(frames: usize) -> (Moglow2020, Parameters<f64>, SequenceBatch<f64>) {
    let config = MoglowConfig {
        blocks: 2,
        hidden: 4,
        ..MoglowConfig::default()
    };
    let mut rng = rng(5);
    let mut parameters = Parameters::new();
    let mut init = Initialiser::new(&mut parameters, &mut rng);
    let moglow = Moglow2020::new(&mut init, &config, 5, 6);
    for (_, mut value) in parameters.values_mut() {
        value.mapv_inplace(|x| x + rng.random_range(-0.3..0.3));
    }
    let mut draw = |columns| {
        Array2::from_shape_simple_fn((2 * frames, columns), || rng.random_range(-1.0..1.0))
    };
    let batch = SequenceBatch {
        condition: draw(6),
        target: draw(5),
        sequences: 2,
        total_sequences: 2,
    };
    (moglow, parameters, batch)
}

#[test]
fn moglow_frame_by_frame_makes_of_its_noise_what_it_was_made_of() {
    let (moglow, parameters, batch) = small_moglow(4);
    let mut workspace = Workspace::new();
    let z = {
        let mut tape = Tape::inference(&parameters, &mut workspace);
        moglow.noise(&mut tape, &batch).expect("sizes that fit")
    };
    let mut states = moglow.start_states(2);
    for frame in 0..4 {
        let rows = s![2 * frame..2 * frame + 2, ..];
        let mut tape = Tape::inference(&parameters, &mut workspace);
        let condition = batch.condition.slice(rows).to_owned();
        let noise = z.slice(rows).to_owned();
        let x = moglow
            .sample(&mut tape, &noise, &condition, &mut states)
            .unwrap();
        let error = &x - &batch.target.slice(rows);
        assert!(
            error.iter().all(|it| it.abs() < 1e-9),
            "frame {frame}: {error}"
        );
    }
}

#[test]
fn moglow_log_densities_of_the_last_frames_and_of_those_before_add_up_to_its_loss() {
    let (moglow, parameters, batch) = small_moglow(6);
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&parameters, &mut workspace);
    let (all, _) = moglow.log_densities(&mut tape, &batch, 6).unwrap();
    let loss = moglow.losses(&mut tape, &batch).unwrap();
    let bits = -(all[0] + all[1]) / (2.0 * 6.0 * LN_2);
    assert!((tape.values(loss.total)[0] - bits).abs() < 1e-9);
    // The first three frames by themselves: what comes behind does not change them.
    let first = SequenceBatch {
        condition: batch.condition.slice(s![..6, ..]).to_owned(),
        target: batch.target.slice(s![..6, ..]).to_owned(),
        ..batch.clone()
    };
    let (first, _) = moglow.log_densities(&mut tape, &first, 3).unwrap();
    let (last, _) = moglow.log_densities(&mut tape, &batch, 3).unwrap();
    for k in 0..2 {
        assert!((first[k] + last[k] - all[k]).abs() < 1e-9);
    }
}

#[test]
fn sixteen_blocks_in_single_precision_and_back_miss_by_less_than_a_thousandth() {
    let config = ValleperezConfig {
        flow_width: 32,
        flow_heads: 4,
        flow_feed_forward: 32,
        ..ValleperezConfig::default()
    };
    assert_eq!((config.blocks, config.predicted_frames), (16, 3));
    let mut rng = rng(7);
    let mut parameters = Parameters::<f32>::new();
    let mut init = Initialiser::new(&mut parameters, &mut rng);
    let flow = Flow::new(&mut init, &config, 61, 20, None).expect("sizes that fit");
    let mut draw = |rows, columns| {
        Array2::from_shape_simple_fn((rows, columns), || rng.random_range(-2.0f32..2.0))
    };
    let (x, h) = (draw(30, 61), draw(30, 20));
    flow.start(&mut parameters, x.clone(), &h).unwrap();
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&parameters, &mut workspace);
    let (given, h) = (tape.constant(x.clone()), tape.constant(h));
    let z = flow.forward(&mut tape, given, h, false).unwrap().z;
    let noise = tape.values(z).iter().map(|&z| f64::from(z)).collect();
    let noise = Array2::from_shape_vec(x.dim(), noise).unwrap();
    let back = flow.inverse(&mut tape, &noise, h).unwrap();
    let error = (back - x.mapv(f64::from)).mapv(f64::abs);
    let worst = error.iter().copied().fold(0.0, f64::max);
    assert!(worst < 1e-3, "{worst}");
}
