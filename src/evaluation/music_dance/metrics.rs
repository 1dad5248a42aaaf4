//! The metrics, and their values from what was measured.

use Better::{Higher, Lower, Neither};
use ndarray::Array2;

use super::beat_scores::{BeatScores, ClipBeats};
use super::smoothness::median;
use super::standardisation::Standardisation;
use super::window::{AllAndNovel, Character, Errors, Mean};
use crate::evaluation::frechet::frechet_distance;
use crate::evaluation::pair_distance::mean_pair_distance;
use crate::evaluation::{Better, Metric, ScoreRow};

/// The column of a score that has one value, over all windows or clips.
pub(super) const ALL: &str = "all";
/// The column of frames of new poses.
pub(super) const NOVEL: &str = "novel";

const fn metric(
    key: &'static str,
    title: &'static str,
    unit: &'static str,
    better: Better,
    decimals: usize,
    about: &'static str,
) -> Metric {
    Metric {
        key,
        title,
        unit,
        better,
        decimals,
        about,
    }
}

/// Real motion and chance stand beside the score that they are the yardstick of.
#[rustfmt::skip]
pub(super) const METRICS: [Metric; 31] = [
    metric("consistency", "consistency error", "squared norm", Lower, 4,
        "squared norm of the difference of a key pose's 144 rotation numbers and the model's at its \
         frame, before they are made rotations, a mean over key poses (eq. 13)"),
    metric("key_pose_error", "key pose error", "cm", Lower, 2,
        "distance of the joints from those of the key pose, about the root, a mean over joints and \
         key poses, cm"),
    metric("smoothness", "smoothness", "ratio", Lower, 2,
        "standard deviation over |mean| of the differences from frame to frame of all rotation \
         numbers of a window (eq. 16), a mean over windows"),
    metric("smoothness_median", "smoothness, median", "ratio", Lower, 2,
        "the same, the median over windows: the ratio is ill-conditioned"),
    metric("smoothness_real", "smoothness, real", "ratio", Neither, 2,
        "the same of the recorded dance, a mean over windows"),
    metric("smoothness_real_median", "smoothness, real, median", "ratio", Neither, 2,
        "the same of the recorded dance, the median over windows"),
    metric("step_variation", "variation of step lengths", "%", Neither, 1,
        "standard deviation over mean of the norms of the differences from frame to frame, a mean \
         over windows, %; to be near the real dance's"),
    metric("step_variation_real", "variation of step lengths, real", "%", Neither, 1,
        "the same of the recorded dance"),
    metric("jerk", "jerk", "m/s^3", Neither, 2,
        "norm of the third derivative of the joints' positions, a mean over joints, frames and \
         windows, m/s^3; to be near the real dance's, not small"),
    metric("jerk_real", "jerk, real", "m/s^3", Neither, 2,
        "the same of the recorded dance"),
    metric("beat_hit_rate", "beat hit rate", "%", Higher, 1,
        "motion beats within delta frames of a music beat over music beats, a mean over whole clips, \
         %; the real dance's is the yardstick, not 100"),
    metric("beat_hit_rate_real", "beat hit rate, real", "%", Neither, 1,
        "the same of the recorded dance"),
    metric("beat_hit_rate_chance", "beat hit rate, chance", "%", Neither, 1,
        "the same of the recorded dance with the music's beats shifted round the clip, a mean over \
         200 shifts"),
    metric("beat_hit_rate_shifted", "beat hit rate, shifted, 97.5 %", "%", Neither, 1,
        "the same of the dance itself with the music's beats shifted round the clips, that which \
         97.5 % of 200 shifts do not exceed: a higher hit rate is not by chance"),
    metric("beat_alignment", "beat alignment", "0 to 1", Higher, 3,
        "exp(-d^2 / (2 x 1.5^2)), d the frames from a music beat to the nearest motion beat, a mean \
         over music beats and clips"),
    metric("beat_alignment_real", "beat alignment, real", "0 to 1", Neither, 3,
        "the same of the recorded dance"),
    metric("beat_alignment_chance", "beat alignment, chance", "0 to 1", Neither, 3,
        "the same of the recorded dance with shifted beats"),
    metric("beat_alignment_of_dance", "beat alignment of the dance", "0 to 1", Higher, 3,
        "the same from a motion beat to the nearest music beat, a mean over motion beats and clips"),
    metric("beat_alignment_of_dance_real", "beat alignment of the dance, real", "0 to 1", Neither, 3,
        "the same of the recorded dance"),
    metric("beat_alignment_of_dance_chance", "beat alignment of the dance, chance", "0 to 1",
        Neither, 3, "the same of the recorded dance with shifted beats"),
    metric("fid_kinetic", "FID, kinetic", "distance", Lower, 3,
        "Frechet distance of the windows' kinetic features from the real windows', standardised by \
         these"),
    metric("fid_kinetic_train", "FID, kinetic, training clips", "distance", Neither, 3,
        "the same of the training clips' windows: the floor"),
    metric("fid_geometric", "FID, geometric", "distance", Lower, 3,
        "Frechet distance of the shares of frames in which 32 relations of joints hold"),
    metric("fid_geometric_train", "FID, geometric, training clips", "distance", Neither, 3,
        "the same of the training clips' windows: the floor"),
    metric("diversity_kinetic", "diversity, kinetic", "distance", Neither, 3,
        "distance of two windows' standardised kinetic features, a mean over pairs; to be near the \
         real dance's"),
    metric("diversity_kinetic_real", "diversity, kinetic, real", "distance", Neither, 3,
        "the same of the recorded dance"),
    metric("diversity_kinetic_train", "diversity, kinetic, training clips", "distance", Neither, 3,
        "the same of the training clips' windows"),
    metric("diversity_geometric", "diversity, geometric", "distance", Neither, 3,
        "distance of two windows' standardised geometric features, a mean over pairs; to be near \
         the real dance's"),
    metric("diversity_geometric_real", "diversity, geometric, real", "distance", Neither, 3,
        "the same of the recorded dance"),
    metric("diversity_geometric_train", "diversity, geometric, training clips", "distance", Neither, 3,
        "the same of the training clips' windows"),
    metric("position_error", "position error", "cm", Lower, 2,
        "distance of the joints from the recorded ones, about the root, a mean over joints, frames \
         and windows, cm; a hint only, many dances fit the same music"),
];

