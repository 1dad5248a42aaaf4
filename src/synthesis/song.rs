//! A dance to a song, from a seed and a few key poses, by a model that hears.

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::DVec3;
use serde::Serialize;
use thiserror::Error;

use super::keyframes::{FileFrom, FileKeyframe, KeyframeChoice, KeyframeError, LONGEST};
use super::seams::{Seam, ease};
use super::song_files::{SongFile, SongFiles, SongPoses};
use super::stand::stand;
use super::summary::Units;
use crate::counted::counted;
use crate::data::DataConfig;
use crate::models::generator::{Given, Motion, NeededPoses, Request};
use crate::models::{Generator, ModelError};
use crate::motion::bvh::{self, Bvh, BvhError};
use crate::motion::fit::RotationFitError;
use crate::motion::rig::RigKeyframe;
use crate::motion::{Clip, Mapping, MappingError, Pose, ResampleError};
use crate::music::{Analysis, Cache, MusicError};

/// The hips of a dancer turn by less than this from one frame to the next, rad.
const WHIRL: f64 = 0.7;

/// Key poses nearer to the seed than this get a warning, frames.
const NEAR: usize = 5;

/// What the dance goes on from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Seed {
    /// Frames of a clip: from one on, or the last ones.
    Motion(PathBuf, Option<usize>),
    /// One pose, held.
    Pose(FileFrom),
}

impl Seed {
    /// The file that it is from.
    pub fn file(&self) -> &PathBuf {
        match self {
            Self::Motion(file, _) => file,
            Self::Pose(from) => &from.file,
        }
    }
}

/// A song and its seed, before it is known whether the model asks for one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SongRequest {
    pub music: PathBuf,
    pub seed: Option<Seed>,
    /// Frames of the result, where it is to be shorter than the song.
    pub frames: Option<usize>,
}

impl SongRequest {
    /// The files that it names.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        [&self.music]
            .into_iter()
            .chain(self.seed.iter().map(Seed::file))
    }

    /// The same with keyframes as its key poses.
    ///
    /// # Errors
    /// There is no seed.
    pub fn choice(&self, keyframes: &KeyframeChoice) -> Result<SongChoice, SongError> {
        Ok(SongChoice {
            music: self.music.clone(),
            seed: self.seed.clone().ok_or(SongError::NoSeed)?,
            key_poses: keyframes.further.clone(),
            frames: self.frames,
            mapping: keyframes.mapping.clone(),
        })
    }
}

/// What is asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SongChoice {
    pub music: PathBuf,
    pub seed: Seed,
    pub key_poses: Vec<FileKeyframe>,
    /// Frames of the result, where it is to be shorter than the song.
    pub frames: Option<usize>,
    /// For clips on another skeleton, in place of the data's.
    pub mapping: Option<PathBuf>,
}

