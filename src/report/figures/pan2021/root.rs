//! Figures 5 to 7: the root trajectory as a control.

use glam::DVec3;

use super::stage::{Generated, Stage};
use super::wording::{mean, percent, verdict};
use crate::evaluation::transitions::TransitionScoring;
use crate::models::Generator;
use crate::models::transition::effect::{Response, body_distance, root_response};
use crate::report::figures::{Figure, Numbers};
use crate::report::{MotionFigure, MotionRow, PathView, ReportError, RootPaths, Shown};
use crate::synthesis::controls::{Speed, smooth_curve};
use crate::synthesis::{SequenceRequest, SynthesisError};

/// Frames from one drawn dancer to the next.
const EVERY: usize = 10;
/// How much the root is raised and lowered in figure 6, cm.
const HEIGHT: f64 = 30.0;
/// How far the trajectories of figure 7 lead aside, cm.
const DETOUR: f64 = 60.0;

/// Figure 5: generated motions and their root trajectories beside the targets. `plain`: the model
/// under the clips' own controls.
pub fn figure_5(stage: &Stage, model: &str, plain: &[Generated]) -> Result<Figure, ReportError> {
    let mut numbers = Numbers::default();
    let mut rows = Vec::new();
    let pairs = stage.windows().iter().zip(plain);
    for (number, (window, generated)) in pairs.take(2).enumerate() {
        let label = format!("clip {}", number + 1);
        rows.push(row_with_paths(&label, generated, PathView::Above));
        let label = window.describe();
        let distance = root_distance(generated);
        numbers.add(&label, "root_distance_mean", distance, "cm");
        let most = root_distances(generated).fold(0.0, f64::max);
        numbers.add(&label, "root_distance_max", most, "cm");
    }
    let distances: Vec<f64> = plain.iter().map(root_distance).collect();
    let distance = mean(distances.iter().copied());
    let threshold = TransitionScoring::default().root_threshold;
    let within = distances.iter().filter(|it| **it < threshold).count();
    stage.count(&mut numbers);
    numbers.add("all windows", "root_distance_mean", distance, "cm");
    numbers.add("all windows", "windows_within_7_cm", within as f64, "");
    let shown = stage.windows().iter().take(2);
    let names: Vec<&str> = shown.map(|window| window.clip.name.as_str()).collect();
    let clips = match names.len() {
        1 => "a test clip",
        _ => "two test clips",
    };
    let names = names.join(" and ");
    let verdict = match 2 * within > plain.len() {
        true => "keeps to",
        false => "does not keep to",
    };
    let caption = format!(
        "Figure 5. Motion generated for {clips} and its root trajectory beside the target, every \
         {EVERY} frames: {} the root is {distance:.1} cm from the target, in {within} of {} less \
         than {threshold} cm; {model} {verdict} its target so closely.",
        stage.measured_on(),
        plain.len()
    );
    let title = format!("Figure 5: {model} on {names}");
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Every(EVERY));
    Figure::of_dancers("figure_5", drawing, numbers)
}

/// Figure 6: the root lowered and raised on its way.
pub fn figure_6(
    stage: &Stage,
    model: &dyn Generator,
    plain: &[Generated],
) -> Result<Figure, ReportError> {
    let mut numbers = Numbers::default();
    let lowered = stage.generate(model, |request| Ok(request.raised(-HEIGHT)))?;
    let raised = stage.generate(model, |request| Ok(request.raised(HEIGHT)))?;
    let labels = [
        format!("root {HEIGHT} cm lower"),
        "as recorded".into(),
        format!("root {HEIGHT} cm higher"),
    ];
    let rows = labels.iter().zip([&lowered[0], &plain[0], &raised[0]]);
    let rows = rows.map(|(label, of)| row_with_paths(label, of, PathView::Height));
    let responses = [(&labels[0], &lowered), (&labels[2], &raised)].map(|(label, changed)| {
        let response = responses(changed, plain);
        record(&mut numbers, label, response);
        let distance = mean_body_distance(changed, plain);
        numbers.add(label, "body_distance_from_as_recorded", distance, "cm");
        (response, distance)
    });
    stage.count(&mut numbers);
    let [(lower, lower_bodies), (higher, higher_bodies)] = responses;
    let caption = format!(
        "Figure 6. One transition with the root {HEIGHT} cm lower and higher halfway, every \
         {EVERY} frames: {} the root gives {} of the lowering and {} of the raising, bodies differ \
         from those of the recorded height by {lower_bodies:.1} and {higher_bodies:.1} cm a joint; \
         {}.",
        stage.measured_on(),
        percent(lower.share()),
        percent(higher.share()),
        verdict(model.name(), "the root's height", &[lower, higher])
    );
    let title = stage.title("Figure 6", model.name());
    let rows = rows.collect();
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Every(EVERY));
    Figure::of_dancers("figure_6", drawing, numbers)
}

