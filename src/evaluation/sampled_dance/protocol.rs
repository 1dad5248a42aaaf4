//! The protocol `sampled_dance`: each song of a part danced from several seeds, and all scores of
//! it.

use ndarray::{Array2, ArrayView2};

use super::asked::{Sampler, music_of};
use super::beat_alignment::{BeatAlignment, Performance};
use super::dances::{Dance, Measure};
use super::frechet::{fmd, fmd_as_published, fpd, fpd_as_published, without};
use super::prompting::{Prompting, Style};
use super::step::mean_step;
use super::{HEIGHT, METRICS, share};
use crate::data::{DataPart, Dataset, Recording};
use crate::evaluation::protocol::{Evaluation, EvaluationError, EvaluationOptions, Protocol};
use crate::evaluation::windows::{bad, failed, in_chunks, spread};
use crate::evaluation::{Metric, ScoreRow, Scores};
use crate::models::generator::{Motion, Request};
use crate::models::{Generator, ModelError};

/// Seeds of every song.
const SEEDS: usize = 5;
/// Dances that a model is asked for in one call.
const CHUNK: usize = 8;
const ALL: &str = "all";
/// Dances to songs that training has heard, and to others.
const HEARD: &str = "heard";
const UNHEARD: &str = "unheard";
const WITHOUT_MUSIC: &str = "no music";

/// How sampled dances are scored (spec of Valle-Pérez et al., sections 1, 7 and 9): each song of the
/// part from 5 seeds, the first frames of its own dance and of the next four by name; the seeds are
/// not scored, nor is what would hear music behind the song's end.
///
/// Dances to songs that training has heard, and to others, are scored apart as well, and each song
/// once without its music.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampledDance {
    most_dances: Option<usize>,
}

impl SampledDance {
    pub fn new(options: &EvaluationOptions) -> Self {
        Self {
            most_dances: options.most_windows,
        }
    }

    fn asked(&self, recordings: usize) -> Vec<Asked> {
        let of_song = |song: usize| {
            (0..SEEDS.min(recordings)).map(move |k| Asked {
                song,
                seed: (song + k) % recordings,
                with_music: true,
            })
        };
        spread(
            (0..recordings).flat_map(of_song).collect(),
            self.most_dances,
        )
    }
}

/// A dance that is asked for: recordings by number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Asked {
    song: usize,
    seed: usize,
    with_music: bool,
}

/// What came of it; none where it diverged.
struct Made {
    asked: Asked,
    dance: Option<Dance>,
}

/// A column: its name, its dances, and recordings by number with what was recorded.
type Group<'m> = (&'static str, Vec<&'m Made>, Vec<(usize, &'m Dance)>);
/// Scores by the keys of their metrics.
type KeyedScores = Vec<(&'static str, f64)>;

struct Stage<'d> {
    model: &'d dyn Generator,
    sampler: Sampler,
    recordings: &'d [Recording],
    music: Vec<Option<Array2<f64>>>,
    measure: Measure,
}

