//! Each operation's forward pass at the model's shapes (32 windows of 7 tokens, width 256) against
//! the loops that one would write first, with the standard library's functions. Dropout and noise
//! are random and not compared; dropout is timed with the products.

use std::hint::black_box;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main};
use keydance::autograd::ops::attention::{AttentionShape, HeadColumns};
use keydance::autograd::ops::lstm_cell::LstmWeights;
use keydance::autograd::ops::query_attention::QueryAttentionWeights;
use keydance::autograd::{AutogradError, Parameters, Tape, Var, Workspace};
use ndarray::{ArrayD, IxDyn};

const WINDOWS: usize = 32;
const TOKENS: usize = 7;
const ROWS: usize = WINDOWS * TOKENS;
const D: usize = 256;
const HEADS: usize = 8;
const DH: usize = D / HEADS;
/// Numbers of a token of the velocity factor controller: five factors and a position of seven.
const NUMBERS: usize = 12;
/// Joints of a chain.
const CHAIN: usize = 24;

fn random(shape: &[usize]) -> ArrayD<f32> {
    let mut state = shape.iter().sum::<usize>() as u32 + 1;
    ArrayD::from_shape_simple_fn(IxDyn(shape), || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 8_388_608.0 - 1.0
    })
}

type Group<'c> = BenchmarkGroup<'c, WallTime>;

/// Times an operation on parameters of the given shapes, and the naive loops on the same numbers.
fn compare(
    group: &mut Group<'_>,
    name: &str,
    shapes: &[&[usize]],
    operation: impl Fn(&mut Tape<'_, f32>, &[Var]) -> Result<Var, AutogradError>,
    naive: impl Fn(&[&[f32]]) -> Vec<f32>,
) {
    let inputs: Vec<ArrayD<f32>> = shapes.iter().map(|shape| random(shape)).collect();
    let mut parameters = Parameters::new();
    let blocks: Vec<_> = inputs
        .iter()
        .enumerate()
        .map(|(k, input)| parameters.add(format!("{k}"), input.clone()).1)
        .collect();
    let slices: Vec<&[f32]> = inputs.iter().filter_map(|input| input.as_slice()).collect();
    let mut workspace = Workspace::new();
    let mut run = || {
        let mut tape = Tape::inference(&parameters, &mut workspace);
        let vars: Vec<Var> = blocks.iter().map(|&block| tape.block(block)).collect();
        let y = operation(&mut tape, &vars).expect("shapes fit");
        tape.values(y).to_vec()
    };
    let (ours, plain) = (run(), naive(&slices));
    assert_eq!(ours.len(), plain.len(), "{name}");
    for (a, b) in ours.iter().zip(&plain) {
        assert!(
            (a - b).abs() <= 1e-3 * b.abs().max(1.0),
            "{name}: {a} and {b}"
        );
    }
    group.bench_function(format!("{name}/keydance"), |bencher| {
        bencher.iter(|| black_box(run()));
    });
    group.bench_function(format!("{name}/naive"), |bencher| {
        bencher.iter(|| black_box(naive(black_box(&slices))));
    });
}

/// x [rows, n] W^T + b for W [m, n].
fn product(x: &[f32], weight: &[f32], bias: &[f32], n: usize) -> Vec<f32> {
    x.chunks_exact(n)
        .flat_map(|x| {
            weight
                .chunks_exact(n)
                .zip(bias)
                .map(|(w, b)| b + x.iter().zip(w).map(|(x, w)| x * w).sum::<f32>())
        })
        .collect()
}

fn softmax(row: &mut [f32]) {
    let max = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    row.iter_mut().for_each(|x| *x = (*x - max).exp());
    let sum: f32 = row.iter().sum();
    row.iter_mut().for_each(|x| *x /= sum);
}

fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + (-x).exp())
}

/// Attention of one query to `keys`, all heads.
fn attend(q: &[f32], keys: &[&[f32]], values: &[&[f32]]) -> Vec<f32> {
    let mut y = vec![0.0; D];
    for h in 0..HEADS {
        let columns = h * DH..(h + 1) * DH;
        let mut weights: Vec<f32> = keys
            .iter()
            .map(|k| {
                let dot: f32 = columns.clone().map(|c| q[c] * k[c]).sum();
                dot / (DH as f32).sqrt()
            })
            .collect();
        softmax(&mut weights);
        for (weight, v) in weights.iter().zip(values) {
            for c in columns.clone() {
                y[c] += weight * v[c];
            }
        }
    }
    y
}

