//! Li et al.: the network's sizes, root trajectory reconstruction, losses, motions.

use glam::{DQuat, DVec3};
use keydance::autograd::{Gradients, Parameters, Tape, Workspace};
use keydance::models::li2023::{
    Input, Li2023, Li2023Settings, LossUnit, RootWeights, StateDecoder, reconstruct_root,
};
use keydance::models::rotations::{
    Body, RotationNetwork, RotationSettings, WindowStatistics, generated_batch,
};
use keydance::motion::root_reconstruction;
use keydance::motion::rotation_window::Interpolation;
use keydance::motion::{Joint, Skeleton};
use keydance::nn::Initialiser;
use ndarray::Array2;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(5)
}

/// A chain of joints with the names that the model looks for.
fn body(joints: usize) -> Body {
    let names = ["RightFoot", "LeftFoot", "RightToe", "LeftToe"];
    let joints = (0..joints).map(|k| Joint {
        name: names
            .get(k)
            .map_or(format!("Joint{k}"), |name| (*name).into()),
        parent: k.checked_sub(1),
        offset: DVec3::ZERO,
        end_sites: Vec::new(),
    });
    Body::of(&Skeleton {
        joints: joints.collect(),
    })
}

fn statistics(joints: usize) -> WindowStatistics {
    WindowStatistics {
        root_deviation: [1.0; 3],
        position_deviation: vec![1.0; 3 * joints],
        ranges: [150.0, 300.0],
    }
}

fn small() -> Li2023Settings {
    let mut settings = Li2023Settings::default().small();
    settings.model.stochastic_depth = 0.0;
    settings
}

#[test]
fn it_has_as_many_weights_as_the_paper_says_for_24_and_for_22_joints() {
    for (joints, weights) in [(24, 19_063_234), (22, 16_030_074)] {
        let mut parameters = Parameters::<f32>::new();
        let mut init = Initialiser::new(&mut parameters, rng());
        let settings = Li2023Settings::default();
        Li2023::new(&mut init, &settings, &body(joints), &statistics(joints)).unwrap();
        let found: usize = parameters.iter().map(|(_, value)| value.len()).sum();
        assert_eq!(found, weights, "{joints} joints");
    }
}

#[test]
fn weights_have_the_names_of_the_specification() {
    let mut parameters = Parameters::<f32>::new();
    let mut init = Initialiser::new(&mut parameters, rng());
    let settings = small();
    Li2023::new(&mut init, &settings, &body(24), &statistics(24)).unwrap();
    let names: Vec<&str> = parameters.iter().map(|(name, _)| name).collect();
    for name in [
        "spatial.embed.weight",
        "spatial.position",
        "spatial.layers.1.self_attn.in_proj_weight",
        "spatial.layers.0.norm2.bias",
        "spatial.norm.weight",
        "mix.keyframe.weight",
        "mix.contact.bias",
        "temporal.position",
        "temporal.layers.1.linear2.weight",
        "temporal.norm.bias",
        "state.weight",
        "contact.weight",
    ] {
        assert!(names.contains(&name), "{name} is not among {names:?}");
    }
}

