//! The paper that the protocol belongs to.

use super::MusicDance;
use crate::models::Paper;
use crate::report::figures::pu2022::draw;

/// Pu and Shan: music-driven dance regeneration with controllable key pose constraints (2022).
pub const PU2022: Paper = Paper {
    name: "pu2022",
    printed: include_str!("../../../experiments/pu2022/paper.toml"),
    figures: Some(draw),
    demo: Some(crate::report::demo::pu2022::open),
    by_name: |_, _| Vec::new(),
    protocols: |data, options| {
        vec![Box::new(
            MusicDance::new(options).with_beats(data.motion_beats),
        )]
    },
};
