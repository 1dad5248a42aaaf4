//! `--motion`, `--keyframes` and `--keyframe`: which frames of which files, and when.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use clap::Args;
use ndarray::{ArrayView2, s};

use crate::data::{DanceClip, DataConfig};
use crate::motion::Mapping;
use crate::motion::bvh::{self, Channel};
use crate::synthesis::{KeyframeSource, SequenceRequest, SynthesisError};

#[derive(Debug, Args)]
pub struct KeyframeArgs {
    /// BVH file of the dancer; gives the root trajectory and the velocity factors between its keyframes, too
    #[arg(long, value_name = "FILE.bvh", requires = "keyframes")]
    motion: Option<PathBuf>,
    /// Frames of --motion that are keyframes, ascending, such as 120,180,260; the first becomes frame 0 of the result, the others keep their distances
    #[arg(
        long,
        value_name = "FRAMES",
        value_delimiter = ',',
        requires = "motion"
    )]
    keyframes: Vec<usize>,
    /// A frame of any file as a keyframe, and its frame in the result, such as jump.bvh:75@60; may be repeated
    #[arg(long, value_name = "FILE.bvh:FRAME@TIME", value_parser = parse_keyframe)]
    keyframe: Vec<KeyframeArg>,
    /// Mapping file for clips on a skeleton other than the dance skeleton [default: the run's]
    #[arg(long, value_name = "FILE")]
    mapping: Option<PathBuf>,
    /// Frames from each keyframe of --motion to the next: one number for all, or one for each, such as 100,250
    #[arg(long, value_name = "FRAMES", value_delimiter = ',', requires = "motion", conflicts_with = "keyframe",
        value_parser = clap::value_parser!(u32).range(1..=i64::from(LONGEST)))]
    length: Vec<u32>,
}

/// Frames of a result at most: an hour at 30 a second.
const LONGEST: u32 = 108_000;

/// One `--keyframe`.
#[derive(Debug, Clone, PartialEq, Eq)]
struct KeyframeArg {
    file: PathBuf,
    frame: usize,
    time: usize,
}

fn parse_keyframe(text: &str) -> Result<KeyframeArg, String> {
    let parts = || {
        let (rest, time) = text.rsplit_once('@')?;
        let (file, frame) = rest.rsplit_once(':')?;
        let (frame, time) = (frame.parse().ok()?, time.parse().ok()?);
        let file = Some(PathBuf::from(file)).filter(|file| !file.as_os_str().is_empty())?;
        Some(KeyframeArg { file, frame, time })
    };
    let keyframe = parts().ok_or("expected FILE.bvh:FRAME@TIME with whole numbers from 0 on")?;
    if keyframe.time > LONGEST as usize {
        return Err(format!("TIME {} is beyond {LONGEST} frames", keyframe.time));
    }
    Ok(keyframe)
}

/// A file that was read.
struct Source {
    clip: DanceClip,
    /// The file's channels, where it is on the dance skeleton and every joint turns.
    channels: Option<Vec<Vec<Channel>>>,
}

/// The keyframes of a result with the files that they come from.
pub struct Keyframes {
    sources: BTreeMap<PathBuf, Source>,
    /// File, frame and time of every keyframe, by time.
    keyframes: Vec<KeyframeArg>,
    /// The file of `--motion` and its first keyframe.
    motion: Option<(PathBuf, usize)>,
    mapping: Option<Mapping>,
    data: DataConfig,
}

impl Keyframes {
    /// Reads the files that the arguments name.
    ///
    /// # Errors
    /// No keyframes, keyframes out of order, a file that cannot be read or is on another skeleton.
    pub fn read(args: &KeyframeArgs, data: &DataConfig) -> anyhow::Result<Self> {
        let mut keyframes = args.keyframe.clone();
        let mut motion = None;
        if let Some(file) = &args.motion {
            if let Some(pair) = args.keyframes.windows(2).find(|pair| pair[1] <= pair[0]) {
                bail!(
                    "--keyframes: frame {} follows frame {}; give ascending frames, each once",
                    pair[1],
                    pair[0]
                );
            }
            let first = args.keyframes.first().copied().unwrap_or(0);
            motion = Some((file.clone(), first));
            keyframes.extend(args.keyframes.iter().map(|&frame| KeyframeArg {
                file: file.clone(),
                frame,
                time: frame - first,
            }));
        }
        keyframes.sort_by_key(|keyframe| keyframe.time);
        match &keyframes[..] {
            [] => bail!(
                "no keyframes; give --motion FILE.bvh --keyframes 120,180,260, or --keyframe FILE.bvh:FRAME@TIME twice or more"
            ),
            [_] => bail!(
                "one keyframe only; a dance goes from one keyframe to another, give two or more"
            ),
            [first, ..] if first.time > 0 => bail!(
                "the first keyframe stands at frame {} of the result; give one at frame 0 (FILE.bvh:FRAME@0)",
                first.time
            ),
            _ => {}
        }
        if let Some(pair) = keyframes
            .windows(2)
            .find(|pair| pair[0].time == pair[1].time)
        {
            bail!(
                "two keyframes stand at frame {} of the result, {} and {}; keep one",
                pair[0].time,
                describe(&pair[0]),
                describe(&pair[1])
            );
        }
        let path = args.mapping.as_deref().or(data.mapping.as_deref());
        let mut read = Self {
            sources: BTreeMap::new(),
            keyframes,
            motion,
            mapping: path.map(Mapping::read).transpose()?,
            data: data.clone(),
        };
        for keyframe in read.keyframes.clone() {
            if !read.sources.contains_key(&keyframe.file) {
                let source = read.source(&keyframe.file)?;
                read.sources.insert(keyframe.file.clone(), source);
            }
        }
        Ok(read)
    }

