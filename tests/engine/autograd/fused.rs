//! Fused operations are what the plain ones make of the same inputs, values and gradients, in f64
//! and f32.

use std::cell::Cell;

use keydance::autograd::ops::attention::{AttentionShape, HeadColumns};
use keydance::autograd::ops::lstm_cell::LstmWeights;
use keydance::autograd::ops::query_attention::QueryAttentionWeights;
use keydance::autograd::{AutogradError, Gradients, Parameters, Real, Tape, Var, Workspace};
use ndarray::{ArrayD, IxDyn};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Result<T> = std::result::Result<T, AutogradError>;

/// A fused operation beside the composition that it stands for.
trait Pair {
    /// Shapes of the inputs.
    fn shapes(&self) -> Vec<Vec<usize>>;

    fn fused<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var]) -> Result<Var>;

    /// Where dropout acts, `masks` is the place on the tape at which its masks are drawn: the same
    /// place draws the same masks.
    fn composed<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        v: &[Var],
        masks: &Cell<usize>,
    ) -> Result<Var>;
}

#[derive(Clone, Copy, PartialEq)]
enum Inputs {
    /// Values on the tape.
    Values,
    /// Parameters, whose products run on packed weights.
    Parameters,
}

const DROPOUT_KEY: u64 = 41;

/// The output, then the gradient of each input, for a fixed upstream gradient.
fn run<T: Real>(
    shapes: &[Vec<usize>],
    dropout: bool,
    inputs: Inputs,
    build: impl FnOnce(&mut Tape<'_, T>, &[Var]) -> Result<Var>,
) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(23);
    let mut draw = |shape: &[usize]| {
        ArrayD::from_shape_simple_fn(IxDyn(shape), || T::from_f64(rng.random_range(-1.0..1.0)))
    };
    let values: Vec<ArrayD<T>> = shapes.iter().map(|shape| draw(shape)).collect();
    let mut parameters = Parameters::new();
    let blocks: Vec<_> = values
        .iter()
        .map(|value| parameters.add("input", value.clone()).1)
        .collect();
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut tape = Tape::recording(&parameters, &mut workspace);
    tape.set_dropout(dropout.then_some(DROPOUT_KEY));
    let vars: Vec<Var> = match inputs {
        Inputs::Values => values.into_iter().map(|value| tape.input(value)).collect(),
        Inputs::Parameters => blocks.into_iter().map(|block| tape.block(block)).collect(),
    };
    let y = build(&mut tape, &vars).unwrap();
    let output = tape.values(y).to_vec();
    let upstream: Vec<T> = (0..output.len())
        .map(|i| T::from_f64((i as f64 * 0.7).cos()))
        .collect();
    let of_values = match inputs {
        Inputs::Values => vars,
        Inputs::Parameters => Vec::new(),
    };
    let found = tape
        .backward_from(y, &upstream, &of_values, &mut gradients)
        .unwrap();
    let gradients: Vec<Vec<T>> = match inputs {
        Inputs::Values => found.into_iter().map(|g| g.into_iter().collect()).collect(),
        Inputs::Parameters => gradients.iter().map(<[T]>::to_vec).collect(),
    };
    let to_f64 = |values: Vec<T>| values.into_iter().map(Real::to_f64).collect();
    std::iter::once(output)
        .chain(gradients)
        .map(to_f64)
        .collect()
}

fn agree<T: Real>(pair: &impl Pair, dropout: bool, tolerance: f64) {
    let shapes = pair.shapes();
    let masks = Cell::new(0);
    let composed = run::<T>(&shapes, dropout, Inputs::Values, |tape, v| {
        pair.composed(tape, v, &masks)
    });
    for inputs in [Inputs::Values, Inputs::Parameters] {
        let fused = run::<T>(&shapes, dropout, inputs, |tape, v| {
            while tape.mark() < masks.get() {
                tape.constant_with(&[1], |out| out.fill(T::zero()));
            }
            pair.fused(tape, v)
        });
        assert_eq!(fused.len(), composed.len());
        for (what, (fused, composed)) in fused.iter().zip(&composed).enumerate() {
            assert_eq!(fused.len(), composed.len());
            let scale = composed.iter().fold(1f64, |scale, x| scale.max(x.abs()));
            for (a, b) in fused.iter().zip(composed) {
                let place = match what {
                    0 => "output".to_owned(),
                    k => format!("gradient of input {}", k - 1),
                };
                assert!(
                    (a - b).abs() <= tolerance * scale,
                    "{place}: {a}, composed {b}"
                );
            }
        }
    }
}

