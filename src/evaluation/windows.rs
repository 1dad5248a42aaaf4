//! What protocols share that cut recordings into windows: which of them, in chunks, and a model
//! asked about each.

use rayon::prelude::*;

use super::protocol::EvaluationError;
use crate::counted::counted;
use crate::models::{Generator, ModelError, Request};

/// Windows that a model is asked about in one call. Bounds memory.
pub(super) const CHUNK: usize = 64;

/// At most `most` of the windows, evenly spread over them; all where there is no such bound.
pub(super) fn spread<W: Copy>(windows: Vec<W>, most: Option<usize>) -> Vec<W> {
    match most {
        Some(most) => {
            let count = windows.len().min(most);
            (0..count)
                .map(|k| windows[k * windows.len() / count])
                .collect()
        }
        None => windows,
    }
}

/// What `measure` tells of each window, in their order.
///
/// Chunks of so many windows run in parallel on rayon's current pool. They do not depend on the
/// number of threads, and their results are kept in order.
pub(super) fn in_chunks<W: Sync, M: Send>(
    windows: &[W],
    chunk: usize,
    measure: impl Fn(&[W]) -> Result<Vec<M>, EvaluationError> + Sync + Send,
) -> Result<Vec<M>, EvaluationError> {
    let chunks = windows.par_chunks(chunk.max(1));
    let measured: Vec<Vec<M>> = chunks.map(measure).collect::<Result<_, _>>()?;
    Ok(measured.into_iter().flatten().collect())
}

/// What a model answers to requests, one to each; `what` says in an error what they are.
pub(super) fn answers<A>(
    model: &dyn Generator,
    requests: &[Request],
    ask: impl FnOnce(&[Request]) -> Result<Vec<A>, ModelError>,
    what: impl FnOnce() -> String,
) -> Result<Vec<A>, EvaluationError> {
    let answers = ask(requests).map_err(|source| failed(model, &what(), source))?;
    if answers.len() != requests.len() {
        let (model, answers, requests) = (model.name(), answers.len(), requests.len());
        return Err(bad(format!(
            "{model} gave {answers} answers to {requests} requests"
        )));
    }
    Ok(answers)
}

/// The error of a model, by its name and what it was asked for.
pub(super) fn failed(model: &dyn Generator, what: &str, source: ModelError) -> EvaluationError {
    EvaluationError::Model {
        what: format!("{}, {what}", model.name()),
        source: Box::new(source),
    }
}

/// The warning of a clip that is shorter than a window.
pub(super) fn left_out(clip: &str, frames: usize, needed: usize, length: usize) -> String {
    let frames = counted(frames, "frame");
    format!(
        "{clip} has {frames}, fewer than a window of {needed} (N = {length}): left out of the \
         scores at this length"
    )
}

/// The error of data that cannot be measured.
pub(super) fn bad(reason: String) -> EvaluationError {
    EvaluationError::Data { reason }
}
