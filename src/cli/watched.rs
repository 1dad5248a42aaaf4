//! An evaluation that shows how far it is, and stops with its command.

use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, PoisonError};

use super::progress::Meter;
use super::stop::{LOOK_EVERY, Stop};
use crate::data::{DataPart, Dataset, Recording};
use crate::evaluation::{Evaluation, EvaluationError, Protocol};
use crate::models::Generator;
use crate::models::watched::Watched;

/// Evaluates a model and shows on stderr how far it got: with a bar where it is `alone`. Ends early
/// where `stop` is asked to.
///
/// # Errors
/// As [`Protocol::evaluate`]; stopped, see [`EvaluationError::is_stopped`].
pub fn evaluate_watched(
    protocol: &dyn Protocol,
    model: &dyn Generator,
    dataset: &Dataset,
    part: DataPart,
    alone: bool,
    stop: Option<&Stop>,
) -> Result<Evaluation, EvaluationError> {
    let recordings = part.of(dataset)?.iter();
    let frames: Vec<usize> = recordings.map(Recording::frames).collect();
    let shown = Mutex::new((0, Meter::new(protocol.frames(&frames), 0, alone)));
    let meter = || shown.lock().unwrap_or_else(PoisonError::into_inner);
    let answered = |frames: u64| {
        let mut shown = meter();
        let (done, meter) = &mut *shown;
        *done += frames;
        let (_, left) = meter.speed(*done);
        let (name, by, share) = (model.name(), protocol.name(), meter.share(*done));
        meter.show(
            *done,
            &format!("evaluating {name} by {by}  {share}  {left} left"),
        );
    };
    let watched = Watched {
        model,
        stopped: &|| stop.is_some_and(Stop::is_asked),
        answered: &answered,
    };
    let evaluation = std::thread::scope(|scope| {
        let (_evaluating, ended) = mpsc::channel::<()>();
        if let Some(stop) = stop {
            let meter = &meter;
            scope.spawn(move || {
                while ended.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Timeout) {
                    stop.end_late(|| meter().1.clear());
                }
            });
        }
        protocol.evaluate(&watched, dataset, part)
    });
    meter().1.clear();
    evaluation
}
