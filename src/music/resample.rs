//! Sounds of other rates brought to 22,050 Hz, piece by piece.

use rubato::audioadapter_buffers::direct::SequentialSlice;
use rubato::{
    Async, FixedAsync, Resampler as _, SincInterpolationParameters, SincInterpolationType,
    WindowFunction,
};

use super::error::MusicError;
use super::sound::RATE;

/// The rates from which sounds are resampled, samples a second.
pub const LOWEST_RATE: u32 = 1_000;
pub const HIGHEST_RATE: u32 = 384_000;

/// Samples of the filter, of the lower of both rates, and where it has halved, relative to half
/// that rate: together they come nearest to the response of soxr's HQ, librosa's choice.
const LENGTH: u32 = 188;
const CUTOFF: f32 = 0.9569;
/// Filters between two samples at most, more only where that makes every position exact.
const BETWEEN: u32 = 1024;
/// Samples that are resampled at a time.
const CHUNK: usize = 4096;

/// Brings samples of one channel to 22,050 Hz with a windowed sinc; sample 0 stays at time 0.
pub(super) struct Resampler {
    /// None where the rate is 22,050 already.
    sinc: Option<Sinc>,
    rate: u32,
    /// Samples that came.
    taken: u64,
    samples: Vec<f32>,
}

struct Sinc {
    inner: Async<f64>,
    /// What came and has not been resampled yet.
    waiting: Vec<f64>,
    output: Vec<f64>,
    /// Samples that come out before time 0.
    early: usize,
}

impl Resampler {
    /// `file` is what errors call the sound.
    pub(super) fn new(file: &str, rate: u32) -> Result<Self, MusicError> {
        if !(LOWEST_RATE..=HIGHEST_RATE).contains(&rate) {
            let file = file.into();
            return Err(MusicError::Rate { file, rate });
        }
        let sinc = (rate != RATE).then(|| Sinc::new(rate)).transpose()?;
        Ok(Self {
            sinc,
            rate,
            taken: 0,
            samples: Vec::new(),
        })
    }

    pub(super) fn push(&mut self, samples: &[f64]) -> Result<(), MusicError> {
        self.taken += samples.len() as u64;
        match &mut self.sinc {
            None => self.samples.extend(samples.iter().map(|&x| x as f32)),
            Some(sinc) => {
                sinc.waiting.extend(samples);
                while sinc.waiting.len() >= CHUNK {
                    sinc.resample_chunk(&mut self.samples)?;
                }
            }
        }
        Ok(())
    }

    /// All samples at 22,050 Hz: as many as begin before the sound's end.
    pub(super) fn finish(mut self) -> Result<Vec<f32>, MusicError> {
        let length = (self.taken * u64::from(RATE)).div_ceil(u64::from(self.rate));
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        if let Some(sinc) = &mut self.sinc {
            while self.samples.len() < length {
                sinc.waiting.resize(CHUNK, 0.0);
                sinc.resample_chunk(&mut self.samples)?;
            }
        }
        self.samples.truncate(length);
        Ok(self.samples)
    }
}

impl Sinc {
    fn new(rate: u32) -> Result<Self, MusicError> {
        let common = common_divisor(rate, RATE);
        let (step, positions) = (rate / common, RATE / common);
        // An output lies `step / positions` samples behind the one before. With a filter for each
        // position none has to be interpolated.
        let (between, interpolation) = if positions <= BETWEEN {
            (positions, SincInterpolationType::Nearest)
        } else {
            (BETWEEN / 4, SincInterpolationType::Cubic)
        };
        let length = LENGTH * rate.max(RATE) / RATE;
        let length = length.next_multiple_of(8) as usize;
        let parameters = SincInterpolationParameters {
            sinc_len: length,
            f_cutoff: Some(CUTOFF),
            oversampling_factor: between as usize,
            interpolation,
            window: WindowFunction::BlackmanHarris,
        };
        let ratio = f64::from(positions) / f64::from(step);
        let inner = Async::new_sinc(ratio, 1.0, &parameters, CHUNK, 1, FixedAsync::Input);
        let inner = inner.map_err(|error| MusicError::Resampling {
            problem: error.to_string(),
        })?;
        // Output j lies at (j + 1) step / positions - length / 2 + 1 / between samples; so many
        // zeros go in front that one lies at the first sample.
        let offset = |zeros: u64| {
            let samples = length as u64 / 2 + zeros;
            let shift = (f64::from(positions) / f64::from(between)).round() as u64;
            samples * u64::from(positions) - shift
        };
        let whole = |zeros: &u64| offset(*zeros).is_multiple_of(u64::from(step));
        let zeros = (0..u64::from(step)).find(whole).unwrap_or(0);
        Ok(Self {
            output: vec![0.0; inner.output_frames_max()],
            inner,
            waiting: vec![0.0; usize::try_from(zeros).unwrap_or(0)],
            early: usize::try_from(offset(zeros) / u64::from(step) - 1).unwrap_or(0),
        })
    }

    /// Resamples what waits first, [`CHUNK`] samples.
    fn resample_chunk(&mut self, samples: &mut Vec<f32>) -> Result<(), MusicError> {
        let failed = |problem: String| MusicError::Resampling { problem };
        let input = SequentialSlice::new(&self.waiting[..CHUNK], 1, CHUNK)
            .map_err(|error| failed(error.to_string()))?;
        let room = self.output.len();
        let mut output = SequentialSlice::new_mut(&mut self.output, 1, room)
            .map_err(|error| failed(error.to_string()))?;
        let (taken, made) = self
            .inner
            .process_into_buffer(&input, &mut output, None)
            .map_err(|error| failed(error.to_string()))?;
        self.waiting.drain(..taken);
        let early = self.early.min(made);
        self.early -= early;
        samples.extend(self.output[early..made].iter().map(|&x| x as f32));
        Ok(())
    }
}

/// The greatest one.
fn common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}