    fn source(&self, path: &Path) -> anyhow::Result<Source> {
        let document = bvh::read(path)?;
        let clip = document.to_clip();
        let own = clip.skeleton.is_dance_skeleton();
        let turns = |channels: &Vec<Channel>| {
            let rotations = channels
                .iter()
                .filter(|c| matches!(c, Channel::Rotation(_)));
            rotations.count() == 3
        };
        let channels = document.channels();
        let channels = (own && channels.iter().all(turns)).then(|| channels.to_vec());
        let mapping = self.mapping.as_ref().filter(|_| !own);
        let clip = DanceClip::new(clip, mapping, &self.data)
            .with_context(|| format!("{} cannot be used", path.display()))?;
        Ok(Source { clip, channels })
    }

    /// A further clip, on the same terms.
    ///
    /// # Errors
    /// It cannot be read or is on another skeleton.
    pub fn clip(&self, path: &Path) -> anyhow::Result<DanceClip> {
        match self.sources.get(path) {
            Some(source) => Ok(source.clip.clone()),
            None => Ok(self.source(path)?.clip),
        }
    }

    /// The clip of `--motion`.
    pub fn motion(&self) -> Option<&DanceClip> {
        let (path, _) = self.motion.as_ref()?;
        Some(&self.sources[path].clip)
    }

    /// What `--motion` has in the frames of a request, `[F, 154]`; none where the request has other keyframes than its, or has them at other
    /// distances.
    pub fn recorded(&self, request: &SequenceRequest) -> Option<ArrayView2<'_, f64>> {
        let (path, first) = self.motion.as_ref()?;
        let its_own = |keyframe: &KeyframeArg| {
            keyframe.file == *path && keyframe.frame == first + keyframe.time
        };
        let times = self.keyframes.iter().map(|keyframe| keyframe.time);
        let frames = *first..*first + request.frames();
        let clip = &self.sources[path].clip;
        let runs_along = self.keyframes.iter().all(its_own)
            && times.eq(request.times())
            && frames.end <= clip.frames();
        runs_along.then(|| clip.features.slice(s![frames, ..]))
    }

    /// The channels of the first keyframe's file, where they can hold the result.
    pub fn channels(&self) -> Option<&[Vec<Channel>]> {
        let first = self.keyframes.first()?;
        self.sources[&first.file].channels.as_deref()
    }

    /// The request: trajectory and velocity factors of `--motion` where there is one.
    ///
    /// # Errors
    /// Frames that a file does not have; dancers that do not fit each other; keyframes beyond the end of `--motion`; lengths that do not fit the keyframes.
    pub fn request(&self, args: &KeyframeArgs) -> anyhow::Result<SequenceRequest> {
        let sources: Vec<KeyframeSource> = self
            .keyframes
            .iter()
            .map(|keyframe| KeyframeSource {
                clip: &self.sources[&keyframe.file].clip,
                frame: keyframe.frame,
                time: keyframe.time,
            })
            .collect();
        let request = SequenceRequest::from_keyframes(&sources)?;
        let Some(((path, first), clip)) = self.motion.as_ref().zip(self.motion()) else {
            return Ok(request);
        };
        let last = clip.frames() - 1 - first;
        if request.frames() - 1 > last {
            bail!(
                "the result ends at frame {}, but {} ends {last} frames after its first keyframe; give earlier keyframes, or --keyframe only",
                request.frames() - 1,
                path.display()
            );
        }
        let request = request.like(clip, *first)?;
        let lengths = match args.length[..] {
            [] => return Ok(request),
            [length] => vec![length as usize; self.keyframes.len() - 1],
            _ => args.length.iter().map(|&length| length as usize).collect(),
        };
        let mut times = vec![0];
        for length in lengths {
            times.push(times[times.len() - 1] + length);
        }
        let end = times[times.len() - 1];
        if end > LONGEST as usize {
            bail!(
                "--length puts the last keyframe at frame {end} of the result, beyond {LONGEST} frames; give smaller lengths"
            );
        }
        request.at_times(&times).map_err(|error| match error {
            SynthesisError::Times { keyframes, times } => anyhow::anyhow!(
                "--length gives {} numbers for the {} transitions between {keyframes} keyframes; give one number, or one for each",
                times - 1,
                keyframes - 1
            ),
            other => other.into(),
        })
    }
}

fn describe(keyframe: &KeyframeArg) -> String {
    format!("{}:{}", keyframe.file.display(), keyframe.frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_keyframe_is_taken_apart_from_its_end() {
        let keyframe = parse_keyframe("a:b@c.bvh:75@60").unwrap();
        assert_eq!(keyframe.file, PathBuf::from("a:b@c.bvh"));
        assert_eq!((keyframe.frame, keyframe.time), (75, 60));
        for bad in [
            "a.bvh",
            "a.bvh:1",
            "a.bvh@3",
            "a.bvh:-1@3",
            "a.bvh:1@x",
            ":1@2",
            "a.bvh:1@999999999",
            "a.bvh:1@18446744073709551615",
        ] {
            assert!(parse_keyframe(bad).is_err(), "{bad}");
        }
    }
}