impl Stage<'_> {
    fn request(&self, asked: Asked) -> Request {
        let [song, seed] = [asked.song, asked.seed].map(|it| &self.recordings[it]);
        let music = self.music[asked.song].clone().filter(|_| asked.with_music);
        let drawn = ((asked.song as u64) << 32) | asked.seed as u64;
        self.sampler.question((song, music), seed, drawn)
    }

    fn name(&self, asked: Asked) -> String {
        let [song, seed] = [asked.song, asked.seed].map(|it| self.recordings[it].name());
        format!("a dance to {song} from the seed of {seed}")
    }

    /// Dances of some requests; one that diverges is none, and the others are asked for again.
    fn dances(&self, asked: &[Asked]) -> Result<Vec<Made>, EvaluationError> {
        let requests: Vec<Request> = asked.iter().map(|it| self.request(*it)).collect();
        let mut open: Vec<usize> = (0..asked.len()).collect();
        let mut made: Vec<Option<Motion>> = asked.iter().map(|_| None).collect();
        while !open.is_empty() {
            let now: Vec<Request> = open.iter().map(|&k| requests[k].clone()).collect();
            match self.model.generate(&now) {
                Ok(motions) => {
                    for (k, motion) in open.drain(..).zip(motions) {
                        let checked = motion.check(&requests[k]);
                        checked.map_err(|it| failed(self.model, &self.name(asked[k]), it))?;
                        made[k] = Some(motion);
                    }
                }
                Err(ModelError::Diverged { request, .. }) if request < open.len() => {
                    open.remove(request);
                }
                Err(source) => {
                    let what = asked.first().map_or(String::new(), |it| self.name(*it));
                    return Err(failed(self.model, &what, source));
                }
            }
        }
        let made = asked.iter().zip(made).map(|(&asked, motion)| {
            let Some(motion) = motion else {
                return Ok(Made { asked, dance: None });
            };
            let poses = motion.poses.as_ref().ok_or_else(|| {
                let model = self.model.name();
                bad(format!(
                    "{model} gives no rotations, which its dances are scored by"
                ))
            })?;
            let skeleton = &self.recordings[asked.seed].clip.skeleton;
            let name = self.name(asked);
            let dance = self
                .measure
                .dance(&name, skeleton, poses, self.sampler.seed);
            let dance = dance.map_err(|source| failed(self.model, &name, source))?;
            Ok(Made {
                asked,
                dance: Some(dance),
            })
        });
        made.collect()
    }

    /// The recorded dance, as far as a made one goes.
    fn recorded(&self, recording: &Recording) -> Result<Dance, EvaluationError> {
        let clip = &recording.clip;
        let frames = recording.frames() - self.sampler.look_ahead;
        let poses = &clip.poses[..frames];
        let dance = self
            .measure
            .dance(&clip.name, &clip.skeleton, poses, self.sampler.seed);
        dance.map_err(|source| failed(self.model, &clip.name, source))
    }

    /// Beats of the music of a recording from the first scored frame on, s.
    fn music_beats(&self, recording: &Recording) -> Vec<f64> {
        let from = self.sampler.seed as f64 / self.measure.fps();
        recording
            .beat_times()
            .into_iter()
            .map(|time| time - from)
            .filter(|time| *time >= 0.0)
            .collect()
    }
}

/// The song of a recording: its name without the frames that it is cut from.
fn song(recording: &Recording) -> &str {
    let name = recording.name();
    name.split_once('@').map_or(name, |(song, _)| song)
}

/// The style of a recording: what stands before the first "_" of its name.
fn style(recording: &Recording) -> &str {
    let name = recording.name();
    name.split_once('_').map_or(name, |(style, _)| style)
}

