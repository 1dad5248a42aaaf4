//! A study from folders of dances.

use std::collections::BTreeMap;
use std::path::PathBuf;

use sha2::{Digest as _, Sha256};

use super::page::{PageClip, StudyPage};
use super::stimuli::{Stimulus, stimuli};
use super::{Question, StudyClip, StudyError, StudyKey, StudyModel};
use crate::counted::counted;
use crate::data::{DataConfig, FileReading, hexadecimal};
use crate::motion::{Clip, bvh};
use crate::music;
use crate::report::viewer::Sound;

/// A piece of a dance that is shorter cannot be rated, s.
const SHORTEST: f64 = 1.0;
/// Digits of the identities of clips and studies.
const DIGITS: usize = 12;

/// What a study is to show and ask.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyRequest {
    /// In the order of tables.
    pub models: Vec<StudyModel>,
    /// Folder of the songs, a sound file of each dance's name.
    pub music: Option<PathBuf>,
    /// What participants are asked, one question after another.
    pub questions: Vec<Question>,
    /// Longest clip, s.
    pub seconds: f64,
    /// Left out at the beginning of every dance and its song, s.
    pub skip: f64,
    /// What the clips' identities and the participants' orders follow from.
    pub seed: u64,
    /// How the dances' files are read.
    pub data: DataConfig,
}

/// A study that may begin.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// The page, HTML.
    pub page: String,
    pub key: StudyKey,
    /// What is odd about the files, a sentence each.
    pub notices: Vec<String>,
}

impl StudyRequest {
    /// Reads the dances and makes the page. All dances of one name are cut to the shortest of them.
    ///
    /// # Errors
    /// Models without the same dances, a song that is not there, a dance that cannot be read or is
    /// too short, a question about music without any, lengths that are none.
    pub fn make(&self, sound: Sound<'_>) -> Result<Study, StudyError> {
        self.check()?;
        let stimuli = stimuli(&self.models, self.music.as_deref())?;
        let mut songs = Vec::new();
        let mut clips = BTreeMap::new();
        let mut key = BTreeMap::new();
        let mut notices = Vec::new();
        for stimulus in &stimuli {
            let dances = self.read(stimulus, &mut notices)?;
            if let Some(file) = &stimulus.sound {
                let heard = music::read(file)?;
                let odd = heard.warnings().iter();
                notices.extend(odd.map(|warning| format!("{} {warning}", file.display())));
                songs.push(sound.source(file).map_err(Box::new)?);
            }
            let song = stimulus.sound.as_ref().map(|_| songs.len() - 1);
            for (model, dance) in self.models.iter().zip(&dances) {
                let id = self.identity(model, &stimulus.name, dance);
                clips.insert(id.clone(), self.clip(&id, dance, song)?);
                let whose = StudyClip {
                    model: model.name.clone(),
                    stimulus: stimulus.name.clone(),
                };
                key.insert(id, whose);
            }
        }
        let mut digest = Sha256::new();
        key.keys().for_each(|id| digest.update(id));
        let study = shortened(digest);
        let page = StudyPage {
            study: &study,
            skip: self.skip,
            questions: self.questions.iter().map(|it| (*it).into()).collect(),
            songs,
            // In the order of their identities, which tells nothing.
            clips: clips.into_values().collect(),
        };
        Ok(Study {
            page: page.html(),
            key: StudyKey {
                study,
                seed: self.seed,
                seconds: self.seconds,
                skip: self.skip,
                questions: self.questions.clone(),
                models: self.models.clone(),
                clips: key,
            },
            notices,
        })
    }