fn agree_in_both(pair: &impl Pair, dropout: bool) {
    agree::<f64>(pair, dropout, 1e-13);
    agree::<f32>(pair, dropout, 5e-6);
}

struct Linear {
    rows: usize,
    bias: bool,
    relu: bool,
}

impl Pair for Linear {
    fn shapes(&self) -> Vec<Vec<usize>> {
        vec![vec![self.rows, 9], vec![6, 9], vec![6]]
    }

    fn fused<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var]) -> Result<Var> {
        tape.linear(v[0], v[1], self.bias.then_some(v[2]), self.relu)
    }

    fn composed<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var], _: &Cell<usize>) -> Result<Var> {
        let x = tape.reshape(v[0], &[self.rows, 1, 9])?;
        let products = tape.mul(x, v[1])?;
        let mut y = tape.sum_last(products)?;
        if self.bias {
            y = tape.add(y, v[2])?;
        }
        Ok(if self.relu {
            tape.clamp(y, 0.0, f64::INFINITY)
        } else {
            y
        })
    }
}

#[test]
fn linear_is_products_summed_with_bias_and_relu() {
    // Few rows are staged for the weight's gradient, many are not.
    for rows in [1, 5, 130] {
        for (bias, relu) in [(false, false), (true, false), (true, true), (false, true)] {
            agree_in_both(&Linear { rows, bias, relu }, false);
        }
    }
}

/// Two steps.
struct Lstm;

impl Pair for Lstm {
    fn shapes(&self) -> Vec<Vec<usize>> {
        let n = 5;
        vec![
            vec![3, 4],
            vec![3, 4],
            vec![3, 2 * n],
            vec![4 * n, 4],
            vec![4 * n, n],
            vec![4 * n],
            vec![4 * n],
        ]
    }

    fn fused<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var]) -> Result<Var> {
        let weights = LstmWeights {
            weight_ih: v[3],
            weight_hh: v[4],
            bias_ih: v[5],
            bias_hh: v[6],
        };
        let state = tape.lstm_cell(v[0], v[2], weights)?;
        tape.lstm_cell(v[1], state, weights)
    }

    fn composed<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var], _: &Cell<usize>) -> Result<Var> {
        let n = 5;
        let mut state = v[2];
        for x in [v[0], v[1]] {
            let h = tape.columns(state, 0..n)?;
            let c = tape.columns(state, n..2 * n)?;
            let from_input = tape.linear(x, v[3], Some(v[5]), false)?;
            let from_state = tape.linear(h, v[4], Some(v[6]), false)?;
            let gates = tape.add(from_input, from_state)?;
            let gate = |tape: &mut Tape<'_, T>, k: usize| tape.columns(gates, k * n..(k + 1) * n);
            let [i, f, g, o] = [
                gate(tape, 0)?,
                gate(tape, 1)?,
                gate(tape, 2)?,
                gate(tape, 3)?,
            ];
            let (i, f) = (tape.sigmoid(i), tape.sigmoid(f));
            let (g, o) = (tape.tanh(g), tape.sigmoid(o));
            let kept = tape.mul(f, c)?;
            let new = tape.mul(i, g)?;
            let c = tape.add(kept, new)?;
            let shown = tape.tanh(c);
            let h = tape.mul(o, shown)?;
            state = tape.concat(&[h, c])?;
        }
        Ok(state)
    }
}

#[test]
fn lstm_cell_is_its_gates_written_out() {
    agree_in_both(&Lstm, false);
}

