//! Layers as structs of parameters; names, layouts and initial values are PyTorch's.

mod attention;
mod convolution;
mod init;
mod linear;
mod lstm;
pub mod measure;
mod mlp;
mod norm;
mod positioned_transformer;
mod positions;
mod pre_norm;
mod transformer;

pub use attention::{MultiHeadAttention, NarrowAttention};
pub use convolution::Convolution;
pub use init::{Initialiser, MOST_WEIGHTS};
pub use linear::Linear;
pub use lstm::Lstm;
pub use mlp::{Activation, LastLayer, Mlp};
pub use norm::LayerNorm;
pub use positioned_transformer::{
    Place, PositionedSizes, PositionedTransformer, Positions, t5_bucket,
};
pub use positions::sinusoidal_positions;
pub use pre_norm::PreNormEncoderLayer;
pub use transformer::{TransformerDecoderLayer, TransformerEncoderLayer, TransformerSizes};