/// Figure 7: quite other root trajectories between the same keyframes.
pub fn figure_7(
    stage: &Stage,
    model: &dyn Generator,
    plain: &[Generated],
) -> Result<Figure, ReportError> {
    let paths: [(&str, &[f64]); 3] = [
        ("to the left", &[1.0]),
        ("to the right", &[-1.0]),
        ("to and fro", &[1.0, -1.0]),
    ];
    let mut numbers = Numbers::default();
    let mut rows = vec![row_with_paths("as recorded", &plain[0], PathView::Above)];
    let mut results: Vec<(&str, Vec<Generated>)> = Vec::new();
    let mut answers = Vec::new();
    for (label, sides) in paths {
        let generated = stage.generate(model, |request| detour(request, sides))?;
        rows.push(row_with_paths(label, &generated[0], PathView::Above));
        let response = responses(&generated, plain);
        record(&mut numbers, label, response);
        answers.push(response);
        results.push((label, generated));
    }
    let mut all = vec![("as recorded", plain)];
    all.extend(results.iter().map(|(label, result)| (*label, &result[..])));
    let mut distances = Vec::new();
    for (index, (label, generated)) in all.iter().enumerate() {
        for (other, against) in &all[..index] {
            let distance = mean_body_distance(generated, against);
            let pair = format!("{label} / {other}");
            numbers.add(&pair, "body_distance", distance, "cm");
            distances.push(distance);
        }
    }
    stage.count(&mut numbers);
    let apart = mean(distances);
    numbers.add("all windows", "body_distance_mean_of_pairs", apart, "cm");
    let shares: Vec<String> = answers.iter().map(|it| percent(it.share())).collect();
    let caption = format!(
        "Figure 7. One transition on the recorded and three other root trajectories, all else the \
         same, every {EVERY} frames: {} the root gives {} of the changes, the bodies of two \
         results are {apart:.1} cm a joint apart; {}.",
        stage.measured_on(),
        shares.join(", "),
        verdict(model.name(), "the root trajectory", &answers)
    );
    let title = stage.title("Figure 7", model.name());
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Every(EVERY));
    Figure::of_dancers("figure_7", drawing, numbers)
}

/// A trajectory from keyframe to keyframe that leads aside, once for each of `sides` (+1 to the
/// left of the way, -1 to the right). Heights stay.
fn detour(request: SequenceRequest, sides: &[f64]) -> Result<SequenceRequest, SynthesisError> {
    let roots = request.keyframe_roots();
    let (from, to) = (roots[0], roots[1]);
    let way = (to - from) * DVec3::new(1.0, 0.0, 1.0);
    // A dancer that comes back to its place goes aside along x.
    let aside = way.cross(DVec3::NEG_Y).try_normalize().unwrap_or(DVec3::X);
    let mut points = vec![from];
    for (index, side) in sides.iter().enumerate() {
        let share = (index + 1) as f64 / (sides.len() + 1) as f64;
        points.push(from + share * way + DETOUR * side * aside);
    }
    points.push(to);
    let mut path = smooth_curve(&points, request.frames(), &Speed::Constant);
    for (place, recorded) in path.iter_mut().zip(request.root_trajectory.rows()) {
        place.y = recorded[1];
    }
    Ok(request.on_path(&path)?.0)
}

/// Root distances from the target in the predicted frames, cm.
fn root_distances(generated: &Generated) -> impl Iterator<Item = f64> {
    let pairs = generated.roots().into_iter().zip(generated.target());
    pairs.skip(1).map(|(root, target)| root.distance(target))
}

/// Their mean.
pub fn root_distance(generated: &Generated) -> f64 {
    mean(root_distances(generated))
}

/// A row of dancers with its root trajectories beside it.
pub fn row_with_paths(label: &str, generated: &Generated, view: PathView) -> MotionRow {
    MotionRow {
        paths: Some(RootPaths {
            view,
            target_label: "root asked for",
            target: generated.target(),
            generated: generated.roots(),
        }),
        ..generated.row(label)
    }
}

fn responses(changed: &[Generated], plain: &[Generated]) -> Response {
    Response::mean(changed.iter().zip(plain).map(|(changed, plain)| {
        let of = |generated: &Generated| generated.request.root_trajectory.clone();
        root_response(
            (of(changed).view(), changed.frames.view()),
            (of(plain).view(), plain.frames.view()),
        )
    }))
}

/// Mean over the windows of the distance between two results, cm a joint.
pub fn mean_body_distance(a: &[Generated], b: &[Generated]) -> f64 {
    let pairs = a.iter().zip(b);
    mean(pairs.map(|(a, b)| body_distance(a.frames.view(), b.frames.view())))
}

fn record(numbers: &mut Numbers, label: &str, response: Response) {
    numbers.add(label, "root_change_asked", response.asked, "cm");
    numbers.add(label, "root_change_measured", response.measured, "cm");
    numbers.add(label, "root_change_share", response.share(), "");
}
