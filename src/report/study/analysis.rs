//! What ratings say: means with their intervals, and which models differ.
//!
//! Every rating counts as an observation of its own, as in the paper; that one person has given
//! many, and that all models danced to the same songs, is left out of account.

use std::collections::BTreeSet;

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

use super::{Question, Rating, StudyKey};

/// Share of intervals that hold the mean.
const CONFIDENCE: f64 = 0.95;

/// The analysis of a study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StudyAnalysis {
    pub study: String,
    pub participants: usize,
    pub ratings: usize,
    /// Those that the study asks, in the order of the page.
    pub questions: Vec<QuestionAnalysis>,
}

/// The answers to one question.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct QuestionAnalysis {
    pub question: Question,
    /// In the order of the key.
    pub models: Vec<ModelRatings>,
    pub comparison: Comparison,
}

/// The answers about one model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelRatings {
    pub model: String,
    pub ratings: usize,
    /// None without ratings.
    pub mean: Option<f64>,
    /// With n - 1; none of fewer than two ratings.
    pub deviation: Option<f64>,
    /// 95 % interval of the mean by the t distribution; none of fewer than two ratings.
    pub interval: Option<[f64; 2]>,
}

/// Whether models differ.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Comparison {
    Tested {
        variance: VarianceAnalysis,
        /// Every two models that have ratings, in the order of the key.
        pairs: Vec<Pair>,
    },
    Untested(Untested),
}

/// Why there is no test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Untested {
    /// Fewer than two models have ratings.
    OneModel,
    /// No model has two ratings.
    OneRatingEach,
    /// All ratings of each model are equal.
    NoVariance,
}

/// A one-way analysis of variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct VarianceAnalysis {
    pub f: f64,
    /// Degrees of freedom between and within models.
    pub freedom: [usize; 2],
    pub p: f64,
}

/// A t test of two models' means, with the deviation within all models.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pair {
    pub models: [String; 2],
    /// The first's mean less the second's.
    pub difference: f64,
    pub t: f64,
    /// Two-sided.
    pub p: f64,
    /// After Holm (1979), for all pairs of the question.
    pub corrected_p: f64,
}

impl StudyAnalysis {
    /// Of ratings that [`super::read_ratings`] gave for the key.
    #[must_use]
    pub fn new(key: &StudyKey, ratings: &[Rating]) -> Self {
        let people: BTreeSet<&str> = ratings.iter().map(|it| it.participant.as_str()).collect();
        let of_model = |question, model: &str| {
            let about = |rating: &&Rating| {
                let clip = key.clips.get(&rating.clip);
                rating.question == question && clip.is_some_and(|clip| clip.model == model)
            };
            let about = ratings.iter().filter(about);
            about.map(|rating| f64::from(rating.rating)).collect()
        };
        let question = |question: &Question| {
            let models = key.models.iter();
            let groups = models.map(|model| Group {
                model: &model.name,
                values: of_model(*question, &model.name),
            });
            QuestionAnalysis::new(*question, &groups.collect::<Vec<_>>())
        };
        Self {
            study: key.study.clone(),
            participants: people.len(),
            ratings: ratings.len(),
            questions: key.questions.iter().map(question).collect(),
        }
    }
}

/// A model's ratings for one question.
struct Group<'m> {
    model: &'m str,
    values: Vec<f64>,
}

impl Group<'_> {
    fn count(&self) -> f64 {
        self.values.len() as f64
    }

    /// Of at least one rating.
    fn mean(&self) -> f64 {
        self.values.iter().sum::<f64>() / self.count()
    }

    /// Sum of the squared deviations from the mean.
    fn squares(&self) -> f64 {
        let mean = self.mean();
        let deviations = self.values.iter().map(|value| value - mean);
        deviations.map(|deviation| deviation * deviation).sum()
    }

    fn described(&self) -> ModelRatings {
        let ratings = self.values.len();
        let mean = (ratings > 0).then(|| self.mean());
        let deviation = (ratings > 1).then(|| (self.squares() / (self.count() - 1.0)).sqrt());
        let interval = mean.zip(deviation).and_then(|(mean, deviation)| {
            let t = student(self.count() - 1.0)?.inverse_cdf(0.5 + CONFIDENCE / 2.0);
            let half = t * deviation / self.count().sqrt();
            Some([mean - half, mean + half])
        });
        ModelRatings {
            model: self.model.into(),
            ratings,
            mean,
            deviation,
            interval,
        }
    }
}

impl QuestionAnalysis {
    fn new(question: Question, groups: &[Group<'_>]) -> Self {
        let rated: Vec<&Group<'_>> = groups.iter().filter(|it| !it.values.is_empty()).collect();
        Self {
            question,
            models: groups.iter().map(Group::described).collect(),
            comparison: compare(&rated).unwrap_or_else(Comparison::Untested),
        }
    }
}

/// Analysis of variance and pairs of groups that have ratings.
fn compare(groups: &[&Group<'_>]) -> Result<Comparison, Untested> {
    let count: usize = groups.iter().map(|group| group.values.len()).sum();
    if groups.len() < 2 {
        return Err(Untested::OneModel);
    }
    let freedom = [groups.len() - 1, count - groups.len()];
    let [between, within] = freedom.map(|freedom| freedom as f64);
    let student = student(within).ok_or(Untested::OneRatingEach)?;
    let fisher = FisherSnedecor::new(between, within).map_err(|_| Untested::OneRatingEach)?;
    let squares: f64 = groups.iter().map(|group| group.squares()).sum();
    if squares == 0.0 {
        return Err(Untested::NoVariance);
    }
    let variance = squares / within;
    let sum: f64 = groups.iter().flat_map(|group| &group.values).sum();
    let mean = sum / count as f64;
    let apart = groups
        .iter()
        .map(|group| group.count() * (group.mean() - mean).powi(2));
    let f = apart.sum::<f64>() / between / variance;

    let mut pairs = Vec::new();
    for (index, first) in groups.iter().enumerate() {
        for second in &groups[index + 1..] {
            let difference = first.mean() - second.mean();
            let error = (variance * (1.0 / first.count() + 1.0 / second.count())).sqrt();
            let t = difference / error;
            let p = (2.0 * student.sf(t.abs())).min(1.0);
            pairs.push(Pair {
                models: [first.model.into(), second.model.into()],
                difference,
                t,
                p,
                corrected_p: p,
            });
        }
    }
    correct(&mut pairs);
    let p = fisher.sf(f);
    Ok(Comparison::Tested {
        variance: VarianceAnalysis { f, freedom, p },
        pairs,
    })
}

/// The t distribution; none without freedom.
fn student(freedom: f64) -> Option<StudentsT> {
    StudentsT::new(0.0, 1.0, freedom).ok()
}

/// Holm's correction: the smallest of m times m, the next times m - 1, none below the one before.
fn correct(pairs: &mut [Pair]) {
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    order.sort_by(|&one, &other| pairs[one].p.total_cmp(&pairs[other].p));
    let mut least = 0.0f64;
    for (rank, &index) in order.iter().enumerate() {
        let tests = (pairs.len() - rank) as f64;
        least = least.max((pairs[index].p * tests).min(1.0));
        pairs[index].corrected_p = least;
    }
}