#[test]
fn the_root_in_the_graph_is_that_of_equations_7_to_11_and_so_is_its_gradient() {
    let (windows, frames) = (2, 6);
    let rows = windows * frames;
    let mut rng = rng();
    let mut drawn = |columns: usize| {
        Array2::from_shape_simple_fn((rows, columns), || rng.random_range(-30.0..30.0))
    };
    let (right, left, upstream) = (drawn(3), drawn(3), drawn(3));
    let weights = drawn(2) / 30.0;
    let parameters = Parameters::<f64>::new();
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let inputs = [&right, &left, &weights].map(|x| tape.input(x.clone()));
    let root = reconstruct_root(&mut tape, [inputs[0], inputs[1]], inputs[2], frames).unwrap();
    let vector = |x: &Array2<f64>, row: usize| DVec3::new(x[[row, 0]], x[[row, 1]], x[[row, 2]]);
    for window in 0..windows {
        let range = window * frames..(window + 1) * frames;
        let feet: Vec<[DVec3; 2]> = range
            .clone()
            .map(|row| [vector(&right, row), vector(&left, row)])
            .collect();
        let own: Vec<[f64; 2]> = range
            .clone()
            .map(|row| [weights[[row, 0]], weights[[row, 1]]])
            .collect();
        let plain = root_reconstruction::reconstruct_root(&feet, &own, DVec3::ZERO);
        for (row, expected) in range.zip(plain) {
            let found = DVec3::from_slice(&tape.values(root)[3 * row..3 * row + 3]);
            assert!(
                found.distance(expected) < 1e-12,
                "{row}: {found} {expected}"
            );
        }
    }
    let upstream_values: Vec<f64> = upstream.iter().copied().collect();
    let mut gradients = Gradients::zeros(&parameters);
    let found = tape
        .backward_from(root, &upstream_values, &inputs, &mut gradients)
        .unwrap();
    // The specification's way back: G_t = g_(t+1) + .. + g_T.
    for window in 0..windows {
        let row = |t: usize| window * frames + t;
        let g =
            |t: usize| (t + 1..frames).fold(DVec3::ZERO, |sum, u| sum + vector(&upstream, row(u)));
        for (foot, positions) in [&right, &left].into_iter().enumerate() {
            for t in 0..frames {
                let mut expected = DVec3::ZERO;
                if t + 1 < frames {
                    expected += g(t) * weights[[row(t), foot]];
                }
                if t > 0 {
                    expected -= g(t - 1) * weights[[row(t - 1), foot]];
                }
                let start = 3 * row(t);
                let own = DVec3::from_slice(&found[foot].as_slice().unwrap()[start..start + 3]);
                assert!(own.distance(expected) < 1e-9, "foot {foot}, frame {t}");
                let of_weight = match t + 1 < frames {
                    true => {
                        let moved = vector(positions, row(t + 1)) - vector(positions, row(t));
                        -g(t).dot(moved)
                    }
                    false => 0.0,
                };
                let own = found[2].as_slice().unwrap()[2 * row(t) + foot];
                assert!((own - of_weight).abs() < 1e-9, "weight {foot}, frame {t}");
            }
        }
    }
}

