//! What another crate can get wrong: each public entry gives an error or the right answer, never a
//! panic, never a number from elsewhere.

use keydance::autograd::ops::attention::{AttentionShape, HeadColumns};
use keydance::autograd::ops::lstm_cell::LstmWeights;
use keydance::autograd::ops::query_attention::QueryAttentionWeights;
use keydance::autograd::{
    AutogradError, BlockId, BufferId, Gradients, Parameters, Tape, Var, Workspace,
};
use keydance::nn::{
    Initialiser, LastLayer, Linear, Lstm, Mlp, MultiHeadAttention, TransformerSizes,
    sinusoidal_positions,
};
use ndarray::{Array2, ArrayD, IxDyn, ShapeBuilder as _, arr1};
use proptest::prelude::*;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

type Operation = fn(&mut Tape<'_, f64>, &[Var], &Numbers) -> Result<Var, AutogradError>;

/// What stands beside an operation's operands.
#[derive(Debug)]
struct Numbers {
    sizes: Vec<usize>,
    real: f64,
}

impl Numbers {
    fn head(&self, value: Var, start: usize) -> HeadColumns {
        let start = self.sizes[start];
        HeadColumns { value, start }
    }

    fn heads(&self, v: &[Var]) -> [HeadColumns; 3] {
        [self.head(v[0], 4), self.head(v[1], 5), self.head(v[2], 5)]
    }

    fn attention(&self) -> AttentionShape {
        AttentionShape {
            heads: self.sizes[0],
            width: self.sizes[1],
            queries: self.sizes[2],
            keys: self.sizes[3],
        }
    }
}

/// Every operation, on whatever operands and numbers.
const OPERATIONS: [(&str, Operation); 47] = [
    ("abs", |t, v, _| Ok(t.abs(v[0]))),
    ("add", |t, v, _| t.add(v[0], v[1])),
    ("add_layer_norm", |t, v, n| {
        t.add_layer_norm(v[0], v[1], (v[2], v[3]), n.real)
    }),
    ("affine", |t, v, n| Ok(t.affine(v[0], n.real, 1.0))),
    ("attention", |t, v, n| {
        t.attention(n.heads(v), n.attention(), None, n.real)
    }),
    ("biased attention", |t, v, n| {
        t.attention(n.heads(v), n.attention(), Some(v[3]), n.real)
    }),
    ("clamp", |t, v, n| Ok(t.clamp(v[0], n.real, 1.0))),
    ("columns", |t, v, n| t.columns(v[0], n.sizes[0]..n.sizes[1])),
    ("concat", |t, v, n| t.concat(&v[..n.sizes[0].min(3)])),
    ("convolve_rows", |t, v, n| {
        t.convolve_rows(v[0], v[1], v[2], n.sizes[0])
    }),
    ("cumulative_sum", |t, v, n| {
        t.cumulative_sum(v[0], n.sizes[0])
    }),
    ("detach", |t, v, _| Ok(t.detach(v[0]))),
    ("div", |t, v, _| t.div(v[0], v[1])),
    ("drop_path", |t, v, n| t.drop_path(v[0], n.real, n.sizes[0])),
    ("dropout", |t, v, n| Ok(t.dropout(v[0], n.real))),
    ("exp", |t, v, _| Ok(t.exp(v[0]))),
    ("forward_kinematics", |t, v, n| {
        let parents = [None, Some(0), Some(n.sizes[0])];
        t.forward_kinematics(v[0], v[1], &parents[..n.sizes[1].min(3)])
    }),
    ("gelu", |t, v, _| Ok(t.gelu(v[0]))),
    ("layer_norm", |t, v, _| t.layer_norm(v[0], v[1], v[2])),
    ("linear", |t, v, _| t.linear(v[0], v[1], Some(v[2]), true)),
    ("linear without a bias", |t, v, _| {
        t.linear(v[0], v[1], None, false)
    }),
    ("ln", |t, v, _| Ok(t.ln(v[0]))),
    ("log_softmax", |t, v, _| Ok(t.log_softmax(v[0]))),
    ("lstm_cell", |t, v, _| {
        let weights = LstmWeights {
            weight_ih: v[2],
            weight_hh: v[3],
            bias_ih: v[4],
            bias_hh: v[4],
        };
        t.lstm_cell(v[0], v[1], weights)
    }),
    ("matmul", |t, v, _| t.matmul(v[0], v[1])),
    ("mean", |t, v, _| t.mean(v[0])),
    ("mean_squared_error", |t, v, _| {
        t.mean_squared_error(v[0], v[1])
    }),
    ("mul", |t, v, _| t.mul(v[0], v[1])),
    ("noise", |t, v, n| Ok(t.noise(v[0], n.real))),
    ("normalise", |t, v, n| t.normalise(v[0], n.sizes[0], n.real)),
    ("plu", |t, v, _| Ok(t.plu(v[0]))),
    ("prelu", |t, v, _| t.prelu(v[0], v[1])),
    ("query_attention", |t, v, n| {
        let weights = QueryAttentionWeights {
            keys: vec![v[2]; n.sizes[1].min(2)],
            values: vec![v[3]; n.sizes[2].min(2)],
            value_bias: v[4],
        };
        t.query_attention(v[0], v[1], weights, n.sizes[0], n.real)
    }),
    ("reshape", |t, v, n| t.reshape(v[0], &n.sizes[..3])),
    ("rows", |t, v, n| t.rows(v[0], n.sizes[0]..n.sizes[1])),
    ("shared_attention", |t, v, n| {
        t.shared_attention(v[0], v[1], n.sizes[0], 1.0, n.real)
    }),
    ("sigmoid", |t, v, _| Ok(t.sigmoid(v[0]))),
    ("softmax", |t, v, _| Ok(t.softmax(v[0]))),
    ("sqrt", |t, v, _| Ok(t.sqrt(v[0]))),
    ("square", |t, v, _| Ok(t.square(v[0]))),
    ("stack", |t, v, n| t.stack(&v[..n.sizes[0].min(3)])),
    ("strided_rows", |t, v, n| {
        t.strided_rows(v[0], n.sizes[0], n.sizes[1])
    }),
    ("sub", |t, v, _| t.sub(v[0], v[1])),
    ("sum", |t, v, _| Ok(t.sum(v[0]))),
    ("sum_last", |t, v, _| t.sum_last(v[0])),
    ("tanh", |t, v, _| Ok(t.tanh(v[0]))),
    ("vector_norm", |t, v, n| t.vector_norm(v[0], n.real)),
];

/// What an operation gives, or why the tape refuses it.
fn asked(
    tape: &mut Tape<'_, f64>,
    operation: Operation,
    vars: &[Var],
    numbers: &Numbers,
) -> Result<Var, AutogradError> {
    let y = operation(tape, vars, numbers)?;
    match tape.check_finite() {
        Err(AutogradError::NonFinite { .. }) | Ok(()) => Ok(y),
        Err(refused) => {
            // There is nothing in it, and it goes nowhere.
            assert_eq!((tape.shape(y), tape.values(y)), (&[0][..], &[][..]));
            let next = tape.sum_last(y).unwrap_err();
            assert_eq!(next.to_string(), refused.to_string());
            Err(refused)
        }
    }
}

/// Shapes that often fit each other, axes of nothing and huge ones without numbers among them.
fn shape() -> impl Strategy<Value = Vec<usize>> {
    let axis = || prop::sample::select(vec![0, 1, 1, 2, 2, 3, 4, 8]);
    prop_oneof![
        8 => prop::collection::vec(axis(), 0..4),
        1 => Just(vec![1 << 40, 0]),
        1 => Just(vec![0, 1 << 40]),
    ]
}

fn numbers() -> impl Strategy<Value = Numbers> {
    let size = prop::sample::select(vec![0, 0, 1, 1, 2, 3, 4, 8, 1 << 33, usize::MAX]);
    let reals = vec![0.0, 0.3, 1.0, -0.5, 2.0, f64::NAN, f64::INFINITY];
    let parts = (prop::collection::vec(size, 6), prop::sample::select(reals));
    parts.prop_map(|(sizes, real)| Numbers { sizes, real })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(20_000) })]

    #[test]
    fn operands_of_all_shapes_and_numbers_of_all_kinds_give_an_error_or_gradients_that_fit(
        (mut shapes, numbers) in (prop::collection::vec(shape(), 5), numbers()),
        (operation, same, recording) in (0..OPERATIONS.len(), any::<bool>(), any::<bool>()),
    ) {
        let (name, operation) = OPERATIONS[operation];
        if same {
            shapes = vec![shapes[0].clone(); 5];
        }
        let parameters = Parameters::new();
        let mut workspace = Workspace::new();
        let mut tape = match recording {
            true => Tape::recording(&parameters, &mut workspace),
            false => Tape::inference(&parameters, &mut workspace),
        }
        .with_dropout(1);
        let halves = |shape: &Vec<usize>| ArrayD::from_elem(IxDyn(shape), 0.5);
        let vars: Vec<Var> = shapes.iter().map(|shape| tape.input(halves(shape))).collect();
        let Ok(y) = asked(&mut tape, operation, &vars, &numbers) else {
            return Ok(());
        };
        let output = tape.values(y).to_vec();
        let finite = output.iter().all(|y| y.is_finite());
        prop_assert!(finite || name == "affine", "{name}: {output:?}");
        let upstream = vec![1.0; output.len()];
        let mut gradients = Gradients::zeros(&parameters);
        let found = tape.backward_from(y, &upstream, &vars, &mut gradients);
        prop_assert_eq!(found.is_ok(), recording, "{}", name);
        for (gradient, shape) in found.into_iter().flatten().zip(&shapes) {
            prop_assert_eq!(gradient.shape(), &shape[..], "{}", name);
        }
    }
}

