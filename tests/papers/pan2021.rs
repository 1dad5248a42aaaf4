//! The network of Pan et al. 2021 and its ablations: what is built, what flows where, and that
//! gradients are right.

use std::collections::BTreeMap;

use keydance::autograd::{Gradients, Parameters, Tape, Workspace};
use keydance::models::pan2021::{Controllers, LossWeights, Pan2021Config, keyframe_weights};
use keydance::models::settings::GradientCheckOptions;
use keydance::models::transition::ModelConfig;
use keydance::models::transition::Standardisation;
use keydance::models::transition::gradient_check::{GradientCase, check_model};
use keydance::models::transition::{Batch, Forcing, Network};
use keydance::motion::features::{FEATURES, FRAME};
use keydance::nn::Initialiser;
use ndarray::{Array3, Axis, s};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::network::{Built, build, generated_windows, predict, residual, with_control_path};

type Shapes = BTreeMap<String, Vec<usize>>;

fn whole_model() -> Pan2021Config {
    Pan2021Config::default()
}

fn one_lstm() -> Pan2021Config {
    Pan2021Config {
        lstms: 1,
        ..whole_model()
    }
}

fn condition_fc() -> Pan2021Config {
    Pan2021Config {
        controllers: Controllers::FullyConnected,
        ..whole_model()
    }
}

fn one_decoder() -> Pan2021Config {
    Pan2021Config {
        decoders: 1,
        ..whole_model()
    }
}

fn without_velocity_factor() -> Pan2021Config {
    Pan2021Config {
        velocity_factor: false,
        ..whole_model()
    }
}

fn without_key_loss() -> Pan2021Config {
    Pan2021Config {
        loss: LossWeights {
            key: 0.0,
            ..LossWeights::default()
        },
        ..whole_model()
    }
}

fn shapes(config: &Pan2021Config) -> Shapes {
    let standardisation = Standardisation::fit([]);
    let built: Built<f32> = build(config, &standardisation);
    let named = built.parameters.iter();
    named
        .map(|(name, value)| (name.to_owned(), value.shape().to_vec()))
        .collect()
}

/// Parameters that an ablation lacks, that it has in addition, and whose shapes it changes.
fn differences(ablation: &Pan2021Config) -> (Vec<String>, Shapes, Shapes) {
    let (whole, ablated) = (shapes(&whole_model()), shapes(ablation));
    let lacks = |name: &&String| !ablated.contains_key(*name);
    let gone = whole.keys().filter(lacks).cloned().collect();
    let new = |(name, _): &(&String, &Vec<usize>)| !whole.contains_key(*name);
    let changed = |(name, shape): &(&String, &Vec<usize>)| {
        whole.get(*name).is_some_and(|before| before != *shape)
    };
    let copy = |(name, shape): (&String, &Vec<usize>)| (name.clone(), shape.clone());
    (
        gone,
        ablated.iter().filter(new).map(copy).collect(),
        ablated.iter().filter(changed).map(copy).collect(),
    )
}

fn expected(shapes: &[(&str, &[usize])]) -> Shapes {
    let copy = |&(name, shape): &(&str, &[usize])| (name.to_owned(), shape.to_vec());
    shapes.iter().map(copy).collect()
}

