//! The fitted baseline as a generator.

use ndarray::{Array1, Array2, s};

use super::NAME;
use super::fit::{Fitted, LOOK_BACK};
use super::settings::Settings;
use crate::data::Recording;
use crate::models::dance_features::{DanceFeatures, Piece, SampledFrames};
use crate::models::flow::noise_like;
use crate::models::generator::{Motion, NeededPoses, Needs, Request, Sampling};
use crate::models::{Generator, ModelError, Streams};
use crate::music::FeatureSet;

/// Draws dances frame by frame, and tells likelihoods, by what was fitted to training clips.
pub struct LinearGaussian {
    settings: Settings,
    /// None before [`Generator::look_up_in`].
    fitted: Option<(DanceFeatures, Fitted)>,
}

impl LinearGaussian {
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            fitted: None,
        }
    }

    fn fitted(&self) -> Result<&(DanceFeatures, Fitted), ModelError> {
        self.fitted.as_ref().ok_or_else(|| ModelError::Model {
            model: NAME.into(),
            reason: "is fitted to training clips; give their folder as --data".into(),
        })
    }

    fn dance(&self, index: usize, request: &Request) -> Result<Motion, ModelError> {
        request.check(NAME, &self.needs())?;
        let (features, fitted) = self.fitted()?;
        let generation = &self.settings.generation;
        let given = features.given(request, self.settings.model.contexts().past())?;
        let mut frames = SampledFrames::after(given.motion.view());
        let mut rng = Streams::new(request.seed).stream("dance", &[]);
        while frames.len() < request.frames {
            let before = frames.last(LOOK_BACK).mapv(f64::from);
            let draws = noise_like(&mut rng, (1, fitted.draws()), generation.temperature);
            let draws: Vec<f64> = draws.into_iter().collect();
            let next = Array1::from_vec(fitted.sample(before.view(), &draws));
            frames.push(
                (NAME, index),
                next.view(),
                generation.clamp,
                &features.columns,
            )?;
        }
        features.motion(&given, frames.generated(request.frames).view())
    }
}

impl Generator for LinearGaussian {
    fn name(&self) -> &str {
        NAME
    }

    fn needs(&self) -> Needs {
        Needs {
            poses: NeededPoses::Seed(self.settings.model.contexts().past()),
            conditions: &[],
            heeds: &[],
        }
    }

    fn look_up_in(&mut self, training: &[Recording]) -> Result<(), ModelError> {
        let Settings {
            model,
            features,
            augmentation,
            ..
        } = &self.settings;
        let features = DanceFeatures::fit(training, features, augmentation.mirror)?;
        let pieces = training.iter().map(|recording| features.piece(recording));
        let mut pieces: Vec<Piece> = pieces.collect::<Result<_, _>>()?;
        if augmentation.mirror {
            let images = pieces.iter().map(|piece| features.mirrored(piece));
            let images: Vec<Piece> = images.collect::<Result<_, _>>()?;
            pieces.extend(images);
        }
        let motions = pieces.iter().map(|piece| piece.motion.mapv(f64::from));
        let motions: Vec<Array2<f64>> = motions.collect();
        let fitted = Fitted::to(&motions, model.base, model.covariance, model.contexts())?;
        self.fitted = Some((features, fitted));
        Ok(())
    }

    fn music_features(&self) -> FeatureSet {
        self.settings
            .features
            .audio
            .feature_set()
            .unwrap_or_default()
    }

    fn reads_given_music(&self) -> bool {
        self.settings.features.audio.feature_set().is_none()
    }

    fn sampling(&self) -> Option<Sampling> {
        let contexts = self.settings.model.contexts();
        Some(Sampling {
            predicted: contexts.predicted,
            look_ahead: contexts.audio_future - 1,
        })
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        let requests = requests.iter().enumerate();
        requests
            .map(|(index, request)| self.dance(index, request))
            .collect()
    }

    /// What a network would know changes nothing: the frames that are looked at go by the truth.
    fn log_likelihoods_knowing(
        &self,
        _known: &[Request],
        requests: &[Request],
        truths: &[Motion],
    ) -> Result<Vec<f64>, ModelError> {
        let (features, fitted) = self.fitted()?;
        let contexts = self.settings.model.contexts();
        let density = |(request, truth): (&Request, &Motion)| {
            request.check(NAME, &self.needs())?;
            let given = features.given(request, contexts.past())?;
            let end = contexts.past() + contexts.predicted;
            let recorded = given.recorded(features, truth, end)?;
            let frames = recorded.slice(s![contexts.past() - LOOK_BACK.., ..]);
            Ok(fitted.log_density(frames.mapv(f64::from).view()))
        };
        requests.iter().zip(truths).map(density).collect()
    }
}
