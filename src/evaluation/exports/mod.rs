//! The protocol `exports`: motions as `generate` writes them with its feet pinned, by what an
//! animator sees: feet on the floor, and jerk. No paper has it.

use glam::DVec3;

use crate::data::{DataPart, Dataset};
use crate::evaluation::protocol::{Evaluation, EvaluationError, Protocol};
use crate::evaluation::scores::{ScoreRow, Scores};
use crate::evaluation::transitions::TransitionScoring;
use crate::evaluation::windows::{bad, failed, in_chunks, left_out};
use crate::evaluation::{Better, Metric};
use crate::models::Generator;
use crate::models::transition::{DanceClip, Window};
use crate::motion::contact::FootTravel;
use crate::motion::{Feet, Floor};
use crate::synthesis::{SequenceRequest, SynthesisError, SynthesisOptions, synthesise};

/// Windows of each length, unless others are asked for: fitting rotations takes its time.
const WINDOWS: usize = 100;

const fn metric(key: &'static str, title: &'static str, unit: &'static str) -> Metric {
    Metric {
        key,
        title,
        unit,
        better: Better::Lower,
        decimals: 2,
        about: "",
    }
}

const METRICS: [Metric; 7] = [
    Metric {
        about: "how far a toe within 3 cm of the floor, the lowest that the recorded toes come, \
                moves in a frame, before the feet are pinned, cm/frame",
        ..metric("foot_skate", "foot skate", "cm/frame")
    },
    Metric {
        about: "the same after the feet are pinned, cm/frame",
        ..metric("foot_skate_pinned", "foot skate, pinned", "cm/frame")
    },
    Metric {
        about: "the same of the recorded motion, cm/frame",
        ..metric("foot_skate_recorded", "foot skate, recorded", "cm/frame")
    },
    Metric {
        about: "how far the lowest toe of all windows goes into the floor before the feet are \
                pinned, cm",
        ..metric("into_floor", "into the floor", "cm")
    },
    Metric {
        about: "the same after the feet are pinned, cm",
        ..metric("into_floor_pinned", "into the floor, pinned", "cm")
    },
    Metric {
        about: "length of the third difference of positions, a mean over frames and joints, after \
                the feet are pinned, cm/frame^3",
        ..metric("jerk_pinned", "jerk, pinned", "cm/frame^3")
    },
    Metric {
        about: "the same of the recorded motion, cm/frame^3",
        ..metric("jerk_recorded", "jerk, recorded", "cm/frame^3")
    },
];

/// What an animator sees of transitions between recorded frames: N frames from one keyframe to the
/// next, with the recorded root trajectory and velocity factors, fitted, bent onto the keyframes,
/// the feet pinned. On at most 100 windows of each length, spread evenly over all.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Exports(pub TransitionScoring);

/// What is measured of one window.
struct Seen {
    /// Before the feet are pinned, after it, recorded.
    travel: [FootTravel; 3],
    /// Before the feet are pinned and after it, cm.
    into_floor: [f64; 2],
    /// After the feet are pinned, and recorded: sum and number.
    jerk: [(f64, usize); 2],
}

impl Exports {
    fn windows(&self, recordings: &[usize], length: usize) -> (Vec<Window>, Vec<usize>) {
        let scoring = TransitionScoring {
            most_windows: self.0.most_windows.or(Some(WINDOWS)),
            ..self.0.clone()
        };
        scoring.cut(recordings, length + 1)
    }
}

impl Protocol for Exports {
    fn name(&self) -> &'static str {
        "exports"
    }

    fn about(&self) -> &'static str {
        "motions as they are exported, with their feet pinned"
    }

    fn metrics(&self) -> &[Metric] {
        &METRICS
    }

    fn lengths(&self) -> &[usize] {
        &self.0.lengths
    }

    fn frames(&self, recordings: &[usize]) -> u64 {
        let lengths = self.0.lengths.iter();
        let frames = lengths.map(|&it| self.windows(recordings, it).0.len() * (it + 1));
        frames.sum::<usize>() as u64
    }

    fn evaluate(
        &self,
        subject: &dyn Generator,
        data: &Dataset,
        part: DataPart,
    ) -> Result<Evaluation, EvaluationError> {
        let clips = DanceClip::measure_all(part.of(data)?, &self.0.features);
        let clips = clips.map_err(|error| bad(error.to_string()))?;
        let recordings: Vec<usize> = clips.iter().map(DanceClip::frames).collect();
        let (mut seen, mut warnings) = (Vec::new(), Vec::new());
        for &length in &self.0.lengths {
            let (windows, skipped) = self.windows(&recordings, length);
            if windows.is_empty() {
                return Err(EvaluationError::NoWindows {
                    length,
                    needed: length + 1,
                    clips: clips.len(),
                    longest: recordings.iter().copied().max().unwrap_or(0),
                });
            }
            let warning = |clip: usize| {
                let frames = recordings[clip];
                left_out(&clips[clip].name, frames, length + 1, length)
            };
            warnings.extend(skipped.into_iter().map(warning));
            let of_chunk = |chunk: &[Window]| {
                let windows = chunk.iter();
                windows
                    .map(|window| see(subject, &clips[window.clip], window.start, length))
                    .collect()
            };
            seen.push((length, in_chunks(&windows, 1, of_chunk)?));
        }
        let counts = seen.iter().map(|(length, windows)| (length, windows.len()));
        Ok(Evaluation {
            scores: Scores::new(rows(&seen), counts),
            warnings,
        })
    }
}