/// The names and shapes that docs/pan2021.md states.
fn documented() -> Shapes {
    let mut all = Shapes::new();
    let mut linear = |name: &str, inputs: usize, outputs: usize| {
        all.insert(format!("{name}.weight"), vec![outputs, inputs]);
        all.insert(format!("{name}.bias"), vec![outputs]);
    };
    for (name, inputs) in [
        ("state_encoder", 77),
        ("velocity_encoder", 72),
        ("target_controller", 73),
    ] {
        linear(&format!("{name}.0"), inputs, 512);
        linear(&format!("{name}.2"), 512, 256);
    }
    linear("position_encoder.0", 4, 512);
    for (name, outputs) in [("state_decoder", 142), ("root_decoder", 7)] {
        linear(&format!("{name}.0"), 256, 512);
        linear(&format!("{name}.2"), 512, 256);
        linear(&format!("{name}.4"), 256, outputs);
    }
    for (name, channels) in [
        ("root_trajectory_controller", 3),
        ("velocity_factor_controller", 5),
    ] {
        linear(&format!("{name}.target_projection"), channels, 256);
        linear(&format!("{name}.mixture_projection"), channels, 256);
        linear(&format!("{name}.output"), 256, 256);
    }
    for controller in ["root_trajectory_controller", "velocity_factor_controller"] {
        for (stack, attentions, norms) in [
            ("encoder", &["self_attn"][..], 2),
            ("decoder", &["self_attn", "multihead_attn"], 3),
        ] {
            for layer in [0, 1] {
                let name = format!("{controller}.{stack}.layers.{layer}");
                for part in ["linear1", "linear2"] {
                    all.insert(format!("{name}.{part}.weight"), vec![256, 256]);
                    all.insert(format!("{name}.{part}.bias"), vec![256]);
                }
                for norm in 1..=norms {
                    all.insert(format!("{name}.norm{norm}.weight"), vec![256]);
                    all.insert(format!("{name}.norm{norm}.bias"), vec![256]);
                }
                for attention in attentions {
                    let name = format!("{name}.{attention}");
                    all.insert(format!("{name}.in_proj_weight"), vec![768, 256]);
                    all.insert(format!("{name}.in_proj_bias"), vec![768]);
                    all.insert(format!("{name}.out_proj.weight"), vec![256, 256]);
                    all.insert(format!("{name}.out_proj.bias"), vec![256]);
                }
            }
        }
    }
    for (name, inputs) in [("lstm1", 1024), ("lstm2", 512)] {
        all.insert(format!("{name}.weight_ih_l0"), vec![1024, inputs]);
        all.insert(format!("{name}.weight_hh_l0"), vec![1024, 256]);
        all.insert(format!("{name}.bias_ih_l0"), vec![1024]);
        all.insert(format!("{name}.bias_hh_l0"), vec![1024]);
    }
    for (name, slopes) in [
        ("state_encoder", &[1, 3][..]),
        ("velocity_encoder", &[1, 3]),
        ("target_controller", &[1, 3]),
        ("position_encoder", &[1]),
        ("state_decoder", &[1, 3]),
        ("root_decoder", &[1, 3]),
    ] {
        for slope in slopes {
            all.insert(format!("{name}.{slope}.weight"), vec![1]);
        }
    }
    all
}

#[test]
fn the_whole_model_has_the_documented_names_shapes_and_number_of_weights() {
    let built = shapes(&whole_model());
    assert_eq!(built, documented());
    let weights: usize = built.values().map(|s| s.iter().product::<usize>()).sum();
    assert_eq!(weights, 7_534_752);
}

#[test]
fn one_lstm_gives_way_to_both_and_takes_all_codes() {
    let (gone, new, changed) = differences(&one_lstm());
    assert_eq!(gone.len(), 8);
    assert!(
        gone.iter()
            .all(|name| name.starts_with("lstm1.") || name.starts_with("lstm2."))
    );
    let lstm = expected(&[
        ("lstm.weight_ih_l0", &[1024, 1280]),
        ("lstm.weight_hh_l0", &[1024, 256]),
        ("lstm.bias_ih_l0", &[1024]),
        ("lstm.bias_hh_l0", &[1024]),
    ]);
    assert_eq!(new, lstm);
    let position = expected(&[
        ("position_encoder.0.weight", &[1280, 4]),
        ("position_encoder.0.bias", &[1280]),
    ]);
    assert_eq!(changed, position);
}

