//! Figures 4 to 9 of Pu and Shan: of the loss, of rows of tables 1 to 5, and of a trained model on a
//! test clip.

mod beats;
mod grid;
mod seeds;
mod stage;
mod sweep;
mod weights;

use super::{DrawnFigures, FigureRequest};
use crate::evaluation::{EvaluationRecord, ProtocolScores, Scores};
use crate::report::ReportError;
use crate::run::RunFolder;
use stage::Stage;

/// The protocol that the figures' scores are by.
const PROTOCOL: &str = "music_dance";
/// Frames of the dance that figures 8 and 9 show where none are asked for, its seed among them: a
/// window.
const LENGTH: usize = 240;

/// Draws those figures that there are scores for: 5 and 6 are over rows, 7 needs the model's own
/// scores.
///
/// # Errors
/// What is to be shown is not there; rows or a page are asked for that there are not; the model
/// fails.
pub fn draw(asked: &FigureRequest<'_>) -> Result<DrawnFigures, ReportError> {
    if asked.page {
        return Err(ReportError::Refused(
            "--viewer shows Pan et al.'s transitions; a dance to its song is shown by `keydance \
             generate --music SONG --viewer OUT.html`"
                .into(),
        ));
    }
    if !asked.compared.is_empty() {
        return Err(ReportError::Refused(
            "--compare: no figure of Pu and Shan sets models side by side; figures 5 and 6 are over \
             evaluated rows, which --rows DIR gives"
                .into(),
        ));
    }
    let stage = Stage::new(asked)?;
    let printed = asked.subject.config.printed()?;
    let model = asked.subject.model.as_ref();
    let mut left_out = Vec::new();
    let mut figures = vec![weights::figure_4(asked)?];
    for plot in [sweep::FIGURE_5, sweep::FIGURE_6] {
        match sweep::figure(&plot, asked.rows, &printed)? {
            Some(figure) => figures.push(figure),
            None => left_out.push(format!(
                "Figure {} is left out: it is over rows of the paper's tables {} and {}, and there \
                 is none; give a folder of them with --rows DIR.",
                plot.number, plot.tables[0], plot.tables[1]
            )),
        }
    }
    match own_scores(asked)? {
        Some(scores) => figures.push(beats::figure_7(asked, &scores, &printed)?),
        None => left_out.push(format!(
            "Figure 7 is left out: {} has no scores on this data; `keydance evaluate` gives it some, \
             or a row of its name in the folder of --rows.",
            asked.subject.config.name
        )),
    }
    figures.push(seeds::figure_8(&stage, model)?);
    figures.push(beats::figure_9(&stage, model)?);
    Ok(DrawnFigures {
        figures,
        left_out,
        page: None,
    })
}

/// The model's scores on the data: those in its run's folder, or else of a row of its name.
fn own_scores(asked: &FigureRequest<'_>) -> Result<Option<Scores>, ReportError> {
    let folder = asked.subject.run.as_ref().map(RunFolder::path);
    let evaluated = folder.filter(|folder| EvaluationRecord::is_in(folder));
    let record = evaluated.map(EvaluationRecord::read).transpose()?;
    let of_run = record.filter(|it| it.data.data_digest == asked.dataset.digest);
    let mut rows = asked.rows.iter();
    let row = rows.find(|row| row.name == asked.subject.config.name);
    let row = row.and_then(|row| row.scores.as_ref());
    let scores: Option<&ProtocolScores> = of_run.as_ref().map(|it| &it.scores).or(row);
    Ok(scores.and_then(|scores| scores.by(PROTOCOL)).cloned())
}