/// Why there is no dance to a song.
#[derive(Debug, Error)]
pub enum SongError {
    #[error(transparent)]
    Music(#[from] MusicError),
    #[error(transparent)]
    Keyframe(#[from] KeyframeError),
    #[error(transparent)]
    Mapping(#[from] MappingError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(
        "a dance goes on from something: give --seed-motion FILE.bvh, or --seed-pose FILE.bvh:FRAME"
    )]
    NoSeed,
    #[error("{model} does not dance to music from a seed; give --keyframe or --motion alone")]
    Deaf { model: String },
    #[error(
        "the model's data has {fps} frames a second and its music is heard at {heard}; such a model \
         cannot dance to a song"
    )]
    Rate { fps: f64, heard: f64 },
    #[error(
        "{model} hears the numbers that its data set gives of its music (features.audio = \
         \"as_given\"), which of another song nobody can compute; take a model that was trained with \
         features.audio = \"transflower85\" or \"onset_beats\""
    )]
    GivenMusic { model: String },
    #[error(
        "a dance of {} to {song} is no longer than the seed, {}: give a longer song, or a later end",
        counted(*frames, "frame"),
        counted(*seed, "frame")
    )]
    Short {
        song: PathBuf,
        frames: usize,
        seed: usize,
    },
    #[error("{song} has {}, beyond {LONGEST}; cut it", counted(*frames, "frame"))]
    Long { song: PathBuf, frames: usize },
    #[error(
        "{file} has {} from frame {first} on, the model goes on from {}; give a longer clip, or one \
         pose with --seed-pose", counted(*found, "frame"), counted(*needed, "frame")
    )]
    ShortSeed {
        file: PathBuf,
        first: usize,
        found: usize,
        needed: usize,
    },
    #[error(
        "{clip} has {}, and the model goes on from the first {} of a dance; give a longer dance",
        counted(*found, "frame"), counted(*needed, "frame")
    )]
    ShortDance {
        clip: PathBuf,
        found: usize,
        needed: usize,
    },
    #[error(
        "the key pose {key} lies beyond the dance, whose last frame is {last} ({:.2} s)",
        *last as f64 / fps
    )]
    Beyond { key: String, last: usize, fps: f64 },
    #[error(
        "the key pose {key} lies in the seed, whose last frame is {last} ({:.2} s); give a later time",
        *last as f64 / fps
    )]
    InSeed { key: String, last: usize, fps: f64 },
    #[error("two key poses stand at frame {frame} of the result, {} and {}; keep one", keys[0], keys[1])]
    Twice { frame: usize, keys: [String; 2] },
    #[error("{model} gave no rotations")]
    NoRotations { model: String },
    #[error("{file}: its poses cannot be brought onto the skeleton that the model dances on")]
    RestPose {
        file: PathBuf,
        source: RotationFitError,
    },
    #[error(transparent)]
    Resample(#[from] ResampleError),
    #[error("the motion cannot be written")]
    Document(#[source] BvhError),
    #[error(transparent)]
    Write(#[from] BvhError),
}

/// A song, a seed and key poses, read.
pub struct Song {
    /// What the model is asked.
    pub request: Request,
    pub music: Analysis,
    /// Its file.
    pub file: PathBuf,
    /// T', frames of the seed.
    pub seed: usize,
    /// The seed is one pose, held.
    pub held: bool,
    /// What is odd about the files and what was asked for, a sentence each.
    pub notices: Vec<String>,
    first: SongFile,
    /// What is given as the rig of the seed's file has it.
    on_rig: Vec<RigKeyframe>,
}

impl Song {
    /// Reads the files of a choice for a model, in the unit, axis and rate of `data`.
    ///
    /// # Errors
    /// A model that does not go on from a seed, a file that cannot be read, a song shorter than the
    /// seed, key poses that are not in the dance.
    pub fn read(
        choice: &SongChoice,
        model: &dyn Generator,
        data: &DataConfig,
        cache: &Cache,
    ) -> Result<Self, SongError> {
        let NeededPoses::Seed(needed) = model.needs().poses else {
            let model = model.name().into();
            return Err(SongError::Deaf { model });
        };
        if model.reads_given_music() {
            let model = model.name().into();
            return Err(SongError::GivenMusic { model });
        }
        let heard = model.music_features().frame_rate();
        if data.fps != heard {
            let fps = data.fps;
            return Err(SongError::Rate { fps, heard });
        }
        let heard = cache.analysis(&choice.music)?;
        let named = |notice| format!("{}: {notice}", choice.music.display());
        let mut notices: Vec<String> = heard.warnings.into_iter().map(named).collect();
        let music = heard.analysis;
        let heard = music.features(model.music_features());
        let frames = heard.nrows().min(choice.frames.unwrap_or(usize::MAX));
        let song = || choice.music.clone();
        if !music.has_onsets() {
            notices.push(format!("no beat is heard in {}", choice.music.display()));
        }
        if let Some(wanted) = choice.frames.filter(|wanted| *wanted > heard.nrows()) {
            let (song, end) = (choice.music.display(), heard.nrows());
            notices.push(format!("{song} ends at frame {end}, before frame {wanted}"));
        }
        if frames <= needed {
            return Err(SongError::Short {
                song: song(),
                frames,
                seed: needed,
            });
        }
        if frames > LONGEST as usize {
            return Err(SongError::Long {
                song: song(),
                frames,
            });
        }
        let mapping = match &choice.mapping {
            Some(path) => Some(Mapping::read(path)?),
            None => data.mapping.clone(),
        };
        let mut files = SongFiles::new(mapping, data, model.rest_pose());
        let SongPoses {
            skeleton,
            seed,
            keys,
            on_rig,
        } = files.given(&choice.seed, &choice.key_poses, needed, frames)?;
        notices.append(&mut files.notices);
        let first = files.into_file(choice.seed.file());
        let first = first.ok_or(KeyframeError::None)?;
        let seed = seed.into_iter().enumerate();
        let given = seed.chain(keys).map(|(frame, pose)| Given {
            frame: frame as i64,
            pose,
            features: None,
        });
        let heard = heard.mapv(f64::from);
        let request = Request {
            given: given.collect(),
            music: Some(heard),
            ..Request::new(skeleton, first.clip.frame_time, frames)
        };
        Ok(Self {
            request,
            music,
            file: choice.music.clone(),
            seed: needed,
            held: matches!(choice.seed, Seed::Pose(_)),
            notices,
            first,
            on_rig,
        })
    }

    /// Warnings of key poses so near to the seed that the dance may jerk to them.
    pub fn near_the_seed(&self) -> impl Iterator<Item = String> {
        let (last, free) = (self.seed.saturating_sub(1), self.seed + NEAR);
        let frames = self.keys().map(|given| given.frame as usize);
        frames.filter(move |frame| *frame < free).map(move |frame| {
            format!(
                "the key pose at frame {frame} comes within {NEAR} frames of the seed, whose last \
                 frame is {last}, so the dance may jerk to it; put it at frame {free} or later"
            )
        })
    }

    /// Frames of the file that the seed is from.
    pub fn seed_clip_frames(&self) -> usize {
        self.first.clip.poses.len()
    }

    /// The dance that a model makes of it, as a clip `name`, on the floor of its seed and without
    /// the jumps where pieces of it meet; and how well it meets its key poses.
    ///
    /// # Errors
    /// The model fails, or gives no rotations.
    pub fn dance(
        &self,
        model: &dyn Generator,
        name: &str,
    ) -> Result<(Clip, SongSummary), SongError> {
        let start = Instant::now();
        let motions = model.generate(std::slice::from_ref(&self.request))?;
        let taken = start.elapsed().as_secs_f64();
        let no_rotations = || SongError::NoRotations {
            model: model.name().into(),
        };
        let motion = motions.into_iter().next().ok_or_else(no_rotations)?;
        motion.check(&self.request)?;
        let Motion { poses, pieces, .. } = motion;
        let mut clip = Clip {
            name: name.into(),
            skeleton: self.request.skeleton.clone(),
            frame_time: self.request.frame_time,
            poses: poses.ok_or_else(no_rotations)?,
        };
        stand(&clip.skeleton, &mut clip.poses, self.seed);
        let seams = match pieces.is_empty() {
            true => vec![self.seed],
            false => pieces,
        };
        let keys: Vec<usize> = self.keys().map(|given| given.frame as usize).collect();
        let seams = ease(&clip.skeleton, &mut clip.poses, &seams, &keys);
        let mut summary = self.summary(model.name(), &clip, seams);
        let made = clip.poses.len().saturating_sub(self.seed) as f64;
        summary.frames_a_second = made / taken.max(1e-9);
        Ok((clip, summary))
    }

    /// The same, written as BVH.
    ///
    /// # Errors
    /// As [`Song::dance`]; the file cannot be written.
    pub fn write(&self, model: &dyn Generator, path: &Path) -> Result<SongSummary, SongError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let (dance, summary) = self.dance(model, &name)?;
        bvh::write(path, &self.document(&dance)?)?;
        Ok(summary)
    }

    /// The key poses among what is given.
    fn keys(&self) -> impl Iterator<Item = &Given> {
        let given = self.request.given.iter();
        given.filter(|given| given.frame >= self.seed as i64)
    }

    fn summary(&self, model: &str, clip: &Clip, seams: Vec<Seam>) -> SongSummary {
        let about_root = |pose: &Pose| -> Vec<DVec3> {
            let world = pose.world_positions(&clip.skeleton);
            world.iter().map(|joint| *joint - world[0]).collect()
        };
        let key_poses = self.keys().map(|given| {
            let frame = given.frame as usize;
            // Where the key pose looks is met too, so both are compared in the world's orientation.
            let (own, wanted) = (about_root(&clip.poses[frame]), about_root(&given.pose));
            let distances = own.iter().zip(&wanted).map(|(a, b)| a.distance(*b));
            KeyPoseMiss {
                frame,
                seconds: frame as f64 * clip.frame_time,
                distance: distances.sum::<f64>() / own.len() as f64,
            }
        });
        SongSummary {
            model: model.into(),
            frames: clip.poses.len(),
            seconds: clip.poses.len() as f64 * clip.frame_time,
            tempo: self.music.tempo,
            metre: self.music.metre,
            seed_frames: self.seed,
            seed_is_held: self.held,
            key_poses: key_poses.collect(),
            seams,
            whirls: whirls(clip),
            frames_a_second: 0.0,
            units: Units::from([
                ("seconds", "s"),
                ("tempo", "beats/min"),
                ("metre", "beats/bar"),
                ("distance", "cm"),
                ("jump", "cm"),
                ("turn", "degrees"),
            ]),
        }
    }

    /// A dance as a file's content: on the rig of the seed's file where its joints were recognised
    /// or mapped, in its unit, axis and rate; else with the file's channels, or with Z X Y
    /// rotations where these cannot hold it.
    ///
    /// # Errors
    /// The clip is not one that a file could hold.
    pub fn document(&self, dance: &Clip) -> Result<Bvh, SongError> {
        self.first.document(dance, &self.on_rig)
    }
}

/// The numbers of a dance to a song: as text and as JSON.
#[derive(Debug, Serialize)]
pub struct SongSummary {
    model: String,
    frames: usize,
    seconds: f64,
    /// Beats a minute.
    tempo: f64,
    /// Beats of a bar.
    metre: usize,
    seed_frames: usize,
    seed_is_held: bool,
    key_poses: Vec<KeyPoseMiss>,
    /// Where pieces meet, and how far the model jumped there before it was eased.
    seams: Vec<Seam>,
    /// Where the hips turn faster than a dancer's.
    whirls: Vec<Whirl>,
    /// Frames that were made in a second of the clock: another each time, so no JSON holds it.
    #[serde(skip)]
    frames_a_second: f64,
    units: Units,
}

/// The hips turn by so much from the frame before.
#[derive(Debug, Serialize)]
struct Whirl {
    frame: usize,
    turn: f64,
}

fn whirls(clip: &Clip) -> Vec<Whirl> {
    let pairs = clip.poses.windows(2).enumerate();
    let turns = pairs.map(|(index, pair)| Whirl {
        frame: index + 1,
        turn: pair[0].rotations[0].angle_between(pair[1].rotations[0]),
    });
    let whirls = turns.filter(|whirl| whirl.turn > WHIRL);
    let in_degrees = |whirl: Whirl| Whirl {
        turn: whirl.turn.to_degrees(),
        ..whirl
    };
    whirls.map(in_degrees).collect()
}

#[derive(Debug, Serialize)]
struct KeyPoseMiss {
    frame: usize,
    seconds: f64,
    /// Mean distance of the joints from the key pose's, about the root, cm.
    distance: f64,
}

impl SongSummary {
    /// Says where the hips turn as no dancer's do: as the model made them, or where a wide seam was
    /// eased in few frames.
    pub fn whirl(&self) -> Option<String> {
        let widest = self
            .whirls
            .iter()
            .max_by(|a, b| a.turn.total_cmp(&b.turn))?;
        let others = match self.whirls.len() - 1 {
            0 => String::new(),
            more => format!(", and by more than 40 at {}", counted(more, "other frame")),
        };
        let (turn, frame) = (widest.turn, widest.frame);
        Some(format!(
            "the hips turn by {turn:.0} degrees at frame {frame}{others}: another seed or other key \
             poses may do better"
        ))
    }

    /// How many key poses there are and how far the dance is from them on average.
    pub fn about_key_poses(&self) -> String {
        let count = self.key_poses.len();
        let distances = self.key_poses.iter().map(|key| key.distance);
        let mean = distances.sum::<f64>() / count.max(1) as f64;
        match count {
            0 => "no key poses".into(),
            _ => format!(
                "{}, joints {mean:.1} cm from them on average",
                counted(count, "key pose")
            ),
        }
    }
}

impl fmt::Display for SongSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.model)?;
        let frames = counted(self.frames, "frame");
        writeln!(f, "{frames}, {:.2} s", self.seconds)?;
        writeln!(
            f,
            "music: {:.1} beats a minute, {} a bar",
            self.tempo, self.metre
        )?;
        let seed = counted(self.seed_frames, "frame");
        match self.seed_is_held {
            true => writeln!(f, "seed: one pose held for {seed}")?,
            false => writeln!(f, "seed: {seed}")?,
        }
        writeln!(f, "made: {:.0} frames a second", self.frames_a_second)?;
        let jumps = self.seams.iter().map(|seam| seam.jump);
        let (count, most) = (self.seams.len(), jumps.fold(0.0, f64::max));
        if count > 0 {
            writeln!(
                f,
                "seams: {count}, at the widest of which joints jump by {most:.1} cm on average; eased \
                 out"
            )?;
        }
        for KeyPoseMiss {
            frame,
            seconds,
            distance,
        } in &self.key_poses
        {
            writeln!(
                f,
                "key pose at frame {frame} ({seconds:.2} s): joints {distance:.1} cm from it on average"
            )?;
        }
        Ok(())
    }
}
