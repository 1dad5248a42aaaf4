//! A toy paper, "Toy 2026: the height of a dancer's root, sampled": with the click c_t of the
//! music, `h_t ~ Normal(m + a (h_(t-1) - m) + b c_t, e^(2 s))`, m a running mean, a, b and s
//! learned.

use std::f64::consts::{LN_2, PI, TAU};

use keydance::autograd::{AutogradError, BlockId, BufferId, Parameters, Tape};
use keydance::data::{DataConfig, DataPart, Dataset, Recording};
use keydance::evaluation::{
    Better, Evaluation, EvaluationError, Metric, Protocol, ScoreRow, Scores,
};
use keydance::models::generator::{Condition, Given, NeededPoses, Needs};
use keydance::models::settings::{InitialRng, LoadError, ValueError};
use keydance::models::weights::SavedWeights;
use keydance::models::{
    Generator, KindOf, LossTerms, ModelError, ModelSettings, Motion, Paper, Request, Statistics,
    Step, Streams, Task, TaskSetting,
};
use keydance::nn::Initialiser;
use ndarray::{Array2, Array3, s};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use serde::{Deserialize, Serialize};

/// Frames of a window.
const WINDOW: usize = 20;
/// Share of a batch's mean that the running mean takes up.
const MOMENTUM: f64 = 0.1;

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Toy {
    model: Sizes,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Sizes {
    kind: String,
    steps: u64,
    /// Windows of a step; each is a shard.
    windows: usize,
}

impl Default for Sizes {
    fn default() -> Self {
        Self {
            kind: "toy".into(),
            steps: 40,
            windows: 3,
        }
    }
}

/// The line of the registry.
pub const TOY: KindOf<Toy> = KindOf::new("toy", || {
    let printed = "title = 'Toy 2026'\ncolumns = ['all']\n[[tables]]\nnumber = 1\nmetric = 'nll'\n\
        [rows.toy]\ntitle = 'Toy'\nnll = [2.5]";
    vec![Paper::new("toy2026", printed, |_, _| {
        vec![Box::new(ToyProtocol)]
    })]
});

impl ModelSettings for Toy {
    fn kind(&self) -> &str {
        "toy"
    }

    fn check(&self, _data: &DataConfig) -> Result<(), ValueError> {
        let windows = self.model.windows;
        ValueError::unless(windows > 0, "model.windows", windows, "1 or more")
    }

    fn task<'d>(
        &self,
        setting: &TaskSetting<'d>,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Box<dyn Task<f32> + 'd>, ModelError> {
        Ok(Box::new(ToyTask {
            sizes: self.model.clone(),
            heights: setting.dataset.train.iter().map(heights).collect(),
            weights: Weights::new(init),
            streams: setting.streams,
        }))
    }

    fn trained(&self, name: &str, saved: &SavedWeights) -> Result<Box<dyn Generator>, LoadError> {
        let none = Statistics::default();
        let (weights, parameters) = saved.network(&none, |init| Ok(Weights::new(init)))?;
        Ok(Box::new(TrainedToy::new(name, &weights, &parameters)))
    }
}

/// Heights of the root, cm.
fn heights(recording: &Recording) -> Vec<f64> {
    let poses = recording.clip.poses.iter();
    poses.map(|pose| pose.translations[0].y).collect()
}

/// The music: a click every half second.
pub fn click(frame: usize) -> f64 {
    (TAU * frame as f64 / 15.0).cos()
}

struct Weights {
    a: BlockId,
    b: BlockId,
    s: BlockId,
    mean: BufferId,
}

impl Weights {
    fn new(init: &mut Initialiser<'_, f32, InitialRng>) -> Self {
        Self {
            a: init.uniform("a".into(), &[1], 0.1).1,
            b: init.uniform("b".into(), &[1], 0.1).1,
            s: init.constant("s".into(), &[1], 1.0).1,
            mean: init.buffer("running_mean".into(), &[1], 90.0),
        }
    }
}

struct ToyTask {
    sizes: Sizes,
    heights: Vec<Vec<f64>>,
    weights: Weights,
    streams: Streams,
}

impl Task<f32> for ToyTask {
    fn steps(&self) -> u64 {
        self.sizes.steps
    }

    fn frame_steps(&self) -> u64 {
        self.sizes.steps * (self.sizes.windows * WINDOW) as u64
    }

    fn step(&self, step: u64) -> Box<dyn Step<f32> + '_> {
        let mut rng = self.streams.stream("windows", &[step]);
        let windows = (0..self.sizes.windows).map(|_| {
            let clip = rng.random_range(0..self.heights.len());
            let start = rng.random_range(0..self.heights[clip].len() - WINDOW);
            (clip, start)
        });
        Box::new(ToyStep {
            task: self,
            windows: windows.collect(),
        })
    }

    fn generator(&self, name: &str, parameters: Parameters<f32>) -> Box<dyn Generator> {
        Box::new(TrainedToy::new(name, &self.weights, &parameters))
    }
}

