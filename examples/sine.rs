//! A multilayer perceptron with PReLU learns a sine with Adam.

use std::error::Error;

use keydance::autograd::{Gradients, Parameters, Tape, Workspace};
use keydance::nn::{Initialiser, LastLayer, Mlp};
use keydance::optim::{Adam, AdamConfig};
use ndarray::Array2;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

fn main() -> Result<(), Box<dyn Error>> {
    let mut parameters = Parameters::<f32>::new();
    let mut init = Initialiser::new(&mut parameters, ChaCha8Rng::seed_from_u64(1));
    let mlp = Mlp::new(&mut init, "mlp", &[1, 32, 32, 1], LastLayer::Linear);
    let x = Array2::from_shape_fn((64, 1), |(row, _)| row as f32 / 10.0 - 3.2);
    let mut adam = Adam::new(AdamConfig::with_rate(1e-2), &parameters)?;
    let mut gradients = Gradients::zeros(&parameters);
    let mut workspace = Workspace::new();
    for step in 0..=1000 {
        let mut tape = Tape::recording(&parameters, &mut workspace);
        let [input, target] = [x.clone(), x.mapv(f32::sin)].map(|value| tape.constant(value));
        let predicted = mlp.forward(&mut tape, input)?;
        let loss = tape.mean_squared_error(predicted, target)?;
        if step % 200 == 0 {
            println!("step {step}: {:.6}", tape.values(loss)[0]);
        }
        tape.backward(loss, &mut gradients)?;
        adam.step(&mut parameters, &mut gradients)?;
    }
    Ok(())
}
