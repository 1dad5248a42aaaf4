//! The scores that the paper prints (tables 2 to 4).

/// The transition lengths of the paper's tables, frames.
pub const LENGTHS: [usize; 4] = [10, 50, 100, 150];

/// One model's row in the paper's tables: the score at each of [`LENGTHS`], then AVG.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperRow {
    /// The model's name in this crate's configs.
    pub name: &'static str,
    /// The row's name as printed.
    pub title: &'static str,
    /// Table 2, cm.
    pub lrp: [f64; 5],
    /// Table 3; it has no rows for the two baselines.
    pub avf: Option<[f64; 5]>,
    /// Table 4; it has no rows for the two baselines.
    pub art: Option<[f64; 5]>,
}

/// All rows, in the order of table 2.
pub const ROWS: [PaperRow; 8] = [
    PaperRow {
        name: "interpolation",
        title: "Interpolation",
        lrp: [13.83, 87.59, 113.59, 124.47, 84.87],
        avf: None,
        art: None,
    },
    PaperRow {
        name: "harvey",
        title: "Harvey et al. 2020",
        lrp: [141.79, 116.40, 201.43, 297.22, 189.21],
        avf: None,
        art: None,
    },
    PaperRow {
        name: "one_lstm",
        title: "One LSTM",
        lrp: [32.81, 70.49, 88.11, 100.81, 73.06],
        avf: Some([0.68, 0.75, 0.70, 0.67, 0.70]),
        art: Some([0.63, 0.74, 0.76, 0.74, 0.72]),
    },
    PaperRow {
        name: "condition_fc",
        title: "Condition-FC",
        lrp: [37.30, 67.03, 85.20, 96.39, 71.48],
        avf: Some([0.68, 0.71, 0.68, 0.65, 0.68]),
        art: Some([0.47, 0.64, 0.67, 0.67, 0.61]),
    },
    PaperRow {
        name: "one_decoder",
        title: "One decoder",
        lrp: [28.36, 51.15, 65.04, 77.24, 55.45],
        avf: Some([0.71, 0.75, 0.73, 0.70, 0.72]),
        art: Some([0.63, 0.55, 0.48, 0.39, 0.51]),
    },
    PaperRow {
        name: "without_velocity_factor",
        title: "Without Velfac constraint",
        lrp: [34.37, 62.30, 83.81, 97.52, 69.50],
        avf: Some([0.60, 0.60, 0.53, 0.49, 0.56]),
        art: Some([0.62, 0.59, 0.45, 0.34, 0.50]),
    },
    PaperRow {
        name: "without_key_loss",
        title: "Without L_key",
        lrp: [41.59, 82.95, 97.31, 105.46, 81.83],
        avf: Some([0.66, 0.68, 0.66, 0.64, 0.66]),
        art: Some([0.62, 0.42, 0.33, 0.27, 0.41]),
    },
    PaperRow {
        name: "whole_model",
        title: "Whole model",
        lrp: [27.07, 50.06, 63.01, 74.37, 53.63],
        avf: Some([0.72, 0.76, 0.75, 0.72, 0.74]),
        art: Some([0.86, 0.85, 0.80, 0.72, 0.81]),
    },
];

/// The paper's row of a model.
pub fn row(name: &str) -> Option<&'static PaperRow> {
    ROWS.iter().find(|row| row.name == name)
}
