//! The model that a command works with: a trained run's, or one that needs no training.

use std::path::Path;

use anyhow::Context as _;

use crate::data::Dataset;
use crate::experiment::ExperimentConfig;
use crate::models::ModelConfig;
use crate::models::transition::DataRanges;
use crate::models::transition::TransitionModel;
use crate::run::RunFolder;

pub struct Subject {
    pub config: ExperimentConfig,
    pub model: Box<dyn TransitionModel>,
    /// What to call it in the output.
    pub what: String,
    /// The run's folder; none for a config.
    pub run: Option<RunFolder>,
    /// Bounds of the controls in what the model was trained on; none without training.
    pub ranges: Option<DataRanges>,
}

impl Subject {
    /// Opens a run's folder, or the config of a model that needs no training; `set` overrides keys of the config.
    ///
    /// # Errors
    /// There is no such run or config, its model is not trained, or its weights are damaged.
    pub fn open(path: &Path, set: &[String]) -> anyhow::Result<Self> {
        if !path.is_dir() {
            let config = ExperimentConfig::load(path, set)?;
            let threshold = config.data.contact_threshold;
            let model = config.model.untrained(threshold).with_context(|| {
                format!(
                    "{} describes a model that is trained; train it with `keydance train {} --data DIR --out RUN_DIR` and \
                     give RUN_DIR instead",
                    path.display(),
                    path.display(),
                )
            })?;
            return Ok(Self {
                what: format!("{} of {}", config.name, path.display()),
                config,
                model,
                run: None,
                ranges: None,
            });
        }
        let run = RunFolder::open(path);
        if !run.config_path().exists() {
            anyhow::bail!(
                "{} is not a run's folder: it has no {}; `keydance train` makes one",
                path.display(),
                file_name(&run.config_path())
            );
        }
        let config = ExperimentConfig::load(&run.config_path(), set)?;
        let untrained = config.model.untrained(config.data.contact_threshold);
        let (model, what, ranges) = match untrained {
            Some(model) => (
                model,
                format!("{} of {}", config.name, path.display()),
                None,
            ),
            None => {
                let model = run.trained_model(&config)?;
                let saved = run.manifest()?.and_then(|manifest| manifest.data_ranges);
                let ranges =
                    saved.unwrap_or_else(|| DataRanges::from_statistics(model.standardisation()));
                let weights = run.newest_weights()?;
                let what = format!("{}, {}", config.name, weights.display());
                (
                    Box::new(model) as Box<dyn TransitionModel>,
                    what,
                    Some(ranges),
                )
            }
        };
        Ok(Self {
            config,
            model,
            what,
            run: Some(run),
            ranges,
        })
    }

    /// Whether the model is interpolation, which other models are shown beside.
    pub fn is_interpolation(&self) -> bool {
        matches!(self.config.model, ModelConfig::Interpolation(_))
    }

    /// Refuses data that the run was not trained on: its training clips may be test clips there.
    ///
    /// # Errors
    /// The config reads or splits the data otherwise than the run's, or the data has another digest than the run's manifest says.
    pub fn check_data(&self, dataset: &Dataset, folder: &Path) -> anyhow::Result<()> {
        let Some(run) = &self.run else {
            return Ok(());
        };
        let trained = run.config()?.data;
        if trained != self.config.data {
            let config = |data| ExperimentConfig {
                data,
                ..ExperimentConfig::default()
            };
            let differences = config(trained).differences(&config(self.config.data.clone()))?;
            anyhow::bail!(
                "{} was trained on other clips or features of the data ({}; values there, values now), so some of these may be its \
                 training clips; give --other-data to use it on them all the same",
                run.path().display(),
                differences.join("; ")
            );
        }
        if let Some(manifest) = run.manifest()?
            && manifest.data_digest != dataset.digest
        {
            anyhow::bail!(
                "{} was trained on data with digest {}, {} has digest {}; give --other-data to use it there all the same",
                manifest.name,
                manifest.data_digest,
                folder.display(),
                dataset.digest
            );
        }
        Ok(())
    }
}

fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}
