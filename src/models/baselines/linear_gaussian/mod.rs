//! The baseline "linear_gaussian": the next frames of a dance as a linear function of those before,
//! and a Gaussian error (spec of Valle-Pérez et al., section 6: what a flow must beat).
//!
//! - `settings`: the tables of a config;
//! - `fit`: the function and its error, fitted to training clips;
//! - `generator`: likelihoods by them, and dances that are drawn from them.

mod fit;
mod generator;
mod settings;

use crate::evaluation::sampled_dance::VALLEPEREZ2021;
use crate::models::kind::KindOf;
use settings::Settings;

const NAME: &str = "linear_gaussian";

/// The line of the registry.
pub(in crate::models) const KIND: KindOf<Settings> = KindOf::new(NAME, || vec![VALLEPEREZ2021]);