/// The tokens of a window, weighted by their softmaxed products with a query.
fn weighted_tokens(q: &[f32], tokens: &[f32]) -> Vec<f32> {
    let mut weights: Vec<f32> = tokens
        .chunks_exact(NUMBERS)
        .map(|token| 0.5 * q.iter().zip(token).map(|(q, x)| q * x).sum::<f32>())
        .collect();
    softmax(&mut weights);
    let mut sum = vec![0.0; NUMBERS];
    for (weight, token) in weights.iter().zip(tokens.chunks_exact(NUMBERS)) {
        sum.iter_mut()
            .zip(token)
            .for_each(|(s, x)| *s += weight * x);
    }
    sum
}

/// Positions of a chain of joints, each turned by its quaternion (x, y, z, w) in its parent's
/// frame.
fn chain(rotations: &[f32], offsets: &[f32]) -> Vec<f32> {
    let mut whole = glam::Quat::IDENTITY;
    let mut position = glam::Vec3::ZERO;
    rotations
        .chunks_exact(4)
        .zip(offsets.chunks_exact(3))
        .flat_map(|(q, o)| {
            position += rotated(whole, glam::Vec3::from_slice(o));
            whole *= glam::Quat::from_slice(q);
            position.to_array()
        })
        .collect()
}

/// v + 2 w (u x v) + 2 u x (u x v), whatever the quaternion's length.
fn rotated(q: glam::Quat, v: glam::Vec3) -> glam::Vec3 {
    let (u, w) = (q.xyz(), q.w);
    v + 2.0 * w * u.cross(v) + 2.0 * u.cross(u.cross(v))
}

fn layer_norm(z: &[f32], gamma: &[f32], beta: &[f32]) -> Vec<f32> {
    z.chunks_exact(D)
        .flat_map(|z| {
            let mean = z.iter().sum::<f32>() / D as f32;
            let variance = z.iter().map(|z| (z - mean).powi(2)).sum::<f32>() / D as f32;
            let scale = 1.0 / (variance + 1e-5).sqrt();
            z.iter()
                .zip(gamma.iter().zip(beta))
                .map(move |(z, (g, b))| (z - mean) * scale * g + b)
                .collect::<Vec<_>>()
        })
        .collect()
}

