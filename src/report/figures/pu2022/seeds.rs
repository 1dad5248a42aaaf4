//! Figure 8: the same music and key poses after two seeds.

use super::stage::{Positions, Stage};
use crate::evaluation::music_dance::consistency::distance_about_root;
use crate::evaluation::music_dance::{SEED, key_frames};
use crate::models::Generator;
use crate::report::figures::{Figure, Numbers};
use crate::report::{MotionFigure, MusicStrip, ReportError, Shown};

/// Frames from one drawn dancer to the next: each third is a key pose.
const EVERY: usize = 15;

/// The recorded dance, and what the model makes of its key poses and its music after its seed and
/// after another.
///
/// # Errors
/// The model fails.
pub fn figure_8(stage: &Stage, model: &dyn Generator) -> Result<Figure, ReportError> {
    let recorded = stage.recorded();
    let own = stage.question(model)?;
    let requests = [stage.with_other_seed(&own)?, own];
    let [other, own] = requests.map(|request| stage.answer(model, &request));
    let (own, other) = (own?, other?);
    let mut numbers = Numbers::default();
    let mut missed = |row: &str, made: &Positions| {
        let keys = key_frames(stage.frames());
        let distances = keys.map(|key| distance_about_root(&recorded[key], &made[key]));
        let miss = mean(distances);
        numbers.add(row, "key_pose_error", miss, "cm");
        miss
    };
    let misses = [missed("first seed", &own), missed("second seed", &other)];
    let pairs = own.iter().zip(&other).skip(SEED);
    let apart = mean(pairs.map(|(a, b)| distance_about_root(a, b)));
    numbers.add("both seeds", "joint_distance", apart, "cm");
    let caption = format!(
        "Figure 8. One song and its key poses (framed) as recorded and as {} dances them after two \
         seeds, every {EVERY} frames: the recorded one, and {}, turned and moved to end where that \
         one does. Mean joint distance about the root at the key poses {:.1} and \
         {:.1}\u{a0}cm, between the two dances {apart:.1}\u{a0}cm.",
        model.name(),
        stage.other_seed(),
        misses[0],
        misses[1]
    );
    let rows = vec![
        stage.row("Recorded", recorded, false),
        stage.row("First seed", own, true),
        stage.row("Second seed", other, true),
    ];
    let shown = Shown::From {
        first: EVERY - 1,
        every: EVERY,
    };
    let title = format!("Figure 8: {} on {}", model.name(), stage.describe());
    let drawing = MotionFigure {
        music: Some(MusicStrip {
            onset: stage.onset(),
            beats: stage.beats(),
        }),
        ..MotionFigure::on_own_paths(title, caption, rows, shown)
    };
    Figure::of_dancers("figure_8", drawing, numbers)
}

/// NaN of none.
fn mean(distances: impl Iterator<Item = f64>) -> f64 {
    let distances: Vec<f64> = distances.collect();
    distances.iter().sum::<f64>() / distances.len() as f64
}
