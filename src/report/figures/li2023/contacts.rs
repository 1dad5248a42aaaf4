//! Figures 7 to 10: the foot in contact as a control, and where it ends.

use glam::DVec3;

use super::stage::{Positions, Stage, Window};
use crate::data::Dataset;
use crate::models::Generator;
use crate::motion::Foot;
use crate::report::figures::{Figure, Numbers};
use crate::report::{MotionFigure, MotionRow, PathView, ReportError, RootPaths, Shown};

/// Frames from one drawn dancer to the next.
const EVERY: usize = 3;
/// Frames that a foot stands in figures 7 and 8.
const STANDS: usize = 10;
/// Tenths of a window's frames in which both toes stand, for figure 9.
const STANDING: usize = 9;
/// Frames from one window that is looked at to the next.
const STRIDE: usize = 10;

/// Feet that take turns, `frames` in all: the k-th stands as `feet` says, the last to the end.
fn turns<const N: usize>(feet: [Foot; N], frames: usize) -> Vec<Foot> {
    let foot = |frame: usize| feet[(frame / STANDS).min(N - 1)];
    (0..frames).map(foot).collect()
}

fn roots(positions: &Positions) -> Vec<DVec3> {
    positions.iter().map(|joints| joints[0]).collect()
}

/// A row with its root's path beside the recorded one, seen from above or by height.
fn with_paths(window: Window<'_>, label: &str, positions: Positions, view: PathView) -> MotionRow {
    let recorded = window.recorded(positions.len());
    MotionRow {
        paths: Some(RootPaths {
            view,
            target_label: "root recorded",
            target: roots(&recorded),
            generated: roots(&positions),
        }),
        ..window.row(label, positions, true)
    }
}

/// Notes where a row's root ends, from where it began.
fn travel(numbers: &mut Numbers, label: &str, positions: &Positions) {
    let roots = roots(positions);
    let way = roots[roots.len() - 1] - roots[0];
    for (axis, value) in ["x", "y", "z"].into_iter().zip(way.to_array()) {
        numbers.add(label, format!("root_travel_{axis}"), value, "cm");
    }
}

/// Mean distance of two motions' joints from their roots, cm.
fn apart(a: &Positions, b: &Positions) -> f64 {
    let pairs = a.iter().zip(b).flat_map(|(a, b)| {
        let own = a.iter().map(|joint| *joint - a[0]);
        own.zip(b.iter().map(|joint| *joint - b[0]))
    });
    let distances: Vec<f64> = pairs.map(|(a, b)| a.distance(b)).collect();
    distances.iter().sum::<f64>() / distances.len() as f64
}

/// Figure 7: other contacts between the same keyframes.
pub fn figure_7(
    stage: &Stage,
    model: &dyn Generator,
    frames: usize,
) -> Result<Figure, ReportError> {
    use Foot::{Left, Right};
    let window = stage.shown();
    let sequences = [
        ("left, right, left", [Left, Right, Left]),
        ("right, left, right", [Right, Left, Right]),
        ("left, left, right", [Left, Left, Right]),
    ];
    let (mut numbers, mut rows, mut first) = (Numbers::default(), Vec::new(), None);
    let mut said = Vec::new();
    for (label, feet) in sequences {
        let feet = turns(feet, frames);
        let positions = stage.answer(model, window, frames, Some(&feet))?;
        travel(&mut numbers, label, &positions);
        let first = first.get_or_insert_with(|| positions.clone());
        let distance = apart(&positions, first);
        numbers.add(label, "joint_distance_from_first", distance, "cm");
        let end = roots(&positions)[frames - 1].distance(roots(first)[frames - 1]);
        numbers.add(label, "root_distance_from_first_at_end", end, "cm");
        said.push(format!("{distance:.1} and {end:.1}"));
        rows.push(with_paths(window, label, positions, PathView::Above));
    }
    let caption = format!(
        "Figure 7. The same keyframes with three sequences of feet, each foot for {STANDS} frames; \
         root paths beside the recorded one. From the first: mean joint distance about the root, \
         and distance of the root at the end, cm: {}.",
        said[1..].join("; ")
    );
    let title = format!("Figure 7: {} on {}", model.name(), window.describe(frames));
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Every(EVERY));
    Figure::of_dancers("figure_7", drawing, numbers)
}

/// Figure 8: the same contacts between other keyframes.
pub fn figure_8(
    stage: &Stage,
    model: &dyn Generator,
    frames: usize,
) -> Result<Figure, ReportError> {
    use Foot::{Left, Right};
    let feet = turns([Left, Right, Left], frames);
    let (mut numbers, mut rows) = (Numbers::default(), Vec::new());
    for (number, &window) in stage.windows.iter().take(2).enumerate() {
        let positions = stage.answer(model, window, frames, Some(&feet))?;
        travel(&mut numbers, &window.describe(frames), &positions);
        let label = format!("keyframes {}", number + 1);
        rows.push(with_paths(window, &label, positions, PathView::Above));
    }
    let shown: Vec<String> = stage
        .windows
        .iter()
        .take(2)
        .map(|it| it.describe(frames))
        .collect();
    let caption = format!(
        "Figure 8. Left, right and left foot for {STANDS} frames each between two pairs of \
         keyframes: {}; root paths beside the recorded ones.",
        shown.join("; ")
    );
    let title = format!("Figure 8: {}", model.name());
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Every(EVERY));
    Figure::of_dancers("figure_8", drawing, numbers)
}