fn layers(c: &mut Criterion) {
    let mut group = c.benchmark_group("operations");
    group.sample_size(20);
    let group = &mut group;
    compare(
        group,
        "linear",
        &[&[ROWS, D], &[D, D], &[D]],
        |tape, v| tape.linear(v[0], v[1], Some(v[2]), false),
        |x| product(x[0], x[1], x[2], D),
    );
    compare(
        group,
        "lstm_cell",
        &[
            &[WINDOWS, 1024],
            &[WINDOWS, 2 * D],
            &[4 * D, 1024],
            &[4 * D, D],
            &[4 * D],
            &[4 * D],
        ],
        |tape, v| {
            let weights = LstmWeights {
                weight_ih: v[2],
                weight_hh: v[3],
                bias_ih: v[4],
                bias_hh: v[5],
            };
            tape.lstm_cell(v[0], v[1], weights)
        },
        naive_lstm_cell,
    );
    compare(
        group,
        "attention",
        &[&[ROWS, 3 * D]],
        |tape, v| {
            let columns = |k: usize| HeadColumns {
                value: v[0],
                start: k * D,
            };
            let shape = AttentionShape {
                heads: HEADS,
                width: D,
                queries: TOKENS,
                keys: TOKENS,
            };
            tape.attention([0, 1, 2].map(columns), shape, None, 0.0)
        },
        |x| {
            x[0].chunks_exact(TOKENS * 3 * D)
                .flat_map(|window| {
                    let tokens: Vec<&[f32]> = window.chunks_exact(3 * D).collect();
                    let keys: Vec<&[f32]> = tokens.iter().map(|t| &t[D..2 * D]).collect();
                    let values: Vec<&[f32]> = tokens.iter().map(|t| &t[2 * D..]).collect();
                    tokens
                        .iter()
                        .flat_map(|q| attend(&q[..D], &keys, &values))
                        .collect::<Vec<_>>()
                })
                .collect()
        },
    );
    compare(
        group,
        "shared_attention",
        &[&[ROWS, HEADS * NUMBERS], &[ROWS, NUMBERS]],
        |tape, v| tape.shared_attention(v[0], v[1], TOKENS, 0.5, 0.0),
        |x| {
            x[0].chunks_exact(TOKENS * HEADS * NUMBERS)
                .zip(x[1].chunks_exact(TOKENS * NUMBERS))
                .flat_map(|(queries, tokens)| {
                    queries
                        .chunks_exact(NUMBERS)
                        .flat_map(|q| weighted_tokens(q, tokens))
                        .collect::<Vec<_>>()
                })
                .collect()
        },
    );
    let mut shapes: Vec<&[usize]> = vec![&[WINDOWS, D], &[ROWS, D], &[D]];
    shapes.extend([&[DH, D][..]; 2 * HEADS]);
    compare(
        group,
        "query_attention",
        &shapes,
        |tape, v| {
            let weights = QueryAttentionWeights {
                keys: v[3..3 + HEADS].to_vec(),
                values: v[3 + HEADS..].to_vec(),
                value_bias: v[2],
            };
            tape.query_attention(v[0], v[1], weights, TOKENS, 0.0)
        },
        |x| {
            let keys = product(x[1], &x[3..3 + HEADS].concat(), &[0.0; D], D);
            let values = product(x[1], &x[3 + HEADS..].concat(), x[2], D);
            x[0].chunks_exact(D)
                .enumerate()
                .flat_map(|(window, q)| {
                    let of_window = |all: &'_ [f32]| -> Vec<Vec<f32>> {
                        all[window * TOKENS * D..(window + 1) * TOKENS * D]
                            .chunks_exact(D)
                            .map(<[f32]>::to_vec)
                            .collect()
                    };
                    let (keys, values) = (of_window(&keys), of_window(&values));
                    let keys: Vec<&[f32]> = keys.iter().map(Vec::as_slice).collect();
                    let values: Vec<&[f32]> = values.iter().map(Vec::as_slice).collect();
                    attend(q, &keys, &values)
                })
                .collect()
        },
    );
    compare(
        group,
        "layer_norm",
        &[&[ROWS, D], &[D], &[D]],
        |tape, v| tape.layer_norm(v[0], v[1], v[2]),
        |x| layer_norm(x[0], x[1], x[2]),
    );
    compare(
        group,
        "add_layer_norm",
        &[&[ROWS, D], &[ROWS, D], &[D], &[D]],
        |tape, v| tape.add_layer_norm(v[0], v[1], (v[2], v[3]), 0.0),
        |x| {
            let z: Vec<f32> = x[0].iter().zip(x[1]).map(|(a, b)| a + b).collect();
            layer_norm(&z, x[2], x[3])
        },
    );
    compare(
        group,
        "matmul",
        &[&[768, D], &[D, 10]],
        |tape, v| tape.matmul(v[0], v[1]),
        |x| {
            x[0].chunks_exact(D)
                .flat_map(|a| (0..10).map(|j| (0..D).map(|k| a[k] * x[1][k * 10 + j]).sum::<f32>()))
                .collect()
        },
    );
}

fn naive_lstm_cell(x: &[&[f32]]) -> Vec<f32> {
    let from_input = product(x[0], x[2], x[4], 1024);
    let mut y = Vec::new();
    for (window, state) in x[1].chunks_exact(2 * D).enumerate() {
        let from_state = product(&state[..D], x[3], x[5], D);
        let gate =
            |k: usize, j: usize| from_input[window * 4 * D + k * D + j] + from_state[k * D + j];
        let c: Vec<f32> = (0..D)
            .map(|j| sigmoid(gate(1, j)) * state[D + j] + sigmoid(gate(0, j)) * gate(2, j).tanh())
            .collect();
        y.extend((0..D).map(|j| sigmoid(gate(3, j)) * c[j].tanh()));
        y.extend(&c);
    }
    y
}

