//! Figures as SVG text: curves of losses and scores, and dancers side by side; the motion viewer as
//! HTML.
//!
//! A figure knows numbers and positions only, no model and no training; the figures of a paper in
//! [`figures`] ask models for them.

pub mod camera;
pub mod chart;
mod dancer;
#[cfg(feature = "papers")]
pub mod demo;
#[cfg(feature = "papers")]
pub mod figures;
pub mod loss_curve;
pub mod motion_figure;
pub mod root_panel;
mod run_table;
mod schedule_note;
mod score_figure;
pub mod svg;
mod thousands;
pub mod validation_curve;
pub mod viewer;

pub use loss_curve::{LossSeries, loss_curve};
pub use motion_figure::{MotionFigure, MotionRow, Placing, Shown};
pub use root_panel::{PathView, RootPaths};
pub use run_table::RunTable;
pub use schedule_note::{NO_TRAINING, schedule_note};
pub use score_figure::{ScoreSeries, score_curve, score_figure};
pub use thousands::thousands;
pub use validation_curve::{ValidationSeries, validation_curve};
pub use viewer::{Asked, MotionKind, Viewer, ViewerKeyframe, ViewerMotion};

/// Why a figure cannot be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FigureError {
    #[error("the figure {figure:?} has nothing to draw: {what}")]
    Empty { figure: String, what: &'static str },
    #[error("the figure {figure:?}: {series} has a NaN or an infinity")]
    NotFinite { figure: String, series: String },
    #[error(
        "the figure {figure:?}: {row} has {found} frames, the first row has {expected}; rows show the same frames"
    )]
    Frames {
        figure: String,
        row: String,
        found: usize,
        expected: usize,
    },
    #[error(
        "{figure:?}: keyframe {frame} lies outside its {frames} frames, which are numbered from 0"
    )]
    Keyframe {
        figure: String,
        frame: usize,
        frames: usize,
    },
}
