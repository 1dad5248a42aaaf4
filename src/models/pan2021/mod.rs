//! Diverse Dance Synthesis via Keyframes with Transformer Controllers (Pan et al. 2021).
//!
//! - `config`: sizes and ablations;
//! - `controller`: root trajectory and velocity factor controllers (figure 3);
//! - `control_path`: a feed-forward path from the controls, an option;
//! - `network`: encoders, LSTM backbone and decoders (figure 2), one frame after the other;
//! - `given`: a batch as the network is given it;
//! - `prior`: the mean that a residual network's numbers are added to;
//! - `losses`: eq. 3 to 11;
//! - `units`: from standardised numbers to centimetres on the tape.
//!
//! `docs/pan2021.md` fixes shapes, names and units.

mod config;
mod control_path;
mod controller;
mod given;
mod losses;
mod network;
mod prior;
mod units;

pub use config::{Controllers, LossWeights, Output, Pan2021Config};
pub use losses::keyframe_weights;
pub use network::Pan2021;
pub use prior::Prior;

use crate::data::DataConfig;
use crate::evaluation::equations::Equations;
use crate::evaluation::exports::Exports;
use crate::evaluation::published::Published;
use crate::evaluation::transitions::TransitionScoring;
use crate::evaluation::{EvaluationOptions, Protocol};
use crate::models::Paper;

/// The paper, the numbers that it prints and how they are counted.
pub const PAPER: Paper = Paper {
    name: "pan2021",
    printed: include_str!("../../../experiments/pan2021/paper.toml"),
    figures: Some(crate::report::figures::pan2021::draw),
    demo: Some(crate::report::demo::pan2021::open),
    protocols,
    by_name: |data, options| {
        let scoring = TransitionScoring::new(data.features(), options);
        vec![Box::new(Exports(scoring))]
    },
};

/// The paper's comparison on cyclic motion (section 4.3), of which it prints no numbers.
pub const CYCLIC: Paper = Paper {
    figures: Some(crate::report::figures::pan2021::cyclic::draw),
    ..Paper::new(
        "pan2021_cyclic",
        include_str!("../../../experiments/pan2021_cyclic/paper.toml"),
        |data, options| {
            let scoring = TransitionScoring::new(data.features(), options);
            vec![Box::new(Equations(scoring))]
        },
    )
};

fn protocols(data: &DataConfig, options: &EvaluationOptions) -> Vec<Box<dyn Protocol>> {
    let scoring = TransitionScoring::new(data.features(), options);
    vec![
        Box::new(Equations(scoring.clone())),
        Box::new(Published(scoring)),
    ]
}

/// The group of learning rates of the controllers' Transformers, which a large rate switches off
/// (docs/notes/why-the-controllers-switched-off.md).
pub const TRANSFORMERS: &str = "transformers";