#[test]
fn condition_fc_codes_both_segments_with_two_layers() {
    let (gone, new, changed) = differences(&condition_fc());
    let whole = shapes(&whole_model());
    let of_controllers = |name: &&String| {
        name.starts_with("root_trajectory_controller.")
            || name.starts_with("velocity_factor_controller.")
    };
    assert_eq!(
        gone,
        whole
            .keys()
            .filter(of_controllers)
            .cloned()
            .collect::<Vec<_>>()
    );
    let mut layers = Shapes::new();
    // Two segments of 7 frames.
    for (name, channels) in [
        ("root_trajectory_controller", 3),
        ("velocity_factor_controller", 5),
    ] {
        for (part, shape) in [
            ("0.weight", vec![256, 14 * channels]),
            ("0.bias", vec![256]),
            ("1.weight", vec![1]),
            ("2.weight", vec![256, 256]),
            ("2.bias", vec![256]),
            ("3.weight", vec![1]),
        ] {
            layers.insert(format!("{name}.{part}"), shape);
        }
    }
    assert_eq!(new, layers);
    assert_eq!(changed, Shapes::new());
}

#[test]
fn one_decoder_gives_every_number_of_a_frame() {
    let (gone, new, changed) = differences(&one_decoder());
    assert_eq!(gone.len(), 8);
    assert!(gone.iter().all(|name| name.starts_with("root_decoder.")));
    assert_eq!(new, Shapes::new());
    let outputs = expected(&[
        ("state_decoder.4.weight", &[149, 256]),
        ("state_decoder.4.bias", &[149]),
    ]);
    assert_eq!(changed, outputs);
}

#[test]
fn without_velocity_factor_there_is_no_controller_and_no_loss_for_it() {
    let (gone, new, changed) = differences(&without_velocity_factor());
    let whole = shapes(&whole_model());
    let of_controller = |name: &&String| name.starts_with("velocity_factor_controller.");
    assert_eq!(
        gone,
        whole
            .keys()
            .filter(of_controller)
            .cloned()
            .collect::<Vec<_>>()
    );
    assert_eq!(new, Shapes::new());
    assert_eq!(changed, expected(&[("lstm1.weight_ih_l0", &[1024, 768])]));
    let terms = losses(&without_velocity_factor().small(), Forcing::FreeRunning);
    assert!(!terms.contains_key("vfac"));
    assert!(losses(&whole_model().small(), Forcing::FreeRunning).contains_key("vfac"));
}

#[test]
fn without_key_loss_only_the_total_changes() {
    let (gone, new, changed) = differences(&without_key_loss());
    assert_eq!(
        (gone, new, changed),
        (Vec::new(), Shapes::new(), Shapes::new())
    );
    for forcing in [Forcing::Teacher, Forcing::FreeRunning] {
        let mut whole = losses(&whole_model().small(), forcing);
        let mut ablated = losses(&without_key_loss().small(), forcing);
        let key = 0.2 * whole["key"];
        let (with, without) = (
            whole.remove("total").unwrap(),
            ablated.remove("total").unwrap(),
        );
        assert!(key > 0.1, "{key}");
        assert!(
            (with - without - key).abs() < 1e-12 * with,
            "{with} {without} {key}"
        );
        assert_eq!(whole, ablated);
    }
}

/// Terms and total on two windows of 12 frames, without dropout.
fn losses(config: &Pan2021Config, forcing: Forcing) -> BTreeMap<&'static str, f64> {
    let (features, standardisation) = generated_windows(12, 2, 5);
    let built: Built<f64> = build(config, &standardisation);
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&built.parameters, &mut workspace);
    let batch = Batch::of(features);
    let losses = built.network.losses(&mut tape, &batch, forcing).unwrap();
    let values = losses.terms.into_iter().chain([("total", losses.total)]);
    values
        .map(|(name, var)| (name, tape.values(var)[0]))
        .collect()
}

#[test]
fn the_total_is_the_weighted_sum_of_equation_3() {
    let terms = losses(&whole_model().small(), Forcing::FreeRunning);
    let sum = 0.3 * terms["rec"]
        + 0.2 * (terms["bone"] + terms["contact"] + terms["velocity"])
        + 0.15 * terms["root"]
        + 0.2 * terms["key"]
        + 0.15 * terms["vfac"];
    assert_eq!(terms.len(), 8);
    assert!(terms.values().all(|&term| term > 0.0), "{terms:?}");
    assert!((terms["total"] - sum).abs() < 1e-12 * sum);
}