/// Two weights and a buffer in parameters of their own.
fn owner() -> (Parameters<f64>, [BlockId; 2], BufferId) {
    let mut parameters = Parameters::new();
    let blocks = [1.0, 2.0].map(|x| parameters.add("x", arr1(&[x, x]).into_dyn()).1);
    let buffer = parameters.add_buffer("mean", arr1(&[3.0]).into_dyn());
    (parameters, blocks, buffer)
}

fn is_misplaced<R: std::fmt::Debug>(result: Result<R, AutogradError>) {
    let error = result.unwrap_err();
    assert!(
        matches!(error, AutogradError::Misplaced { .. }),
        "{error:?}"
    );
}

#[test]
fn a_value_of_another_tape_is_refused_wherever_one_is_asked_for() {
    let (parameters, [block, _], _) = owner();
    let mut workspaces = [Workspace::new(), Workspace::new()];
    let [first, second] = &mut workspaces;
    let mut other = Tape::recording(&parameters, first);
    let numbers = Numbers {
        sizes: vec![1; 6],
        real: 0.5,
    };
    // Of a tape that is there, and of one whose buffers the tape has now.
    let beside = other.block(block);
    let earlier = Tape::recording(&parameters, second).block(block);
    for foreign in [beside, earlier] {
        for (name, operation) in OPERATIONS {
            let mut tape = Tape::recording(&parameters, second);
            let error = asked(&mut tape, operation, &[foreign; 5], &numbers).unwrap_err();
            assert!(
                matches!(error, AutogradError::Misplaced { .. }),
                "{name}: {error}"
            );
        }
        let mut tape = Tape::recording(&parameters, second);
        let own = tape.block(block);
        is_misplaced(tape.add(own, foreign));
        assert_eq!(tape.shape(foreign), [0]);
        assert!(tape.values(foreign).is_empty() && tape.array(foreign).is_empty());
        let mut gradients = Gradients::zeros(&parameters);
        is_misplaced(tape.backward(foreign, &mut gradients));
        let mut tape = Tape::recording(&parameters, second);
        let x = tape.input(arr1(&[1.0]).into_dyn());
        is_misplaced(tape.backward_from(x, &[1.0], &[x, foreign], &mut gradients));
    }
}

