//! What the commands ask of a config of this model.

use ndarray::Array2;
use rand::{Rng, RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::batch::Batch;
use super::clips::{MusicStatistics, RecordedWindow, TrainingClip, draw, draw_keys, music_of};
use super::config::{Pu2022Settings, WindowConfig};
use super::generator::{DEVIATION, MEAN, Reference, TrainedPu2022};
use super::made_up::MadeUpTask;
use super::network::Pu2022;
use super::task::Pu2022Task;
use crate::autograd::check::CheckReport;
use crate::autograd::{AutogradError, Parameters, Real, Tape, Workspace};
use crate::data::DataConfig;
use crate::data::choreography::{ChoreographyConfig, generate};
use crate::models::exported_batch::{ExportOptions, ExportedBatch};
use crate::models::gradient_report::check_losses;
use crate::models::rotations::Body;
use crate::models::settings::{
    GradientCheckOptions, InitialRng, LoadError, ModelSettings, TaskSetting, ValueError,
};
use crate::models::weights::SavedWeights;
use crate::models::{Generator, ModelError, Streams, Task};
use crate::nn::Initialiser;

/// Uniform noise on every weight, so that none stands at a special value such as 0.
const NOISE: f64 = 0.1;
/// Key of the dropout masks.
const DROPOUT_KEY: u64 = 0x5eed;

impl Pu2022Settings {
    /// Takes windows of this many frames, as `--frames` asks.
    ///
    /// # Errors
    /// Frames that no window can have.
    fn set_length(&mut self, frames: usize) -> Result<(), ModelError> {
        self.window.length = frames;
        self.check_values().map_err(|error| ModelError::Data {
            reason: format!("--frames {frames}: {error}"),
        })
    }

    pub(super) fn build<T: Real, R: Rng>(
        &self,
        init: &mut Initialiser<'_, T, R>,
        joints: usize,
    ) -> Result<Pu2022, ModelError> {
        let network = Pu2022::new(init, self, joints, self.music.features.numbers());
        let network = network.map_err(|error| ModelError::data(&error))?;
        match init.exceeded() {
            None => Ok(network),
            Some(most) => Err(ModelError::TooLarge { most }),
        }
    }

    /// Windows of generated dance, each from a clip of its own, with music that is noise.
    ///
    /// # Errors
    /// More frames than can be generated.
    pub(super) fn made_up(
        &self,
        windows: usize,
        seed: u64,
    ) -> Result<(Vec<RecordedWindow>, Body), ModelError> {
        let clips = generate(&ChoreographyConfig {
            clips: windows,
            frames_per_clip: self.window.length,
            seed,
        });
        let clips = clips.map_err(|error| ModelError::data(&error))?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let numbers = self.music.features.numbers();
        let body = Body::of(&clips[0].clip.skeleton);
        let windows = clips.into_iter().map(|dance| {
            let music = Array2::from_shape_simple_fn((self.window.length, numbers), || {
                rng.random_range(-1.0..1.0)
            });
            // With key poses, where there may be any: what reads them is to be seen.
            let mut keys = draw_keys(&mut rng, &self.window, &self.schedule);
            while keys.is_empty() && self.schedule.key_poses > 0 {
                keys = draw_keys(&mut rng, &self.window, &self.schedule);
            }
            let clip = TrainingClip::new(dance.clip, music, false)?;
            Ok(clip.window(0, &keys, false, &self.window))
        });
        Ok((windows.collect::<Result<_, ModelError>>()?, body))
    }
}

struct Loaded {
    network: Pu2022,
    parameters: Parameters<f32>,
    reference: Reference,
    joints: usize,
}

impl Pu2022Settings {
    fn load(&self, saved: &SavedWeights) -> Result<Loaded, LoadError> {
        let body = Body::saved(saved)?;
        let numbers = self.music.features.numbers();
        let statistic = |name| -> Result<_, LoadError> {
            let values = saved.statistic(name, &[numbers])?;
            Ok(values.iter().copied().collect())
        };
        let music = MusicStatistics {
            mean: statistic(MEAN)?,
            deviation: statistic(DEVIATION)?,
        };
        let joints = body.joints();
        let reference = Reference::new(body, music, self)?;
        let (network, parameters) =
            saved.network(&reference.statistics(), |init| self.build(init, joints))?;
        Ok(Loaded {
            network,
            parameters,
            reference,
            joints,
        })
    }

    fn check_case(
        &self,
        masks: bool,
        options: &GradientCheckOptions,
    ) -> Result<CheckReport, ModelError> {
        let (windows, body) = self.made_up(options.windows.max(1), options.seed)?;
        let (given, truths): (Vec<_>, Vec<_>) = windows.into_iter().unzip();
        let batch = Batch::of(&given, &truths, &self.window, &self.loss);
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        let mut parameters = Parameters::<f64>::new();
        let mut init = Initialiser::new(&mut parameters, &mut rng);
        let network = self.build(&mut init, body.joints())?;
        for (_, mut value) in parameters.values_mut() {
            value.mapv_inplace(|x| x + rng.random_range(-NOISE..NOISE));
        }
        let key = masks.then_some(DROPOUT_KEY);
        let report = check_losses(&mut parameters, key, options.per_parameter, |tape| {
            network.losses(tape, &batch)
        });
        report.map_err(|error| ModelError::data(&error))
    }
}

impl ModelSettings for Pu2022Settings {
    fn kind(&self) -> &str {
        "pu2022"
    }

    fn check(&self, _data: &DataConfig) -> Result<(), ValueError> {
        self.check_values()
    }

    fn budget_note(&self) -> String {
        let schedule = &self.schedule;
        let WindowConfig { length, .. } = self.window;
        format!(
            "{} steps of {} windows of {length} frames",
            schedule.steps, schedule.batch_size
        )
    }

    fn task<'d>(
        &self,
        setting: &TaskSetting<'d>,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Box<dyn Task<f32> + 'd>, ModelError> {
        let task = Pu2022Task::new(self, setting, |joints| self.build(init, joints))?;
        Ok(Box::new(task))
    }

    fn made_up_task(
        &self,
        frames: Option<usize>,
        batch: usize,
        streams: Streams,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Box<dyn Task<f32>>, ModelError> {
        let mut settings = self.clone();
        settings.schedule.batch_size = batch;
        frames.map_or(Ok(()), |frames| settings.set_length(frames))?;
        Ok(Box::new(MadeUpTask::new(settings, streams, init)?))
    }

    fn trained(&self, name: &str, saved: &SavedWeights) -> Result<Box<dyn Generator>, LoadError> {
        let loaded = self.load(saved)?;
        Ok(Box::new(TrainedPu2022::new(
            name,
            loaded.network.into(),
            loaded.parameters,
            loaded.reference,
        )))
    }

    fn check_gradients(
        &self,
        options: &GradientCheckOptions,
    ) -> Result<Vec<(String, CheckReport)>, ModelError> {
        let mut settings = match options.full_size {
            true => self.clone(),
            false => self.small(),
        };
        if let Some(frames) = options.frames {
            settings.set_length(frames)?;
        }
        let case = |masks: bool| {
            let title = format!(
                "T = {}, dropout {}",
                settings.window.length,
                if masks { "on" } else { "off" }
            );
            Ok((title, settings.check_case(masks, options)?))
        };
        [false, true].into_iter().map(case).collect()
    }

    fn export_batch(
        &self,
        saved: &SavedWeights,
        setting: &TaskSetting<'_>,
        options: &ExportOptions,
    ) -> Result<ExportedBatch, LoadError> {
        options.check_not_fed()?;
        options.check_frames(self.window.length, "window.length")?;
        let loaded = self.load(saved)?;
        let windows = self.exported_windows(setting, options)?;
        let (given, truths): (Vec<_>, Vec<_>) = windows.into_iter().unzip();
        let mut exported = ExportedBatch::default();
        let results = if options.double {
            let (network, parameters) = saved
                .network::<f64, _>(&loaded.reference.statistics(), |init| {
                    self.build(init, loaded.joints)
                })?;
            let batch = Batch::of(&given, &truths, &self.window, &self.loss);
            self.add_results(&mut exported, &network, &parameters, &batch)
        } else {
            let batch = Batch::of(&given, &truths, &self.window, &self.loss);
            self.add_results(&mut exported, &loaded.network, &loaded.parameters, &batch)
        };
        results.map_err(|error| ModelError::data(&error))?;
        Ok(exported)
    }
}

impl Pu2022Settings {
    /// The windows of the first step of a training.
    fn exported_windows(
        &self,
        setting: &TaskSetting<'_>,
        options: &ExportOptions,
    ) -> Result<Vec<RecordedWindow>, ModelError> {
        let set = self.music.features;
        let recordings = &setting.dataset.train;
        let heard = recordings.iter().map(|it| music_of(it, set));
        let heard = heard.collect::<Result<Vec<_>, _>>()?;
        let statistics = MusicStatistics::of(&heard);
        let clips = recordings.iter().zip(&heard).map(|(recording, heard)| {
            TrainingClip::new(recording.clip.clone(), statistics.standardise(heard), false)
        });
        let clips = clips.collect::<Result<Vec<_>, _>>()?;
        let starts: Vec<usize> = clips.iter().map(|it| it.starts(&self.window)).collect();
        if starts.iter().all(|&starts| starts == 0) {
            let reason = "no training clip is as long as a window (window.length)".into();
            return Err(ModelError::Data { reason });
        }
        let windows = (0..options.windows as u64).map(|index| {
            let place = [0, index];
            let (window, schedule) = (&self.window, &self.schedule);
            let drawn = draw(setting.streams, place, &starts, window, schedule, false);
            clips[drawn.clip].window(drawn.start, &drawn.keys, false, window)
        });
        Ok(windows.collect())
    }

    /// Dropout is off. W windows, rows = W T: `seed [W T', 6 J + 3]`, `music [rows, numbers]`,
    /// `key_poses [rows, 6 J]`, `is_key [rows, 1]`, `local_positions [rows, d]`,
    /// `weights [W (T - T'), 1]`, `truth` and `output [W (T - T'), 6 J + 3]`, `windows [1]`;
    /// `loss.*`, `gradient.*`.
    fn add_results<T: Real>(
        &self,
        exported: &mut ExportedBatch,
        network: &Pu2022,
        parameters: &Parameters<T>,
        batch: &Batch<T>,
    ) -> Result<(), AutogradError> {
        let mut add = |name: &str, array: &Array2<T>| {
            let values: Vec<T> = array.iter().copied().collect();
            exported.add(name, array.shape(), &values);
        };
        add("seed", &batch.seed);
        add("music", &batch.music);
        add("key_poses", &batch.key_poses);
        add("is_key", &batch.is_key);
        add("local_positions", &batch.local_positions(self.model.width));
        add("weights", &batch.weights);
        if let Some(truth) = &batch.truth {
            add("truth", truth);
        }
        exported.add("windows", &[1], &[batch.windows as f32]);
        let mut workspace = Workspace::new();
        let mut tape = Tape::inference(parameters, &mut workspace);
        let output = network.forward(&mut tape, batch)?;
        exported.add("output", tape.shape(output), tape.values(output));
        drop(tape);
        exported.add_losses(parameters, &mut workspace, |tape| {
            network.losses(tape, batch)
        })
    }
}
