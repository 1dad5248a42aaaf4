//! What the scores are called.

use Better::{Higher, Lower, Neither};

use crate::evaluation::{Better, Metric};

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

/// The unit of distances of raw columns.
const SQUARES: &str = "cm^2 + rad^2";

/// Tables 2, 3 and 4 of the paper, and ours. True dances and chance stand beside the score that they
/// are the yardstick of; each measure is a file of this folder.
#[rustfmt::skip]
pub const METRICS: [Metric; 35] = [
    metric("fpd_as_published", "FPD as published", SQUARES, Lower, 1,
        "Frechet distance of the generated frames' raw columns from the training frames', as the \
         paper's program counts: the mean of x x^T stands for the covariance"),
    metric("fpd_as_published_real", "FPD as published, real", SQUARES, Neither, 1,
        "the same of the recorded dances"),
    metric("fmd_as_published", "FMD as published", SQUARES, Lower, 1,
        "the same of three consecutive frames, cut without overlap from all dances laid end to end"),
    metric("fmd_as_published_real", "FMD as published, real", SQUARES, Neither, 1,
        "the same of the recorded dances"),
    metric("fpd", "FPD", SQUARES, Lower, 2,
        "Frechet pose distance: that of the generated frames' raw columns (cm, rad) from the \
         training frames', covariances with n - 1"),
    metric("fpd_real", "FPD, real", SQUARES, Neither, 2, "the same of the recorded dances: the floor"),
    metric("fpd_mean_pose", "FPD, mean pose", SQUARES, Neither, 2,
        "the same of the training frames' mean held: a model below it has learned something"),
    metric("fpd_without_height", "FPD without height", SQUARES, Lower, 3,
        "FPD without the root's height, which in cm rules the sum"),
    metric("fpd_without_height_real", "FPD without height, real", SQUARES, Neither, 3,
        "the same of the recorded dances"),
    metric("fpd_without_height_mean_pose", "FPD without height, mean pose", SQUARES, Neither, 3,
        "the same of the training frames' mean held"),
    metric("fmd", "FMD", SQUARES, Lower, 2,
        "Frechet movement distance: the same of three consecutive frames of a dance, every start"),
    metric("fmd_real", "FMD, real", SQUARES, Neither, 2, "the same of the recorded dances: the floor"),
    metric("fmd_mean_pose", "FMD, mean pose", SQUARES, Neither, 2,
        "the same of the training frames' mean held"),
    metric("beat_offset", "beat offset", "s", Lower, 3,
        "from a music beat to the nearest kinematic beat, a local minimum of the root's vertical \
         velocity, a mean over all music beats of all dances; smaller for a dance that trembles, so \
         see it over chance"),
    metric("beat_offset_deviation", "beat offset, deviation", "s", Neither, 3,
        "its standard deviation over all music beats of all dances"),
    metric("beat_offset_over_chance", "beat offset over chance", "ratio", Lower, 3,
        "the mean over that of beats drawn uniformly over each dance: 1 where dance and music know \
         nothing of each other"),
    metric("beat_offset_mismatched", "beat offset, mismatched", "s", Neither, 3,
        "the mean with the music of each dance to another song"),
    metric("beat_offset_deviation_mismatched", "beat offset, deviation, mismatched", "s", Neither, 3,
        "the deviation with the music of each dance to another song"),
    metric("beat_offset_real", "beat offset, real", "s", Neither, 3,
        "the mean of the recorded dances"),
    metric("beat_offset_deviation_real", "beat offset, deviation, real", "s", Neither, 3,
        "the deviation of the recorded dances"),
    metric("beat_offset_over_chance_real", "beat offset over chance, real", "ratio", Neither, 3,
        "the mean over chance of the recorded dances"),
    metric("beat_offset_real_mismatched", "beat offset, real, mismatched", "s", Neither, 3,
        "the mean of the recorded dances with the music of each dance to another song"),
    metric("beat_offset_deviation_real_mismatched", "beat offset, deviation, real, mismatched", "s",
        Neither, 3, "the deviation of the recorded dances with the music of each dance to another \
         song"),
    metric("kinematic_beats", "kinematic beats", "1/s", Neither, 2,
        "kinematic beats a second; to be near the recorded dances'"),
    metric("kinematic_beats_real", "kinematic beats, real", "1/s", Neither, 2,
        "the same of the recorded dances"),
    metric("without_kinematic_beat", "dances without a beat", "%", Lower, 1,
        "dances without a kinematic beat, which the offsets leave out"),
    metric("freezing", "dances that freeze", "%", Lower, 1,
        "dances of which some 5 s have a mean joint speed below a tenth of training's"),
    metric("freezing_real", "dances that freeze, real", "%", Neither, 1,
        "the same of the recorded dances"),
    metric("divergence", "dances that diverge", "%", Lower, 1,
        "dances of which a column leaves 10 standard deviations of training"),
    metric("diversity", "within-dance diversity", "deviations", Neither, 3,
        "distance of two pieces of 3 s of a dance, each as means and deviations of its D \
         standardised columns, / sqrt(2 D), a mean over pairs and dances; to be near the recorded \
         dances'"),
    metric("diversity_real", "within-dance diversity, real", "deviations", Neither, 3,
        "the same of the recorded dances"),
    metric("step", "step", "deviations", Neither, 3,
        "|difference| from frame to frame, a mean over standardised columns and frames; to be near \
         the recorded dances'"),
    metric("step_real", "step, real", "deviations", Neither, 3, "the same of the recorded dances"),
    metric("prompted_fmd", "FMD from seeds of a style", SQUARES, Lower, 1,
        "FMD as published of the dances from seeds of one style from the true dances of a style"),
    metric("prompted_own", "seeds that set the style", "count", Higher, 0,
        "styles whose seeds give dances nearer to their own true dances than to any other style's"),
];
