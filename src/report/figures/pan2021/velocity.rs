//! Figures 4 (b), 8 and 9: velocity factors, measured and as a control.

use super::root::mean_body_distance;
use super::stage::{Generated, Stage};
use super::wording::{mean, percent, verdict};
use crate::models::Generator;
use crate::models::transition::effect::{Response, mean_rows, mean_velocity_factors};
use crate::motion::{PART_NAMES, PARTS, measured_velocity_factors};
use crate::report::chart::{Axis, Chart, Line};
use crate::report::figures::{Figure, Numbers};
use crate::report::{MotionFigure, MotionRow, ReportError, Shown};
use crate::synthesis::{SequenceRequest, SynthesisOptions, synthesise};
use ndarray::s;

/// Frames from one drawn dancer to the next, as in the paper.
const EVERY: usize = 5;
/// What the velocity factors are multiplied by in figure 8.
const GAINS: [f64; 2] = [0.5, 1.5];
/// The same in figure 9, for left leg and right arm.
const PART_GAINS: [f64; PARTS] = [1.0, 1.5, 1.0, 1.5, 1.0];

/// Figure 4 (b): velocity factors along a generated motion, one that passes through its keyframes.
pub fn figure_4b(stage: &Stage, model: &dyn Generator) -> Result<Figure, ReportError> {
    let request = &stage.shown().request;
    let sequence = synthesise(model, request, &SynthesisOptions::default(), model.name())?;
    let factors = measured_velocity_factors(sequence.features.view());
    let measured = mean_velocity_factors(sequence.features.view());
    let wanted = asked(request);
    let mut numbers = Numbers::default();
    let name = model.name();
    numbers.add_factor_series(name, &factors);
    numbers.add_parts(name, "velocity_factor_mean", measured, "cm/frame");
    numbers.add_parts(name, "velocity_factor_mean_asked", wanted, "cm/frame");
    let caption = format!(
        "Figure 4 (b). Velocity factors (eq. 1) of the five body parts along the motion that {name} \
         generates for {}, through its keyframes: {:.2} cm/frame in the mean, {:.2} were asked for.",
        stage.shown().describe(),
        mean(measured),
        mean(wanted)
    );
    let line = |part: usize| {
        let frames = 1..factors.len();
        let points = frames.map(|frame| (frame as f64, factors[frame][part]));
        Line {
            name: PART_NAMES[part].replace('_', " "),
            ..Line::plain(points.collect(), part)
        }
    };
    let svg = Chart {
        title: "Figure 4 (b): velocity factors of a generated motion".into(),
        caption: caption.clone(),
        x: Axis::linear("frame"),
        y: Axis::linear("velocity factor (cm/frame)"),
        lines: (0..PARTS).map(line).collect(),
    }
    .svg()?;
    Ok(Figure {
        name: "figure_4b",
        caption,
        svg,
        numbers,
    })
}

/// Figure 8: all velocity factors times 1.0, 0.5 and 1.5.
pub fn figure_8(
    stage: &Stage,
    model: &dyn Generator,
    plain: &[Generated],
) -> Result<Figure, ReportError> {
    let mut numbers = Numbers::default();
    let mut rows = vec![plain[0].row("factors × 1.0")];
    record_means(&mut numbers, "x 1.0", plain);
    let (mut results, mut answers, mut said) = (Vec::new(), Vec::new(), Vec::new());
    for gain in GAINS {
        let generated = stage.generate(model, |request| request.velocity_times([gain; PARTS]))?;
        rows.push(generated[0].row(&format!("factors × {gain:.1}")));
        let label = format!("x {gain:.1}");
        record_means(&mut numbers, &label, &generated);
        let answer = responses(&generated, plain);
        let shares = answer.map(Response::share);
        numbers.add_parts(&label, "velocity_factor_change_share", shares, "");
        let distance = mean_body_distance(&generated, plain);
        numbers.add(&label, "body_distance_from_x_1.0", distance, "cm");
        said.push(format!(
            "×\u{a0}{gain:.1} gives {} of the change of speed (bodies {distance:.1} cm a joint apart)",
            percent(mean(shares))
        ));
        answers.extend(answer);
        results.push(generated);
    }
    let between = mean_body_distance(&results[0], &results[1]);
    numbers.add("x 0.5 / x 1.5", "body_distance", between, "cm");
    stage.count(&mut numbers);
    let caption = format!(
        "Figure 8. One transition with all velocity factors times 1.0, 0.5 and 1.5, every {EVERY} \
         frames: {}, {}; {}.",
        stage.measured_on(),
        said.join(", "),
        verdict(model.name(), "the velocity factors", &answers)
    );
    let title = stage.title("Figure 8", model.name());
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Every(EVERY));
    Figure::of_dancers("figure_8", drawing, numbers)
}