/// Scores of some dances by metric, beside those of the recorded ones.
fn group(
    stage: &Stage<'_>,
    made: &[&Made],
    real: &[(usize, &Dance)],
    beats: &[Vec<f64>],
) -> KeyedScores {
    let dances: Vec<&Dance> = made.iter().filter_map(|it| it.dance.as_ref()).collect();
    let raw: Vec<ArrayView2<'_, f64>> = dances.iter().map(|it| it.raw.view()).collect();
    let recorded: Vec<ArrayView2<'_, f64>> = real.iter().map(|it| it.1.raw.view()).collect();
    let training = &stage.measure.training;
    let training: Vec<ArrayView2<'_, f64>> = training.iter().map(|it| it.view()).collect();
    let frames = raw.iter().map(|it| it.nrows()).sum::<usize>().max(3);
    let held = stage.measure.mean_pose(frames);
    let held = [held.view()];
    let flat = |dances: &[ArrayView2<'_, f64>]| -> Vec<Array2<f64>> {
        dances.iter().map(|dance| without(*dance, HEIGHT)).collect()
    };
    let without_height = |dances: &[ArrayView2<'_, f64>]| {
        let (training, dances) = (flat(&training), flat(dances));
        let training: Vec<_> = training.iter().map(|it| it.view()).collect();
        let dances: Vec<_> = dances.iter().map(|it| it.view()).collect();
        fpd(&training, &dances)
    };
    let performances: Vec<Performance<'_>> = made
        .iter()
        .filter_map(|it| {
            Some(Performance {
                song: song(&stage.recordings[it.asked.song]),
                dance: &it.dance.as_ref()?.beats,
                music: &beats[it.asked.song],
            })
        })
        .collect();
    let recorded_performances: Vec<Performance<'_>> = real
        .iter()
        .map(|(index, dance)| Performance {
            song: song(&stage.recordings[*index]),
            dance: &dance.beats,
            music: &beats[*index],
        })
        .collect();
    let own = BeatAlignment::matched(&performances);
    let other = BeatAlignment::mismatched(&performances);
    let real_own = BeatAlignment::matched(&recorded_performances);
    let real_other = BeatAlignment::mismatched(&recorded_performances);
    let mean = |values: Vec<f64>| {
        let count = values.len();
        (count > 0).then(|| values.iter().sum::<f64>() / count as f64)
    };
    let diversity = |dances: &mut dyn Iterator<Item = &Dance>| {
        mean(dances.filter_map(|it| it.diversity).collect())
    };
    let frozen: Vec<bool> = dances.iter().map(|it| it.freezes).collect();
    let real_frozen: Vec<bool> = real.iter().map(|it| it.1.freezes).collect();
    let diverged: Vec<bool> = made
        .iter()
        .map(|it| it.dance.as_ref().is_none_or(|dance| dance.diverges))
        .collect();
    let beatless = 100.0 * own.without_beat as f64 / own.dances.max(1) as f64;
    let standardised: Vec<_> = dances.iter().map(|it| it.standardised.view()).collect();
    let real_standardised: Vec<_> = real.iter().map(|it| it.1.standardised.view()).collect();
    let scores = [
        ("fpd_as_published", fpd_as_published(&training, &raw)),
        (
            "fpd_as_published_real",
            fpd_as_published(&training, &recorded),
        ),
        ("fmd_as_published", fmd_as_published(&training, &raw)),
        (
            "fmd_as_published_real",
            fmd_as_published(&training, &recorded),
        ),
        ("fpd", fpd(&training, &raw)),
        ("fpd_real", fpd(&training, &recorded)),
        ("fpd_mean_pose", fpd(&training, &held)),
        ("fpd_without_height", without_height(&raw)),
        ("fpd_without_height_real", without_height(&recorded)),
        ("fpd_without_height_mean_pose", without_height(&held)),
        ("fmd", fmd(&training, &raw)),
        ("fmd_real", fmd(&training, &recorded)),
        ("fmd_mean_pose", fmd(&training, &held)),
        ("beat_offset", own.mean),
        ("beat_offset_deviation", own.deviation),
        ("beat_offset_over_chance", own.over_chance()),
        ("beat_offset_mismatched", other.mean),
        ("beat_offset_deviation_mismatched", other.deviation),
        ("beat_offset_real", real_own.mean),
        ("beat_offset_deviation_real", real_own.deviation),
        ("beat_offset_over_chance_real", real_own.over_chance()),
        ("beat_offset_real_mismatched", real_other.mean),
        (
            "beat_offset_deviation_real_mismatched",
            real_other.deviation,
        ),
        ("kinematic_beats", own.beats_per_second),
        ("kinematic_beats_real", real_own.beats_per_second),
        ("without_kinematic_beat", Some(beatless)),
        ("freezing", share(&frozen)),
        ("freezing_real", share(&real_frozen)),
        ("divergence", share(&diverged)),
        ("diversity", diversity(&mut dances.iter().copied())),
        ("diversity_real", diversity(&mut real.iter().map(|it| it.1))),
        ("step", mean_step(&standardised)),
        ("step_real", mean_step(&real_standardised)),
    ];
    scores
        .into_iter()
        .filter_map(|(key, score)| Some((key, score?)))
        .collect()
}

/// Table 4: dances by the style of their seeds against all true dances of each style.
fn prompted(
    stage: &Stage<'_>,
    data: &Dataset,
    made: &[Made],
) -> Result<Option<Prompting>, EvaluationError> {
    let mut names: Vec<&str> = stage.recordings.iter().map(style).collect();
    names.sort_unstable();
    names.dedup();
    if names.len() < 2 {
        return Ok(None);
    }
    let parts = [&data.train, &data.validation, &data.test];
    let mut truths: Vec<(&str, Array2<f64>)> = Vec::new();
    for recording in parts.into_iter().flatten() {
        let clip = &recording.clip;
        let dance = stage
            .measure
            .dance(&clip.name, &clip.skeleton, &clip.poses, 0);
        let dance = dance.map_err(|source| failed(stage.model, &clip.name, source))?;
        truths.push((style(recording), dance.raw));
    }
    let styles: Vec<Style<'_>> = names
        .iter()
        .map(|&name| Style {
            name: name.into(),
            truth: truths
                .iter()
                .filter(|(of, _)| *of == name)
                .map(|(_, raw)| raw.view())
                .collect(),
            made: made
                .iter()
                .filter(|it| style(&stage.recordings[it.asked.seed]) == name)
                .filter_map(|it| Some(it.dance.as_ref()?.raw.view()))
                .collect(),
        })
        .collect();
    Ok(Prompting::of(&styles, fmd_as_published))
}

