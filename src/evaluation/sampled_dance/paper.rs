//! The paper that the protocols belong to.

use super::{Likelihood, SampledDance};
use crate::models::Paper;

/// Valle-Pérez et al.: Transflower (2021).
pub const VALLEPEREZ2021: Paper = Paper {
    name: "valleperez2021",
    printed: include_str!("../../../experiments/valleperez2021/paper.toml"),
    figures: Some(crate::report::figures::valleperez2021::draw),
    demo: Some(crate::report::demo::valleperez2021::open),
    by_name: |_, _| Vec::new(),
    protocols: |_, options| {
        vec![
            Box::new(Likelihood::new(options)),
            Box::new(SampledDance::new(options)),
        ]
    },
};