struct ToyStep<'t> {
    task: &'t ToyTask,
    windows: Vec<(usize, usize)>,
}

impl Step<f32> for ToyStep<'_> {
    fn shards(&self) -> usize {
        self.windows.len()
    }

    fn frames(&self) -> u64 {
        (self.windows.len() * WINDOW) as u64
    }

    fn losses(&self, tape: &mut Tape<'_, f32>, shard: usize) -> Result<LossTerms, AutogradError> {
        let (clip, start) = self.windows[shard];
        let weights = &self.task.weights;
        let heights = &self.task.heights[clip][start..=start + WINDOW];
        let before = f64::from(tape.buffer(weights.mean)?[[0]]);
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        let mean = (1.0 - MOMENTUM) * before + MOMENTUM * mean;
        let mut numbers = |number: &dyn Fn(usize) -> f64| {
            tape.constant_with(&[WINDOW], |out| {
                let values = (0..WINDOW).map(|t| number(t) as f32);
                out.iter_mut().zip(values).for_each(|(out, x)| *out = x);
            })
        };
        let now = numbers(&|t| heights[t + 1] - mean);
        let past = numbers(&|t| heights[t] - mean);
        let clicks = numbers(&|t| click(start + t + 1));
        let [a, b, s] = [weights.a, weights.b, weights.s].map(|block| tape.block(block));
        let (followed, moved) = (tape.mul(past, a)?, tape.mul(clicks, b)?);
        let left = tape.sub(now, followed)?;
        let left = tape.sub(left, moved)?;
        let inverse = tape.affine(s, -1.0, 0.0);
        let inverse = tape.exp(inverse);
        let left = tape.mul(left, inverse)?;
        let squares = tape.square(left);
        let squares = tape.sum(squares);
        let share = 1.0 / (WINDOW * self.windows.len()) as f64;
        let squares = tape.affine(squares, share / 2.0, 0.0);
        let width = tape.affine(s, 1.0 / self.windows.len() as f64, 0.0);
        let mut terms = LossTerms::weighted(
            tape,
            &[("squares", 1.0, squares), ("width", 1.0, width)],
            None,
        )?;
        terms.buffers.push((weights.mean, vec![mean]));
        Ok(terms)
    }

    fn describe(&self) -> String {
        format!("{} windows of {WINDOW} frames", self.windows.len())
    }
}

struct TrainedToy {
    name: String,
    mean: f64,
    a: f64,
    b: f64,
    s: f64,
}

impl TrainedToy {
    fn new(name: &str, weights: &Weights, parameters: &Parameters<f32>) -> Self {
        let of = |name: &str| {
            let found = parameters.iter().find(|(known, _)| *known == name);
            f64::from(found.unwrap().1[[0]])
        };
        Self {
            name: name.into(),
            mean: f64::from(parameters.buffer(weights.mean).unwrap()[[0]]),
            a: of("a"),
            b: of("b"),
            s: of("s"),
        }
    }

    fn expected(&self, before: f64, click: f64) -> f64 {
        self.mean + self.a * (before - self.mean) + self.b * click
    }
}

impl Generator for TrainedToy {
    fn name(&self) -> &str {
        &self.name
    }

