//! A file from a place on, as if it began there.

use std::io::{self, Read, Seek, SeekFrom};

use symphonia::core::io::MediaSource;

/// What is behind the tags of a file: they may hold pictures or sounds of their own.
pub(super) struct Behind<S> {
    source: S,
    start: u64,
}

impl<S: Seek> Behind<S> {
    /// # Errors
    /// The source cannot go there.
    pub fn new(mut source: S, start: u64) -> io::Result<Self> {
        source.seek(SeekFrom::Start(start))?;
        Ok(Self { source, start })
    }
}

impl<S: Read> Read for Behind<S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.source.read(buffer)
    }
}

impl<S: Seek> Seek for Behind<S> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let to = match to {
            SeekFrom::Start(place) => SeekFrom::Start(place.saturating_add(self.start)),
            relative => relative,
        };
        let place = self.source.seek(to)?;
        place.checked_sub(self.start).ok_or_else(|| {
            let problem = "a place before the beginning";
            io::Error::new(io::ErrorKind::InvalidInput, problem)
        })
    }
}

impl<S: MediaSource> MediaSource for Behind<S> {
    fn is_seekable(&self) -> bool {
        self.source.is_seekable()
    }

    fn byte_len(&self) -> Option<u64> {
        let all = self.source.byte_len()?;
        Some(all.saturating_sub(self.start))
    }
}