/// Queries in one value, keys and values beside each other in another, a bias of the scores in a
/// third.
struct Attention {
    windows: usize,
    heads: usize,
    head_width: usize,
    queries: usize,
    keys: usize,
    /// Heads of the bias, if there is one.
    biases: Option<usize>,
    dropout: f64,
}

impl Attention {
    fn width(&self) -> usize {
        self.heads * self.head_width
    }

    fn columns(value: Var, start: usize) -> HeadColumns {
        HeadColumns { value, start }
    }

    /// q_h k_h^T / sqrt(dh), plus the bias, softmax, for one window and head, `[queries, keys]`.
    fn probabilities<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        (q, k): (Var, Var),
        bias: Option<Var>,
    ) -> Result<Var> {
        let (dh, tq, tk) = (self.head_width, self.queries, self.keys);
        let q = tape.reshape(q, &[tq, 1, dh])?;
        let k = tape.reshape(k, &[1, tk, dh])?;
        let products = tape.mul(q, k)?;
        let scores = tape.sum_last(products)?;
        let mut scores = tape.affine(scores, 1.0 / (dh as f64).sqrt(), 0.0);
        if let Some(bias) = bias {
            let bias = tape.reshape(bias, &[tq, tk])?;
            scores = tape.add(scores, bias)?;
        }
        Ok(tape.softmax(scores))
    }
}

impl Pair for Attention {
    fn shapes(&self) -> Vec<Vec<usize>> {
        let width = self.width();
        vec![
            vec![self.windows * self.queries, width],
            vec![self.windows * self.keys, 2 * width],
            vec![self.biases.unwrap_or(1), self.queries, self.keys],
        ]
    }

    fn fused<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var]) -> Result<Var> {
        let shape = AttentionShape {
            heads: self.heads,
            width: self.width(),
            queries: self.queries,
            keys: self.keys,
        };
        let (q, k, w) = (
            Self::columns(v[0], 0),
            Self::columns(v[1], 0),
            Self::columns(v[1], self.width()),
        );
        let bias = self.biases.map(|_| v[2]);
        tape.attention([q, k, w], shape, bias, self.dropout)
    }

    fn composed<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        v: &[Var],
        masks: &Cell<usize>,
    ) -> Result<Var> {
        let (dh, tq, tk, width) = (self.head_width, self.queries, self.keys, self.width());
        // The masks are those of rows padded to whole vectors.
        let padded = tk.next_multiple_of(8);
        let padding = tape.constant_with(&[tq, padded - tk], |out| out.fill(T::zero()));
        let (mut all, mut values) = (Vec::new(), Vec::new());
        for window in 0..self.windows {
            let q = tape.rows(v[0], window * tq..(window + 1) * tq)?;
            let kv = tape.rows(v[1], window * tk..(window + 1) * tk)?;
            for head in 0..self.heads {
                let of_head = |start: usize| start + head * dh..start + (head + 1) * dh;
                let q = tape.columns(q, of_head(0))?;
                let k = tape.columns(kv, of_head(0))?;
                values.push(tape.columns(kv, of_head(width))?);
                let bias = match self.biases {
                    None => None,
                    Some(heads) => Some(tape.rows(v[2], head % heads..head % heads + 1)?),
                };
                let p = self.probabilities(tape, (q, k), bias)?;
                all.push(tape.concat(&[p, padding])?);
            }
        }
        let all = tape.stack(&all)?;
        masks.set(tape.mark());
        let all = tape.dropout(all, self.dropout);
        let mut windows = Vec::new();
        for window in 0..self.windows {
            let mut heads = Vec::new();
            for head in 0..self.heads {
                let row = window * self.heads + head;
                let p = tape.rows(all, row..row + 1)?;
                let p = tape.reshape(p, &[tq, padded])?;
                let p = tape.columns(p, 0..tk)?;
                heads.push(tape.matmul(p, values[row])?);
            }
            windows.push(tape.concat(&heads)?);
        }
        let y = tape.stack(&windows)?;
        tape.reshape(y, &[self.windows * tq, width])
    }
}

