//! Sound files decoded: wav, flac, mp3 and ogg (Vorbis), any channels and rate.

use std::fs::File;
use std::io::{self, Cursor, Read as _, SeekFrom};
use std::path::Path;

use symphonia::core::codecs::audio::{AudioDecoder, AudioDecoderOptions};
use symphonia::core::errors::Error;
use symphonia::core::formats::probe::Hint;
use symphonia::core::formats::{FormatOptions, FormatReader, TrackType};
use symphonia::core::io::{MediaSource, MediaSourceStream, ReadOnlySource};
use symphonia::core::meta::MetadataOptions;
use symphonia::core::packet::Packet;

use super::behind::Behind;
use super::container::{Container, behind_tags, recognise};
use super::error::MusicError;
use super::resample::Resampler;
use super::riff::mended;
use super::sound::Sound;
use crate::counted::counted;

/// Seconds that a sound may last.
pub(super) const LONGEST: u64 = 3600;
/// Bytes that a second of sound has at least: of mp3 at its lowest bit rate.
const LEAST_BYTES: u64 = 1000;
/// Samples that are taken for a packet which cannot be decoded, at most: those of the largest.
const LONGEST_PACKET: u64 = 1 << 16;

/// Reads a sound file: decodes it, takes the mean of its channels, brings it to 22,050 Hz. What its
/// ending says does not matter. At most an hour of samples is held, whatever the file claims.
///
/// # Errors
/// The file cannot be read, is no wav, flac, mp3 or ogg (Vorbis) file, holds no sample that can be
/// decoded, or is longer than an hour.
pub fn read(path: &Path) -> Result<Sound, MusicError> {
    let failed = |source| MusicError::Read {
        path: path.into(),
        source,
    };
    let kind = path.metadata().map_err(failed)?.file_type();
    // A pipe would be waited for, and cannot be read twice.
    if !kind.is_file() {
        let what = if kind.is_dir() {
            "a folder"
        } else {
            "a pipe or device"
        };
        let path = path.into();
        return Err(MusicError::NoFile { path, what });
    }
    let file = File::open(path).map_err(failed)?;
    decode(file, &path.display().to_string()).map_err(|error| match error {
        Failure::Io(source) => failed(source),
        Failure::Sound(error) => error,
    })
}

/// Decodes the content of a sound file as [`read`] does; `file` is what messages call it.
///
/// # Errors
/// As [`read`].
pub fn parse(content: &[u8], file: &str) -> Result<Sound, MusicError> {
    decode(Cursor::new(content.to_vec()), file).map_err(|error| match error {
        // Of bytes in memory only their end is an error.
        Failure::Io(source) => MusicError::Damaged {
            file: file.into(),
            problem: source.to_string(),
        },
        Failure::Sound(error) => error,
    })
}

