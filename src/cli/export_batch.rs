//! `keydance export-batch`: a batch with a trained model's outputs, losses and gradients, for comparison with another
//! implementation (`scripts/compare_pytorch.py check`).

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context as _, bail};
use clap::Args;
use ndarray::{Array3, Axis};
use safetensors::tensor::{Dtype, TensorView};

use crate::autograd::{Gradients, Tape, Workspace};
use crate::data::Dataset;
use crate::models::transition::{Batch, Feed, PoseWindows};
use crate::models::transition::{RootFrame, Standardisation, windows};
use crate::run::{RunFolder, replace_file};

#[derive(Debug, Args)]
pub struct ExportBatchArgs {
    /// Folder of a run
    run: PathBuf,
    /// Folder of BVH files; windows come from its training clips
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// File to write, safetensors
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Frames of a transition
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u16).range(1..=1000))]
    frames: u16,
    /// Windows in the batch
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..=1024))]
    windows: u16,
    /// Feed the true frames instead of the model's predictions
    #[arg(long)]
    ground_truth: bool,
}

/// One array of the file: its shape and its numbers, f32.
type Entry = (Vec<usize>, Vec<f32>);

/// Dropout is off. `window [N + 1, B, 154]`, `outputs [N, B, 149]` (own predictions fed), `loss.*`, `gradient.*`.
///
/// # Errors
/// The run or the data cannot be used; no clip is long enough; the file cannot be written.
pub fn run(args: ExportBatchArgs) -> anyhow::Result<()> {
    let run = RunFolder::open(&args.run);
    let config = run.config()?;
    let model = run.trained_model(&config)?;
    let dataset = Dataset::load(&args.data, &config.data)?;
    let root_frame = config.model.root_frame();
    let (parameters, network) = (model.parameters(), model.network());
    let batch = cut(&args, &dataset, model.standardisation(), root_frame)?;
    let mut workspace = Workspace::new();
    let outputs = network.predict(&mut Tape::inference(parameters, &mut workspace), &batch)?;
    let feed = match args.ground_truth {
        true => Feed::GroundTruth,
        false => Feed::Predictions,
    };
    let feed = network.feed(feed);
    let mut gradients = Gradients::zeros(parameters);
    let mut tape = Tape::recording(parameters, &mut workspace);
    let losses = network.losses(&mut tape, &batch, feed)?;
    let mut entries: BTreeMap<String, Entry> = BTreeMap::new();
    for (name, term) in losses.terms.iter().chain([&("total", losses.total)]) {
        entries.insert(
            format!("loss.{name}"),
            (vec![1], tape.values(*term).to_vec()),
        );
    }
    tape.backward(losses.total, &mut gradients)?;
    for ((name, value), gradient) in parameters.iter().zip(gradients.iter()) {
        let entry = (value.shape().to_vec(), gradient.to_vec());
        entries.insert(format!("gradient.{name}"), entry);
    }
    for (name, array) in [("window", batch.features), ("outputs", outputs)] {
        let entry = (array.shape().to_vec(), array.into_raw_vec_and_offset().0);
        entries.insert(name.into(), entry);
    }
    let fed = f32::from(u8::from(feed == Feed::GroundTruth));
    entries.insert("ground_truth_fed".into(), (vec![1], vec![fed]));
    replace_file(&args.out, &serialise(&entries)?)?;
    Ok(())
}

/// Windows `[N + 1, B, 154]` with their poses, spread evenly over the training clips.
fn cut(
    args: &ExportBatchArgs,
    dataset: &Dataset,
    standardisation: &Standardisation,
    root_frame: RootFrame,
) -> anyhow::Result<Batch<f32>> {
    let (frames, count) = (usize::from(args.frames), usize::from(args.windows));
    let lengths: Vec<usize> = dataset.train.iter().map(|clip| clip.frames()).collect();
    let all = windows(&lengths, frames).windows;
    if all.is_empty() {
        bail!(
            "no training clip of {} has the {} frames that --frames {frames} needs",
            args.data.display(),
            frames + 1
        );
    }
    let shape = (frames + 1, count, crate::motion::features::FEATURES);
    let mut features = Array3::zeros(shape);
    let mut poses = PoseWindows::zeros(frames + 1, count);
    for (k, mut target) in features.axis_iter_mut(Axis(1)).enumerate() {
        let window = all[k * all.len() / count];
        let clip = &dataset.train[window.clip];
        let cut = root_frame.window_features(&clip.features, window.start, frames);
        target.assign(&standardisation.standardise(cut.view()).mapv(|x| x as f32));
        poses.write(k, 0..=frames, &clip.clip.poses[window.start..]);
    }
    Ok(Batch {
        poses: Some(poses),
        ..Batch::of(features)
    })
}

fn serialise(entries: &BTreeMap<String, Entry>) -> anyhow::Result<Vec<u8>> {
    let bytes: Vec<Vec<u8>> = entries
        .values()
        .map(|(_, numbers)| numbers.iter().flat_map(|x| x.to_le_bytes()).collect())
        .collect();
    let mut views = Vec::new();
    for ((name, (shape, _)), bytes) in entries.iter().zip(&bytes) {
        let view = TensorView::new(Dtype::F32, shape.clone(), bytes)
            .with_context(|| format!("{name} as a tensor"))?;
        views.push((name.as_str(), view));
    }
    Ok(safetensors::serialize(views, None)?)
}