#[test]
fn a_value_that_a_tape_forgot_is_refused_and_what_it_kept_is_not() {
    let (parameters, [early, late], _) = owner();
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&parameters, &mut workspace);
    let before = tape.block(early);
    let mark = tape.mark();
    let gone = tape.square(before);
    let weight = tape.block(late);
    let mut kept = tape.affine(before, 5.0, 0.0);
    let copy = kept;
    tape.forget_since(mark, &mut [&mut kept]);
    assert_eq!(tape.values(before), [1.0, 1.0]);
    assert_eq!(tape.values(kept), [5.0, 5.0]);
    let weight_now = tape.block(late);
    assert_eq!(tape.values(weight_now), [2.0, 2.0]);
    // Other values stand in their places.
    tape.square(kept);
    for forgotten in [gone, weight, copy] {
        assert!(tape.values(forgotten).is_empty());
        is_misplaced(tape.add(kept, forgotten));
    }
    assert_eq!(tape.values(kept), [5.0, 5.0]);
    tape.forget_since(usize::MAX, &mut []);
    assert_eq!(tape.values(kept), [5.0, 5.0]);
    let mut forgotten = gone;
    tape.forget_since(mark, &mut [&mut kept, &mut forgotten]);
    assert_eq!(tape.values(kept), [5.0, 5.0]);
    is_misplaced(tape.add(kept, forgotten));
}

#[test]
fn what_belongs_to_other_parameters_is_refused_and_a_clone_has_the_same() {
    let (mut parameters, [block, _], buffer) = owner();
    let (mut others, [foreign, _], foreign_buffer) = owner();
    let (foreign_id, _) = others.add("more", arr1(&[0.0]).into_dyn());
    let mut workspace = Workspace::new();
    is_misplaced(parameters.rows(foreign_id, 0..1));
    is_misplaced(parameters.buffer(foreign_buffer));
    is_misplaced(parameters.buffer_mut(foreign_buffer));
    let mut tape = Tape::recording(&parameters, &mut workspace);
    is_misplaced(tape.buffer(foreign_buffer));
    let x = tape.block(block);
    let refused = tape.block(foreign);
    is_misplaced(tape.add(x, refused));
    let loss = tape.sum(x);
    is_misplaced(tape.backward(loss, &mut Gradients::zeros(&others)));
    let clone = parameters.clone();
    let mut tape = Tape::recording(&clone, &mut workspace);
    let x = tape.block(block);
    assert_eq!(tape.values(x), [1.0, 1.0]);
    assert_eq!(tape.buffer(buffer).unwrap()[[0]], 3.0);
}

