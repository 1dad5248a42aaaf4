//! Figure 3 of Valle-Pérez et al.: tempograms of a song and of dances to it by several models.

pub mod tempograms;

pub use tempograms::{TempogramPanel, figure_3};

use super::{DrawnFigures, FigureRequest};
use crate::data::Recording;
use crate::evaluation::sampled_dance::dance_question;
use crate::evaluation::sampled_dance::kinematic_beats::kinematic_beats;
use crate::evaluation::sampled_dance::tempogram::{Tempogram, beat_curve};
use crate::models::{Generator, ModelError};
use crate::music::FeatureSet;
use crate::report::ReportError;

/// What the dances are drawn from.
const DRAWN: u64 = 1;
const TITLE: &str = "Figure 3: tempograms";

/// Draws figure 3: the song of a test clip, and a dance to it from the clip's beginning by every
/// model.
///
/// # Errors
/// What is to be shown is not there; rows or a page are asked for that there are not; a model fails
/// or its dance diverges.
pub fn draw(asked: &FigureRequest<'_>) -> Result<DrawnFigures, ReportError> {
    asked.without_rows()?;
    let refused = |reason: &str| Err(ReportError::Refused(reason.into()));
    if asked.page {
        return refused(
            "--viewer shows Pan et al.'s transitions; dances to a song are shown by `keydance \
             generate --music SONG --count 5 --viewer OUT.html`",
        );
    }
    if asked.start.is_some() || asked.length.is_some() {
        return refused("--start and --length: figure 3 shows a whole song; leave them out");
    }
    let test = &asked.dataset.test;
    let song = match asked.clip {
        Some(name) => test.iter().find(|it| it.name() == name),
        None => test.iter().min_by_key(|it| it.name().to_string()),
    };
    let Some(song) = song else {
        let name = asked.clip.unwrap_or_default();
        return refused(&format!("--clip {name}: there is no such test clip"));
    };
    let mut panels = vec![panel("Music", onset(song)?, song)?];
    for subject in std::iter::once(asked.subject).chain(asked.compared) {
        let curve = danced(&*subject.model, song)?;
        panels.push(panel(&subject.config.name, curve, song)?);
    }
    let sentence = format!(
        "{} and dances to it, from its own first seconds on.",
        song.name()
    );
    Ok(DrawnFigures {
        figures: vec![figure_3(&panels, &sentence)?],
        left_out: Vec::new(),
        page: None,
    })
}

fn panel(name: &str, curve: Vec<f64>, song: &Recording) -> Result<TempogramPanel, ReportError> {
    let tempogram = Tempogram::of(&curve, 1.0 / song.clip.frame_time);
    let short = || {
        ReportError::Refused(format!(
            "{TITLE}: {} is shorter than a window of 8 s; show another with --clip",
            song.name()
        ))
    };
    Ok(TempogramPanel {
        name: name.into(),
        tempogram: tempogram.ok_or_else(short)?,
    })
}

/// Onset strength of a recording's music at the rate of its motion.
fn onset(song: &Recording) -> Result<Vec<f64>, ReportError> {
    if let Some(given) = &song.given_music {
        let onset = given.columns.column(given.onset);
        return Ok(onset.iter().map(|&x| f64::from(x)).collect());
    }
    let none = || ReportError::Refused(format!("{} comes without music", song.name()));
    let heard = song.music.as_ref().ok_or_else(none)?;
    let onset = heard.features(FeatureSet::OnsetBeats);
    Ok(onset.column(0).iter().map(|&x| f64::from(x)).collect())
}

/// The beats of a model's dance to a song, weighted by how fast the body falls.
fn danced(model: &dyn Generator, song: &Recording) -> Result<Vec<f64>, ReportError> {
    let question = dance_question(model, song, song, DRAWN)?;
    let seed = question.given.len();
    let motion = model.generate(std::slice::from_ref(&question))?.remove(0);
    let none = || ModelError::Model {
        model: model.name().into(),
        reason: "gives no rotations".into(),
    };
    let poses = motion.poses.ok_or_else(none)?;
    let height: Vec<f64> = poses
        .iter()
        .skip(seed)
        .map(|pose| pose.translations[0].y)
        .collect();
    let fps = 1.0 / song.clip.frame_time;
    Ok(beat_curve(
        &kinematic_beats(&height, fps),
        height.len(),
        fps,
    ))
}
