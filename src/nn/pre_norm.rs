//! A Transformer layer that normalises before each of its two branches (Xiong et al. 2020), with
//! exact GELU and stochastic depth.

use rand::Rng;

use super::{Initialiser, LayerNorm, Linear, MultiHeadAttention, TransformerSizes};
use crate::autograd::{AutogradError, Real, Tape, Var};

/// Self-attention, then two linear layers with GELU between them, each as
/// `x + drop_path(branch(norm(x)))`; names as of `torch.nn.TransformerEncoderLayer`, which is this
/// with `norm_first=True, activation="gelu"` and neither dropout nor stochastic depth.
#[derive(Debug, Clone)]
pub struct PreNormEncoderLayer {
    self_attention: MultiHeadAttention,
    linear1: Linear,
    linear2: Linear,
    norms: [LayerNorm; 2],
    drop_path: f64,
}

impl PreNormEncoderLayer {
    /// Adds `{name}.self_attn`, `.linear1`, `.linear2`, `.norm1`, `.norm2`. `drop_path` is the
    /// probability that a branch is dropped for a whole window; the dropout of `sizes` is that of
    /// the attention weights, and the only one.
    ///
    /// # Errors
    /// Heads that do not divide the width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        sizes: TransformerSizes,
        drop_path: f64,
    ) -> Result<Self, AutogradError> {
        let (d, wide) = (sizes.width, sizes.feed_forward);
        Ok(Self {
            self_attention: MultiHeadAttention::new(init, &format!("{name}.self_attn"), sizes)?,
            linear1: Linear::new(init, &format!("{name}.linear1"), d, wide),
            linear2: Linear::new(init, &format!("{name}.linear2"), wide, d),
            norms: [1, 2].map(|k| LayerNorm::new(init, &format!("{name}.norm{k}"), d)),
            drop_path,
        })
    }

    /// Tokens `x [windows * tokens, d]`, in windows of `tokens`, to the same shape. Where the
    /// tape's dropout is on, a branch is dropped for all `tokens` rows of a window or for none.
    ///
    /// # Errors
    /// Rows that are no whole windows; a probability that is none.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        tokens: usize,
    ) -> Result<Var, AutogradError> {
        let y = self.norms[0].forward(tape, x)?;
        let y = self.self_attention.own(tape, y, tokens)?;
        let y = tape.drop_path(y, self.drop_path, tokens)?;
        let x = tape.add(x, y)?;
        let y = self.norms[1].forward(tape, x)?;
        let y = self.linear1.forward(tape, y)?;
        let y = tape.gelu(y);
        let y = self.linear2.forward(tape, y)?;
        let y = tape.drop_path(y, self.drop_path, tokens)?;
        tape.add(x, y)
    }
}

#[cfg(test)]
mod tests {
    use ndarray::Array2;
    use rand::SeedableRng as _;

    use super::*;
    use crate::autograd::check::check_parameters;
    use crate::autograd::{Gradients, Parameters, Workspace};

    const TOKENS: usize = 3;

    fn layer(drop_path: f64) -> (Parameters<f64>, PreNormEncoderLayer) {
        let sizes = TransformerSizes {
            width: 8,
            heads: 2,
            feed_forward: 10,
            dropout: 0.0,
        };
        let mut parameters = Parameters::new();
        let rng = rand_chacha::ChaCha8Rng::seed_from_u64(11);
        let mut init = Initialiser::new(&mut parameters, rng);
        let layer = PreNormEncoderLayer::new(&mut init, "layers.0", sizes, drop_path).unwrap();
        (parameters, layer)
    }

    fn tokens(windows: usize) -> Array2<f64> {
        Array2::from_shape_fn((windows * TOKENS, 8), |(i, j)| {
            (1.7 * (i * 8 + j) as f64).sin()
        })
    }

    fn run(drop_path: f64, dropout: Option<u64>, windows: usize) -> Vec<f64> {
        let (parameters, layer) = layer(drop_path);
        let mut workspace = Workspace::new();
        let mut tape = Tape::inference(&parameters, &mut workspace);
        tape.set_dropout(dropout);
        let x = tape.constant(tokens(windows));
        let y = layer.forward(&mut tape, x, TOKENS).unwrap();
        assert_eq!(tape.shape(y), [windows * TOKENS, 8]);
        tape.values(y).to_vec()
    }

    #[test]
    fn names_are_those_of_pytorch() {
        let (parameters, _) = layer(0.0);
        let names: Vec<&str> = parameters.iter().map(|(name, _)| name).collect();
        let expected = [
            "self_attn.in_proj_weight",
            "self_attn.in_proj_bias",
            "self_attn.out_proj.weight",
            "self_attn.out_proj.bias",
            "linear1.weight",
            "linear1.bias",
            "linear2.weight",
            "linear2.bias",
            "norm1.weight",
            "norm1.bias",
            "norm2.weight",
            "norm2.bias",
        ];
        assert_eq!(names, expected.map(|name| format!("layers.0.{name}")));
    }

    #[test]
    fn its_gradient_is_that_of_central_differences() {
        for dropout in [None, Some(4)] {
            let (mut parameters, layer) = layer(0.5);
            let loss = |parameters: &Parameters<f64>, gradients: Option<&mut Gradients<f64>>| {
                let mut workspace = Workspace::new();
                let mut tape = Tape::recording(parameters, &mut workspace);
                tape.set_dropout(dropout);
                let x = tape.constant(tokens(4));
                let y = layer.forward(&mut tape, x, TOKENS)?;
                let y = tape.square(y);
                let loss = tape.sum(y);
                let value = tape.values(loss)[0];
                gradients.map_or(Ok(()), |gradients| tape.backward(loss, gradients))?;
                Ok(value)
            };
            let mut gradients = Gradients::zeros(&parameters);
            loss(&parameters, Some(&mut gradients)).unwrap();
            let report = check_parameters(&mut parameters, &gradients, 20, |parameters, _| {
                loss(parameters, None)
            });
            let report = report.unwrap();
            assert!(report.error() < 1e-6, "{report:?}");
        }
    }

    #[test]
    fn a_window_with_both_branches_dropped_is_unchanged_and_windows_are_dropped_alone() {
        let given: Vec<f64> = tokens(64).into_iter().collect();
        assert_eq!(run(1.0, Some(1), 64), given);
        assert_ne!(run(1.0, None, 64), given);
        let kept = run(0.5, None, 64);
        assert_eq!(kept, run(0.0, Some(1), 64));
        let dropped = run(0.5, Some(1), 64);
        let windows = dropped.chunks(TOKENS * 8).zip(given.chunks(TOKENS * 8));
        let unchanged = windows.filter(|(y, x)| y == x).count();
        // A quarter of 64, give or take three deviations.
        assert!((6..=26).contains(&unchanged), "{unchanged}");
    }
}
