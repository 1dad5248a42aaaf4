//! What normalising flows of dances share: the norm of a block, its invertible linear layer, and
//! the density of what is left (Kingma and Dhariwal 2018, Henter et al. 2020).

mod linear;
mod norm;
mod prior;

pub use linear::PluLinear;
pub use norm::{FlowNorm, NormKind, Normed};
pub use prior::{Density, LN_TAU, noise_like, squares_of_windows};
