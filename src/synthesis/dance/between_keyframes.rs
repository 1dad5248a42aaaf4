//! A dance between keyframes: in transitions, or all at once by a model that makes rotations.

use rand::RngExt as _;

use super::{Dance, DanceError, DanceRequest, DanceSummary, MadeSequence, Origin};
use crate::data::DataConfig;
use crate::models::Streams;
use crate::models::generator::Condition;
use crate::models::transition::DataRanges;
use crate::motion::Foot;
use crate::run::Subject;
use crate::synthesis::clip_keyframes::ClipKeyframes;
use crate::synthesis::keyframes::Keyframes;
use crate::synthesis::{self, CompletionSummary, ControlWarning, Summary, control_warnings};

/// Transitions one after the other.
pub(super) fn synthesise(
    subject: &Subject,
    asked: &DanceRequest,
    data: &DataConfig,
    warn: &mut dyn FnMut(String),
) -> Result<Dance, DanceError> {
    let keyframes = Keyframes::read(&asked.keyframes, &asked.lengths, data)?;
    keyframes.notices().iter().cloned().for_each(&mut *warn);
    let request = keyframes.request()?;
    let (request, mut warnings) = asked.trajectory.apply(request, &keyframes)?;
    let (request, notices) = asked.velocity.apply(request, &keyframes)?;
    notices.into_iter().for_each(&mut *warn);
    let ranges = DataRanges::of_subject(subject)?;
    let unread = asked.unread(&subject.model.needs()).into_iter();
    warnings.extend(unread.map(ControlWarning::Unread));
    warnings.extend(control_warnings(&request, ranges.as_ref()));
    warnings.iter().map(ToString::to_string).for_each(warn);
    let (model, options) = (&*subject.model, asked.options);
    let sequence = synthesis::synthesise(model, &request, &options, &asked.name)?;
    let (clip, times) = (&sequence.clip, &sequence.keyframes);
    let document = keyframes.document(clip, times, sequence.pinned_to.as_ref());
    let mut summary = Summary::new(&subject.what, &request, &sequence, &options, &warnings);
    if let Some((times, frame_time)) = keyframes.times_in_document(&sequence.keyframes) {
        summary = summary.at_frames(&times, frame_time);
    }
    Ok(Dance {
        document: document.map_err(DanceError::Document)?,
        summary: DanceSummary::Sequence(summary),
        origin: Origin::Sequence(Box::new(MadeSequence {
            keyframes,
            request,
            sequence,
            options,
        })),
    })
}

/// On any skeleton that the model was trained on, with the foot that stands.
pub(super) fn complete(
    subject: &Subject,
    asked: &DanceRequest,
    data: &DataConfig,
    warn: &mut dyn FnMut(String),
) -> Result<Dance, DanceError> {
    let (model, what) = (&*subject.model, &subject.what);
    if asked.options.foot_cleanup {
        return Err(DanceError::Refused(format!(
            "--foot-cleanup: {what} keeps the standing foot still itself"
        )));
    }
    if asked.keyframes.own_frames {
        return Err(DanceError::Refused(format!(
            "--own-frames: {what} counts frames at its own rate of {}",
            data.fps
        )));
    }
    let needs = model.needs();
    let mut warnings = asked.left_out(&needs);
    let keyframes = ClipKeyframes::read(&asked.keyframes, data)?;
    keyframes.notices().iter().cloned().for_each(&mut *warn);
    let mut drawn = Streams::new(asked.seed).stream("contact_foot", &[]);
    let draw = || match drawn.random() {
        true => Foot::Right,
        false => Foot::Left,
    };
    let (rule, threshold) = (model.contact_rule(), data.contact_threshold);
    let mut request = keyframes.request(&asked.lengths, rule, threshold, draw)?;
    if let Some(contacts) = &asked.contacts {
        let labels = contacts.labels(request.frames(), asked.seed);
        request.contacts = Some(labels.map_err(DanceError::Contacts)?);
    }
    if request.contacts.is_none() && needs.conditions.contains(&Condition::Contacts) {
        return Err(DanceError::Refused(format!(
            "{what} is told which foot stands: give --contacts left:0-9,right:10-24, or --motion, \
             whose lower foot counts"
        )));
    }
    let completion = synthesis::complete(model, &request, asked.seed, &asked.name)?;
    let document = keyframes.document(&completion.clip);
    warnings.extend(completion.gap_warnings());
    warnings.iter().cloned().for_each(warn);
    let summary = CompletionSummary::new(what, &request, &completion, warnings);
    Ok(Dance {
        document: document.map_err(DanceError::Document)?,
        summary: DanceSummary::Completion(summary),
        origin: Origin::Completion {
            keyframes: request.keyframes,
            made: Box::new(completion),
        },
    })
}
