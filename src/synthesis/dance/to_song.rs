//! A dance to a song, from a seed and key poses.

use super::{Dance, DanceError, DanceRequest, DanceSummary, Origin};
use crate::data::DataConfig;
use crate::music::Cache;
use crate::run::Subject;
use crate::synthesis::song::{Song, SongRequest};

pub(super) fn make(
    subject: &Subject,
    asked: &DanceRequest,
    wanted: &SongRequest,
    data: &DataConfig,
    warn: &mut dyn FnMut(String),
) -> Result<Dance, DanceError> {
    let (model, refused) = (&*subject.model, |text| Err(DanceError::Refused(text)));
    if asked.keyframes.motion.is_some() {
        return refused("--motion gives no key poses to a song; name each with --keyframe".into());
    }
    if asked.options.foot_cleanup {
        let what = &subject.what;
        return refused(format!(
            "--foot-cleanup: {what}, does not tell which foot stands, so none can be pinned"
        ));
    }
    let choice = wanted.choice(&asked.keyframes)?;
    let mut song = Song::read(&choice, model, data, &Cache::of_user())?;
    song.request.seed = asked.seed;
    asked
        .left_out(&model.needs())
        .into_iter()
        .for_each(&mut *warn);
    song.notices.iter().cloned().for_each(&mut *warn);
    song.near_the_seed().for_each(&mut *warn);
    let (dance, summary) = song.dance(model, &asked.name)?;
    summary.whirl().into_iter().for_each(warn);
    Ok(Dance {
        document: song.document(&dance)?,
        summary: DanceSummary::Song(summary),
        origin: Origin::Song {
            song: Box::new(song),
            dance,
        },
    })
}