fn gradients_are_right(config: &Pan2021Config) {
    let model = ModelConfig::Pan2021(config.small());
    for (transition, forcing, dropout) in [
        (12, Forcing::FreeRunning, true),
        (6, Forcing::Teacher, false),
    ] {
        let case = GradientCase {
            transition,
            forcing,
            dropout,
        };
        let options = GradientCheckOptions {
            frames: None,
            full_size: false,
            windows: 2,
            per_parameter: 2,
            seed: 2,
        };
        let report = check_model(&model, case, &options).unwrap().unwrap();
        let worst = report.parameters.iter().filter_map(|p| p.worst.as_ref());
        let worst = worst.max_by(|a, b| a.error.total_cmp(&b.error));
        assert!(report.error() < 1e-5, "{case:?}: {worst:?}");
        assert!(report.parameters.iter().all(|p| p.compared + p.kinks > 0));
        assert!(
            50 * report.kinks() <= report.compared(),
            "{case:?}: {} kinks, {} compared",
            report.kinks(),
            report.compared()
        );
    }
}

#[test]
fn the_gradient_of_the_whole_model_is_that_of_central_differences() {
    gradients_are_right(&whole_model());
}

#[test]
fn the_gradient_of_one_lstm_is_that_of_central_differences() {
    gradients_are_right(&one_lstm());
}

#[test]
fn the_gradient_of_condition_fc_is_that_of_central_differences() {
    gradients_are_right(&condition_fc());
}

#[test]
fn the_gradient_of_one_decoder_is_that_of_central_differences() {
    gradients_are_right(&one_decoder());
}

#[test]
fn the_gradient_without_velocity_factor_is_that_of_central_differences() {
    gradients_are_right(&without_velocity_factor());
}

#[test]
fn the_gradient_without_key_loss_is_that_of_central_differences() {
    gradients_are_right(&without_key_loss());
}

#[test]
fn the_gradient_of_residual_outputs_is_that_of_central_differences() {
    gradients_are_right(&residual());
}

#[test]
fn the_gradient_with_a_control_path_is_that_of_central_differences() {
    gradients_are_right(&with_control_path());
}

/// The ablations and options that change the network.
fn networks() -> [Pan2021Config; 9] {
    [
        residual(),
        with_control_path(),
        Pan2021Config {
            control_path_members: 2,
            ..with_control_path()
        },
        Pan2021Config {
            velocity_factor: false,
            ..with_control_path()
        },
        whole_model(),
        one_lstm(),
        condition_fc(),
        one_decoder(),
        without_velocity_factor(),
    ]
    .map(|config| config.small())
}