enum Failure {
    Io(io::Error),
    Sound(MusicError),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<MusicError> for Failure {
    fn from(error: MusicError) -> Self {
        Self::Sound(error)
    }
}

fn decode(mut source: impl MediaSource + 'static, file: &str) -> Result<Sound, Failure> {
    let file = || file.to_string();
    let bytes = source.byte_len().unwrap_or(0);
    if bytes == 0 {
        return Err(MusicError::Empty { file: file() }.into());
    }
    let start = behind_tags(&mut source)?;
    let container = recognise(&mut source, start)?;
    let container = container.map_err(|what| MusicError::OtherFormat { file: file(), what })?;
    let mended = match container {
        Container::Wav => mended(&mut source, start)?,
        _ => None,
    };
    if let Some(header) = mended {
        source.seek(SeekFrom::Start(header.samples))?;
        let source = ReadOnlySource::new(Cursor::new(header.bytes).chain(source));
        return decode_stream(Box::new(source), container, file(), bytes);
    }
    let source = Behind::new(source, start)?;
    let source: Box<dyn MediaSource> = match container {
        // Where the source has a length, symphonia guesses the sound's and cuts what is beyond.
        Container::Mp3 { has_length: false } => Box::new(ReadOnlySource::new(source)),
        _ => Box::new(source),
    };
    decode_stream(source, container, file(), bytes)
}

/// Decodes what begins with a sound's own first byte; `bytes` are those of the file.
fn decode_stream(
    source: Box<dyn MediaSource>,
    container: Container,
    name: String,
    bytes: u64,
) -> Result<Sound, Failure> {
    let file = || name.clone();
    let stream = MediaSourceStream::new(source, Default::default());
    let (options, metadata) = (FormatOptions::default(), MetadataOptions::default());
    let probe = symphonia::default::get_probe();
    let format = probe
        .probe(&Hint::new(), stream, options, metadata)
        .map_err(|error| match error {
            // The probe's own words, where no reader took what it saw.
            Error::Unsupported(problem) if problem.starts_with("core (probe)") => {
                MusicError::Damaged {
                    file: file(),
                    problem: "no part of it can be decoded".into(),
                }
            }
            Error::Unsupported(problem) => MusicError::Codec {
                file: file(),
                container: container.name(),
                problem: problem.into(),
            },
            error => MusicError::Damaged {
                file: file(),
                problem: problem(&error),
            },
        })?;
    let mut decoding = Decoding::begin(format, container, file(), bytes)?;
    let end = decoding.run()?;
    Ok(decoding.finish(end)?)
}

/// A file that is being decoded.
struct Decoding {
    file: String,
    container: Container,
    format: Box<dyn FormatReader>,
    decoder: Box<dyn AudioDecoder>,
    track: u32,
    rate: u32,
    /// Samples of a channel that the file says it has.
    announced: Option<u64>,
    resampler: Resampler,
    /// Samples of a channel that were decoded, and those that silence stands for.
    decoded: u64,
    replaced: u64,
    /// When the packet that follows should begin, samples; unknown at first.
    next: Option<i64>,
    not_finite: usize,
    interleaved: Vec<f64>,
    mean: Vec<f64>,
}

/// Why there is no packet any more.
type End = Option<Error>;

impl Decoding {
    fn begin(
        format: Box<dyn FormatReader>,
        container: Container,
        file: String,
        bytes: u64,
    ) -> Result<Self, MusicError> {
        let Begun {
            decoder,
            track,
            rate,
            announced,
        } = begin_track(&*format, container, &file)?;
        // A header that lies is found out as the samples come.
        let seconds = announced.unwrap_or(0) / u64::from(rate.max(1));
        if seconds > LONGEST && bytes / LEAST_BYTES >= seconds {
            return Err(MusicError::TooLong { file });
        }
        Ok(Self {
            resampler: Resampler::new(&file, rate)?,
            file,
            container,
            format,
            decoder,
            track,
            rate,
            announced,
            decoded: 0,
            replaced: 0,
            next: None,
            not_finite: 0,
            interleaved: Vec::new(),
            mean: Vec::new(),
        })
    }

    /// Decodes all packets.
    fn run(&mut self) -> Result<End, MusicError> {
        loop {
            match self.format.next_packet() {
                Ok(Some(packet)) if packet.track_id == self.track => self.take(&packet)?,
                Ok(Some(_)) => {}
                Ok(None) => return Ok(None),
                // In ogg one sound may follow another.
                Err(Error::ResetRequired) => self.next_sound()?,
                Err(error) => return Ok(Some(error)),
            }
            self.check_length(0)?;
        }
    }

    /// Refuses what with so many samples more would be too long.
    fn check_length(&self, more: u64) -> Result<(), MusicError> {
        let samples = (self.decoded + self.replaced).saturating_add(more);
        if samples > LONGEST * u64::from(self.rate) {
            let file = self.file.clone();
            return Err(MusicError::TooLong { file });
        }
        Ok(())
    }

    fn next_sound(&mut self) -> Result<(), MusicError> {
        let next = begin_track(&*self.format, self.container, &self.file)?;
        if next.rate != self.rate {
            return Err(MusicError::RateChange {
                file: self.file.clone(),
                before: self.rate,
                after: next.rate,
            });
        }
        (self.decoder, self.track) = (next.decoder, next.track);
        self.next = None;
        self.announced = self
            .announced
            .zip(next.announced)
            .map(|(a, b)| a.saturating_add(b));
        Ok(())
    }