/// Figure 9: the velocity factors of right arm and left leg times 1.5.
pub fn figure_9(
    stage: &Stage,
    model: &dyn Generator,
    plain: &[Generated],
) -> Result<Figure, ReportError> {
    let faster = stage.generate(model, |request| request.velocity_times(PART_GAINS))?;
    let marked = PART_GAINS.map(|gain| gain != 1.0);
    let rows = vec![
        plain[0].row("(a) as asked in the clip"),
        MotionRow {
            marked,
            ..faster[0].row("(b) right arm, left leg × 1.5")
        },
    ];
    let mut numbers = Numbers::default();
    record_means(&mut numbers, "(a)", plain);
    record_means(&mut numbers, "(b)", &faster);
    let answers = responses(&faster, plain);
    let gained = changes(&faster, plain);
    numbers.add_parts("(b)", "velocity_factor_change", gained, "cm/frame");
    let (mut chosen, mut said) = (Vec::new(), Vec::new());
    for part in (0..PARTS).filter(|&part| marked[part]) {
        let share = answers[part].share();
        numbers.add_part("(b)", "velocity_factor_change_share", part, share);
        let name = PART_NAMES[part].replace('_', " ");
        said.push(format!("the {name} gives {}", percent(share)));
        chosen.push(answers[part]);
    }
    let distance = mean_body_distance(&faster, plain);
    numbers.add("(b) / (a)", "body_distance", distance, "cm");
    stage.count(&mut numbers);
    let others = (0..PARTS).filter(|&part| !marked[part]);
    let caption = format!(
        "Figure 9. One transition, (b) with the velocity factors of right arm and left leg (blue) \
         times 1.5, every {EVERY} frames: {}, of the change asked for {}, the other parts change \
         by {:.2} cm/frame, bodies are {distance:.1} cm a joint apart; {}.",
        stage.measured_on(),
        said.join(" and "),
        mean(others.map(|part| gained[part].abs())),
        verdict(
            model.name(),
            "the velocity factors of single parts",
            &chosen
        )
    );
    let title = stage.title("Figure 9", model.name());
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Every(EVERY));
    Figure::of_dancers("figure_9", drawing, numbers)
}

/// Mean velocity factors that were asked for in the predicted frames, cm/frame.
fn asked(request: &SequenceRequest) -> [f64; PARTS] {
    asked_after(request, 0)
}

/// The same in the frames after frame `from`.
pub fn asked_after(request: &SequenceRequest, from: usize) -> [f64; PARTS] {
    let factors = request.velocity_factors.slice(s![from + 1.., ..]);
    std::array::from_fn(|part| mean(factors.column(part).iter().copied()))
}

/// Mean over the windows of one number a part.
pub fn mean_parts(
    generated: &[Generated],
    of: impl Fn(&Generated) -> [f64; PARTS],
) -> [f64; PARTS] {
    mean_rows(&generated.iter().map(of).collect::<Vec<_>>())
}

fn measured(generated: &Generated) -> [f64; PARTS] {
    mean_velocity_factors(generated.frames.view())
}

/// Change of the measured mean velocity factors, cm/frame.
fn changes(changed: &[Generated], plain: &[Generated]) -> [f64; PARTS] {
    let [after, before] = [changed, plain].map(|of| mean_parts(of, measured));
    std::array::from_fn(|part| after[part] - before[part])
}

/// Changes of mean velocity factors, asked for and measured, in the mean over the windows.
fn responses(changed: &[Generated], plain: &[Generated]) -> [Response; PARTS] {
    std::array::from_fn(|part| {
        Response::mean(changed.iter().zip(plain).map(|(changed, plain)| Response {
            asked: asked(&changed.request)[part] - asked(&plain.request)[part],
            measured: measured(changed)[part] - measured(plain)[part],
        }))
    })
}

fn record_means(numbers: &mut Numbers, label: &str, generated: &[Generated]) {
    let asked = mean_parts(generated, |generated| asked(&generated.request));
    numbers.add_parts(label, "velocity_factor_mean_asked", asked, "cm/frame");
    let measured = mean_parts(generated, measured);
    numbers.add_parts(label, "velocity_factor_mean", measured, "cm/frame");
}
