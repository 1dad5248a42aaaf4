//! The protocol `likelihood`: bits a frame of recorded frames, by what a model knows before them.

use ndarray::Array2;

use super::asked::{Sampler, are_novel, music_of};
use crate::data::{DataPart, Dataset, Recording, Window, WindowCut};
use crate::evaluation::protocol::{Evaluation, EvaluationError, EvaluationOptions, Protocol};
use crate::evaluation::windows::{bad, failed, in_chunks, left_out, spread};
use crate::evaluation::{Better, Metric, ScoreRow, Scores};
use crate::models::generator::{Given, Motion, Request};
use crate::models::{Generator, ModelError};

/// Windows that a model is asked about in one call.
const CHUNK: usize = 16;
/// Frames from one window to the next.
const EVERY: usize = 2;
const ALL: &str = "all";
const NOVEL: &str = "novel";

const fn metric(key: &'static str, title: &'static str, about: &'static str) -> Metric {
    Metric {
        key,
        title,
        unit: "bits a frame",
        better: Better::Lower,
        decimals: 1,
        about,
    }
}

const METRICS: [Metric; 4] = [
    metric(
        "bits",
        "-log2 p",
        "of the next frames together, divided by their number, of standardised columns (spec, \
         section 6); of the deterministic model by a normal distribution of deviation 1",
    ),
    Metric {
        better: Better::Higher,
        ..metric(
            "bits_foreign_latent",
            "-log2 p, latent of another window",
            "the same where the network knows the past and the music of another window: far worse \
             unless it ignores them",
        )
    },
    Metric {
        better: Better::Higher,
        ..metric(
            "bits_foreign_music",
            "-log2 p, music of another window",
            "the same with the music of another window",
        )
    },
    Metric {
        better: Better::Neither,
        ..metric(
            "bits_without_music",
            "-log2 p, no music",
            "the same with music whose standardised numbers are all 0",
        )
    },
];

/// Likelihood of recorded frames under a model that samples (spec of Valle-Pérez et al., section 6):
/// every second window of each clip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Likelihood {
    most_windows: Option<usize>,
}

impl Likelihood {
    pub fn new(options: &EvaluationOptions) -> Self {
        Self {
            most_windows: options.most_windows,
        }
    }
}

/// A window's request and what was recorded there.
struct Question {
    request: Request,
    truth: Motion,
    novel: bool,
}

/// Nats of a window in the four ways that it is asked about.
struct Answer {
    nats: [f64; 4],
    novel: bool,
}

fn question(
    sampler: &Sampler,
    recording: &Recording,
    music: Option<&Array2<f64>>,
    start: usize,
    novel: bool,
) -> Result<Question, ModelError> {
    let clip = &recording.clip;
    let frames = sampler.seed + sampler.predicted;
    // The frame before, where there is one: the first frame's steps are then known.
    let given = |frame: i64| {
        let at = start.checked_add_signed(frame as isize)?;
        Some(Given {
            frame,
            pose: clip.poses.get(at)?.clone(),
            features: None,
        })
    };
    let heard = start..start + sampler.window();
    Ok(Question {
        request: Request {
            given: (-1..sampler.seed as i64).filter_map(given).collect(),
            music: music.map(|it| it.slice(ndarray::s![heard, ..]).to_owned()),
            ..Request::new(clip.skeleton.clone(), clip.frame_time, frames)
        },
        truth: Motion::recorded(clip, start..start + frames)?,
        novel,
    })
}

