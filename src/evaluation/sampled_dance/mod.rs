//! Scores of dances sampled from a model frame by frame, as functions of arrays: those of
//! Valle-Perez et al. (2021), section 5, and what the paper says in words only.
//!
//! Dances are their raw motion columns, `[frames, columns]` in cm and rad, or, where a function
//! says so, these standardised by the training part. Seeds are left out by who calls.
//!
//! - [`frechet`]: FPD and FMD (table 2), in two forms;
//! - [`kinematic_beats`], [`beat_alignment`] (table 3), [`tempogram`] (figure 3);
//! - [`prompting`]: what a seed's style does (table 4);
//! - [`freezing`], [`divergence`], [`diversity`], [`step`]: how dances go wrong.

mod asked;
pub mod beat_alignment;
mod dances;
pub mod divergence;
pub mod diversity;
pub mod frechet;
pub mod freezing;
pub mod kinematic_beats;
mod likelihood;
mod metrics;
mod paper;
pub mod prompting;
mod protocol;
pub mod step;
pub mod tempogram;

pub use asked::dance_question;
pub use likelihood::Likelihood;
pub use metrics::METRICS;
pub use paper::VALLEPEREZ2021;
pub use protocol::SampledDance;

/// The column of the root's height, cm.
pub const HEIGHT: usize = 2;

/// The share of dances of which something holds, %. None of no dance.
#[must_use]
pub fn share(dances: &[bool]) -> Option<f64> {
    let holds = dances.iter().filter(|holds| **holds).count();
    (!dances.is_empty()).then(|| 100.0 * holds as f64 / dances.len() as f64)
}