/// Makes the motion of one window and looks at it.
fn see(
    subject: &dyn Generator,
    clip: &DanceClip,
    start: usize,
    length: usize,
) -> Result<Seen, EvaluationError> {
    let end = start + length;
    let what = || format!("{}, frames {start} to {end}", clip.name);
    let unusable = |error: SynthesisError| match error {
        SynthesisError::Transition { source, .. } => failed(subject, &what(), *source),
        error => bad(format!("{}: {error}", what())),
    };
    let request = SequenceRequest::from_clip(clip, &[start, end]).map_err(unusable)?;
    let options = SynthesisOptions { foot_cleanup: true };
    let made = synthesise(subject, &request, &options, &clip.name).map_err(unusable)?;
    let missing = || bad(format!("{}: the skeleton has no feet", clip.name));
    let feet = made.feet.ok_or_else(missing)?;
    let world = |of: &DanceClip| {
        let poses = &of.clip.poses[start..=end];
        of.clip.skeleton.world_positions(poses)
    };
    let recorded = world(clip);
    let joints = Feet::of(&clip.clip.skeleton).map_err(|_| missing())?;
    let floor = Floor::under(&recorded, &joints);
    let made = made.clip.skeleton.world_positions(&made.clip.poses);
    let into_floor = |lowest: f64| (-lowest).max(0.0);
    Ok(Seen {
        travel: [
            feet.before.travel,
            feet.after.travel,
            floor.toe_travel(&recorded, &joints),
        ],
        into_floor: [feet.before.lowest, feet.after.lowest].map(into_floor),
        jerk: [jerk(&made), jerk(&recorded)],
    })
}

/// Lengths of the third differences of all joints' positions: their sum and number.
fn jerk(world: &[Vec<DVec3>]) -> (f64, usize) {
    let of_frames = |frames: &[Vec<DVec3>]| -> f64 {
        let joints = 0..frames[0].len();
        let third = |joint: usize| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|frame| frames[frame][joint]);
            (d - a - 3.0 * (c - b)).length()
        };
        joints.map(third).sum()
    };
    let lengths = world.windows(4);
    let number = lengths.len() * world.first().map_or(0, Vec::len);
    (lengths.map(of_frames).sum(), number)
}

/// The rows of all metrics; one that cannot be told at some length is left out.
fn rows(seen: &[(usize, Vec<Seen>)]) -> Vec<(&'static str, ScoreRow)> {
    let skate = |windows: &[Seen], which: usize| {
        let mut all = FootTravel::default();
        windows.iter().for_each(|it| all.add(it.travel[which]));
        all.mean()
    };
    let into_floor = |windows: &[Seen], which: usize| {
        let depths = windows.iter().map(|it| it.into_floor[which]);
        Some(depths.fold(0.0, f64::max))
    };
    let jerk = |windows: &[Seen], which: usize| {
        let all = windows.iter().map(|it| it.jerk[which]);
        let (sum, number) = all.fold((0.0, 0), |(sum, n), (more, of)| (sum + more, n + of));
        (number > 0).then(|| sum / number as f64)
    };
    let score = |metric: usize, windows: &[Seen]| match metric {
        0..3 => skate(windows, metric),
        3..5 => into_floor(windows, metric - 3),
        _ => jerk(windows, metric - 5),
    };
    let metrics = METRICS.iter().enumerate();
    let told = metrics.filter_map(|(index, metric)| {
        let lengths = seen.iter();
        let row = lengths.map(|(length, windows)| Some((length, score(index, windows)?)));
        let row: Option<Vec<_>> = row.collect();
        Some((metric.key, ScoreRow::new(row?).with_average()))
    });
    told.collect()
}
