//! Figure 10: the same keyframes with more and more frames between them.

use super::root::mean_body_distance;
use super::stage::{Generated, Stage};
use super::velocity::{asked_after, mean_parts};
use super::wording::{mean, percent};
use crate::models::Generator;
use crate::models::transition::effect::{FOLLOWED, mean_velocity_factors};
use crate::report::figures::{Figure, Numbers};
use crate::report::{MotionFigure, ReportError, Shown};
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
        rows.push(generated[0].row(&label));
        let mut share = |from: usize, of: &str| {
            let wanted = mean_parts(&generated, |it| asked_after(&it.request, from));
            let measured = mean_parts(&generated, |it| {
                mean_velocity_factors(it.frames.slice(s![from.., ..]))
            });
            let factors = "velocity_factor_mean";
            numbers.add_parts(&label, format!("{factors}_asked{of}"), wanted, "cm/frame");
            numbers.add_parts(&label, format!("{factors}{of}"), measured, "cm/frame");
            mean(measured) / mean(wanted)
        };
        let half = "_second_half";
        let (whole, second) = (share(0, ""), share(length / 2, half));
        let measure = "velocity_factor_share_of_asked";
        numbers.add(&label, measure, whole, "");
        numbers.add(&label, format!("{measure}{half}"), second, "");
        if let Some(first) = results.first() {
            let distance = mean_body_distance(first, &generated);
            numbers.add(&label, "body_distance_from_N_100", distance, "cm");
            said.push(format!("{distance:.1} cm at {length}"));
        }
        if second < FOLLOWED {
            stalled.push(format!("N = {length} ({})", percent(second)));
        }
        results.push(generated);
    }
    stage.count(&mut numbers);
    let ending = match stalled.is_empty() {
        true => format!(
            "{name} keeps moving: at every length its second half has a third of the speed asked \
             for or more"
        ),
        false => format!(
            "{name} stalls: its second half has less than a third of the speed asked for at {}",
            stalled.join(", ")
        ),
    };
    let caption = format!(
        "Figure 10. The same keyframes with 100, 150, 200 and 250 frames between them, {DANCERS} \
         frames of each: {} the bodies are apart from those at 100, at the same share of the way, \
         by {} a joint; {ending}.",
        stage.measured_on(),
        said.join(", ")
    );
    let title = stage.title("Figure 10", name);
    let drawing = MotionFigure::on_own_paths(title, caption, rows, Shown::Count(DANCERS));
    Figure::of_dancers("figure_10", drawing, numbers)
}
