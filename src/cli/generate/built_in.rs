//! The models that come with the program: models/README.md.

use crate::run::BuiltIn;

/// Between keyframes.
pub const DANCE: BuiltIn = BuiltIn {
    folder: "models/dance",
    config: include_str!("../../../models/dance/config.toml"),
    manifest: include_str!("../../../models/dance/manifest.json"),
    weights: include_bytes!("../../../models/dance/weights.safetensors"),
};

/// To music.
pub const MUSIC: BuiltIn = BuiltIn {
    folder: "models/music",
    config: include_str!("../../../models/music/config.toml"),
    manifest: include_str!("../../../models/music/manifest.json"),
    weights: include_bytes!("../../../models/music/weights.safetensors"),
};
