//! What kind of file it is, by its content.

use std::io::{self, Read, Seek, SeekFrom};

/// How far from its beginning a file is looked at.
const LOOK: u64 = 1 << 16;
/// Frames of MPEG audio that must follow each other to be taken for music.
const FRAMES: usize = 3;

/// A format that is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Container {
    Wav,
    Flac,
    Ogg,
    /// Whether the file says how long it is.
    Mp3 {
        has_length: bool,
    },
}

impl Container {
    /// With its article.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Wav => "a wav file",
            Self::Flac => "a flac file",
            Self::Ogg => "an ogg file",
            Self::Mp3 { .. } => "an mp3 file",
        }
    }
}

/// Begins of files that are no sound or none that is decoded: where, what, with article.
const OTHERS: [(usize, &[u8], &str); 24] = [
    (
        4,
        b"ftyp",
        "an MPEG-4 file (m4a, mp4; AAC or ALAC, m4p is protected)",
    ),
    (
        0,
        b"\x30\x26\xb2\x75\x8e\x66\xcf\x11",
        "a Windows Media file (wma; may be protected)",
    ),
    (0, b"FORM", "an AIFF file"),
    (0, b"caff", "a Core Audio file"),
    (0, b"RF64", "an RF64 file (wav of more than 4 GB)"),
    (0, b"riff", "a Wave64 file"),
    (0, b"\x1a\x45\xdf\xa3", "a Matroska or WebM file"),
    (0, b"MThd", "a MIDI file (notes, no sound)"),
    (0, b"MAC ", "a Monkey's Audio file"),
    (0, b"wvpk", "a WavPack file"),
    (0, b"ADIF", "an AAC file"),
    (0, b"\xff\xf1", "an AAC file"),
    (0, b"\xff\xf9", "an AAC file"),
    (0, b"\xff\xfd", "an MPEG layer II file (mp2)"),
    (0, b".snd", "an AU file"),
    (0, b"RIFF", "a RIFF file without wave sound"),
    (0, b"\x89PNG", "a PNG picture"),
    (0, b"\xff\xd8\xff", "a JPEG picture"),
    (0, b"GIF8", "a GIF picture"),
    (0, b"%PDF", "a PDF document"),
    (0, b"PK\x03\x04", "a ZIP archive"),
    (0, b"\x1f\x8b", "a gzip archive"),
    (0, b"HIERARCHY", "a BVH file (motion)"),
    (0, b"\x93NUMPY", "a .npy array"),
];

/// The format of a file that begins at `start`, or what else it seems to be. Leaves the position
/// where it may.
pub(super) fn recognise(
    file: &mut (impl Read + Seek),
    start: u64,
) -> io::Result<Result<Container, &'static str>> {
    let mut head = Vec::new();
    file.seek(SeekFrom::Start(start))?;
    file.take(LOOK).read_to_end(&mut head)?;
    let begins = |at: usize, mark: &[u8]| head.get(at..).is_some_and(|rest| rest.starts_with(mark));
    if begins(0, b"RIFF") && begins(8, b"WAVE") {
        return Ok(Ok(Container::Wav));
    }
    if begins(0, b"fLaC") {
        return Ok(Ok(Container::Flac));
    }
    if begins(0, b"OggS") {
        return Ok(Ok(Container::Ogg));
    }
    let other = OTHERS.iter().find(|(at, mark, _)| begins(*at, mark));
    if let Some((_, _, what)) = other {
        return Ok(Err(what));
    }
    // Some begin with the end of a frame or with zeros.
    if let Some(frame) = (0..head.len()).find(|&at| is_mp3(&head[at..])) {
        let first = &head[frame..(frame + 64).min(head.len())];
        let marks: [&[u8]; 3] = [b"Xing", b"Info", b"VBRI"];
        let has_length = first.windows(4).any(|four| marks.contains(&four));
        return Ok(Ok(Container::Mp3 { has_length }));
    }
    let text = !head.is_empty() && std::str::from_utf8(&head[..head.len().min(64)]).is_ok();
    Ok(Err(if text && !head.contains(&0) {
        "a text"
    } else {
        "no sound file that is known"
    }))
}

/// Where the file begins behind ID3 tags, which any format may have in front.
pub(super) fn behind_tags(file: &mut (impl Read + Seek)) -> io::Result<u64> {
    let mut start = 0;
    loop {
        let mut tag = Vec::new();
        file.seek(SeekFrom::Start(start))?;
        file.by_ref().take(10).read_to_end(&mut tag)?;
        let [b'I', b'D', b'3', _, _, flags, size @ ..] = tag.as_slice() else {
            return Ok(start);
        };
        let Ok(size) = <[u8; 4]>::try_from(size) else {
            return Ok(start);
        };
        // Seven bits a byte, without the header, nor the footer that a flag announces.
        let size = size
            .iter()
            .fold(0, |sum, byte| (sum << 7) | u64::from(byte & 0x7f));
        start += 10 + size + if flags & 0x10 == 0 { 0 } else { 10 };
    }
}

/// Whether frames of MPEG audio, layer III, follow each other from here.
fn is_mp3(bytes: &[u8]) -> bool {
    let mut at = 0;
    for frame in 0..FRAMES {
        let rest = bytes.get(at..).unwrap_or_default();
        // A short file may have one frame only.
        if frame > 0 && rest.len() < 4 {
            return true;
        }
        let Some(length) = mp3_frame_length(rest) else {
            return false;
        };
        at += length;
    }
    true
}

/// Bytes of the frame that begins here, where its header is one of layer III.
fn mp3_frame_length(bytes: &[u8]) -> Option<usize> {
    const FIRST_VERSION: [usize; 15] = [
        0, 32, 40, 48, 56, 64, 80, 96, 112, 128, 160, 192, 224, 256, 320,
    ];
    const LOWER_RATES: [usize; 15] = [0, 8, 16, 24, 32, 40, 48, 56, 64, 80, 96, 112, 128, 144, 160];
    let [0xff, second, third, _, ..] = *bytes else {
        return None;
    };
    // Eleven bits of ones, then version and layer.
    let version = (second >> 3) & 3;
    if second >> 5 != 7 || version == 1 || (second >> 1) & 3 != 1 {
        return None;
    }
    let rate = *[44_100, 48_000, 32_000].get(usize::from((third >> 2) & 3))?;
    let (rate, rates, samples) = match version {
        3 => (rate, FIRST_VERSION, 144_000),
        2 => (rate / 2, LOWER_RATES, 72_000),
        _ => (rate / 4, LOWER_RATES, 72_000),
    };
    let bit_rate = *rates
        .get(usize::from(third >> 4))
        .filter(|&&rate| rate > 0)?;
    Some(samples * bit_rate / rate + usize::from((third >> 1) & 1))
}
