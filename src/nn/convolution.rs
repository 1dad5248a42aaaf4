//! A convolution over time.

use rand::Rng;

use super::Initialiser;
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};

/// A convolution over the frames of windows, as PyTorch's `Conv1d` with zeros beyond the ends;
/// `weight [out, in, width]`, `bias [out]`, both uniform within 1 / sqrt(in width) at first.
#[derive(Debug, Clone, Copy)]
pub struct Convolution {
    weight: BlockId,
    bias: BlockId,
}

impl Convolution {
    /// Adds `{name}.weight` and `{name}.bias`; `width` is the number of frames that one is made of,
    /// odd.
    ///
    /// # Errors
    /// An even width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        (inputs, outputs): (usize, usize),
        width: usize,
    ) -> Result<Self, AutogradError> {
        let bound = 1.0 / (inputs as f64 * width as f64).sqrt();
        Self::within(init, name, [outputs, inputs, width], bound)
    }

    /// With weights uniform within `bound`.
    fn within<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        shape: [usize; 3],
        bound: f64,
    ) -> Result<Self, AutogradError> {
        let [outputs, _, width] = shape;
        if width.is_multiple_of(2) {
            return Err(AutogradError::Argument {
                operation: "convolve_rows",
                shape: shape.to_vec(),
                argument: format!("a width of {width}"),
                expected: "an odd number",
            });
        }
        Ok(Self {
            weight: init.uniform(format!("{name}.weight"), &shape, bound).1,
            bias: init.uniform(format!("{name}.bias"), &[outputs], bound).1,
        })
    }

    /// [`Convolution::new`], with 0 for every weight: whatever goes in, 0 comes out until it is
    /// trained.
    ///
    /// # Errors
    /// An even width.
    pub fn of_zeros<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        (inputs, outputs): (usize, usize),
        width: usize,
    ) -> Result<Self, AutogradError> {
        Self::within(init, name, [outputs, inputs, width], 0.0)
    }

    /// `x [windows * frames, in]` -> `[windows * frames, out]`.
    ///
    /// # Errors
    /// An input of another width, rows that are no whole windows.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        frames: usize,
    ) -> Result<Var, AutogradError> {
        let (weight, bias) = (tape.block(self.weight), tape.block(self.bias));
        tape.convolve_rows(x, weight, bias, frames)
    }
}

#[cfg(test)]
mod tests {
    use ndarray::arr2;
    use rand::SeedableRng as _;

    use super::*;
    use crate::autograd::{Parameters, Workspace};

    /// y_t = b + 1 x_(t-1) + 10 x_t + 100 x_(t+1) by hand: the taps stand in time's order, and a
    /// window sees nothing of the next.
    #[test]
    fn taps_are_those_of_conv1d() {
        let mut parameters = Parameters::<f64>::new();
        let rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut init = Initialiser::new(&mut parameters, rng);
        let layer = Convolution::new(&mut init, "state", (2, 1), 3).unwrap();
        assert!(Convolution::new(&mut init, "even", (2, 1), 4).is_err());
        let mut found = Vec::new();
        for (name, mut value) in parameters.values_mut() {
            assert!(value.iter().all(|x| x.abs() <= 1.0 / 6f64.sqrt()));
            found.push((name.to_owned(), value.shape().to_vec()));
            match name {
                "state.weight" => value
                    .iter_mut()
                    .zip([1.0, 10.0, 100.0, 1e3, 1e4, 1e5])
                    .for_each(|(w, x)| *w = x),
                _ => value.fill(0.5),
            }
        }
        let names = [("state.weight", vec![1, 2, 3]), ("state.bias", vec![1])];
        assert_eq!(found, names.map(|(name, shape)| (name.to_owned(), shape)));
        let mut workspace = Workspace::new();
        let mut tape = Tape::inference(&parameters, &mut workspace);
        let x = tape.constant(arr2(&[[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]]));
        let y = layer.forward(&mut tape, x, 2).unwrap();
        let expected = [420_310.5, 42_031.5, 860_750.5, 86_075.5];
        assert_eq!(tape.values(y), expected);
        assert_eq!(tape.shape(y), [4, 1]);
        assert!(layer.forward(&mut tape, x, 3).is_err());
    }
}
