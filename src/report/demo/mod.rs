//! What a demo leaves: tables, scores, curves, and one transition to look at.

mod comparison;
mod losses;
mod settings;
mod showcase;

pub use comparison::Comparison;
pub use losses::Losses;
pub use settings::{DemoSettings, DemoSettingsError};
pub use showcase::{Showcase, ShowcaseFiles};

use std::fs;
use std::path::{Path, PathBuf};

use super::FigureError;
use crate::data::{DataPart, Dataset, EmptyPart};
use crate::evaluation::{EvaluatedData, EvaluationRecord, PrintedTables, TableRow, Tables};
use crate::models::ModelError;
use crate::motion::bvh::BvhError;
use crate::motion::fit::RotationFitError;
use crate::run::{FileError, replace_file, write_json};

/// Why a demo has no results.
#[derive(Debug, thiserror::Error)]
pub enum DemoError {
    #[error("no test clip has the frames of a transition of {length}")]
    TooShort { length: usize },
    #[error("{clip} has fewer poses than frames")]
    Poses { clip: String },
    #[error("{model} gave no transition")]
    NoTransition { model: String },
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Rotations(#[from] RotationFitError),
    #[error(transparent)]
    Figure(#[from] FigureError),
    #[error(transparent)]
    Bvh(#[from] BvhError),
    #[error(transparent)]
    EmptyPart(#[from] EmptyPart),
    #[error(transparent)]
    Toml(#[from] toml::ser::Error),
    #[error(transparent)]
    File(#[from] FileError),
}

const TABLES: &str = "tables.md";
const LOSS_CURVE: &str = "loss_curve.svg";
/// Name of the file with the transition that is shown.
pub const TRANSITION: &str = "transition.bvh";
const FIGURE: &str = "motion.svg";
const VIEWER: &str = "viewer.html";
const INTERPOLATION: &str = "interpolation.json";
const UNTRAINED: &str = "untrained.json";
const CHOREOGRAPHY: &str = "choreography.toml";

/// Removes what an earlier demo left beside its run: a demo that is interrupted must not leave
/// results of two.
///
/// # Errors
/// A file cannot be removed.
pub fn remove_results(folder: &Path) -> Result<(), FileError> {
    let own = [
        TABLES,
        LOSS_CURVE,
        TRANSITION,
        FIGURE,
        VIEWER,
        INTERPOLATION,
        UNTRAINED,
        CHOREOGRAPHY,
    ];
    let names = own
        .into_iter()
        .chain(EvaluationRecord::files(DataPart::Test));
    for path in names.map(|name| folder.join(name)) {
        if path.exists() {
            fs::remove_file(&path).map_err(FileError::at(&path, "removed"))?;
        }
    }
    Ok(())
}

/// Writes the loss curve.
///
/// # Errors
/// There is no loss to draw, or the file cannot be written.
pub fn write_losses(folder: &Path, losses: &Losses) -> Result<(), DemoError> {
    Ok(replace_file(
        &folder.join(LOSS_CURVE),
        losses.figure()?.as_bytes(),
    )?)
}

/// Writes tables, the scores of all three, and what was generated.
///
/// # Errors
/// A file cannot be written.
pub fn write_scores(
    folder: &Path,
    settings: &DemoSettings,
    dataset: &Dataset,
    comparison: &Comparison,
    printed: &PrintedTables,
    rows: &[TableRow],
) -> Result<(), DemoError> {
    let protocol = settings.experiment.protocol();
    let tables = Tables {
        metrics: protocol.metrics(),
        printed,
    };
    let text = tables.markdown(rows, &caption(settings, dataset));
    replace_file(&folder.join(TABLES), text.as_bytes())?;
    write_json(&folder.join(INTERPOLATION), &comparison.interpolation)?;
    write_json(&folder.join(UNTRAINED), &comparison.untrained)?;
    EvaluationRecord {
        scores: comparison.model.clone(),
        data: EvaluatedData::of(dataset, DataPart::Test)?,
    }
    .write(folder)?;
    let choreography = toml::to_string(&settings.choreography)?;
    Ok(replace_file(
        &folder.join(CHOREOGRAPHY),
        choreography.as_bytes(),
    )?)
}

/// What the scores were measured on.
fn caption(settings: &DemoSettings, dataset: &Dataset) -> String {
    let choreography = &settings.choreography;
    format!(
        "{} of {} generated clips of {} frames (seed {}), the paper's on its own data: not comparable",
        dataset.test.len(),
        choreography.clips,
        choreography.frames_per_clip,
        choreography.seed
    )
}

/// Where the showcase of a demo goes.
pub fn showcase_files(folder: &Path) -> ShowcaseFiles {
    let path = |name: &str| -> PathBuf { folder.join(name) };
    ShowcaseFiles {
        figure: path(FIGURE),
        viewer: path(VIEWER),
        bvh: path(TRANSITION),
    }
}
