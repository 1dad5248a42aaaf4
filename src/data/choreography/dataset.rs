//! Generated dances with their music as a data set.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::DanceWithMusic;
use crate::data::{DataConfig, DataError, Dataset};
use crate::music::{Analysis, RATE, Sound};

/// Dances with what is heard in their music, read and split as `config` says.
///
/// # Errors
/// The clips do not fit the config, or a sound cannot be heard.
pub fn dataset_with_music(
    dances: &BTreeMap<String, DanceWithMusic>,
    config: &DataConfig,
) -> Result<Dataset, DataError> {
    let clips = dances.values().map(|it| it.dance.clip.clone()).collect();
    let mut dataset = Dataset::from_clips(clips, config)?;
    let Dataset {
        train,
        validation,
        test,
        ..
    } = &mut dataset;
    let recordings = train.par_iter_mut().chain(validation).chain(test);
    recordings.try_for_each(|recording| {
        let samples = dances.get(recording.name()).map(|it| &it.samples);
        let sound = Sound::new(recording.name(), samples.map_or(&[], |it| it), RATE)?;
        recording.music = Some(Arc::new(Analysis::of(&sound)?));
        Ok::<(), DataError>(())
    })?;
    Ok(dataset)
}

/// Dances by their clips' names.
pub fn by_name(dances: Vec<DanceWithMusic>) -> BTreeMap<String, DanceWithMusic> {
    let named = dances.into_iter();
    named
        .map(|dance| (dance.dance.clip.name.clone(), dance))
        .collect()
}
