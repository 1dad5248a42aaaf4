//! Layers as structs of parameters; names and layouts are PyTorch's.

mod init;

pub use init::Initialiser;
