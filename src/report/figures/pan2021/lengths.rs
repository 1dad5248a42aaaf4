//! Figure 10: the same keyframes with more and more frames between them.

use super::root::mean_body_distance;
use super::stage::{Generated, Stage};
use super::velocity::{asked_after, mean_parts};
use super::wording::{mean, percent};
use crate::models::Generator;
use crate::models::transition::effect::{FOLLOWED, mean_velocity_factors};
use crate::report::figures::{Figure, Numbers};
use crate::report::{MotionFigure, MotionRow, ReportError, Shown};
use ndarray::s;

/// Transition lengths of the paper's figure, frames.
const LENGTHS: [usize; 4] = [100, 150, 200, 250];
/// Dancers a row, as in the paper.
const DANCERS: usize = 25;

/// The trajectory is gone in more time, the velocity factors keep their values.
pub fn figure_10(stage: &Stage, model: &dyn Generator) -> Result<Figure, ReportError> {
    let name = model.name();
    let mut numbers = Numbers::default();
    let mut rows = Vec::new();
    let mut results: Vec<Vec<Generated>> = Vec::new();
    let mut said = Vec::new();
    let mut stalled = Vec::new();
    for length in LENGTHS {
        let generated = stage.generate(model, |request| request.with_length(length))?;
        let label = format!("N = {length}");
        rows.push(MotionRow::between_keyframes(
            &label,
            generated[0].drawn(),
            true,
        ));
        let mut share = |from: usize, asked: &'static str, found: &'static str| {
            let wanted = mean_parts(&generated, |generated| {
                asked_after(&generated.request, from)
            });
            let measured = mean_parts(&generated, |generated| {
                mean_velocity_factors(generated.frames.slice(s![from.., ..]))
            });
            numbers.add_parts(&label, asked, wanted, "cm/frame");
            numbers.add_parts(&label, found, measured, "cm/frame");
            mean(&measured) / mean(&wanted)
        };
        let whole = share(0, "velocity_factor_mean_asked", "velocity_factor_mean");
        let second = share(
            length / 2,
            "velocity_factor_mean_asked_second_half",
            "velocity_factor_mean_second_half",
        );
        numbers.add(&label, "velocity_factor_share_of_asked", whole, "");
        numbers.add(
            &label,
            "velocity_factor_share_of_asked_second_half",
            second,
            "",
        );
        if let Some(first) = results.first() {
            let distance = mean_body_distance(first, &generated);
            numbers.add(&label, "body_distance_from_N_100", distance, "cm");
            said.push(format!("{distance:.1} cm at {length}"));
        }
        if second < FOLLOWED {
            stalled.push((length, second));
        }
        results.push(generated);
    }
    numbers.add("all windows", "windows", stage.windows().len() as f64, "");
    let ending = if stalled.is_empty() {
        format!(
            "{name} keeps moving: at every length its second half has a third of the speed asked for or more"
        )
    } else {
        let stalled: Vec<String> = stalled
            .iter()
            .map(|(length, share)| format!("N = {length} ({})", percent(*share)))
            .collect();
        format!(
            "{name} stalls: its second half has less than a third of the speed asked for at {}",
            stalled.join(", ")
        )
    };
    let caption = format!(
        "Figure 10. The same keyframes with 100, 150, 200 and 250 frames between them, {DANCERS} frames of each: {} the bodies are apart from those at 100, at the same share \
         of the way, by {} a joint; {ending}.",
        stage.measured_on(),
        said.join(", ")
    );
    let title = stage.title("Figure 10", name);
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Count(DANCERS));
    Figure::of_dancers("figure_10", drawing, numbers)
}
