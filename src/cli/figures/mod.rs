//! `keydance figures`: reads a run's folder and a data folder, writes the paper's figures with captions and numbers.

mod comparison;
mod lengths;
mod output;
mod root;
mod stage;
mod velocity;
mod wording;

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;

use super::threads::Threads;
use super::viewer_page::{Shown, viewer_page};
use crate::data::Dataset;
use crate::models::ModelConfig;
use crate::models::baselines::interpolation::Interpolation;
use crate::models::transition::TransitionModel;
use crate::report::MotionKind;
use crate::run::{Subject, replace_file};
use crate::synthesis::{SynthesisOptions, synthesise};
use comparison::Entry;
use output::{Figure, index};
use stage::{Choice, Stage};

/// Draws figures 4 (b) to 12 of the paper with a trained model, each as SVG with a caption and its numbers as CSV beside it.
///
/// A figure shows one transition of a test clip: by default the one in the middle of the first clip by name. Captions and CSV files give means
/// over such a transition of every test clip that is long enough. A model follows a control where it gives at least a third of the change that is asked
/// for; the captions of figures 6 to 9 say so where it does not. Motion is shown as the model predicts it, neither bent onto the keyframes nor cleaned up.
#[derive(Debug, Args)]
pub struct FiguresArgs {
    /// Folder of a run, or the config of a model that needs no training
    #[arg(value_name = "RUN_DIR_OR_CONFIG")]
    run: PathBuf,
    /// Folder of BVH files; the run's config says which of them test
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Folder for the figures
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// A run to set beside in figures 11 and 12; may be repeated
    #[arg(long, value_name = "RUN_DIR_OR_CONFIG")]
    compare: Vec<PathBuf>,
    /// Test clip to show, by its file name [default: the first by name]
    #[arg(long, value_name = "NAME")]
    clip: Option<String>,
    /// First keyframe in that clip [default: the transition is in its middle]
    #[arg(long, value_name = "FRAME")]
    start: Option<usize>,
    /// Frames from keyframe to keyframe
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(2..=10_000))]
    length: u16,
    /// Show the transition in the motion viewer, too: one HTML page
    #[arg(long, value_name = "OUT.html")]
    viewer: Option<PathBuf>,
    /// Take other data than the run was trained on
    #[arg(long)]
    other_data: bool,
    #[command(flatten)]
    threads: Threads,
}

/// # Errors
/// A run or the data cannot be used, do not fit each other, or a model fails on them; nothing is written then. A file cannot be written.
pub fn run(args: FiguresArgs) -> anyhow::Result<()> {
    let subject = Subject::open(&args.run, &[])?;
    let compared: Vec<Subject> = args
        .compare
        .iter()
        .map(|path| Subject::open(path, &[]))
        .collect::<Result<_, _>>()?;
    for other in &compared {
        same_features(&subject, other)?;
    }
    let dataset = Dataset::load(&args.data, &subject.config.data)?;
    if !args.other_data {
        for subject in std::iter::once(&subject).chain(&compared) {
            subject.check_data(&dataset, &args.data)?;
        }
    }
    let stage = Stage::new(
        &dataset.test,
        &Choice {
            length: args.length.into(),
            clip: args.clip.as_deref(),
            start: args.start,
        },
    )?;
    let cast = Cast::new(subject, compared);
    let figures = args.threads.pool()?.install(|| cast.figures(&stage))?;
    let page = match &args.viewer {
        Some(_) => Some(cast.page(&stage)?),
        None => None,
    };
    std::fs::create_dir_all(&args.out)
        .with_context(|| format!("{} cannot be created", args.out.display()))?;
    for figure in &figures {
        figure.write(&args.out)?;
    }
    let about = format!(
        "{} on {} test clips of the data with digest {}.",
        cast.subject.what,
        dataset.test.len(),
        dataset.digest
    );
    replace_file(
        &args.out.join("index.md"),
        index(&figures, &about).as_bytes(),
    )?;
    if let Some((path, page)) = args.viewer.as_ref().zip(page) {
        replace_file(path, page.as_bytes())?;
    }
    let mut out = std::io::stdout();
    for figure in &figures {
        writeln!(out, "{}", figure.caption)?;
    }
    writeln!(out, "{}", args.out.display())?;
    Ok(())
}

