//! Self-attention learns to fetch: every token says the number of the one token that is marked.

use std::error::Error;

use keydance::autograd::{Gradients, Parameters, Tape, Workspace};
use keydance::nn::{Initialiser, Linear, MultiHeadAttention, TransformerSizes};
use keydance::optim::{Adam, AdamConfig};
use ndarray::Array2;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

const WINDOWS: usize = 32;
const TOKENS: usize = 8;

fn main() -> Result<(), Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut parameters = Parameters::<f32>::new();
    let mut init = Initialiser::new(&mut parameters, ChaCha8Rng::seed_from_u64(1));
    let sizes = TransformerSizes {
        width: 16,
        heads: 2,
        feed_forward: 32,
        dropout: 0.0,
    };
    let embedding = Linear::new(&mut init, "embedding", 2, 16);
    let attention = MultiHeadAttention::new(&mut init, "attention", sizes)?;
    let head = Linear::new(&mut init, "head", 16, 1);
    let mut adam = Adam::new(AdamConfig::with_rate(5e-3), &parameters)?;
    let mut gradients = Gradients::zeros(&parameters);
    let mut workspace = Workspace::new();
    for step in 0..=1000 {
        let marked: Vec<usize> = (0..WINDOWS).map(|_| rng.random_range(0..TOKENS)).collect();
        let numbers: Vec<f32> = (0..WINDOWS * TOKENS)
            .map(|_| rng.random_range(-1.0..1.0))
            .collect();
        let is_marked = |row: usize| row % TOKENS == marked[row / TOKENS];
        let tokens = Array2::from_shape_fn((WINDOWS * TOKENS, 2), |(row, column)| match column {
            0 => numbers[row],
            _ => f32::from(u8::from(is_marked(row))),
        });
        let fetched = Array2::from_shape_fn((WINDOWS * TOKENS, 1), |(row, _)| {
            let window = row / TOKENS;
            numbers[window * TOKENS + marked[window]]
        });
        let mut tape = Tape::recording(&parameters, &mut workspace);
        let (tokens, fetched) = (tape.constant(tokens), tape.constant(fetched));
        let x = embedding.forward(&mut tape, tokens)?;
        let x = attention.own(&mut tape, x, TOKENS)?;
        let said = head.forward(&mut tape, x)?;
        let loss = tape.mean_squared_error(said, fetched)?;
        if step % 200 == 0 {
            println!("step {step}: {:.4}", tape.values(loss)[0]);
        }
        tape.backward(loss, &mut gradients)?;
        adam.step(&mut parameters, &mut gradients)?;
    }
    Ok(())
}
