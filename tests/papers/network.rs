//! Networks of Pan et al. 2021 with their weights.

use keydance::autograd::{Parameters, Real, Tape, Workspace};
use keydance::models::pan2021::{Output, Pan2021, Pan2021Config};
use keydance::models::transition::Standardisation;
use keydance::models::transition::gradient_check::generated_batch;
use keydance::models::transition::{Batch, Network};
use keydance::nn::Initialiser;
use ndarray::Array3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Features of generated windows alone, standardised `[transition + 1, windows, 154]`.
pub fn generated_windows(
    transition: usize,
    windows: usize,
    seed: u64,
) -> (Array3<f64>, Standardisation) {
    let (batch, standardisation) = generated_batch(transition, windows, seed).unwrap();
    (batch.features, standardisation)
}

pub fn residual() -> Pan2021Config {
    Pan2021Config {
        output: Output::Residual,
        ..Pan2021Config::default()
    }
}

pub fn with_control_path() -> Pan2021Config {
    Pan2021Config {
        control_path: true,
        ..residual()
    }
}

/// A network with its weights.
pub struct Built<T> {
    pub network: Pan2021,
    pub parameters: Parameters<T>,
}

pub fn build<T: Real>(config: &Pan2021Config, standardisation: &Standardisation) -> Built<T> {
    let mut parameters = Parameters::new();
    let mut init = Initialiser::new(&mut parameters, ChaCha8Rng::seed_from_u64(3));
    let network = Pan2021::new(&mut init, config, standardisation).unwrap();
    Built {
        network,
        parameters,
    }
}

impl<T: Real> Built<T> {
    /// As after some training: no weight stands at a special value, such as the zeros that a
    /// residual network begins with.
    pub fn disturbed(mut self) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for (_, mut value) in self.parameters.values_mut() {
            value.mapv_inplace(|x| x + T::from_f64(rng.random_range(-0.1..0.1)));
        }
        self
    }
}

pub fn predict<T: Real>(built: &Built<T>, features: &Array3<T>) -> Array3<T> {
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&built.parameters, &mut workspace);
    let batch = Batch::of(features.clone());
    built.network.predict(&mut tape, &batch).unwrap()
}
