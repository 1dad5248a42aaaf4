//! Single-shot motion completion (Duan et al. 2022), as Li et al. compare with it: a Transformer
//! over frames that completes a whole window at once.
//!
//! Its authors published no program; what is known of it fixes the parts, and the sizes are those
//! of the specification (`docs/li2023.md`).

mod config;
mod network;

pub use config::{Duan2022Config, Duan2022Settings};
pub use network::Duan2022;

use crate::models::kind::KindOf;
use crate::models::li2023;
use crate::models::rotations::RotationSettings as _;

/// The line of the registry.
pub const KIND: KindOf<Duan2022Settings> =
    KindOf::new(Duan2022Settings::KIND, || li2023::PAPERS.to_vec()).called("duan");
