//! `--unit` and `--up`: what a BVH file's numbers mean.

use clap::Args;

use crate::data::DataConfig;
use crate::motion::{Unit, Up};

#[derive(Debug, Args)]
pub struct FileUnits {
    /// Unit of the file's lengths: cm, m, mm, in, or auto, which recognises it by the body's height
    /// [default: the run's data.unit, or auto]
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<Unit>,
    /// Axis that points up in the file: y, z, or auto, which recognises it by how the body stands
    /// [default: the run's data.up, or auto]
    #[arg(long, value_name = "AXIS")]
    pub up: Option<Up>,
}

impl FileUnits {
    /// A config's `[data]` for files that are read under these.
    pub fn over(&self, data: &DataConfig) -> DataConfig {
        DataConfig {
            unit: self.unit.unwrap_or(data.unit),
            up: self.up.unwrap_or(data.up),
            ..data.clone()
        }
    }
}