fn largest_difference(a: &Array3<f64>, b: &Array3<f64>) -> f64 {
    assert_eq!(a.dim(), b.dim());
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[test]
fn windows_predicted_together_are_those_predicted_one_by_one() {
    // 40 windows are more than a controller codes at once, 3 fewer.
    for (windows, chunk) in [(5, 1), (5, 3), (40, 40), (40, 3)] {
        let (features, standardisation) = generated_windows(9, windows, 11);
        for config in networks() {
            let built: Built<f64> = build(&config, &standardisation).disturbed();
            let together = predict(&built, &features);
            let parts: Vec<Array3<f64>> = features
                .axis_chunks_iter(Axis(1), chunk)
                .map(|part| predict(&built, &part.as_standard_layout().into_owned()))
                .collect();
            let views: Vec<_> = parts.iter().map(|part| part.view()).collect();
            let apart = ndarray::concatenate(Axis(1), &views).unwrap();
            assert!(largest_difference(&together, &apart) < 1e-12, "{config:?}");
        }
    }
}

#[test]
fn a_prediction_reads_only_what_is_given() {
    let (features, standardisation) = generated_windows(9, 3, 13);
    for config in networks() {
        let built: Built<f64> = build(&config, &standardisation).disturbed();
        let before = predict(&built, &features);
        let mut unread = features.clone();
        // Between the keyframes the root trajectory (69..72) and the velocity factors (149..154)
        // are given, of k2 the pose too.
        for columns in [0..69, 72..FRAME] {
            unread.slice_mut(s![1..9, .., columns]).fill(1e6);
        }
        unread.slice_mut(s![9, .., 73..FRAME]).fill(-1e6);
        assert_eq!(predict(&built, &unread), before, "{config:?}");
    }
}

#[test]
fn a_prediction_follows_everything_that_is_given() {
    let (features, standardisation) = generated_windows(9, 3, 13);
    for config in networks() {
        let built: Built<f64> = build(&config, &standardisation).disturbed();
        let before = predict(&built, &features);
        for (what, row, column) in [
            ("pose of k1", 0, 10),
            ("contact of k1", 0, 74),
            ("velocity of k1", 0, 100),
            ("root of k1", 0, 70),
            ("trajectory", 5, 71),
            ("end of the trajectory", 9, 69),
            ("pose of k2", 9, 20),
            ("facing of k2", 9, 72),
            ("velocity factor", 4, 150),
        ] {
            let mut changed = features.clone();
            changed[[row, 1, column]] += 0.5;
            let after = predict(&built, &changed);
            let read = column < FRAME || config.velocity_factor;
            let moved = largest_difference(&before, &after) > 1e-9;
            assert_eq!(moved, read, "{what}: {config:?}");
            // The other windows of the batch do not notice.
            for window in [0, 2] {
                let [before, after] = [&before, &after].map(|x| x.index_axis(Axis(1), window));
                assert_eq!(before, after, "{what}");
            }
        }
    }
}

#[test]
fn predictions_are_the_frames_whose_losses_training_takes() {
    let (features, standardisation) = generated_windows(12, 3, 17);
    for config in networks() {
        let built: Built<f64> = build(&config, &standardisation).disturbed();
        let predicted = predict(&built, &features);
        let truth = features.slice(s![1.., .., ..FRAME]);
        let squares: f64 = (&predicted - &truth).mapv(|x| x * x).sum();
        let rec = squares / (12 * 3) as f64;
        let moved = &predicted.slice(s![1.., .., 69..73]) - &predicted.slice(s![..-1, .., 69..73]);
        let first = &predicted.slice(s![0, .., 69..73]) - &features.slice(s![0, .., 69..73]);
        let root = (moved.mapv(|x| x * x).sum() + first.mapv(|x| x * x).sum()) / (12 * 3) as f64;
        let batch = Batch::of(features.clone());
        let mut workspace = Workspace::new();
        let mut tape = Tape::recording(&built.parameters, &mut workspace);
        let losses = built
            .network
            .losses(&mut tape, &batch, Forcing::FreeRunning)
            .unwrap();
        for (name, ours) in [("rec", rec), ("root", root)] {
            let term = losses
                .terms
                .iter()
                .find(|(term, _)| *term == name)
                .unwrap()
                .1;
            let term = tape.values(term)[0];
            assert!((ours - term).abs() < 1e-12 * term, "{name}: {ours} {term}");
        }
    }
}

fn gradients_of(built: &Built<f64>, batches: &[Batch<f64>], forcing: Forcing) -> (f64, Vec<f64>) {
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&built.parameters);
    let mut sum = 0.0;
    for batch in batches {
        let mut tape = Tape::recording(&built.parameters, &mut workspace);
        let total = built
            .network
            .losses(&mut tape, batch, forcing)
            .unwrap()
            .total;
        sum += tape.values(total)[0];
        tape.backward(total, &mut gradients).unwrap();
    }
    (sum, gradients.iter().flatten().copied().collect())
}

#[test]
fn shards_on_tapes_of_their_own_add_up_to_the_batch() {
    let (features, standardisation) = generated_windows(7, 5, 19);
    let built: Built<f64> = build(&whole_model().small(), &standardisation);
    let shard = |windows: std::ops::Range<usize>| Batch {
        features: features
            .slice(s![.., windows, ..])
            .as_standard_layout()
            .into_owned(),
        total_windows: 5,
        ..Batch::of(Array3::zeros((0, 0, 0)))
    };
    for forcing in [Forcing::Teacher, Forcing::FreeRunning] {
        let (whole, gradient) = gradients_of(&built, &[shard(0..5)], forcing);
        let (sum, added) = gradients_of(&built, &[shard(0..2), shard(2..3), shard(3..5)], forcing);
        assert!((whole - sum).abs() < 1e-12 * whole);
        let largest = gradient.iter().fold(0f64, |m, x| m.max(x.abs()));
        assert!(largest > 1e-3);
        for (a, b) in gradient.iter().zip(&added) {
            assert!((a - b).abs() < 1e-12 * largest, "{a} {b}");
        }
    }
}