#[test]
fn attention_is_softmax_and_products_in_each_window_and_head() {
    for (windows, heads, head_width, queries, keys, biases) in [
        (1, 1, 1, 1, 1, None),
        (3, 2, 3, 7, 7, None),
        (3, 2, 3, 7, 7, Some(1)),
        (2, 3, 4, 2, 9, Some(3)),
    ] {
        for dropout in [0.0, 0.4] {
            let pair = Attention {
                windows,
                heads,
                head_width,
                queries,
                keys,
                biases,
                dropout,
            };
            agree_in_both(&pair, dropout > 0.0);
        }
    }
}

/// One query a window to `tokens` tokens of 5 numbers, 2 heads of 3.
struct QueryAttention {
    tokens: usize,
    dropout: f64,
}

const HEADS: usize = 2;
const HEAD_WIDTH: usize = 3;

impl Pair for QueryAttention {
    fn shapes(&self) -> Vec<Vec<usize>> {
        let mut shapes = vec![vec![4, HEADS * HEAD_WIDTH], vec![4 * self.tokens, 5]];
        shapes.extend(vec![vec![HEAD_WIDTH, 5]; 2 * HEADS]);
        shapes.push(vec![HEADS * HEAD_WIDTH]);
        shapes
    }

    fn fused<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var]) -> Result<Var> {
        let weights = QueryAttentionWeights {
            keys: v[2..4].to_vec(),
            values: v[4..6].to_vec(),
            value_bias: v[6],
        };
        tape.query_attention(v[0], v[1], weights, self.tokens, self.dropout)
    }

    /// Keys and values are projected; the keys with a bias, which does not matter.
    fn composed<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        v: &[Var],
        masks: &Cell<usize>,
    ) -> Result<Var> {
        let width = HEADS * HEAD_WIDTH;
        let key_bias = tape.constant_with(&[width], |out| {
            for (k, out) in out.iter_mut().enumerate() {
                *out = T::from_f64(k as f64 - 2.0);
            }
        });
        let keys = tape.stack(&v[2..4])?;
        let keys = tape.reshape(keys, &[width, 5])?;
        let values = tape.stack(&v[4..6])?;
        let values = tape.reshape(values, &[width, 5])?;
        let k = tape.linear(v[1], keys, Some(key_bias), false)?;
        let w = tape.linear(v[1], values, Some(v[6]), false)?;
        let whole = |value| HeadColumns { value, start: 0 };
        let shape = AttentionShape {
            heads: HEADS,
            width,
            queries: 1,
            keys: self.tokens,
        };
        masks.set(tape.mark());
        let operands = [whole(v[0]), whole(k), whole(w)];
        tape.attention(operands, shape, None, self.dropout)
    }
}

#[test]
fn query_attention_is_attention_with_projected_keys_and_values() {
    for tokens in [1, 7, 8, 10] {
        for dropout in [0.0, 0.4] {
            agree_in_both(&QueryAttention { tokens, dropout }, dropout > 0.0);
        }
    }
}

struct AddLayerNorm {
    dropout: f64,
}

impl Pair for AddLayerNorm {
    fn shapes(&self) -> Vec<Vec<usize>> {
        vec![vec![6, 11], vec![6, 11], vec![11], vec![11]]
    }

    fn fused<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var]) -> Result<Var> {
        tape.add_layer_norm(v[0], v[1], (v[2], v[3]), self.dropout)
    }

    fn composed<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        v: &[Var],
        masks: &Cell<usize>,
    ) -> Result<Var> {
        masks.set(tape.mark());
        let dropped = tape.dropout(v[0], self.dropout);
        let sum = tape.add(v[1], dropped)?;
        tape.layer_norm(sum, v[2], v[3])
    }
}

#[test]
fn add_layer_norm_is_dropout_add_and_layer_norm() {
    for dropout in [0.0, 0.4] {
        agree_in_both(&AddLayerNorm { dropout }, dropout > 0.0);
    }
}

struct ConvolveRows;

