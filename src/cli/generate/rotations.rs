//! `keydance generate` with a model that makes rotations: keyframes of any skeleton that it was
//! trained on, and which foot stands when.

use std::io::Write as _;

use anyhow::Context as _;
use clap::Args;
use rand::RngExt as _;

use super::GenerateArgs;
use crate::cli::notice::warn;
use crate::models::Streams;
use crate::models::generator::Condition;
use crate::motion::{Foot, bvh};
use crate::run::{Subject, write_json};
use crate::synthesis::clip_keyframes::ClipKeyframes;
use crate::synthesis::{CompletionSummary, ContactSequence, complete};

#[derive(Debug, Args)]
pub struct ContactArgs {
    /// Which foot stands when, every frame once, such as left:0-9,right:10-24,both:25-30; where
    /// both stand one is drawn by --seed [default: the lower foot of --motion]
    #[arg(long, value_name = "FOOT:FIRST-LAST,..")]
    pub contacts: Option<ContactSequence>,
    /// What is drawn follows from this
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

/// # Errors
/// As [`super::run`].
pub fn run(args: &GenerateArgs, subject: &Subject) -> anyhow::Result<()> {
    if args.viewer.is_some() {
        anyhow::bail!(
            "--viewer shows motions of the dance skeleton by models of transitions; leave it out \
             and open {} in any viewer of BVH",
            args.out.display()
        );
    }
    if args.foot_cleanup {
        anyhow::bail!(
            "--foot-cleanup: {} keeps the standing foot still itself",
            subject.what
        );
    }
    let needs = subject.model.needs();
    let mut asked = vec![args.trajectory.asked(), args.velocity.asked()];
    let contacts = &args.contacts.contacts;
    asked.push(contacts.as_ref().map(|_| Condition::Contacts));
    let unread = asked.into_iter().flatten().filter(|&it| !needs.reads(it));
    let mut warnings: Vec<String> = unread
        .map(|it| format!("the model does not read {}: left out", it.title()))
        .collect();
    let data = args.units.over(&subject.config.data);
    let keyframes = ClipKeyframes::read(&args.keyframes.choice(data.fps), &data)?;
    warn(keyframes.notices());
    let mut drawn = Streams::new(args.contacts.seed).stream("contact_foot", &[]);
    let draw = || match drawn.random() {
        true => Foot::Right,
        false => Foot::Left,
    };
    let (rule, threshold) = (subject.model.contact_rule(), data.contact_threshold);
    let mut request = keyframes.request(&args.keyframes.length, rule, threshold, draw)?;
    if let Some(contacts) = contacts {
        let labels = contacts.labels(request.frames(), args.contacts.seed);
        request.contacts = Some(labels.context("--contacts")?);
    }
    if request.contacts.is_none() && needs.conditions.contains(&Condition::Contacts) {
        anyhow::bail!(
            "{} is told which foot stands: give --contacts left:0-9,right:10-24, or --motion, \
             whose lower foot counts",
            subject.what
        );
    }
    let name = args.out.file_name().unwrap_or_default().to_string_lossy();
    let model = subject.model.as_ref();
    let completion = complete(model, &request, args.contacts.seed, &name)?;
    let document = keyframes.document(&completion.clip);
    let document = document.context("the motion cannot be written")?;
    warnings.extend(completion.gap_warnings());
    warn(&warnings);
    bvh::write(&args.out, &document)?;
    let summary = CompletionSummary::new(&subject.what, &request, &completion, warnings);
    if let Some(path) = &args.json {
        write_json(path, &summary)?;
    }
    writeln!(std::io::stdout(), "{summary}{}", args.out.display())?;
    Ok(())
}