#[test]
fn features_of_another_shape_are_refused_with_their_shape() {
    let (_, standardisation) = generated_windows(3, 1, 1);
    let built: Built<f64> = build(&whole_model().small(), &standardisation);
    let mut workspace = Workspace::new();
    for shape in [(1, 2, FEATURES), (4, 2, FRAME)] {
        let mut tape = Tape::inference(&built.parameters, &mut workspace);
        let error = built
            .network
            .predict(&mut tape, &Batch::of(Array3::zeros(shape)))
            .unwrap_err();
        let (frames, windows, numbers) = shape;
        let found = format!("[{frames}, {windows}, {numbers}]");
        assert!(error.to_string().contains(&found), "{error}");
    }
}

/// Sets columns of a weight to zero: what enters there is not read.
fn cut_columns(built: &mut Built<f64>, weight: &str, columns: std::ops::Range<usize>) {
    let (_, mut value) = built
        .parameters
        .values_mut()
        .find(|(name, _)| *name == weight)
        .unwrap();
    value.slice_axis_mut(Axis(1), columns.into()).fill(0.0);
}

/// Whether the prediction moves when one number of the batch does.
fn reads(built: &Built<f64>, features: &Array3<f64>, row: usize, column: usize) -> bool {
    let mut changed = features.clone();
    changed[[row, 0, column]] += 0.5;
    largest_difference(&predict(built, features), &predict(built, &changed)) > 1e-9
}

#[test]
fn each_code_enters_the_lstms_at_its_own_place() {
    let (features, standardisation) = generated_windows(9, 2, 13);
    // Codes are 8 wide here: state, velocity, root trajectory, velocity factor; the target's beside
    // the first LSTM's output.
    let (one, two) = ("lstm.weight_ih_l0", "lstm2.weight_ih_l0");
    let first = "lstm1.weight_ih_l0";
    for (config, weight, columns, what, row, column) in [
        (whole_model(), first, 8..16, "velocity of k1", 0, 100),
        (whole_model(), first, 24..32, "velocity factor", 4, 150),
        (whole_model(), two, 8..16, "pose of k2", 9, 20),
        (one_lstm(), one, 8..16, "velocity of k1", 0, 100),
        (one_lstm(), one, 24..32, "velocity factor", 4, 150),
        (one_lstm(), one, 32..40, "pose of k2", 9, 20),
        (condition_fc(), first, 24..32, "velocity factor", 4, 150),
        (without_velocity_factor(), two, 8..16, "pose of k2", 9, 20),
    ] {
        let mut built: Built<f64> = build(&config.small(), &standardisation);
        assert!(reads(&built, &features, row, column), "{what}: {config:?}");
        cut_columns(&mut built, weight, columns);
        assert!(!reads(&built, &features, row, column), "{what}: {config:?}");
    }
    // The trajectory enters by its code and by its place alone.
    for (config, weight) in [
        (whole_model(), first),
        (one_lstm(), one),
        (condition_fc(), first),
        (one_decoder(), first),
        (without_velocity_factor(), first),
    ] {
        let mut built: Built<f64> = build(&config.small(), &standardisation);
        cut_columns(&mut built, weight, 16..24);
        assert!(reads(&built, &features, 5, 70), "{config:?}");
        cut_columns(&mut built, "position_encoder.0.weight", 0..3);
        assert!(!reads(&built, &features, 5, 70), "{config:?}");
    }
}