/// Models are compared on the same features.
fn same_features(subject: &Subject, other: &Subject) -> anyhow::Result<()> {
    let (ours, theirs) = (&subject.config.data, &other.config.data);
    if (ours.fps, ours.features(), &ours.mapping)
        != (theirs.fps, theirs.features(), &theirs.mapping)
    {
        anyhow::bail!(
            "{} was made for data at another rate, or with another mapping, contact threshold or facing_sigma than {}: they cannot be compared",
            other.what,
            subject.what
        );
    }
    Ok(())
}

/// The models of the figures.
struct Cast {
    subject: Subject,
    compared: Vec<Subject>,
    interpolation: Interpolation,
}

impl Cast {
    fn new(subject: Subject, compared: Vec<Subject>) -> Self {
        let interpolation = Interpolation {
            contact_threshold: subject.config.data.contact_threshold,
        };
        Self {
            subject,
            compared,
            interpolation,
        }
    }

    /// Name, whether it was trained, and model: interpolation unless it is among those given, the others, the figures' own.
    fn models(&self) -> Vec<(&str, bool, &dyn TransitionModel)> {
        let given = || self.compared.iter().chain([&self.subject]);
        let mut models: Vec<(&str, bool, &dyn TransitionModel)> = Vec::new();
        if !given().any(|subject| matches!(subject.config.model, ModelConfig::Interpolation(_))) {
            models.push(("Interpolation", false, &self.interpolation));
        }
        models.extend(given().map(|subject| {
            let trained = subject.ranges.is_some();
            (
                subject.config.name.as_str(),
                trained,
                subject.model.as_ref(),
            )
        }));
        models
    }

    fn figures(&self, stage: &Stage) -> anyhow::Result<Vec<Figure>> {
        let model = self.subject.model.as_ref();
        let name = &self.subject.config.name;
        let mut entries = Vec::new();
        let models = self.models();
        for (index, &(name, trained, model)) in models.iter().enumerate() {
            entries.push(Entry {
                name: name.into(),
                drawn_with_root: trained || index + 1 == models.len(),
                generated: stage.generate(model, Ok)?,
            });
        }
        let plain = &entries.last().context("no model to draw")?.generated;
        Ok(vec![
            velocity::figure_4b(stage, model)?,
            root::figure_5(stage, name, plain)?,
            root::figure_6(stage, model, plain)?,
            root::figure_7(stage, model, plain)?,
            velocity::figure_8(stage, model, plain)?,
            velocity::figure_9(stage, model, plain)?,
            lengths::figure_10(stage, model)?,
            comparison::figure_11(stage, &entries)?,
            comparison::figure_12(stage, &entries)?,
        ])
    }

    /// The viewer's page of the shown transition, as `keydance generate` would make it.
    fn page(&self, stage: &Stage) -> anyhow::Result<String> {
        let window = stage.shown();
        let options = SynthesisOptions::default();
        let mut sequences = Vec::new();
        for (name, _, model) in self.models() {
            sequences.push((name, synthesise(model, &window.request, &options, name)?));
        }
        let mut shown = vec![Shown {
            name: "Ground truth",
            kind: MotionKind::Recorded,
            frames: window.recorded.view(),
        }];
        for (index, (name, sequence)) in sequences.iter().enumerate() {
            let own = index + 1 == sequences.len();
            shown.push(Shown {
                name,
                kind: if own {
                    MotionKind::Model
                } else {
                    MotionKind::Other
                },
                frames: sequence.features.view(),
            });
        }
        Ok(viewer_page(&window.describe(), &window.request, &shown)?)
    }
}