impl Protocol for Likelihood {
    fn name(&self) -> &'static str {
        "likelihood"
    }

    fn about(&self) -> &'static str {
        "every second window of each clip"
    }

    fn metrics(&self) -> &[Metric] {
        &METRICS
    }

    fn frames(&self, recordings: &[usize]) -> u64 {
        let windows: usize = recordings.iter().map(|it| it / EVERY).sum();
        let windows = self.most_windows.map_or(windows, |most| most.min(windows));
        (METRICS.len() * windows) as u64
    }

    fn evaluate(
        &self,
        subject: &dyn Generator,
        data: &Dataset,
        part: DataPart,
    ) -> Result<Evaluation, EvaluationError> {
        let sampler = Sampler::of(subject)?;
        let recordings = part.of(data)?;
        let frames: Vec<usize> = recordings.iter().map(Recording::frames).collect();
        let cut = WindowCut {
            frames: sampler.window(),
            every: EVERY,
            strictly: false,
        };
        let windows = spread(cut.windows(&frames), self.most_windows);
        if windows.is_empty() {
            return Err(bad(format!(
                "no clip has the {} frames of a window, the longest has {}; give longer clips",
                cut.frames,
                frames.iter().max().unwrap_or(&0)
            )));
        }
        let music = recordings.iter().map(|it| music_of(subject, it));
        let music = music.collect::<Result<Vec<_>, _>>()?;
        // The partner of a window is the one half a round further.
        let partner = |index: usize| (index + windows.len() / 2) % windows.len();
        let ask = |index: usize, music_from: usize| {
            let Window { clip, start } = windows[index];
            let recording = &recordings[clip];
            let other = windows[music_from];
            let own = index == music_from;
            let novel = are_novel(data, recording, start + sampler.seed, sampler.predicted);
            let asked = question(&sampler, recording, music[clip].as_ref(), start, novel);
            let asked = asked.map(|mut asked| {
                if !own && let Some(heard) = &music[other.clip] {
                    let rows = other.start..other.start + sampler.window();
                    asked.request.music = Some(heard.slice(ndarray::s![rows, ..]).to_owned());
                }
                asked
            });
            asked.map_err(|source| failed(subject, recording.name(), source))
        };
        let indices: Vec<usize> = (0..windows.len()).collect();
        let of_chunk = |indices: &[usize]| {
            let all = |ask: &dyn Fn(usize) -> Result<Question, EvaluationError>| {
                indices
                    .iter()
                    .map(|&index| ask(index))
                    .collect::<Result<Vec<_>, _>>()
            };
            let own = all(&|index| ask(index, index))?;
            let others = all(&|index| ask(partner(index), partner(index)))?;
            let foreign = all(&|index| ask(index, partner(index)))?;
            let split = |questions: Vec<Question>| -> (Vec<Request>, Vec<Motion>, Vec<bool>) {
                let mut split = (Vec::new(), Vec::new(), Vec::new());
                for question in questions {
                    split.0.push(question.request);
                    split.1.push(question.truth);
                    split.2.push(question.novel);
                }
                split
            };
            let (requests, truths, novel) = split(own);
            let (others, ..) = split(others);
            let (foreign, ..) = split(foreign);
            let silent: Vec<Request> = requests
                .iter()
                .map(|request| Request {
                    music: None,
                    ..request.clone()
                })
                .collect();
            let failed = |source| failed(subject, "its likelihood", source);
            let own = subject
                .log_likelihoods(&requests, &truths)
                .map_err(failed)?;
            let by = |known: &[Request]| {
                let nats = subject.log_likelihoods_knowing(known, &requests, &truths);
                nats.map_err(failed)
            };
            let ways = [own, by(&others)?, by(&foreign)?, by(&silent)?];
            Ok((0..requests.len())
                .map(|k| Answer {
                    nats: [0, 1, 2, 3].map(|way| ways[way].get(k).copied().unwrap_or(f64::NAN)),
                    novel: novel[k],
                })
                .collect())
        };
        let answers = in_chunks(&indices, CHUNK, of_chunk)?;
        let bits = -1.0 / (sampler.predicted as f64 * std::f64::consts::LN_2);
        let mean = |way: usize, novel: bool| {
            let chosen = answers.iter().filter(|it| it.novel || !novel);
            let nats: Vec<f64> = chosen.map(|it| it.nats[way]).collect();
            bits * nats.iter().sum::<f64>() / nats.len() as f64
        };
        let with_novel = answers.iter().filter(|it| it.novel).count();
        let columns = |way: usize| {
            let mut columns = vec![(ALL, mean(way, false))];
            if with_novel > 0 {
                columns.push((NOVEL, mean(way, true)));
            }
            ScoreRow::new(columns)
        };
        let rows = METRICS.iter().enumerate();
        let rows = rows.map(|(way, metric)| (metric.key, columns(way)));
        let mut counts = vec![(ALL, answers.len())];
        if with_novel > 0 {
            counts.push((NOVEL, with_novel));
        }
        let short = cut.too_short(&frames).into_iter();
        let warning = |clip: usize| {
            left_out(
                recordings[clip].name(),
                frames[clip],
                cut.frames,
                sampler.predicted,
            )
        };
        Ok(Evaluation {
            scores: Scores::new(rows, counts),
            warnings: short.map(warning).collect(),
        })
    }
}