#[test]
fn a_tape_that_only_computes_gives_no_gradient_of_zero() {
    let (parameters, [block, _], _) = owner();
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&parameters, &mut workspace);
    let x = tape.block(block);
    let loss = tape.sum(x);
    is_misplaced(tape.backward(loss, &mut Gradients::zeros(&parameters)));
}

#[test]
fn a_shape_of_more_numbers_than_memory_has_is_refused() {
    let (parameters, ..) = owner();
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&parameters, &mut workspace);
    for shape in [[1 << 40, 1 << 40], [usize::MAX, 2]] {
        let refused = tape.constant_with(&shape, |_| ());
        assert!(tape.sum_last(refused).is_err());
    }
    let columns = tape.constant(ArrayD::zeros(IxDyn(&[1 << 40, 0])));
    let rows = tape.constant(ArrayD::zeros(IxDyn(&[0, 1 << 40])));
    for product in [
        tape.matmul(columns, rows),
        tape.linear(columns, columns, None, false),
    ] {
        let message = product.unwrap_err().to_string();
        assert!(message.contains("memory"), "{message}");
    }
}

#[test]
fn values_keep_shape_and_layout_whatever_is_written_into_them() {
    let mut parameters = Parameters::new();
    let (_, block) = parameters.add("w", ArrayD::<f64>::zeros(IxDyn(&[2, 3])));
    let counted = Array2::from_shape_fn((2, 3).f(), |(i, j)| (3 * i + j) as f64);
    for (_, mut value) in parameters.values_mut() {
        value.assign(&counted);
        assert!(value.is_standard_layout());
    }
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(&parameters, &mut workspace);
    let x = tape.block(block);
    assert_eq!(tape.values(x), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
}

/// An initialiser of parameters that are thrown away.
fn initialise<R>(build: impl FnOnce(&mut Initialiser<'_, f64, ChaCha8Rng>) -> R) -> R {
    let mut parameters = Parameters::new();
    let rng = ChaCha8Rng::seed_from_u64(1);
    build(&mut Initialiser::new(&mut parameters, rng))
}

#[test]
fn layers_of_no_width_and_heads_that_divide_nothing_are_refused_or_empty() {
    for (width, heads) in [(8, 0), (8, 3), (0, 0), (0, 2), (8, usize::MAX)] {
        let sizes = TransformerSizes {
            width,
            heads,
            feed_forward: 8,
            dropout: 0.1,
        };
        let error = initialise(|init| MultiHeadAttention::new(init, "a", sizes)).unwrap_err();
        assert!(error.to_string().contains("heads"), "{error}");
    }
    let mut parameters = Parameters::<f64>::new();
    let rng = ChaCha8Rng::seed_from_u64(1);
    let mut init = Initialiser::new(&mut parameters, rng);
    let linear = Linear::new(&mut init, "linear", 0, 3);
    let lstm = Lstm::new(&mut init, "lstm", 2, 0);
    let no_layers = Mlp::new(&mut init, "mlp", &[3], LastLayer::Linear);
    let sizes = TransformerSizes {
        width: 8,
        heads: 2,
        feed_forward: 8,
        dropout: f64::NAN,
    };
    let attention = MultiHeadAttention::new(&mut init, "attention", sizes).unwrap();
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&parameters, &mut workspace).with_dropout(1);
    let nothing = tape.constant(ArrayD::zeros(IxDyn(&[2, 0])));
    let y = linear.forward(&mut tape, nothing).unwrap();
    assert!(tape.values(y).iter().all(|y| y.is_finite()));
    let x = tape.constant(ArrayD::zeros(IxDyn(&[2, 2])));
    let state = lstm.start(&mut tape, 2);
    assert!(lstm.step(&mut tape, x, state).is_err());
    assert!(no_layers.forward(&mut tape, x).is_err());
    let tokens = tape.constant(ArrayD::zeros(IxDyn(&[4, 8])));
    for count in [0, 3, 4] {
        let error = attention.own(&mut tape, tokens, count);
        assert!(error.is_err(), "{count} tokens");
    }
    assert!(attention.narrow(&mut tape, tokens, 3..9).is_err());
    assert_eq!(sinusoidal_positions(0, 0).dim(), (0, 0));
}