#[test]
fn each_output_of_the_decoders_is_its_number_of_the_frame() {
    let (features, standardisation) = generated_windows(1, 2, 13);
    let (state, root) = ("state_decoder.4.bias", "root_decoder.4.bias");
    for (config, bias, output, number) in [
        (whole_model(), state, 68, 68),
        (whole_model(), state, 69, 73),
        (whole_model(), state, 73, 77),
        (whole_model(), root, 0, 69),
        (whole_model(), root, 3, 72),
        (whole_model(), root, 4, 146),
        (one_decoder(), state, 68, 68),
        (one_decoder(), state, 69, 69),
        (one_decoder(), state, 148, 148),
    ] {
        let mut built: Built<f64> = build(&config.small(), &standardisation);
        let before = predict(&built, &features);
        let values = built.parameters.values_mut();
        for (_, mut value) in values.filter(|(name, _)| *name == bias) {
            value.as_slice_mut().unwrap()[output] += 1.0;
        }
        let moved = predict(&built, &features) - before;
        for (column, moved) in moved.index_axis(Axis(0), 0).axis_iter(Axis(1)).enumerate() {
            let expected = f64::from(u8::from(column == number));
            assert!(
                moved.iter().all(|x| (x - expected).abs() < 1e-12),
                "{bias} {output} moves {column}"
            );
        }
    }
}

#[test]
fn sizes_that_no_model_has_are_refused_by_their_key() {
    type Change = fn(&mut Pan2021Config);
    let refusal = |change: Change| {
        let mut config = whole_model().small();
        change(&mut config);
        let mut parameters = Parameters::<f32>::new();
        let mut init = Initialiser::new(&mut parameters, ChaCha8Rng::seed_from_u64(3));
        let model = ModelConfig::Pan2021(config);
        let built = model.build(&mut init, &Standardisation::fit([]));
        built.err().unwrap().to_string()
    };
    let cases: [(Change, &str); 14] = [
        (
            |config| config.lstms = 3,
            "model.lstms = 3: expected 1 or 2",
        ),
        (
            |config| config.decoders = 0,
            "model.decoders = 0: expected 1 or 2",
        ),
        (
            |config| config.hidden = 0,
            "model.hidden = 0: expected 1 to 65536",
        ),
        (
            |config| config.encoder_layers = 65,
            "model.encoder_layers = 65: expected 1 to 64",
        ),
        (
            |config| config.heads = 3,
            "model.code = 8: expected a multiple of model.heads = 3",
        ),
        (
            |config| config.window = 6,
            "model.window = 6: expected an odd number",
        ),
        (
            |config| config.control_path = true,
            "expected model.output = \"residual\"",
        ),
        (
            |config| config.control_path_members = 0,
            "model.control_path_members = 0: expected 1 to 64",
        ),
        (
            |config| (config.velocity_refinement, config.velocity_factor) = (true, false),
            "expected model.velocity_factor = true",
        ),
        (
            |config| config.dropout = 1.0,
            "model.dropout = 1: expected at least 0 and below 1",
        ),
        (
            |config| config.single_frames = 65_537,
            "model.single_frames = 65537: expected 0 to 65536",
        ),
        (
            |config| config.loss.single_frames = f64::NAN,
            "model.loss.single_frames = NaN: expected 0 or more",
        ),
        (
            |config| config.loss.root = -1.0,
            "model.loss.root = -1: expected 0 or more",
        ),
        (
            |config| (config.hidden, config.code) = (65_536, 4096),
            "more than 536870912 weights",
        ),
    ];
    for (change, words) in cases {
        let text = refusal(change);
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn keyframe_weights_pull_to_the_nearer_keyframe_and_sum_to_one() {
    for (n, m) in [(3, 5), (10, 5), (11, 5), (50, 5)] {
        let all: Vec<_> = (1..=n).map(|t| keyframe_weights(t, n, m)).collect();
        let sum: f64 = all.iter().map(|(a, b)| a + b).sum();
        assert!((sum - 1.0).abs() < 1e-12, "N = {n}");
        assert!(
            all[n - 1].1 > all[n - 1].0,
            "N = {n}: the last frame belongs to k2"
        );
    }
}
