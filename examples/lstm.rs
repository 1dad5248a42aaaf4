//! An LSTM learns to say, at the end of a sequence, the number that it began with.

use std::error::Error;

use keydance::autograd::{Gradients, Parameters, Tape, Workspace};
use keydance::nn::{Initialiser, Linear, Lstm};
use keydance::optim::{Adam, AdamConfig};
use ndarray::Array2;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

const BATCH: usize = 64;
const LENGTH: usize = 10;

fn main() -> Result<(), Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut parameters = Parameters::<f32>::new();
    let mut init = Initialiser::new(&mut parameters, ChaCha8Rng::seed_from_u64(1));
    let lstm = Lstm::new(&mut init, "lstm", 1, 32);
    let head = Linear::new(&mut init, "head", 32, 1);
    let mut adam = Adam::new(AdamConfig::with_rate(5e-3), &parameters)?;
    let mut gradients = Gradients::zeros(&parameters);
    let mut workspace = Workspace::new();
    for step in 0..=600 {
        let mut tape = Tape::recording(&parameters, &mut workspace);
        let mut state = lstm.start(&mut tape, BATCH);
        let (mut output, mut first) = (state, None);
        for _ in 0..LENGTH {
            let numbers = Array2::from_shape_simple_fn((BATCH, 1), || rng.random_range(-1.0..1.0));
            let numbers = tape.constant(numbers);
            first.get_or_insert(numbers);
            (output, state) = lstm.step(&mut tape, numbers, state)?;
        }
        let said = head.forward(&mut tape, output)?;
        let loss = tape.mean_squared_error(said, first.ok_or("no sequence")?)?;
        if step % 100 == 0 {
            println!("step {step}: {:.4}", tape.values(loss)[0]);
        }
        tape.backward(loss, &mut gradients)?;
        adam.step(&mut parameters, &mut gradients)?;
    }
    Ok(())
}
