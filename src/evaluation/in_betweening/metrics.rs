//! The metrics, and their values from what was summed.

use super::scores::Sums;
use crate::evaluation::{Better, Metric, ScoreRow};

const fn lower(
    key: &'static str,
    title: &'static str,
    unit: &'static str,
    about: &'static str,
) -> Metric {
    Metric {
        key,
        title,
        unit,
        better: Better::Lower,
        decimals: 2,
        about,
    }
}

/// How a metric is taken from sums over windows: none where it cannot be told.
type Value = fn(&Sums) -> Option<f64>;

pub(super) const METRICS: [Metric; 12] = [
    lower(
        "l2q_local",
        "L2Q, local",
        "norm",
        "norm of the differences of all joints' local quaternions, a mean over frames",
    ),
    lower(
        "l2q_global",
        "L2Q, global",
        "norm",
        "norm of the differences of all joints' quaternions in the world, a mean over frames",
    ),
    lower(
        "l2p_relative",
        "L2P, relative",
        "standard deviations",
        "norm of the differences of all joints' positions relative to the root, each coordinate in \
         standard deviations of the training windows, a mean over frames",
    ),
    lower(
        "l2p_global",
        "L2P, global",
        "standard deviations",
        "the same of positions in the world",
    ),
    Metric {
        decimals: 4,
        ..lower(
            "npss_local",
            "NPSS, local",
            "distance of spectra",
            "normalised power spectrum similarity of local quaternions, weights shared over all \
             windows",
        )
    },
    Metric {
        decimals: 4,
        ..lower(
            "npss_global",
            "NPSS, global",
            "distance of spectra",
            "the same of quaternions in the world",
        )
    },
    lower(
        "root_error",
        "root error",
        "cm",
        "distance of the root from the recorded one, a mean over frames, cm",
    ),
    lower(
        "root_error_at_k2",
        "root error at k2",
        "cm",
        "the same in the last frame, where the model's own root is taken, cm",
    ),
    lower(
        "root_error_rtr",
        "root error against RTR",
        "cm",
        "distance of the root from the one that the recorded pose and contacts give (eq. 7 to 11), \
         a mean over frames, cm",
    ),
    lower(
        "root_error_rtr_at_k2",
        "root error against RTR at k2",
        "cm",
        "the same in the last frame, where the model's own root is taken, cm",
    ),
    lower(
        "foot_skate",
        "foot skate",
        "cm/frame",
        "how far an ankle or toe moves in a frame in which the recorded one is in contact, \
         cm/frame",
    ),
    lower(
        "contact_foot_speed",
        "speed of the contact foot",
        "cm/frame",
        "how far the foot that the recording's label calls in contact moves, cm/frame",
    ),
];

/// In the order of [`METRICS`].
const VALUES: [Value; METRICS.len()] = [
    |sums| Some(sums.l2q[0] / sums.frames as f64),
    |sums| Some(sums.l2q[1] / sums.frames as f64),
    |sums| Some(sums.l2p[0] / sums.frames as f64),
    |sums| Some(sums.l2p[1] / sums.frames as f64),
    |sums| Some(sums.npss[0].score()),
    |sums| Some(sums.npss[1].score()),
    |sums| Some(sums.root[0] / sums.frames as f64),
    |sums| Some(sums.root_at_end[0] / sums.windows as f64),
    |sums| Some(sums.root[1] / sums.frames as f64),
    |sums| Some(sums.root_at_end[1] / sums.windows as f64),
    |sums| sums.skate.mean(),
    |sums| sums.labelled.mean(),
];

/// The rows of all metrics from the sums of each length; a metric that cannot be told at some
/// length is left out.
pub(super) fn rows(lengths: &[(usize, Sums)]) -> Vec<(&'static str, ScoreRow)> {
    let metrics = METRICS.iter().zip(VALUES);
    let rows = metrics.filter_map(|(metric, value)| {
        let columns = lengths.iter();
        let columns = columns.map(|(length, sums)| Some((*length, value(sums)?)));
        let columns: Vec<(usize, f64)> = columns.collect::<Option<_>>()?;
        Some((metric.key, ScoreRow::new(columns)))
    });
    rows.collect()
}