    fn take(&mut self, packet: &Packet) -> Result<(), MusicError> {
        let begins = packet.pts.get();
        let lost = self
            .next
            .map_or(0, |next| begins.saturating_sub(next).max(0));
        let length = packet.dur.get() as i64;
        let trimmed = (packet.trim_start.get() + packet.trim_end.get()) as i64;
        self.next = Some(begins.saturating_add(length.saturating_add(trimmed)));
        self.silence(lost.unsigned_abs())?;
        let Ok(buffer) = self.decoder.decode(packet) else {
            return self.silence(packet.dur.get().min(LONGEST_PACKET));
        };
        let (rate, channels) = (buffer.spec().rate(), buffer.spec().channels().count());
        if buffer.frames() == 0 || channels == 0 {
            return Ok(());
        }
        if rate != self.rate {
            return Err(MusicError::RateChange {
                file: self.file.clone(),
                before: self.rate,
                after: rate,
            });
        }
        buffer.copy_to_vec_interleaved(&mut self.interleaved);
        self.mean.clear();
        for channels in self.interleaved.chunks_exact(channels) {
            let mean = channels.iter().sum::<f64>() / channels.len() as f64;
            let is_sound = (mean as f32).is_finite();
            self.not_finite += usize::from(!is_sound);
            self.mean.push(if is_sound { mean } else { 0.0 });
        }
        self.decoded += self.mean.len() as u64;
        self.resampler.push(&self.mean)
    }

    /// Stands for samples that were lost, so that what follows keeps its time.
    fn silence(&mut self, samples: u64) -> Result<(), MusicError> {
        self.check_length(samples)?;
        self.replaced += samples;
        let mut left = samples;
        while left > 0 {
            let part = left.min(LONGEST_PACKET);
            self.mean.clear();
            self.mean.resize(part as usize, 0.0);
            self.resampler.push(&self.mean)?;
            left -= part;
        }
        Ok(())
    }

    fn finish(self, end: End) -> Result<Sound, MusicError> {
        if self.decoded == 0 {
            let problem = match end {
                Some(error) => problem(&error),
                None if self.replaced > 0 => "no part of it can be decoded".into(),
                None => "it holds no sample".into(),
            };
            let file = self.file;
            return Err(MusicError::Damaged { file, problem });
        }
        let seconds = |samples: u64| samples as f64 / f64::from(self.rate);
        let all = self.decoded + self.replaced;
        let mut warnings = Vec::new();
        // Encoders differ by some samples in what they count.
        let missing = self.announced.unwrap_or(0).saturating_sub(all) > u64::from(self.rate) / 10;
        if let Some(announced) = self.announced.filter(|_| missing) {
            warnings.push(format!(
                "is cut off: it says that it lasts {:.2} s, {:.2} s are there and used",
                seconds(announced),
                seconds(all)
            ));
        } else if let Some(error) = end.filter(|error| !is_end(error)) {
            warnings.push(format!(
                "is damaged after {:.2} s ({}); what comes then is left out",
                seconds(all),
                problem(&error)
            ));
        }
        if self.replaced > 0 {
            warnings.push(format!(
                "is damaged: silence stands for {:.2} s that cannot be decoded",
                seconds(self.replaced)
            ));
        }
        if self.not_finite > 0 {
            warnings.push(format!(
                "holds {} that are no finite numbers; they count as 0",
                counted(self.not_finite, "sample")
            ));
        }
        Ok(Sound {
            name: self.file,
            samples: self.resampler.finish()?,
            warnings,
        })
    }
}

/// What is needed to decode the sound that begins.
struct Begun {
    decoder: Box<dyn AudioDecoder>,
    track: u32,
    rate: u32,
    announced: Option<u64>,
}

fn begin_track(
    format: &dyn FormatReader,
    container: Container,
    file: &str,
) -> Result<Begun, MusicError> {
    let codec = |problem: String| MusicError::Codec {
        file: file.into(),
        container: container.name(),
        problem,
    };
    let track = format
        .default_track(TrackType::Audio)
        .ok_or_else(|| codec("no track of sound".into()))?;
    let parameters = track.codec_params.as_ref().and_then(|it| it.audio());
    let parameters = parameters.ok_or_else(|| codec("an unknown codec".into()))?;
    let decoder = symphonia::default::get_codecs()
        .make_audio_decoder(parameters, &AudioDecoderOptions::default())
        .map_err(|error| codec(problem(&error)))?;
    let rate = parameters.sample_rate.ok_or_else(|| MusicError::Damaged {
        file: file.into(),
        problem: "it does not say how many samples a second has".into(),
    })?;
    Ok(Begun {
        decoder,
        track: track.id,
        rate,
        announced: track.num_frames,
    })
}

/// Whether the file just ended.
fn is_end(error: &Error) -> bool {
    matches!(error, Error::IoError(error) if error.kind() == io::ErrorKind::UnexpectedEof)
}

/// What an error of the decoder says.
fn problem(error: &Error) -> String {
    if is_end(error) {
        return "it ends too early".into();
    }
    error.to_string()
}
