//! Figures as SVG text: curves of losses and scores, and dancers side by side; the motion viewer as
//! HTML, and the page of a user study.
//!
//! A figure knows numbers and positions only, no model and no training; the figures of a paper in
//! [`figures`] ask models for them.

pub mod beat_figure;
pub mod chart;
mod dancer;
pub mod demo;
mod error;
pub mod figures;
pub mod motion_figure;
mod music_strip;
pub mod root_panel;
mod run_table;
mod schedule_note;
mod score_figure;
#[cfg(feature = "papers")]
pub mod study;
pub mod svg;
mod thousands;
pub mod training_curves;
pub mod viewer;

pub use beat_figure::{BeatCurve, BeatCurveKind, BeatFigure};
pub use dancer::DrawnBody;
pub use error::{FigureError, ReportError};
pub use motion_figure::{MotionFigure, MotionRow, Placing, Shown};
pub use music_strip::MusicStrip;
pub use root_panel::{PathView, RootPaths};
pub use run_table::RunTable;
pub use schedule_note::{NO_TRAINING, schedule_note};
pub use score_figure::{ScoreSeries, score_curve, score_figure};
pub use thousands::thousands;
pub use training_curves::{
    Series, learning_rate_curve, loss_curve, total_losses_curve, validation_curve,
};
pub use viewer::{
    Asked, MotionKind, Viewer, ViewerBody, ViewerKeyframe, ViewerMotion, ViewerMusic,
};