fn elementwise(c: &mut Criterion) {
    let mut group = c.benchmark_group("operations");
    group.sample_size(20);
    let group = &mut group;
    let one: &[&[usize]] = &[&[ROWS, D]];
    let two: &[&[usize]] = &[&[ROWS, D], &[ROWS, D]];
    let map = |x: &[f32], f: fn(f32) -> f32| x.iter().map(|&x| f(x)).collect::<Vec<f32>>();
    compare(
        group,
        "exp",
        one,
        |tape, v| Ok(tape.exp(v[0])),
        |x| map(x[0], f32::exp),
    );
    compare(
        group,
        "tanh",
        one,
        |tape, v| Ok(tape.tanh(v[0])),
        |x| map(x[0], f32::tanh),
    );
    compare(
        group,
        "sigmoid",
        one,
        |tape, v| Ok(tape.sigmoid(v[0])),
        |x| map(x[0], sigmoid),
    );
    compare(
        group,
        "square",
        one,
        |tape, v| Ok(tape.square(v[0])),
        |x| map(x[0], |x| x * x),
    );
    compare(
        group,
        "sqrt",
        one,
        |tape, v| {
            let squares = tape.square(v[0]);
            Ok(tape.sqrt(squares))
        },
        |x| map(x[0], |x| (x * x).sqrt()),
    );
    compare(
        group,
        "abs",
        one,
        |tape, v| Ok(tape.abs(v[0])),
        |x| map(x[0], f32::abs),
    );
    compare(
        group,
        "plu",
        one,
        |tape, v| Ok(tape.plu(v[0])),
        |x| {
            map(x[0], |x| {
                (0.1 * (x + 1.0) - 1.0).max((0.1 * (x - 1.0) + 1.0).min(x))
            })
        },
    );
    compare(
        group,
        "normalise",
        one,
        |tape, v| tape.normalise(v[0], 4, 1e-8),
        |x| {
            x[0].chunks_exact(4)
                .flat_map(|x| {
                    let length = (x.iter().map(|x| x * x).sum::<f32>() + 1e-8).sqrt();
                    x.iter().map(|x| x / length).collect::<Vec<_>>()
                })
                .collect()
        },
    );
    compare(
        group,
        "forward_kinematics",
        &[&[ROWS, 4 * CHAIN], &[1, 3 * CHAIN]],
        |tape, v| {
            let parents: Vec<_> = (0..CHAIN)
                .map(|joint: usize| joint.checked_sub(1))
                .collect();
            let unit = tape.normalise(v[0], 4, 1e-8)?;
            tape.forward_kinematics(unit, v[1], &parents)
        },
        |x| {
            x[0].chunks_exact(4 * CHAIN)
                .flat_map(|rotations| {
                    let unit: Vec<f32> = rotations
                        .chunks_exact(4)
                        .flat_map(|q| glam::Quat::from_slice(q).normalize().to_array())
                        .collect();
                    chain(&unit, x[1])
                })
                .collect()
        },
    );
    compare(
        group,
        "clamp",
        one,
        |tape, v| Ok(tape.clamp(v[0], 0.0, 0.5)),
        |x| map(x[0], |x| x.clamp(0.0, 0.5)),
    );
    compare(
        group,
        "affine",
        one,
        |tape, v| Ok(tape.affine(v[0], 2.0, 1.0)),
        |x| map(x[0], |x| 2.0 * x + 1.0),
    );
    compare(
        group,
        "prelu",
        &[&[ROWS, D], &[1]],
        |tape, v| tape.prelu(v[0], v[1]),
        |x| {
            x[0].iter()
                .map(|&a| if a > 0.0 { a } else { a * x[1][0] })
                .collect()
        },
    );
    compare(
        group,
        "softmax",
        &[&[ROWS * HEADS, TOKENS]],
        |tape, v| Ok(tape.softmax(v[0])),
        |x| {
            let mut y = x[0].to_vec();
            y.chunks_exact_mut(TOKENS).for_each(softmax);
            y
        },
    );
    let zip = |x: &[&[f32]], f: fn(f32, f32) -> f32| {
        x[0].iter()
            .zip(x[1])
            .map(|(&a, &b)| f(a, b))
            .collect::<Vec<f32>>()
    };
    compare(
        group,
        "add",
        two,
        |tape, v| tape.add(v[0], v[1]),
        |x| zip(x, |a, b| a + b),
    );
    compare(
        group,
        "sub",
        two,
        |tape, v| tape.sub(v[0], v[1]),
        |x| zip(x, |a, b| a - b),
    );
    compare(
        group,
        "mul",
        two,
        |tape, v| tape.mul(v[0], v[1]),
        |x| zip(x, |a, b| a * b),
    );
    compare(
        group,
        "sum",
        one,
        |tape, v| Ok(tape.sum(v[0])),
        |x| vec![x[0].iter().sum()],
    );
    compare(
        group,
        "sum_last",
        one,
        |tape, v| tape.sum_last(v[0]),
        |x| x[0].chunks_exact(D).map(|row| row.iter().sum()).collect(),
    );
    compare(
        group,
        "vector_norm",
        &[&[ROWS, 24, 3]],
        |tape, v| tape.vector_norm(v[0], 1e-8),
        |x| {
            x[0].chunks_exact(3)
                .map(|v| (v.iter().map(|x| x * x).sum::<f32>() + 1e-8).sqrt())
                .collect()
        },
    );
}