    fn check(&self) -> Result<(), StudyError> {
        let refused = |problem: String| Err(StudyError::Refused(problem));
        let (seconds, skip) = (self.seconds, self.skip);
        if !(seconds.is_finite() && seconds >= SHORTEST) {
            return refused(format!(
                "clips of {seconds} s: expected at least {SHORTEST} s"
            ));
        }
        if !(skip.is_finite() && skip >= 0.0) {
            return refused(format!("{skip} s left out: expected 0 or more"));
        }
        if self.questions.is_empty() {
            return refused("a study asks at least one question".into());
        }
        let mut questions = self.questions.iter().enumerate();
        let twice = |(index, question): &(usize, &Question)| {
            let earlier = &self.questions[..*index];
            earlier.contains(question)
        };
        if let Some((_, question)) = questions.find(twice) {
            let question = question.name();
            return refused(format!("{question} is asked twice; ask each question once"));
        }
        let heard = self.questions.iter().find(|question| question.has_sound());
        match heard.filter(|_| self.music.is_none()) {
            Some(question) => refused(format!(
                "{} is about the music: name the folder of the songs (--music), or leave the \
                 question out (--questions naturalness,diversity)",
                question.name()
            )),
            None => Ok(()),
        }
    }

    /// The dances of a stimulus, all of one length, `skip` left out.
    fn read(
        &self,
        stimulus: &Stimulus,
        notices: &mut Vec<String>,
    ) -> Result<Vec<Clip>, StudyError> {
        let mut dances = Vec::new();
        for file in &stimulus.dances {
            let clip = bvh::read(file)?.to_clip();
            let reading = FileReading::of(clip, None, &self.data).map_err(Box::new)?;
            let named = |notice| format!("{}: {notice}", file.display());
            notices.extend(reading.notices.into_iter().map(named));
            dances.push(reading.recording.clip);
        }
        let skipped = self.frames(self.skip);
        let lengths = dances.iter().map(|dance| dance.poses.len());
        let length = lengths.min().unwrap_or_default().saturating_sub(skipped);
        if length < self.needed() {
            return Err(StudyError::Refused(format!(
                "{}: the shortest dance of this name has {} behind the first {} s; a study that \
                 asks this needs {}",
                stimulus.name,
                counted(length, "frame"),
                self.skip,
                self.needed()
            )));
        }
        if length < self.frames(self.seconds) {
            notices.push(format!(
                "{}: clips of {:.1} s, as long as the shortest dance of this name",
                stimulus.name,
                length as f64 / self.data.fps
            ));
        }
        for dance in &mut dances {
            dance.poses.truncate(skipped + length);
            dance.poses.drain(..skipped);
        }
        Ok(dances)
    }

    fn frames(&self, seconds: f64) -> usize {
        (seconds * self.data.fps).round() as usize
    }

    /// Frames that a dance needs.
    fn needed(&self) -> usize {
        let pieces = match self.questions.iter().any(|question| question.is_of_pairs()) {
            true => 2,
            false => 1,
        };
        pieces * self.frames(SHORTEST)
    }

    /// What a page shows of a dance: its first seconds, and, where a question is about two disjoint
    /// pieces, the first beside the last.
    fn clip(&self, id: &str, dance: &Clip, song: Option<usize>) -> Result<PageClip, StudyError> {
        let (frames, longest) = (dance.poses.len(), self.frames(self.seconds));
        let piece = longest.min(frames / 2);
        let asks = |of_pairs: bool| {
            let mut questions = self.questions.iter();
            questions.any(|question| question.is_of_pairs() == of_pairs)
        };
        let whole = asks(false).then(|| PageClip::shown(dance, &[(0, longest.min(frames))]));
        let pair =
            asks(true).then(|| PageClip::shown(dance, &[(0, piece), (frames - piece, piece)]));
        Ok(PageClip {
            id: id.into(),
            song,
            whole: whole.transpose()?,
            pair: pair.transpose()?,
        })
    }

    /// A clip's identity: of the seed, the model and the motion, so that it tells none of them, and
    /// no other study has it.
    fn identity(&self, model: &StudyModel, stimulus: &str, dance: &Clip) -> String {
        let mut digest = Sha256::new();
        digest.update(self.seed.to_le_bytes());
        for name in [&model.name, stimulus] {
            digest.update((name.len() as u64).to_le_bytes());
            digest.update(name);
        }
        for places in dance.skeleton.world_positions(&dance.poses) {
            for number in places.iter().flat_map(|place| place.to_array()) {
                digest.update(number.to_le_bytes());
            }
        }
        shortened(digest)
    }
}

fn shortened(digest: Sha256) -> String {
    let mut digits = hexadecimal(&digest.finalize());
    digits.truncate(DIGITS);
    digits
}
