//! The windows of a batch with what a trained network makes of them.

use ndarray::Array2;

use super::settings::{build, loaded};
use super::{Batch, RotationNetwork, RotationSettings, TrainingClip};
use crate::autograd::{AutogradError, Parameters, Real, Tape, Workspace};
use crate::data::WindowCut;
use crate::models::exported_batch::{ExportOptions, ExportedBatch, FRAMES, spread};
use crate::models::settings::{LoadError, TaskSetting};
use crate::models::weights::SavedWeights;
use crate::models::{ModelError, Statistics};
use crate::motion::Feet;

/// Random masks are off. W windows of T frames, rows = W T: `input [rows, 4 J]`,
/// `keyframes [rows, 2]`, `contacts [rows, 2]`, `distances [rows, 1]`, `offsets [rows, 3 J]`,
/// `straight_root [rows, 3]`, of a model that is given a past `past.rotations [W P, 4 J]` and
/// `past.root [W P, 3]`, `truth.rotations [rows, 4 J]`, `truth.root [rows, 3]`, as in
/// [`Batch`]; `windows [1]`, `parents [J]` (-1: none), `feet [2]` (right and left);
/// `output.rotations`, `output.contacts`, `output.root`, those that the network says; `loss.*`,
/// `gradient.*`.
pub(super) fn export<S: RotationSettings>(
    settings: &S,
    saved: &SavedWeights,
    setting: &TaskSetting<'_>,
    options: &ExportOptions,
) -> Result<ExportedBatch, LoadError> {
    options.check_not_fed()?;
    let model = loaded(settings, saved)?;
    let longest = model.network.longest();
    let frames = options.frames.unwrap_or(FRAMES.min(longest));
    if !(3..=longest).contains(&frames) {
        let reason = format!(
            "--frames {frames}: the model's windows have 3 to {longest} frames \
             (schedule.lengths.max)"
        );
        return Err(ModelError::Data { reason }.into());
    }
    let recordings = &setting.dataset.train;
    for recording in recordings {
        model
            .body
            .check(recording.name(), &recording.clip.skeleton)?;
    }
    let cut = WindowCut {
        frames,
        every: 1,
        strictly: false,
    };
    let lengths: Vec<usize> = recordings.iter().map(|it| it.frames()).collect();
    let mut windows = Vec::new();
    let mut all = cut.windows(&lengths);
    all.retain(|window| window.start >= settings.past());
    for window in spread(&all, options.windows, frames, frames)? {
        // As a training labels it.
        let indices = [0, window.clip as u64];
        let clip = TrainingClip::new(
            recordings[window.clip].clip.clone(),
            settings.contact_rule(),
            setting.data.contact_threshold,
            setting.streams.stream("contact_foot", &indices),
        )?;
        windows.push(clip.window(window.start, frames, settings.past(), settings.root_frame()));
    }
    let (given, truths): (Vec<_>, Vec<_>) = windows.into_iter().unzip();
    let mut exported = ExportedBatch::default();
    let input = model.network.input();
    let results = if options.double {
        let (body, statistics) = (&model.body, &model.statistics);
        let known = statistics.statistics(body.statistics(Statistics::default()));
        let (network, parameters) =
            saved.network::<f64, _>(&known, |init| build(settings, init, body, statistics))?;
        let batch = Batch::of(&given, &truths, input);
        add_results(&mut exported, &*network, &parameters, &batch)
    } else {
        let batch = Batch::of(&given, &truths, input);
        add_results(&mut exported, &*model.network, &model.parameters, &batch)
    };
    results.map_err(|error| ModelError::data(&error))?;
    let feet = Feet::of(model.body.skeleton()).map_err(|error| ModelError::data(&error))?;
    let feet = settings
        .contact_rule()
        .joints(&feet)
        .map(|joint| joint as f32);
    let parents = model.body.parents().into_iter();
    let parents: Vec<f32> = parents
        .map(|parent| parent.map_or(-1.0, |parent| parent as f32))
        .collect();
    exported.add("feet", &[2], &feet);
    exported.add("parents", &[parents.len()], &parents);
    exported.add("windows", &[1], &[options.windows as f32]);
    Ok(exported)
}

fn add_results<T: Real>(
    exported: &mut ExportedBatch,
    network: &dyn RotationNetwork<T>,
    parameters: &Parameters<T>,
    batch: &Batch<T>,
) -> Result<(), AutogradError> {
    let mut add = |name: &str, array: &Array2<T>| {
        let values: Vec<T> = array.iter().copied().collect();
        exported.add(name, array.shape(), &values);
    };
    add("input", &batch.input);
    add("keyframes", &batch.keyframes);
    add("contacts", &batch.contacts);
    add("distances", &batch.distances);
    add("offsets", &batch.offsets);
    add("straight_root", &batch.root);
    if batch.past_frames > 0 {
        add("past.rotations", &batch.past_rotations);
        add("past.root", &batch.past_root);
    }
    if let Some(truth) = &batch.truth {
        add("truth.rotations", &truth.rotations);
        add("truth.root", &truth.root);
    }
    let mut workspace = Workspace::new();
    let mut tape = Tape::inference(parameters, &mut workspace);
    let said = network.predict(&mut tape, batch)?;
    for (name, var) in [
        ("rotations", Some(said.rotations)),
        ("contacts", said.contacts),
        ("root", said.root),
    ] {
        if let Some(var) = var {
            exported.add(format!("output.{name}"), tape.shape(var), tape.values(var));
        }
    }
    drop(tape);
    exported.add_losses(parameters, &mut workspace, |tape| {
        network.losses(tape, batch)
    })
}
