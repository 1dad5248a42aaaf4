//! The whole model against recorded results of an independent implementation in PyTorch
//! (`scripts/make_golden.py`).

use std::collections::HashMap;

use keydance::autograd::{Gradients, Parameters, Tape, Workspace};
use keydance::models::pan2021::{Pan2021, Pan2021Config};
use keydance::models::transition::Standardisation;
use keydance::models::transition::{Batch, Forcing, Network};
use keydance::nn::Initialiser;
use ndarray::{Array3, ArrayD, Axis, IxDyn};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use safetensors::{Dtype, SafeTensors};

/// Largest difference from a recorded number, relative to the largest number of its tensor.
const TOLERANCE: f64 = 1e-9;

struct Golden {
    tensors: HashMap<String, ArrayD<f64>>,
    /// Names of the loss terms, in the order in which they were recorded.
    terms: Vec<String>,
}

impl Golden {
    fn read() -> Self {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/tests/golden/pan2021.safetensors"
        );
        let bytes = std::fs::read(path).unwrap();
        let (_, header) = SafeTensors::read_metadata(&bytes).unwrap();
        let terms = header.metadata().as_ref().unwrap()["terms"].clone();
        let tensors = SafeTensors::deserialize(&bytes)
            .unwrap()
            .iter()
            .map(|(name, tensor)| {
                assert_eq!(tensor.dtype(), Dtype::F64, "{name}");
                let numbers = tensor.data().chunks_exact(8);
                let numbers = numbers.map(|x| f64::from_le_bytes(x.try_into().unwrap()));
                let shape = IxDyn(tensor.shape());
                let array = ArrayD::from_shape_vec(shape, numbers.collect()).unwrap();
                (name.to_owned(), array)
            })
            .collect();
        Self {
            tensors,
            terms: terms.split(' ').map(str::to_owned).collect(),
        }
    }

    fn numbers(&self, name: &str) -> Vec<f64> {
        self.tensors[name].iter().copied().collect()
    }

    /// The small network with the recorded weights.
    fn model(&self) -> (Pan2021, Parameters<f64>) {
        let config = Pan2021Config {
            code: 4,
            hidden: 8,
            heads: 2,
            feed_forward: 6,
            ..Pan2021Config::default()
        };
        let standardisation = Standardisation {
            mean: self.numbers("feature_mean"),
            std: self.numbers("feature_std"),
            position_scale: self.numbers("position_scale")[0],
            velocity_scale: self.numbers("velocity_scale")[0],
        };
        let mut parameters = Parameters::new();
        let mut init = Initialiser::new(&mut parameters, ChaCha8Rng::seed_from_u64(0));
        let network = Pan2021::new(&mut init, &config, &standardisation).unwrap();
        let recorded = self
            .tensors
            .keys()
            .filter(|name| name.starts_with("weight."));
        assert_eq!(recorded.count(), parameters.len());
        for (name, mut value) in parameters.values_mut() {
            let weight = &self.tensors[&format!("weight.{name}")];
            assert_eq!(weight.shape(), value.shape(), "{name}");
            value.assign(weight);
        }
        (network, parameters)
    }

    /// The first `transition + 1` frames of the recorded windows.
    fn window(&self, transition: usize) -> Array3<f64> {
        let window = &self.tensors["window"];
        let cut = window.slice_axis(Axis(0), (0..transition + 1).into());
        cut.to_owned().into_dimensionality().unwrap()
    }
}

fn assert_close<'a>(what: &str, ours: impl Iterator<Item = &'a f64>, recorded: &[f64]) {
    let ours: Vec<f64> = ours.copied().collect();
    assert_eq!(ours.len(), recorded.len(), "{what}");
    let scale = recorded.iter().fold(0f64, |scale, x| scale.max(x.abs()));
    for (index, (ours, recorded)) in ours.iter().zip(recorded).enumerate() {
        assert!(
            (ours - recorded).abs() <= TOLERANCE * scale,
            "{what}, number {index}: {ours}, PyTorch {recorded}"
        );
    }
}

fn check(transition: usize, forcing: Forcing) {
    let golden = Golden::read();
    let (network, parameters) = golden.model();
    let feed_name = match forcing {
        Forcing::Teacher => "fed",
        Forcing::FreeRunning => "own",
    };
    let case = format!("n{transition}_{feed_name}");
    let batch = Batch::of(golden.window(transition));
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let losses = network.losses(&mut tape, &batch, forcing).unwrap();

    let recorded = golden.numbers(&format!("{case}.terms"));
    assert_eq!(golden.terms.len(), losses.terms.len() + 1);
    for (name, &recorded) in golden.terms.iter().zip(&recorded) {
        let var = match name.as_str() {
            "total" => losses.total,
            name => {
                losses
                    .terms
                    .iter()
                    .find(|(term, _)| *term == name)
                    .unwrap()
                    .1
            }
        };
        assert_close(
            &format!("{case}: {name}"),
            tape.values(var).iter(),
            &[recorded],
        );
    }

    tape.backward(losses.total, &mut gradients).unwrap();
    let recorded = golden.numbers(&format!("{case}.gradients"));
    let mut ours: Vec<(&str, &[f64])> = parameters
        .iter()
        .map(|(name, _)| name)
        .zip(gradients.iter())
        .collect();
    ours.sort_unstable_by_key(|(name, _)| *name);
    let mut start = 0;
    for (name, gradient) in ours {
        let recorded = &recorded[start..start + gradient.len()];
        start += gradient.len();
        let what = format!("{case}: gradient of {name}");
        assert_close(&what, gradient.iter(), recorded);
    }
    assert_eq!(start, golden.numbers(&format!("{case}.gradients")).len());

    if forcing == Forcing::FreeRunning {
        let mut tape = Tape::inference(&parameters, &mut workspace);
        let predicted = network.predict(&mut tape, &batch).unwrap();
        let recorded = golden.numbers(&format!("{case}.outputs"));
        assert_close(&format!("{case}: outputs"), predicted.iter(), &recorded);
    }
}

#[test]
fn a_long_window_on_own_predictions_agrees_with_pytorch() {
    check(12, Forcing::FreeRunning);
}

#[test]
fn a_long_window_fed_with_the_truth_agrees_with_pytorch() {
    check(12, Forcing::Teacher);
}

#[test]
fn a_window_of_at_most_2m_frames_on_own_predictions_agrees_with_pytorch() {
    check(6, Forcing::FreeRunning);
}

#[test]
fn a_window_of_at_most_2m_frames_fed_with_the_truth_agrees_with_pytorch() {
    check(6, Forcing::Teacher);
}
