//! The analysis as text, and its means as a table for others to draw.

use std::fmt;

use serde::Serialize;

use super::{Comparison, Question, QuestionAnalysis, StudyAnalysis, StudyError, Untested};
use crate::counted::counted;

impl StudyAnalysis {
    /// Means, deviations and intervals as CSV, a line a question and model; empty where there is
    /// none.
    ///
    /// # Errors
    /// None that ratings could cause.
    pub fn csv(&self) -> Result<Vec<u8>, StudyError> {
        #[derive(Serialize)]
        struct Line<'a> {
            question: Question,
            model: &'a str,
            ratings: usize,
            mean: Option<f64>,
            deviation: Option<f64>,
            low: Option<f64>,
            high: Option<f64>,
        }
        let mut table = csv::Writer::from_writer(Vec::new());
        for QuestionAnalysis {
            question, models, ..
        } in &self.questions
        {
            for model in models {
                table.serialize(Line {
                    question: *question,
                    model: &model.model,
                    ratings: model.ratings,
                    mean: model.mean,
                    deviation: model.deviation,
                    low: model.interval.map(|[low, _]| low),
                    high: model.interval.map(|[_, high]| high),
                })?;
            }
        }
        let written = table.into_inner();
        Ok(written.map_err(|error| csv::Error::from(error.into_error()))?)
    }
}

impl fmt::Display for StudyAnalysis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ratings = counted(self.ratings, "rating");
        let people = counted(self.participants, "participant");
        writeln!(f, "study {}: {ratings} of {people}", self.study)?;
        self.questions
            .iter()
            .try_for_each(|question| write!(f, "\n{question}"))
    }
}

impl fmt::Display for QuestionAnalysis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.question.ends();
        writeln!(f, "{}, 1 {low} to 5 {high}", self.question.name())?;
        let names = self.models.iter().map(|it| it.model.chars().count());
        let wide = names.max().unwrap_or_default().max("model".len());
        writeln!(
            f,
            "  {:wide$}  ratings   mean  deviation  95 % interval",
            "model"
        )?;
        let number = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.2}"));
        for model in &self.models {
            let interval = model
                .interval
                .map(|[low, high]| format!("{low:.2} to {high:.2}"));
            writeln!(
                f,
                "  {:wide$}  {:>7}  {:>5}  {:>9}  {}",
                model.model,
                model.ratings,
                number(model.mean),
                number(model.deviation),
                interval.as_deref().unwrap_or("-")
            )?;
        }
        write!(f, "{}", self.comparison)
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (variance, pairs) = match self {
            Self::Untested(why) => return writeln!(f, "  no test: {why}"),
            Self::Tested { variance, pairs } => (variance, pairs),
        };
        let [between, within] = variance.freedom;
        let p = probability(variance.p);
        let statistic = variance.f;
        writeln!(
            f,
            "  analysis of variance: F({between}, {within}) = {statistic:.2}, p {p}"
        )?;
        writeln!(f, "  t tests of pairs, p after Holm:")?;
        for pair in pairs {
            let ([one, other], t) = (&pair.models, pair.t);
            let (difference, p) = (pair.difference, probability(pair.corrected_p));
            writeln!(
                f,
                "    {one} less {other}: {difference:+.2}, t({within}) = {t:.2}, p {p}"
            )?;
        }
        Ok(())
    }
}

impl fmt::Display for Untested {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OneModel => "fewer than two models have ratings",
            Self::OneRatingEach => "no model has two ratings",
            Self::NoVariance => "the ratings of each model are all equal",
        })
    }
}

/// As papers print it.
fn probability(p: f64) -> String {
    match p < 0.001 {
        true => "< 0.001".into(),
        false => format!("= {p:.3}"),
    }
}