/// Eq. 17 to 20 by loops over what the network says.
#[test]
fn the_losses_are_those_of_equations_17_to_20() {
    for (unit, weights) in [
        (LossUnit::Cm, RootWeights::PredictedSoft),
        (LossUnit::Range, RootWeights::Given),
    ] {
        let mut settings = small();
        settings.loss.unit = unit;
        settings.rtr.weights = weights;
        let (frames, windows) = (7, 3);
        let (batch, body, statistics) =
            generated_batch(&settings, frames, windows, 4, Interpolation::Slerp).unwrap();
        let mut parameters = Parameters::<f64>::new();
        let mut init = Initialiser::new(&mut parameters, rng());
        let network = Li2023::new(&mut init, &settings, &body, &statistics).unwrap();
        let mut workspace = Workspace::new();
        let mut tape = Tape::inference(&parameters, &mut workspace);
        let said = network.forward(&mut tape, &batch).unwrap();
        let joints = body.joints();
        let rotations = tape.values(said.rotations).to_vec();
        let logits = tape.values(said.contact_logits).to_vec();
        let truth = batch.truth.as_ref().unwrap();
        let quaternions = |values: &[f64], row: usize| -> Vec<DQuat> {
            let own = &values[row * 4 * joints..(row + 1) * 4 * joints];
            let unit = |q: &[f64]| DQuat::from_xyzw(q[0], q[1], q[2], q[3]).normalize();
            own.chunks_exact(4).map(unit).collect()
        };
        let positions = |values: &[f64], row: usize| -> Vec<DVec3> {
            let local = quaternions(values, row);
            let (mut places, mut turns) = (Vec::new(), Vec::<DQuat>::new());
            for (joint, parent) in body.parents().into_iter().enumerate() {
                let offset = DVec3::new(
                    batch.offsets[[row, 3 * joint]],
                    batch.offsets[[row, 3 * joint + 1]],
                    batch.offsets[[row, 3 * joint + 2]],
                );
                let (place, turn): (DVec3, DQuat) = match parent {
                    None => (offset, local[joint]),
                    Some(parent) => (
                        places[parent] + turns[parent] * offset,
                        turns[parent] * local[joint],
                    ),
                };
                places.push(place);
                turns.push(turn);
            }
            places
        };
        let recorded: Vec<f64> = truth.rotations.iter().copied().collect();
        let rows = frames * windows;
        let (mut rec, mut con, mut p) = (0.0, 0.0, 0.0);
        for row in 0..rows {
            let range = row * 4 * joints..(row + 1) * 4 * joints;
            let squares = range.map(|k| (rotations[k] - recorded[k]).powi(2));
            rec += squares.sum::<f64>() / (4 * joints) as f64;
            let exps = [logits[2 * row].exp(), logits[2 * row + 1].exp()];
            for (foot, exp) in exps.into_iter().enumerate() {
                let (s, label) = (exp / (exps[0] + exps[1]), batch.contacts[[row, foot]]);
                con -= label * s.ln() + (1.0 - label) * (1.0 - s).ln();
            }
            let pairs = positions(&rotations, row)
                .into_iter()
                .zip(positions(&recorded, row));
            p += pairs.map(|(a, b)| a.distance_squared(b)).sum::<f64>() / (3 * joints) as f64;
        }
        let feet = [
            body.skeleton().index_of("RightFoot"),
            body.skeleton().index_of("LeftFoot"),
        ];
        let root = |values: &[f64], weight: &dyn Fn(usize) -> [f64; 2], window: usize| {
            let rows = window * frames..(window + 1) * frames;
            let own: Vec<[DVec3; 2]> = rows
                .clone()
                .map(|row| {
                    let places = positions(values, row);
                    feet.map(|foot| places[foot.unwrap()])
                })
                .collect();
            let weights: Vec<[f64; 2]> = rows.map(weight).collect();
            root_reconstruction::reconstruct_root(&own, &weights, DVec3::ZERO)
        };
        let label = |row: usize| [batch.contacts[[row, 0]], batch.contacts[[row, 1]]];
        let soft = |row: usize| {
            let exps = [logits[2 * row].exp(), logits[2 * row + 1].exp()];
            exps.map(|exp| exp / (exps[0] + exps[1]))
        };
        let mut r = 0.0;
        for window in 0..windows {
            let own = match weights {
                RootWeights::PredictedSoft => root(&rotations, &soft, window),
                RootWeights::Given => root(&rotations, &label, window),
            };
            let pairs = own.into_iter().zip(root(&recorded, &label, window));
            r += pairs.map(|(a, b)| a.distance_squared(b)).sum::<f64>() / 3.0;
        }
        let [p_unit, r_unit] = match unit {
            LossUnit::Cm => [1.0; 2],
            LossUnit::Range => statistics.ranges,
        };
        let expected = [
            ("rec", rec),
            ("con", con),
            ("position", p / (p_unit * p_unit)),
            ("root", r / (r_unit * r_unit)),
        ];
        let losses = network.losses(&mut tape, &batch).unwrap();
        let mut total = 0.0;
        for ((name, term), (expected_name, sum)) in losses.terms.iter().zip(expected) {
            let (found, expected) = (tape.values(*term)[0], sum / rows as f64);
            assert_eq!(*name, expected_name);
            let scale = expected.abs().max(1e-3);
            assert!(
                (found - expected).abs() / scale < 1e-9,
                "{name}: {found} {expected}"
            );
            let weight = if ["position", "root"].contains(name) {
                1e-5
            } else {
                1.0
            };
            total += weight * expected;
        }
        assert_eq!(losses.terms.len(), 4);
        let found = tape.values(losses.total)[0];
        assert!((found - total).abs() < 1e-9 * total, "{found} {total}");
    }
}

#[test]
fn a_decoder_of_zeros_and_a_fading_output_leave_the_interpolation_where_they_should() {
    let zeros = |settings: &mut Li2023Settings| settings.model.zero_decoder = true;
    let convolution = |settings: &mut Li2023Settings| {
        settings.model.zero_decoder = true;
        settings.model.state_decoder = StateDecoder::Conv3;
        settings.model.input = Input::Linear;
    };
    let fading = |settings: &mut Li2023Settings| settings.model.fade_frames = 3;
    type Change = fn(&mut Li2023Settings);
    let changes: [(Change, bool); 3] = [(zeros, true), (convolution, true), (fading, false)];
    for (change, everywhere) in changes {
        let mut settings = small();
        change(&mut settings);
        let (batch, body, statistics) =
            generated_batch(&settings, 6, 2, 4, Interpolation::Slerp).unwrap();
        let mut parameters = Parameters::<f64>::new();
        let mut init = Initialiser::new(&mut parameters, rng());
        let network = Li2023::new(&mut init, &settings, &body, &statistics).unwrap();
        let mut workspace = Workspace::new();
        let mut tape = Tape::inference(&parameters, &mut workspace);
        let said = network.forward(&mut tape, &batch).unwrap();
        let said = tape.array(said.rotations).into_owned();
        for row in 0..batch.rows() {
            let same = said
                .index_axis(ndarray::Axis(0), row)
                .iter()
                .eq(batch.input.row(row));
            let keyframe = batch.keyframes[[row, 0]] == 1.0;
            assert_eq!(same, everywhere || keyframe, "row {row}");
        }
    }
}