impl Protocol for SampledDance {
    fn name(&self) -> &'static str {
        "sampled_dance"
    }

    fn about(&self) -> &'static str {
        "each song danced from 5 seeds, which are not scored"
    }

    fn metrics(&self) -> &[Metric] {
        &METRICS
    }

    fn frames(&self, recordings: &[usize]) -> u64 {
        let asked = self.asked(recordings.len());
        let with_music: usize = asked.iter().map(|it| recordings[it.song]).sum();
        (with_music + recordings.iter().sum::<usize>()) as u64
    }

    fn evaluate(
        &self,
        subject: &dyn Generator,
        data: &Dataset,
        part: DataPart,
    ) -> Result<Evaluation, EvaluationError> {
        let sampler = Sampler::of(subject)?;
        let all = part.of(data)?;
        // A second of dance behind the seed at least: its beats are told by their neighbours.
        let needed = sampler.window() + 20;
        let long = |it: &&Recording| it.frames() >= needed;
        let (recordings, short): (Vec<_>, Vec<_>) = all.iter().partition(long);
        let recordings: Vec<Recording> = recordings.into_iter().cloned().collect();
        if recordings.is_empty() {
            let longest = all.iter().map(Recording::frames).max().unwrap_or(0);
            return Err(bad(format!(
                "no clip has the {needed} frames of a seed and a second of dance, the longest has \
                 {longest}; give longer clips"
            )));
        }
        let fit = Measure::of(&data.train);
        let music = recordings.iter().map(|it| music_of(subject, it));
        let stage = Stage {
            model: subject,
            sampler,
            recordings: &recordings,
            music: music.collect::<Result<Vec<_>, _>>()?,
            measure: fit.map_err(|source| failed(subject, "the training clips", source))?,
        };
        let mut asked = self.asked(recordings.len());
        let with_music = asked.len();
        let silent = spread((0..recordings.len()).collect(), self.most_dances);
        asked.extend(silent.into_iter().map(|song| Asked {
            song,
            seed: song,
            with_music: false,
        }));
        let mut made = in_chunks(&asked, CHUNK, |asked: &[Asked]| stage.dances(asked))?;
        let silent = made.split_off(with_music);
        let real = recordings.iter().map(|it| stage.recorded(it));
        let real = real.collect::<Result<Vec<_>, _>>()?;
        let beats: Vec<Vec<f64>> = recordings.iter().map(|it| stage.music_beats(it)).collect();

        let is_heard = |index: usize| {
            let name = song(&recordings[index]);
            data.train.iter().any(|it| song(it) == name)
        };
        let mut groups: Vec<Group<'_>> = Vec::new();
        let every: Vec<(usize, &Dance)> = real.iter().enumerate().collect();
        groups.push((ALL, made.iter().collect(), every.clone()));
        let heard = (0..recordings.len())
            .filter(|&index| is_heard(index))
            .count();
        if heard > 0 && heard < recordings.len() {
            for (name, wanted) in [(HEARD, true), (UNHEARD, false)] {
                let own = made.iter().filter(|it| is_heard(it.asked.song) == wanted);
                let true_own = every.iter().filter(|it| is_heard(it.0) == wanted);
                groups.push((name, own.collect(), true_own.copied().collect()));
            }
        }
        groups.push((WITHOUT_MUSIC, silent.iter().collect(), every));
        let scored = groups.iter();
        let scored =
            scored.map(|(name, made, real)| (*name, made.len(), group(&stage, made, real, &beats)));
        let scored: Vec<(&str, usize, KeyedScores)> = scored.collect();
        let mut rows: Vec<(&'static str, ScoreRow)> = METRICS
            .iter()
            .filter_map(|metric| {
                let columns = scored.iter().filter_map(|(name, _, scores)| {
                    let score = scores.iter().find(|(key, _)| *key == metric.key)?;
                    Some((*name, score.1))
                });
                let columns: Vec<(&str, f64)> = columns.collect();
                (!columns.is_empty()).then(|| (metric.key, ScoreRow::new(columns)))
            })
            .collect();
        if let Some(prompting) = prompted(&stage, data, &made)? {
            let pairs = prompting.distances.indexed_iter();
            let pairs = pairs.map(|((row, column), &distance)| {
                let [row, column] = [row, column].map(|at| &prompting.styles[at]);
                (format!("{row} from {column}"), distance)
            });
            rows.push(("prompted_fmd", ScoreRow::new(pairs.collect::<Vec<_>>())));
            rows.push((
                "prompted_own",
                ScoreRow::new([(ALL, prompting.own() as f64)]),
            ));
        }
        let counts = scored.iter().map(|(name, dances, _)| (*name, *dances));
        let warning = |clip: &Recording| {
            format!(
                "{} has {} frames, fewer than a seed and a second of dance ({needed}): left out",
                clip.name(),
                clip.frames()
            )
        };
        Ok(Evaluation {
            scores: Scores::new(rows, counts.collect::<Vec<_>>()),
            warnings: short.into_iter().map(warning).collect(),
        })
    }
}
