//! Which files are the dances of which model, and the music of each.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{StudyError, StudyModel};
use crate::data::{clip_files, sound_files, sound_of};

/// How many names an error lists.
const NAMED: usize = 3;

/// Dances of one name: the same task for every model.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stimulus {
    /// Name of the files.
    pub name: String,
    /// A file a model, in their order.
    pub dances: Vec<PathBuf>,
    /// The song, where the study has music.
    pub sound: Option<PathBuf>,
}

/// The stimuli of models, by name.
///
/// # Errors
/// No model or two of one name, a folder without dances, a dance that another model lacks, or one
/// whose music is not in `music`.
pub(super) fn stimuli(
    models: &[StudyModel],
    music: Option<&Path>,
) -> Result<Vec<Stimulus>, StudyError> {
    for (index, StudyModel { name, .. }) in models.iter().enumerate() {
        if models[..index].iter().any(|earlier| earlier.name == *name) {
            return Err(StudyError::Refused(format!(
                "two models are called {name:?}; give each a name of its own"
            )));
        }
    }
    let folders = models.iter().map(|StudyModel { name, folder }| {
        clip_files(folder).map_err(|source| StudyError::Dances {
            model: name.clone(),
            source: Box::new(source),
        })
    });
    let folders: Vec<BTreeMap<String, PathBuf>> = folders.collect::<Result<_, _>>()?;
    let Some((first, others)) = folders.split_first() else {
        let problem = "a study needs at least one model with its dances";
        return Err(StudyError::Refused(problem.into()));
    };
    for (model, dances) in models[1..].iter().zip(others) {
        check_same((&models[0].name, first), (&model.name, dances))?;
        check_same((&model.name, dances), (&models[0].name, first))?;
    }
    let sounds = music.map(sound_files).transpose();
    let sounds = sounds.map_err(|error| StudyError::Music(Box::new(error)))?;
    let stimulus = |name: &String| {
        let sound = sounds.as_ref().map(|sounds| {
            sound_of(name, sounds).cloned().ok_or_else(|| {
                let folder = music.unwrap_or(Path::new("")).display();
                StudyError::Refused(format!(
                    "{folder} holds no music of {name}: every dance needs a sound file of its name \
                     (wav, flac, mp3 or ogg)"
                ))
            })
        });
        Ok(Stimulus {
            name: name.clone(),
            dances: folders
                .iter()
                .filter_map(|it| it.get(name))
                .cloned()
                .collect(),
            sound: sound.transpose()?,
        })
    };
    first.keys().map(stimulus).collect()
}

/// Refuses dances of one model that another lacks.
fn check_same(
    (model, dances): (&str, &BTreeMap<String, PathBuf>),
    (other, others): (&str, &BTreeMap<String, PathBuf>),
) -> Result<(), StudyError> {
    let lacking: Vec<&str> = dances
        .keys()
        .filter(|name| !others.contains_key(*name))
        .map(String::as_str)
        .collect();
    if lacking.is_empty() {
        return Ok(());
    }
    let more = match lacking.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let names = lacking[..lacking.len().min(NAMED)].join(", ");
    Err(StudyError::Refused(format!(
        "{other} lacks {names}{more}, which {model} has: every model needs a dance of every name"
    )))
}
