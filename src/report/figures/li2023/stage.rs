//! Which frames of the test clips are shown, and what a model makes of them.

use glam::DVec3;

use crate::counted::counted;
use crate::data::Recording;
use crate::evaluation::in_betweening::window_question;
use crate::models::{Generator, ModelError};
use crate::motion::{Clip, ContactRule, FeatureConfig, Feet, Foot, Skeleton};
use crate::report::figures::FigureRequest;
use crate::report::{DrawnBody, MotionRow, ReportError};

/// World positions of the joints, `[frames][joints]`, cm.
pub type Positions = Vec<Vec<DVec3>>;

/// Frames of a test clip, keyframes at both ends.
#[derive(Debug, Clone, Copy)]
pub struct Window<'d> {
    pub clip: &'d Clip,
    pub start: usize,
}

/// The test clips, one window each: the first is shown, all are measured.
pub struct Stage<'d> {
    pub windows: Vec<Window<'d>>,
    pub features: FeatureConfig,
}

impl<'d> Stage<'d> {
    /// Windows of `longest` frames: of the clip that was asked for, or else the first by name, the
    /// frames that were asked for, of all others those in the middle.
    ///
    /// # Errors
    /// No test clip is long enough; what was asked for is not there.
    pub fn new(asked: &FigureRequest<'d>, longest: usize) -> Result<Self, ReportError> {
        let clips = asked.dataset.test.iter().map(|Recording { clip, .. }| clip);
        let mut clips: Vec<&Clip> = clips.filter(|clip| clip.poses.len() >= longest).collect();
        clips.sort_by(|a, b| a.name.cmp(&b.name));
        if clips.is_empty() {
            return Err(ReportError::Refused(format!(
                "no test clip has the {longest} frames that the figures show"
            )));
        }
        let mut first = 0;
        if let Some(name) = asked.clip {
            let found = clips.iter().position(|clip| clip.name == name);
            first = found.ok_or_else(|| {
                let names: Vec<&str> = clips.iter().map(|clip| clip.name.as_str()).collect();
                ReportError::Refused(format!(
                    "--clip {name} is not among the test clips with {longest} frames or more: {}",
                    names.join(", ")
                ))
            })?;
        }
        clips[..=first].rotate_right(1);
        let window = |(index, clip): (usize, &'d Clip)| {
            let last = clip.poses.len() - longest;
            let start = match asked.start {
                Some(start) if index == 0 => start,
                _ => last / 2,
            };
            match start <= last {
                true => Ok(Window { clip, start }),
                false => Err(ReportError::Refused(format!(
                    "--start {start}: {} has {}, so {longest} of them start at frame {last} at the \
                     latest",
                    clip.name,
                    counted(clip.poses.len(), "frame")
                ))),
            }
        };
        let windows = clips.into_iter().enumerate().map(window);
        Ok(Self {
            windows: windows.collect::<Result<_, _>>()?,
            features: asked.subject.config.data.features(),
        })
    }

    /// The window that is shown.
    pub fn shown(&self) -> Window<'d> {
        self.windows[0]
    }

    /// What a model makes of `frames` frames of a window, the feet in contact as recorded or as
    /// given.
    ///
    /// # Errors
    /// The model fails.
    pub fn answer(
        &self,
        model: &dyn Generator,
        window: Window<'_>,
        frames: usize,
        contacts: Option<&[Foot]>,
    ) -> Result<Positions, ReportError> {
        let range = window.start..window.start + frames;
        let mut request = window_question(model, window.clip, range, &self.features)?;
        if let (Some(feet), Some(asked)) = (contacts, &mut request.contacts) {
            for (mut row, foot) in asked.rows_mut().into_iter().zip(feet) {
                let label = foot.one_hot();
                row.iter_mut().zip(label).for_each(|(x, label)| *x = label);
            }
        }
        let motions = model.generate(std::slice::from_ref(&request))?;
        let motion = motions
            .into_iter()
            .next()
            .ok_or_else(|| ReportError::Refused(format!("{} gave no motion", model.name())))?;
        motion.check(&request)?;
        let frames = motion.positions.outer_iter();
        let at = |frame: ndarray::ArrayView2<f64>| -> Vec<DVec3> {
            let joints = frame.rows().into_iter();
            joints
                .map(|joint| DVec3::new(joint[0], joint[1], joint[2]))
                .collect()
        };
        Ok(frames.map(at).collect())
    }

    /// How far the ankle of the foot that is labelled in contact moves a frame, cm/frame.
    ///
    /// # Errors
    /// The clip has no feet that could be told by their names.
    pub fn contact_foot_speed(
        &self,
        window: Window<'_>,
        positions: &[Vec<DVec3>],
    ) -> Result<f64, ReportError> {
        let feet = window.feet()?;
        let labels = window.labels(positions.len(), self.features.contact_threshold)?;
        let steps = positions.windows(2).zip(&labels).map(|(pair, foot)| {
            let joint = feet.ankles[foot.index()];
            pair[1][joint].distance(pair[0][joint])
        });
        Ok(steps.sum::<f64>() / (positions.len() - 1) as f64)
    }
}

impl Window<'_> {
    pub fn skeleton(&self) -> &Skeleton {
        &self.clip.skeleton
    }

    /// # Errors
    /// The clip has none that could be told by their names.
    pub fn feet(&self) -> Result<Feet, ReportError> {
        let feet = Feet::of(self.skeleton());
        Ok(feet.map_err(|missing| ModelError::data(&missing))?)
    }

    /// The lower foot of every frame, `[frames]`.
    ///
    /// # Errors
    /// As [`Window::feet`].
    pub fn labels(&self, frames: usize, threshold: f64) -> Result<Vec<Foot>, ReportError> {
        let rule = ContactRule::LowerAnkle;
        let labels = rule.labels(&self.recorded(frames), &self.feet()?, threshold, || {
            Foot::Left
        });
        Ok(labels)
    }

    pub fn recorded(&self, frames: usize) -> Positions {
        let poses = &self.clip.poses[self.start..self.start + frames];
        self.skeleton().world_positions(poses)
    }

    /// "NAME, frames 120 to 150".
    pub fn describe(&self, frames: usize) -> String {
        let (name, start) = (&self.clip.name, self.start);
        format!("{name}, frames {start} to {}", start + frames - 1)
    }

    /// The recorded dancers between the keyframes.
    pub fn truth(&self, frames: usize) -> MotionRow {
        self.row("Ground truth", self.recorded(frames), false)
    }

    /// A row of dancers on this skeleton.
    pub fn row(&self, label: &str, positions: Positions, generated: bool) -> MotionRow {
        let body = DrawnBody::of(self.skeleton());
        MotionRow::of_body(label, body, positions, generated)
    }
}