/// All that was measured.
#[derive(Debug, Clone, Default)]
pub(super) struct Measured {
    /// Windows of the answers, of the recorded dances in the same frames, and of training clips.
    pub made: Vec<Character>,
    pub real: Vec<Character>,
    pub train: Vec<Character>,
    pub errors: Errors,
    pub beats: ClipBeats,
}

/// Values by metric; one that cannot be told is none, and has no row.
struct Rows(Vec<(&'static str, ScoreRow)>);

impl Rows {
    fn single(&mut self, key: &'static str, value: Option<f64>) {
        self.columns(key, [(ALL, value)]);
    }

    fn columns<C: std::fmt::Display>(
        &mut self,
        key: &'static str,
        values: impl IntoIterator<Item = (C, Option<f64>)>,
    ) {
        let values = values.into_iter();
        let known: Vec<(C, f64)> = values
            .filter_map(|(column, value)| Some((column, value?)))
            .collect();
        if !known.is_empty() {
            self.0.push((key, ScoreRow::new(known)));
        }
    }

    fn all_and_novel(&mut self, key: &'static str, AllAndNovel { all, novel }: &AllAndNovel) {
        self.columns(key, [(ALL, all.value()), (NOVEL, novel.value())]);
    }

    fn smoothness(&mut self, [mean, middle]: [&'static str; 2], windows: &[Character]) {
        let values = windows.iter().filter_map(|window| window.smoothness);
        self.single(mean, values.clone().collect::<Mean>().value());
        self.single(middle, median(values.collect()));
    }

    fn steps_and_jerk(&mut self, [steps, jerk]: [&'static str; 2], windows: &[Character]) {
        let lengths = windows.iter().filter_map(|window| window.step_variation);
        self.single(steps, lengths.collect::<Mean>().value());
        let jerks = windows.iter().map(|window| window.jerk);
        self.single(jerk, jerks.collect::<Mean>().value());
    }

    fn beats(&mut self, [rate, music, dance]: [&'static str; 3], of: &BeatScores) {
        let rates = (1..).zip(&of.hit_rate);
        self.columns(
            rate,
            rates.map(|(delta, mean): (usize, _)| (delta, mean.value())),
        );
        self.single(music, of.alignment.value());
        self.single(dance, of.alignment_of_dance.value());
    }
}

/// The rows of all metrics that can be told.
pub(super) fn rows(measured: &Measured) -> Vec<(&'static str, ScoreRow)> {
    let Measured {
        made,
        real,
        train,
        errors,
        beats,
    } = measured;
    let mut rows = Rows(Vec::new());
    rows.all_and_novel("consistency", &errors.consistency);
    rows.all_and_novel("key_pose_error", &errors.key_pose);
    rows.smoothness(["smoothness", "smoothness_median"], made);
    rows.smoothness(["smoothness_real", "smoothness_real_median"], real);
    rows.steps_and_jerk(["step_variation", "jerk"], made);
    rows.steps_and_jerk(["step_variation_real", "jerk_real"], real);
    for (keys, of) in [
        (
            ["beat_hit_rate", "beat_alignment", "beat_alignment_of_dance"],
            &beats.made,
        ),
        (
            [
                "beat_hit_rate_real",
                "beat_alignment_real",
                "beat_alignment_of_dance_real",
            ],
            &beats.real,
        ),
        (
            [
                "beat_hit_rate_chance",
                "beat_alignment_chance",
                "beat_alignment_of_dance_chance",
            ],
            &beats.chance,
        ),
    ] {
        rows.beats(keys, of);
    }
    let shifted = (1..).zip(beats.made_by_chance());
    rows.columns(
        "beat_hit_rate_shifted",
        shifted.map(|(delta, rate): (usize, _)| (delta, rate)),
    );
    let windows = [made, real, train];
    let kinetic = windows.map(|windows| features(windows, |it| &it.kinetic));
    let geometric = windows.map(|windows| features(windows, |it| &it.geometric));
    let distances = ["fid_kinetic", "fid_kinetic_train"];
    let spreads = [
        "diversity_kinetic",
        "diversity_kinetic_real",
        "diversity_kinetic_train",
    ];
    compare(&mut rows, &kinetic, distances, spreads);
    let distances = ["fid_geometric", "fid_geometric_train"];
    let spreads = [
        "diversity_geometric",
        "diversity_geometric_real",
        "diversity_geometric_train",
    ];
    compare(&mut rows, &geometric, distances, spreads);
    rows.all_and_novel("position_error", &errors.position);
    rows.0
}

/// `[windows, features]`.
fn features(windows: &[Character], of: impl Fn(&Character) -> &Vec<f64>) -> Array2<f64> {
    let columns = windows.first().map_or(0, |window| of(window).len());
    let numbers: Vec<f64> = windows
        .iter()
        .flat_map(|it| of(it).iter().copied())
        .collect();
    // All windows are on one skeleton.
    Array2::from_shape_vec((windows.len(), columns), numbers).unwrap_or_default()
}

fn compare(
    rows: &mut Rows,
    [made, real, train]: &[Array2<f64>; 3],
    [fid, floor]: [&'static str; 2],
    spreads: [&'static str; 3],
) {
    let Some(standard) = Standardisation::of(real.view()) else {
        return;
    };
    let sets = [made, real, train].map(|set| match set.ncols() == real.ncols() {
        true => standard.apply(set.view()),
        false => Array2::zeros((0, 0)),
    });
    let [made, real, train] = &sets;
    rows.single(fid, frechet_distance(made.view(), real.view()));
    rows.single(floor, frechet_distance(train.view(), real.view()));
    for (key, set) in spreads.into_iter().zip(&sets) {
        rows.single(
            key,
            mean_pair_distance(set.view()).filter(|mean| mean.is_finite()),
        );
    }
}
