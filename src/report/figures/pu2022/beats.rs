//! Figures 7 and 9: whether dances move to the beat of their music.

use super::stage::Stage;
use crate::evaluation::music_dance::SEED;
use crate::evaluation::music_dance::beats::{joint_speed, motion_beats};
use crate::evaluation::{PrintedTables, Scores};
use crate::models::Generator;
use crate::report::chart::{Axis, Chart, Line};
use crate::report::figures::{Figure, FigureRequest, Numbers};
use crate::report::{BeatCurve, BeatCurveKind, BeatFigure, ReportError};

/// The rows of figure 7: name and metric.
const RATES: [(&str, &str); 3] = [
    ("real", "beat_hit_rate_real"),
    ("generated", "beat_hit_rate"),
    ("chance", "beat_hit_rate_chance"),
];
/// Frames within which figure 9 counts a hit: the delta whose rates figure 7's caption says.
const DELTA: usize = 2;

/// Figure 7: beat hit rates over delta.
///
/// # Errors
/// There is no rate, or one is not finite.
pub fn figure_7(
    asked: &FigureRequest<'_>,
    scores: &Scores,
    printed: &PrintedTables,
) -> Result<Figure, ReportError> {
    let name = &asked.subject.config.name;
    let (mut lines, mut numbers, mut said) = (Vec::new(), Numbers::default(), Vec::new());
    let paper = printed.row(name);
    for (colour, (row, metric)) in RATES.into_iter().enumerate() {
        let Some(rates) = scores.row(metric) else {
            continue;
        };
        let points = points(rates.columns().filter_map(|it| Some((it, rates.at(it)?))));
        for (delta, rate) in &points {
            numbers.add(row, format!("beat_hit_rate_within_{delta}"), *rate, "%");
        }
        let within = rates.at(DELTA);
        said.extend(within.map(|rate| format!("{row} {rate:.1}\u{a0}%")));
        lines.push(Line {
            name: row.into(),
            emphasised: true,
            dots: true,
            ..Line::plain(points, colour)
        });
        if let Some(values) = paper.and_then(|paper| paper.values.get(metric)) {
            let columns = printed.columns_of(metric).iter().map(String::as_str);
            lines.push(Line {
                name: format!("{row}, paper"),
                dashed: true,
                ..Line::plain(self::points(columns.zip(values.iter().copied())), colour)
            });
        }
    }
    let mut caption = format!(
        "Figure 7. Beat hit rate of {name} on the test clips over δ; within {DELTA} frames: {}. \
         Chance: the recorded dances with shifted beats. The rate is hits over beats of the music, \
         so a motion with more beats of its own has a higher one by chance.",
        said.join(", ")
    );
    let dashed = lines.iter().any(|line| line.dashed);
    if let Some(note) = printed.note.as_ref().filter(|_| dashed) {
        caption += &format!(" {note}");
    }
    let svg = Chart {
        title: format!("Figure 7: beat hit rate of {name}"),
        caption: caption.clone(),
        x: Axis::linear("δ (frames at 30 a second)"),
        y: Axis::linear("beat hit rate (%)"),
        lines,
    }
    .svg()?;
    Ok(Figure {
        name: "figure_7",
        caption,
        svg,
        numbers,
    })
}

fn points<'c>(columns: impl Iterator<Item = (&'c str, f64)>) -> Vec<(f64, f64)> {
    let points = columns.filter_map(|(delta, rate)| Some((delta.parse().ok()?, rate)));
    points.collect()
}

/// Figure 9: speed of the recorded and the generated dance over the onsets of their music.
///
/// # Errors
/// The model fails.
pub fn figure_9(stage: &Stage, model: &dyn Generator) -> Result<Figure, ReportError> {
    let made = stage.answer(model, &stage.question(model)?)?;
    let beats = stage.beats();
    let after = beats.iter().filter(|beat| **beat >= SEED).count();
    let mut numbers = Numbers::default();
    let mut said = Vec::new();
    let mut curve = |kind, label: &str, world| {
        let values = joint_speed(world);
        let dots = motion_beats(&values, stage.motion_beats);
        let own = dots.iter().filter(|dot| **dot >= SEED);
        let near = |dot: &&usize| beats.iter().any(|beat| beat.abs_diff(**dot) <= DELTA);
        let (count, hits) = (own.clone().count(), own.filter(near).count());
        numbers.add(label, "motion_beats", count as f64, "");
        numbers.add(label, "motion_beats_hit", hits as f64, "");
        let mean = values[SEED..].iter().sum::<f64>() / (values.len() - SEED) as f64;
        numbers.add(label, "speed_mean", mean, "cm/s");
        if kind == BeatCurveKind::Generated {
            numbers.add_series(label, "speed", SEED, &values[SEED..], "cm/s");
        }
        said.push(format!("{hits} of {count} {label}"));
        BeatCurve {
            kind,
            label: label.into(),
            unit: "speed, cm/s",
            values,
            dots,
        }
    };
    let mut curves = vec![
        curve(BeatCurveKind::Recorded, "recorded", &stage.recorded()),
        curve(BeatCurveKind::Generated, "generated", &made),
    ];
    curves.push(BeatCurve {
        kind: BeatCurveKind::Music,
        label: "music".into(),
        unit: "onsets, dB",
        values: stage.onset(),
        dots: Vec::new(),
    });
    numbers.add("music", "beats", after as f64, "");
    let caption = format!(
        "Figure 9. Mean speed of the joints (smoothed) of the recorded dance and of {}'s over the \
         onset strength of the music. Beats of a motion are the {} of its speed; after the seed, \
         within {DELTA} frames of one of {after} music beats: {}.",
        model.name(),
        stage.motion_beats,
        said.join(", ")
    );
    let svg = BeatFigure {
        title: format!("Figure 9: {} on {}", model.name(), stage.describe()),
        caption: caption.clone(),
        curves,
        beats,
        seed: SEED,
    }
    .svg()?;
    Ok(Figure {
        name: "figure_9",
        caption,
        svg,
        numbers,
    })
}
