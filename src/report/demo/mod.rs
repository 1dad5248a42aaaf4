//! What a demo leaves: tables, scores, curves, and one transition to look at.

mod comparison;
mod losses;
mod settings;
mod showcase;

pub use comparison::Comparison;
pub use losses::Losses;
pub use settings::DemoSettings;
pub use showcase::Showcase;

use std::path::Path;

use super::ReportError;
use crate::counted::counted;
use crate::data::{DataPart, Dataset};
use crate::evaluation::{EvaluatedData, EvaluationRecord, TableRow, Tables};
use crate::run::{RunFolder, check_output_folder, remove_file, replace_file, write_json};

const TABLES: &str = "tables.md";
const LOSS_CURVE: &str = "loss_curve.svg";
/// Name of the file with the transition that is shown.
pub const TRANSITION: &str = "transition.bvh";
const FIGURE: &str = "motion.svg";
const VIEWER: &str = "viewer.html";
const INTERPOLATION: &str = "interpolation.json";
const UNTRAINED: &str = "untrained.json";
const CHOREOGRAPHY: &str = "choreography.toml";

/// Refuses a folder that holds something else than an earlier demo.
///
/// # Errors
/// It does.
pub fn check_folder(folder: &Path) -> Result<(), ReportError> {
    let problem =
        if folder.join(CHOREOGRAPHY).exists() || check_output_folder(folder, false).is_ok() {
            return Ok(());
        } else if folder.join(RunFolder::CONFIG).exists() {
            "holds a run already, which is no demo"
        } else {
            "holds other files than a demo's"
        };
    let folder = folder.display();
    Err(ReportError::Refused(format!(
        "{folder} {problem}; give another --out"
    )))
}

/// Removes what an earlier demo left beside its run, as a demo that is interrupted must not leave
/// results of two; and writes what is generated, by which the folder is known as a demo's.
///
/// # Errors
/// A file cannot be removed or written.
pub fn begin_results(folder: &Path, settings: &DemoSettings) -> Result<(), ReportError> {
    let own = [
        TABLES,
        LOSS_CURVE,
        TRANSITION,
        FIGURE,
        VIEWER,
        INTERPOLATION,
        UNTRAINED,
    ];
    let scores = EvaluationRecord::files(DataPart::Test);
    own.iter()
        .chain(&scores)
        .try_for_each(|name| remove_file(&folder.join(name)))?;
    let choreography = toml::to_string(&settings.choreography)?;
    Ok(replace_file(&folder.join(CHOREOGRAPHY), choreography)?)
}

/// Writes the loss curve.
///
/// # Errors
/// There is no loss to draw, or the file cannot be written.
pub fn write_losses(folder: &Path, losses: &Losses) -> Result<(), ReportError> {
    Ok(replace_file(&folder.join(LOSS_CURVE), losses.figure()?)?)
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
    tables: Tables<'_>,
    rows: &[TableRow],
) -> Result<(), ReportError> {
    let choreography = &settings.choreography;
    let subject = format!(
        "{} of {} of {} (seed {})",
        dataset.test.len(),
        counted(choreography.clips, "generated clip"),
        counted(choreography.frames_per_clip, "frame"),
        choreography.seed
    );
    replace_file(&folder.join(TABLES), tables.markdown(rows, &subject))?;
    write_json(&folder.join(INTERPOLATION), &comparison.interpolation)?;
    write_json(&folder.join(UNTRAINED), &comparison.untrained)?;
    EvaluationRecord {
        scores: comparison.model.clone(),
        data: EvaluatedData::of(dataset, DataPart::Test)?,
    }
    .write(folder)?;
    Ok(())
}