impl Pair for ConvolveRows {
    fn shapes(&self) -> Vec<Vec<usize>> {
        vec![vec![8, 5], vec![6, 5, 3], vec![6]]
    }

    fn fused<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var]) -> Result<Var> {
        tape.convolve_rows(v[0], v[1], v[2], 4)
    }

    /// A product for each place in the kernel, with the rows that it meets.
    fn composed<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var], _: &Cell<usize>) -> Result<Var> {
        let zeros = tape.constant_with(&[1, 5], |out| out.fill(T::zero()));
        let weights = tape.reshape(v[1], &[30, 3])?;
        let mut sum = None;
        for w in 0..3 {
            let mut rows = Vec::new();
            for row in 0..8 {
                let inside = (1..5).contains(&(row % 4 + w));
                rows.push(match inside {
                    true => tape.rows(v[0], row + w - 1..row + w)?,
                    false => zeros,
                });
            }
            let x = tape.stack(&rows)?;
            let x = tape.reshape(x, &[8, 5])?;
            let weight = tape.columns(weights, w..w + 1)?;
            let weight = tape.reshape(weight, &[6, 5])?;
            let bias = (w == 1).then_some(v[2]);
            let y = tape.linear(x, weight, bias, false)?;
            sum = match sum {
                None => Some(y),
                Some(sum) => Some(tape.add(sum, y)?),
            };
        }
        Ok(sum.unwrap())
    }
}

#[test]
fn convolve_rows_is_a_product_for_each_place_in_the_kernel() {
    agree_in_both(&ConvolveRows, false);
}

struct LogSoftmax;

impl Pair for LogSoftmax {
    fn shapes(&self) -> Vec<Vec<usize>> {
        vec![vec![4, 19]]
    }

    fn fused<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var]) -> Result<Var> {
        Ok(tape.log_softmax(v[0]))
    }

    fn composed<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var], _: &Cell<usize>) -> Result<Var> {
        let p = tape.softmax(v[0]);
        Ok(tape.ln(p))
    }
}

#[test]
fn log_softmax_is_ln_of_softmax() {
    agree_in_both(&LogSoftmax, false);
}

struct SumLast;

impl Pair for SumLast {
    fn shapes(&self) -> Vec<Vec<usize>> {
        vec![vec![4, 19]]
    }

    fn fused<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var]) -> Result<Var> {
        tape.sum_last(v[0])
    }

    fn composed<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var], _: &Cell<usize>) -> Result<Var> {
        let ones = tape.constant_with(&[19, 1], |out| out.fill(T::one()));
        let y = tape.matmul(v[0], ones)?;
        tape.reshape(y, &[4])
    }
}

struct VectorNorm;

impl Pair for VectorNorm {
    fn shapes(&self) -> Vec<Vec<usize>> {
        vec![vec![2, 5, 3]]
    }

    fn fused<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var]) -> Result<Var> {
        tape.vector_norm(v[0], 1e-3)
    }

    fn composed<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var], _: &Cell<usize>) -> Result<Var> {
        let squares = tape.square(v[0]);
        let sums = tape.sum_last(squares)?;
        let sums = tape.affine(sums, 1.0, 1e-3);
        Ok(tape.sqrt(sums))
    }
}

struct Prelu;

impl Pair for Prelu {
    fn shapes(&self) -> Vec<Vec<usize>> {
        vec![vec![5, 7], vec![1]]
    }

    fn fused<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var]) -> Result<Var> {
        tape.prelu(v[0], v[1])
    }

    fn composed<T: Real>(&self, tape: &mut Tape<'_, T>, v: &[Var], _: &Cell<usize>) -> Result<Var> {
        let positive = tape.clamp(v[0], 0.0, f64::INFINITY);
        let negative = tape.sub(v[0], positive)?;
        let negative = tape.mul(negative, v[1])?;
        tape.add(positive, negative)
    }
}

#[test]
fn sums_norms_and_prelu_are_their_formulas() {
    agree_in_both(&SumLast, false);
    agree_in_both(&VectorNorm, false);
    agree_in_both(&Prelu, false);
}