    fn needs(&self) -> Needs {
        Needs {
            poses: NeededPoses::Past(1),
            conditions: &[Condition::Music],
            heeds: &[],
        }
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        let answer = |request: &Request| {
            request.check(&self.name, &self.needs())?;
            let mut rng = Streams::new(request.seed).stream("dance", &[]);
            let music = request.music.as_ref().unwrap();
            let pose = &request.given[0].pose;
            let body = pose.world_positions(&request.skeleton);
            let mut height = pose.translations[0].y;
            let raw = Array2::from_shape_fn((request.frames, 1), |(frame, _)| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                height = self.expected(height, music[[frame, 0]]) + self.s.exp() * noise;
                height
            });
            let shape = (request.frames, body.len(), 3);
            let positions = Array3::from_shape_fn(shape, |(frame, joint, axis)| match axis {
                1 => body[joint].y + raw[[frame, 0]] - pose.translations[0].y,
                _ => body[joint][axis],
            });
            Ok(Motion {
                raw: Some(raw),
                ..Motion::new(positions)
            })
        };
        requests.iter().map(answer).collect()
    }

    fn log_likelihoods(
        &self,
        requests: &[Request],
        truths: &[Motion],
    ) -> Result<Vec<f64>, ModelError> {
        let of = |(request, truth): (&Request, &Motion)| {
            let music = request.music.as_ref().unwrap();
            let mut before = request.given[0].pose.translations[0].y;
            let heights = truth.positions.slice(s![.., 0, 1]);
            let density = heights.iter().zip(music.column(0)).map(|(&now, &click)| {
                let left = (now - self.expected(before, click)) / self.s.exp();
                before = now;
                -(left * left + PI.ln() + LN_2) / 2.0 - self.s
            });
            density.sum()
        };
        Ok(requests.iter().zip(truths).map(of).collect())
    }
}

/// What is asked about frames `start`.. of a recording, and what was recorded.
pub fn question(recording: &Recording, start: usize, frames: usize) -> (Request, Motion) {
    let clip = &recording.clip;
    let before = Given {
        frame: -1,
        pose: clip.poses[start - 1].clone(),
        features: None,
    };
    let clicks = Array2::from_shape_fn((frames, 1), |(t, _)| click(start + t));
    let request = Request {
        given: vec![before],
        music: Some(clicks),
        seed: start as u64,
        ..Request::new(clip.skeleton.clone(), clip.frame_time, frames)
    };
    let truth = Motion::recorded(clip, start..start + frames).unwrap();
    (request, truth)
}

struct ToyProtocol;

const METRICS: [Metric; 2] = [
    Metric {
        key: "nll",
        title: "NLL",
        unit: "nats a frame",
        better: Better::Lower,
        decimals: 2,
        about: "negative logarithm of the likelihood of a frame",
    },
    Metric {
        key: "spread",
        title: "spread",
        unit: "cm",
        better: Better::Higher,
        decimals: 2,
        about: "standard deviation of the raw output",
    },
];

impl Protocol for ToyProtocol {
    fn name(&self) -> &'static str {
        "likelihood"
    }

    fn about(&self) -> &'static str {
        "of the first frames of each clip"
    }

    fn metrics(&self) -> &[Metric] {
        &METRICS
    }

    fn frames(&self, recordings: &[usize]) -> u64 {
        (recordings.len() * WINDOW) as u64
    }

    fn evaluate(
        &self,
        subject: &dyn Generator,
        data: &Dataset,
        part: DataPart,
    ) -> Result<Evaluation, EvaluationError> {
        let clips = part.of(data)?.iter();
        let (requests, truths): (Vec<_>, Vec<_>) =
            clips.map(|clip| question(clip, 1, WINDOW)).unzip();
        let failed = |error: ModelError| EvaluationError::Data {
            reason: error.to_string(),
        };
        let likelihoods = subject
            .log_likelihoods(&requests, &truths)
            .map_err(failed)?;
        let raw = subject.raw(&requests).map_err(failed)?;
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let spreads: Vec<f64> = raw.iter().map(|heights| heights.std(0.0)).collect();
        let nll = -mean(&likelihoods) / WINDOW as f64;
        let rows = [
            ("nll", ScoreRow::new([("all", nll)])),
            ("spread", ScoreRow::new([("all", mean(&spreads))])),
        ];
        Ok(Evaluation {
            scores: Scores::new(rows, [("all", requests.len())]),
            warnings: Vec::new(),
        })
    }
}
