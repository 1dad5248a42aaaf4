//! Figures 3 to 6: methods and ablations on one transition.

use super::Cast;
use super::stage::Stage;
use crate::models::Generator;
use crate::report::figures::{Figure, Numbers};
use crate::report::{MotionFigure, Placing, ReportError, Shown};

/// Frames from one drawn dancer to the next.
const EVERY: usize = 3;

/// A figure of the recording and of models on the shown window of `frames` frames, with the mean
/// joint distance of each.
fn side_by_side(
    stage: &Stage,
    (name, number): (&'static str, &str),
    about: &str,
    models: &[(&str, &dyn Generator)],
    frames: usize,
    every: usize,
) -> Result<Figure, ReportError> {
    let window = stage.shown();
    let recorded = window.recorded(frames);
    let mut rows = vec![window.truth(frames)];
    let (mut numbers, mut said) = (Numbers::default(), Vec::new());
    for (label, model) in models {
        let positions = stage.answer(*model, window, frames, None)?;
        let pairs = positions.iter().zip(&recorded);
        let joints = pairs.flat_map(|(own, recorded)| own.iter().zip(recorded));
        let distances: Vec<f64> = joints.map(|(a, b)| a.distance(*b)).collect();
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        numbers.add(label, "joint_distance", mean, "cm");
        said.push(format!("{label} {mean:.1} cm"));
        rows.push(window.row(label, positions, true));
    }
    let caption = format!(
        "Figure {number}. {about}, every {every} frames; mean distance of the joints from the \
         recorded ones: {}.",
        said.join(", ")
    );
    let drawing = MotionFigure {
        title: format!("Figure {number}: {}", window.describe(frames)),
        caption,
        rows,
        shown: Shown::Every(every),
        placing: Placing::OnFirstPath,
        music: None,
    };
    Figure::of_dancers(name, drawing, numbers)
}

/// Figure 3: with and without the mix embedding, rows 3 and 2 of table 2; none where they are not
/// given.
pub fn figure_3(
    stage: &Stage,
    cast: &Cast<'_>,
    frames: usize,
) -> Result<Option<Figure>, ReportError> {
    let rows = [("mix_embedding", "with E_m"), ("slerp", "without E_m")];
    let Some(models) = cast.called(rows) else {
        return Ok(None);
    };
    let about = "Transitions with and without the mix embedding";
    side_by_side(stage, ("figure_3", "3"), about, &models, frames, EVERY).map(Some)
}

/// Figure 4: with and without L_p, rows 5 and 4 of table 2; none where they are not given.
pub fn figure_4(
    stage: &Stage,
    cast: &Cast<'_>,
    frames: usize,
) -> Result<Option<Figure>, ReportError> {
    let rows = [
        ("position_loss", "with L_p"),
        ("contact_loss", "without L_p"),
    ];
    let Some(models) = cast.called(rows) else {
        return Ok(None);
    };
    let about = "Transitions with and without the joint position loss";
    side_by_side(stage, ("figure_4", "4"), about, &models, frames, EVERY).map(Some)
}

/// Figure 5: every method on a transition.
pub fn figure_5(stage: &Stage, cast: &Cast<'_>, frames: usize) -> Result<Figure, ReportError> {
    let about = "One transition as recorded and as generated";
    side_by_side(
        stage,
        ("figure_5", "5"),
        about,
        &cast.methods(),
        frames,
        EVERY,
    )
}

/// Figure 6: where the labelled foot is while a short transition lasts.
pub fn figure_6(stage: &Stage, cast: &Cast<'_>, frames: usize) -> Result<Figure, ReportError> {
    let window = stage.shown();
    let mut rows = vec![window.truth(frames)];
    let (mut numbers, mut said) = (Numbers::default(), Vec::new());
    let mut measure = |label: &str, speeds: Vec<f64>| {
        let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
        numbers.add(label, "contact_foot_speed", speeds[0], "cm/frame");
        numbers.add(label, "contact_foot_speed_all_windows", mean, "cm/frame");
        said.push(format!("{label} {mean:.2}"));
    };
    let recorded = stage.windows.iter();
    let recorded = recorded.map(|it| stage.contact_foot_speed(*it, &it.recorded(frames)));
    measure("Ground truth", recorded.collect::<Result<_, _>>()?);
    for (label, model) in cast.methods() {
        let mut speeds = Vec::new();
        for (index, &of) in stage.windows.iter().enumerate() {
            let positions = stage.answer(model, of, frames, None)?;
            speeds.push(stage.contact_foot_speed(of, &positions)?);
            if index == 0 {
                rows.push(window.row(label, positions, true));
            }
        }
        measure(label, speeds);
    }
    numbers.add("all windows", "windows", stage.windows.len() as f64, "");
    let caption = format!(
        "Figure 6. A short transition, every second frame; how far the ankle of the foot that is \
         labelled in contact moves, in the mean of {} test transitions, cm/frame: {}.",
        stage.windows.len(),
        said.join(", ")
    );
    let drawing = MotionFigure {
        title: format!("Figure 6: {}", window.describe(frames)),
        caption,
        rows,
        shown: Shown::Every(2),
        placing: Placing::OnFirstPath,
        music: None,
    };
    Figure::of_dancers("figure_6", drawing, numbers)
}
