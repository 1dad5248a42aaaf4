//! Wav files whose chunks are not as they should be, as many recorders and editors write them.

use std::io::{self, Read, Seek, SeekFrom};

/// Largest chunk that is kept beside the samples.
const LARGEST: u32 = 4096;
/// Most chunks before the samples: a file of zeros is no chunk after the other.
const MOST: usize = 1000;
/// What may stand behind a chunk of no samples.
const BEHIND: [&[u8]; 7] = [
    b"LIST", b"id3 ", b"fact", b"cue ", b"smpl", b"bext", b"JUNK",
];

/// The beginning of a sound file up to its samples.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub bytes: Vec<u8>,
    /// Where the samples are in the file.
    pub samples: u64,
}

/// A chunk's name, length and the place of its content.
struct Chunk {
    name: [u8; 4],
    length: u32,
    content: u64,
}

/// A sound header for a wav file that begins at `start`, where its own is not a sound one: chunks
/// of odd length without the byte that fills them up, an empty list, a length of the whole that is
/// too short, samples whose length was never written. None where there is nothing to mend, or too
/// little to do it.
pub(super) fn mended(file: &mut (impl Read + Seek), start: u64) -> io::Result<Option<Header>> {
    let end = file.seek(SeekFrom::End(0))?;
    let Some(whole) = chunk(file, start)? else {
        return Ok(None);
    };
    let (mut place, mut kept, mut is_sound, mut has_format) = (start + 12, Vec::new(), true, false);
    for _ in 0..MOST {
        let Some(found) = chunk(file, place)? else {
            return Ok(None);
        };
        if &found.name == b"data" {
            let there = end.saturating_sub(found.content);
            let behind = chunk(file, found.content)?.map(|chunk| chunk.name);
            let is_empty = behind.is_some_and(|name| BEHIND.contains(&&name[..]));
            let is_unknown = found.length == 0 && there > 0 && !is_empty;
            let length = match is_unknown {
                true => u32::try_from(there).unwrap_or(u32::MAX),
                false => found.length,
            };
            let told = found.content - start - 8 + u64::from(length);
            is_sound &= !is_unknown && (length == u32::MAX || u64::from(whole.length) >= told);
            let header = Header {
                bytes: header(&kept, length),
                samples: found.content,
            };
            return Ok((!is_sound && has_format && length > 0).then_some(header));
        }
        has_format |= &found.name == b"fmt ";
        is_sound &= &found.name != b"LIST" || found.length >= 4;
        if found.length <= LARGEST && [b"fmt ", b"fact"].contains(&&found.name) {
            kept.extend(found.name);
            kept.extend(found.length.to_le_bytes());
            file.seek(SeekFrom::Start(found.content))?;
            file.by_ref()
                .take(found.length.into())
                .read_to_end(&mut kept)?;
            kept.extend(vec![0; kept.len() % 2]);
        }
        let behind = found.content + u64::from(found.length);
        let filled = behind + u64::from(found.length % 2);
        let [filled_name, name] = [known(file, filled)?, known(file, behind)?];
        place = if !filled_name && name { behind } else { filled };
        is_sound &= place == filled;
    }
    Ok(None)
}

/// Whether a chunk that is known begins here.
fn known(file: &mut (impl Read + Seek), place: u64) -> io::Result<bool> {
    let name = chunk(file, place)?.map(|chunk| chunk.name);
    let known = |name: [u8; 4]| {
        let samples: [&[u8]; 2] = [b"fmt ", b"data"];
        samples.iter().chain(&BEHIND).any(|it| **it == name[..])
    };
    Ok(name.is_some_and(known))
}

/// The header of a wav file with these chunks before `length` bytes of samples.
fn header(chunks: &[u8], length: u32) -> Vec<u8> {
    let whole = (4 + chunks.len() as u32 + 8).saturating_add(length);
    let mut bytes = b"RIFF".to_vec();
    bytes.extend(whole.to_le_bytes());
    bytes.extend(b"WAVE");
    bytes.extend(chunks);
    bytes.extend(b"data");
    bytes.extend(length.to_le_bytes());
    bytes
}

fn chunk(file: &mut (impl Read + Seek), place: u64) -> io::Result<Option<Chunk>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(place))?;
    file.by_ref().take(8).read_to_end(&mut bytes)?;
    let Some((name, length)) = bytes.split_first_chunk() else {
        return Ok(None);
    };
    let length = <[u8; 4]>::try_from(length).ok();
    Ok(length.map(|length| Chunk {
        name: *name,
        length: u32::from_le_bytes(length),
        content: place + 8,
    }))
}
