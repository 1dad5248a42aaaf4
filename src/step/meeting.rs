//! Shards that meet before the step's loss: each on its tape up to there, one tape for what they
//! have in common, then back on theirs.

use std::ops::Range;

use ndarray::{ArrayD, ArrayViewD, Axis, Slice, concatenate};
use rayon::prelude::*;

use super::error::StepError;
use super::losses::Losses;
use super::stepper::{StepInput, failure};
use crate::autograd::{AutogradError, Gradients, Parameters, Tape, Var, Workspace};
use crate::models::Meeting;
use crate::ranks::Together;

/// A shard on its way: its tape, and what it brings.
type Brought<'t> = (Tape<'t, f32>, Var);

/// Where a rank's shards are computed.
pub(super) struct Place<'p> {
    /// One more than the shards.
    pub workspaces: &'p mut [Workspace<f32>],
    /// One for each shard.
    pub gradients: &'p mut [Gradients<f32>],
    pub together: &'p mut Together,
    /// This rank's.
    pub shards: Range<usize>,
}

/// Losses of a step whose shards meet, on the first rank; none on the others, which compute the
/// same. Gradients are added to those of the shards, and of what they have in common to the first.
pub(super) fn run_meeting(
    input: StepInput<'_>,
    meeting: &dyn Meeting<f32>,
    parameters: &Parameters<f32>,
    place: Place<'_>,
    trace: bool,
) -> Result<Vec<Losses>, StepError> {
    let Place {
        workspaces,
        gradients,
        together,
        shards,
    } = place;
    let failed = |cause| failure(input, cause);
    let Some((common, own)) = workspaces.split_last_mut() else {
        return Ok(Vec::new());
    };
    let brought: Vec<Result<Brought<'_>, AutogradError>> = own
        .par_iter_mut()
        .zip(shards)
        .map(|(workspace, shard)| {
            let mut tape = input.tape(parameters, workspace, shard, trace);
            let brought = meeting.bring(&mut tape, shard)?;
            Ok((tape, brought))
        })
        .collect();
    let brought = brought.into_iter().collect::<Result<Vec<_>, _>>();
    let brought = together.agree(brought.map_err(failed))?;
    let values: Vec<ArrayViewD<'_, f32>> = brought
        .iter()
        .map(|(tape, brought)| tape.array(*brought))
        .collect();
    let own = concatenated(&values).map_err(failed)?;
    let Rows { before, all } = Rows::of_all(own, together)?;
    if brought.is_empty() {
        return Ok(Vec::new());
    }

    let mut tape = input.tape(parameters, common, input.step.shards(), trace);
    let all = tape.input(all);
    let losses = meeting.losses(&mut tape, all).map_err(failed)?;
    let numbers = Losses::read(&tape, &losses);
    if !numbers.are_finite() {
        let mut tapes = brought.iter().map(|(tape, _)| tape).chain([&tape]);
        tapes.try_for_each(Tape::check_finite).map_err(failed)?;
    }
    let mut elsewhere;
    let of_common = match gradients.first_mut() {
        Some(first) if together.is_first() => first,
        _ => {
            elsewhere = Gradients::zeros(parameters);
            &mut elsewhere
        }
    };
    let upstream = tape.backward_from(losses.total, &[1.0], &[all], of_common);
    let upstream = upstream.map_err(failed)?;
    let upstream: ArrayD<f32> = upstream.into_iter().next().unwrap_or_default();

    let mut end = before;
    let shards: Vec<_> = brought
        .into_iter()
        .map(|(tape, brought)| {
            let start = end;
            end += tape.shape(brought).first().copied().unwrap_or(0);
            (tape, brought, Slice::from(start..end))
        })
        .collect();
    let back: Vec<Result<(), AutogradError>> = shards
        .into_par_iter()
        .zip(gradients)
        .map(|((tape, brought, rows), gradients)| {
            let own = upstream.slice_axis(Axis(0), rows);
            let own = own.as_standard_layout();
            let own = own.as_slice().unwrap_or_default();
            tape.backward_from(brought, own, &[], gradients).map(drop)
        })
        .collect();
    back.into_iter()
        .collect::<Result<(), _>>()
        .map_err(failed)?;
    Ok(match together.is_first() {
        true => vec![numbers],
        false => Vec::new(),
    })
}

/// What all shards bring, their rows in the shards' order.
struct Rows {
    /// Rows of the ranks before this one.
    before: usize,
    all: ArrayD<f32>,
}

impl Rows {
    fn of_all(own: ArrayD<f32>, together: &mut Together) -> Result<Self, StepError> {
        if together.is_alone() {
            return Ok(Self {
                before: 0,
                all: own,
            });
        }
        let shape = own.shape().to_vec();
        let said = together.share((shape, own.into_raw_vec_and_offset().0))?;
        let arrays = said.into_iter().map(|(shape, values)| {
            let array = ArrayD::from_shape_vec(shape, values);
            array.map_err(|cause| StepError::Refused(format!("a rank's rows: {cause}")))
        });
        let arrays: Vec<ArrayD<f32>> = arrays.collect::<Result<_, _>>()?;
        let rows = |array: &ArrayD<f32>| array.shape().first().copied().unwrap_or(0);
        let before = arrays.iter().take(together.rank()).map(rows).sum();
        // Ranks without a shard bring nothing.
        let brought = arrays.iter().filter(|array| !array.is_empty());
        let views: Vec<ArrayViewD<'_, f32>> = brought.map(|array| array.view()).collect();
        let refused = |cause: AutogradError| StepError::Refused(cause.to_string());
        let all = concatenated(&views).map_err(refused)?;
        Ok(Self { before, all })
    }
}

/// Rows below each other; `[0]` of nothing.
fn concatenated(parts: &[ArrayViewD<'_, f32>]) -> Result<ArrayD<f32>, AutogradError> {
    if parts.is_empty() {
        return Ok(ArrayD::zeros(vec![0]));
    }
    concatenate(Axis(0), parts).map_err(|_| AutogradError::Misplaced {
        operation: "meeting",
        what: "what its shards bring differs in an axis behind the first",
    })
}
