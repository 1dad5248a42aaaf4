//! Figure 4: how much a frame weighs in the loss.

use super::grid::equals;
use crate::models::pu2022::{LossConfig, Pu2022Settings, WindowConfig, frame_weights};
use crate::report::ReportError;
use crate::report::chart::{Axis, Chart, Line};
use crate::report::figures::{Figure, FigureRequest, Numbers};

/// (lambda, sigma): rising lambda, then rising sigma.
const PAIRS: [(f64, f64); 5] = [
    (1.0, 0.05),
    (3.0, 0.05),
    (5.0, 0.05),
    (5.0, 0.1),
    (5.0, 0.2),
];
/// Key poses of the window, evenly over what is generated.
const KEYS: usize = 4;

/// w_t (eq. 15), as the loss takes it, over the frames after the seed.
pub fn figure_4(asked: &FigureRequest<'_>) -> Result<Figure, ReportError> {
    let settings = asked.subject.config.model.downcast_ref::<Pu2022Settings>();
    let window = settings.map_or_else(WindowConfig::default, |it| it.window.clone());
    let generated = window.generated();
    let keys = (1..=KEYS).map(|key| window.seed - 1 + key * generated / KEYS);
    let keys: Vec<usize> = keys.collect();
    let mut numbers = Numbers::default();
    let mut lines = Vec::new();
    for (colour, (lambda, sigma)) in PAIRS.into_iter().enumerate() {
        let loss = LossConfig {
            lambda,
            sigma,
            ..LossConfig::default()
        };
        let weights = frame_weights(&keys, &window, &loss);
        let row = format!("lambda {lambda}, sigma {sigma}");
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        let most = weights.iter().copied().fold(0.0, f64::max);
        numbers.add(&row, "weight_mean", mean, "");
        numbers.add(&row, "weight_most", most, "");
        let points = (1..)
            .zip(weights)
            .map(|(frame, weight)| (f64::from(frame), weight));
        lines.push(Line {
            name: format!("{}, {}", equals("λ", lambda), equals("σ", sigma)),
            ..Line::plain(points.collect(), colour)
        });
    }
    let places = keys.iter().map(|key| (key + 1 - window.seed).to_string());
    let caption = format!(
        "Figure 4. The weight w_t of a frame in the loss (eq. 15) for pairs of λ and σ, as the \
         training computes it: {generated} frames after a seed of {}, key poses at frames {} of \
         them.",
        window.seed,
        places.collect::<Vec<_>>().join(", ")
    );
    let svg = Chart {
        title: "Figure 4: weight of a frame in the loss".into(),
        caption: caption.clone(),
        x: Axis::linear("frame after the seed"),
        y: Axis::linear("w_t"),
        lines,
    }
    .svg()?;
    Ok(Figure {
        name: "figure_4",
        caption,
        svg,
        numbers,
    })
}