/// Figure 9: both feet on the ground, told as the left and as the right.
pub fn figure_9(
    stage: &Stage,
    dataset: &Dataset,
    model: &dyn Generator,
    frames: usize,
) -> Result<Figure, ReportError> {
    let window = most(dataset, frames, |window| {
        let (positions, toes) = (window.recorded(frames), window.feet()?.toes);
        let slow = |pair: &&[Vec<DVec3>]| {
            toes.iter().all(|&toe| {
                let squared = pair[1][toe].distance_squared(pair[0][toe]);
                squared < stage.features.contact_threshold
            })
        };
        let stands = positions.windows(2).filter(slow).count();
        let steps = positions.windows(2);
        let way: f64 = steps.map(|pair| pair[1][0].distance(pair[0][0])).sum();
        Ok(match stands >= STANDING * (frames - 1) / 10 {
            true => way,
            // Where no window stands enough, the one that stands most.
            false => stands as f64 - frames as f64,
        })
    })?;
    let (mut numbers, mut rows) = (Numbers::default(), vec![window.truth(frames)]);
    let mut motions = Vec::new();
    for (label, foot) in [("left foot", Foot::Left), ("right foot", Foot::Right)] {
        let positions = stage.answer(model, window, frames, Some(&vec![foot; frames]))?;
        travel(&mut numbers, label, &positions);
        rows.push(with_paths(
            window,
            label,
            positions.clone(),
            PathView::Above,
        ));
        motions.push(positions);
    }
    let [bodies, end] = [
        apart(&motions[0], &motions[1]),
        motions[0][frames - 1][0].distance(motions[1][frames - 1][0]),
    ];
    numbers.add("left and right", "joint_distance", bodies, "cm");
    numbers.add("left and right", "root_distance_at_end", end, "cm");
    let caption = format!(
        "Figure 9. Both feet on the ground, told as the left one and as the right one: bodies \
         differ by {bodies:.1} cm a joint, roots by {end:.1} cm at the end. Of the test transitions \
         in which both toes stand, the one whose root moves most."
    );
    let title = format!("Figure 9: {} on {}", model.name(), window.describe(frames));
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Every(EVERY));
    Figure::of_dancers("figure_9", drawing, numbers)
}

/// Figure 10: a jump, which no foot in contact can say.
pub fn figure_10(
    stage: &Stage,
    dataset: &Dataset,
    model: &dyn Generator,
    frames: usize,
) -> Result<Figure, ReportError> {
    let window = most(dataset, frames, |window| {
        let (positions, toes) = (window.recorded(frames), window.feet()?.toes);
        let lower = |joints: &Vec<DVec3>| joints[toes[0]].y.min(joints[toes[1]].y);
        let ends = lower(&positions[0]).max(lower(&positions[frames - 1]));
        let highest = positions
            .iter()
            .map(lower)
            .fold(f64::NEG_INFINITY, f64::max);
        Ok(highest - ends)
    })?;
    let positions = stage.answer(model, window, frames, None)?;
    let rise = |positions: &Positions| {
        let start = positions[0][0].y;
        let heights = positions.iter().map(|joints| joints[0].y - start);
        heights.fold(f64::NEG_INFINITY, f64::max)
    };
    let [recorded, own] = [rise(&window.recorded(frames)), rise(&positions)];
    let mut numbers = Numbers::default();
    numbers.add("Ground truth", "root_rise", recorded, "cm");
    numbers.add(model.name(), "root_rise", own, "cm");
    let rows = vec![
        window.truth(frames),
        with_paths(window, model.name(), positions, PathView::Height),
    ];
    let caption = format!(
        "Figure 10. The highest jump of the test clips: the root rises by {recorded:.1} cm, and \
         by {own:.1} cm as {} has it, where one foot always counts as standing.",
        model.name()
    );
    let title = format!("Figure 10: {} on {}", model.name(), window.describe(frames));
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Every(EVERY));
    Figure::of_dancers("figure_10", drawing, numbers)
}

/// The first window of the test clips, one every few frames, of which `measure` gives most.
fn most<'d>(
    dataset: &'d Dataset,
    frames: usize,
    measure: impl Fn(Window<'d>) -> Result<f64, ReportError>,
) -> Result<Window<'d>, ReportError> {
    let mut best: Option<(f64, Window)> = None;
    for recording in &dataset.test {
        let clip = &recording.clip;
        let starts = 0..(clip.poses.len() + 1).saturating_sub(frames);
        for start in starts.step_by(STRIDE) {
            let window = Window { clip, start };
            let value = measure(window)?;
            if best.as_ref().is_none_or(|(most, _)| value > *most) {
                best = Some((value, window));
            }
        }
    }
    let none = || ReportError::Refused("no test clip is long enough".into());
    best.map(|(_, window)| window).ok_or_else(none)
}