fn movement(c: &mut Criterion) {
    let mut group = c.benchmark_group("operations");
    group.sample_size(20);
    let group = &mut group;
    let one: &[&[usize]] = &[&[ROWS, D]];
    let two: &[&[usize]] = &[&[ROWS, D], &[ROWS, D]];
    let rows = |x: &[f32], pick: fn(usize) -> bool| -> Vec<f32> {
        let picked = x.chunks_exact(D).enumerate().filter(|(row, _)| pick(*row));
        picked.flat_map(|(_, row)| row.to_vec()).collect()
    };
    compare(
        group,
        "reshape",
        one,
        |tape, v| tape.reshape(v[0], &[D, ROWS]),
        |x| x[0].to_vec(),
    );
    compare(
        group,
        "columns",
        one,
        |tape, v| tape.columns(v[0], 0..DH),
        |x| {
            x[0].chunks_exact(D)
                .flat_map(|row| row[..DH].to_vec())
                .collect()
        },
    );
    compare(
        group,
        "rows",
        one,
        |tape, v| tape.rows(v[0], 0..TOKENS),
        |x| rows(x[0], |row| row < TOKENS),
    );
    compare(
        group,
        "strided_rows",
        one,
        |tape, v| tape.strided_rows(v[0], 3, TOKENS),
        |x| rows(x[0], |row| row % TOKENS == 3),
    );
    compare(
        group,
        "concat",
        two,
        |tape, v| tape.concat(v),
        |x| {
            let pairs = x[0].chunks_exact(D).zip(x[1].chunks_exact(D));
            pairs.flat_map(|(a, b)| [a, b].concat()).collect()
        },
    );
    compare(group, "stack", two, |tape, v| tape.stack(v), |x| x.concat());
    dropout(group);
}

/// Dropout has no reference to agree with number by number: the naive loop draws each number's fate
/// from a generator.
fn dropout(group: &mut Group<'_>) {
    use rand::{RngExt, SeedableRng};
    let input = random(&[ROWS, D]);
    let parameters = Parameters::new();
    let mut workspace = Workspace::new();
    group.bench_function("dropout/keydance", |bencher| {
        bencher.iter(|| {
            let mut tape = Tape::inference(&parameters, &mut workspace).with_dropout(1);
            let x = tape.constant(input.clone());
            let y = tape.dropout(x, 0.1);
            black_box(tape.values(y).to_vec())
        });
    });
    group.bench_function("dropout/naive", |bencher| {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        bencher.iter(|| {
            let kept = input.iter().map(|x| {
                if rng.random::<f32>() < 0.1 {
                    0.0
                } else {
                    x / 0.9
                }
            });
            black_box(kept.collect::<Vec<f32>>())
        });
    });
}

criterion_group!(benches, layers, elementwise, movement);
criterion_main!(benches);
