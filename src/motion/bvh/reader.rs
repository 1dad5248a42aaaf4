//! From a file's bytes to a document.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

use super::document::{Bvh, JOINTS_PER_CHANNEL};
use super::error::BvhError;
use super::hierarchy::hierarchy;
use super::rows::motion;
use super::scanner::Scanner;
use crate::counted::counted;

/// Bytes in which a file that is no text is recognised, before all of it is read.
const HEAD: u64 = 512;

/// Reads a BVH file. The document takes the file's name.
///
/// # Errors
/// The file cannot be read, or it is not BVH: the error names file, line and what was expected.
pub fn read(path: &Path) -> Result<Bvh, BvhError> {
    let unreadable = |source| BvhError::Read {
        path: path.into(),
        source,
    };
    let name = path.display().to_string();
    let mut file = File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    let mut head = io::Read::by_ref(&mut file).take(HEAD);
    head.read_to_end(&mut bytes).map_err(unreadable)?;
    check_text(&bytes, &name)?;
    file.read_to_end(&mut bytes).map_err(unreadable)?;
    let mut document = parse(&bytes, &name)?;
    if let Some(name) = path.file_name() {
        document.name = name.to_string_lossy().into_owned();
    }
    Ok(document)
}

/// Reads a BVH document from the bytes of a file named `name`.
///
/// # Errors
/// As [`read`].
pub fn parse(bytes: &[u8], name: &str) -> Result<Bvh, BvhError> {
    check_text(bytes, name)?;
    let text = text(bytes, name)?;
    let mut scanner = Scanner::new(name, text);
    let (skeleton, channels) = hierarchy(&mut scanner)?;
    let total: usize = channels.iter().map(Vec::len).sum();
    if total * JOINTS_PER_CHANNEL < skeleton.len() {
        let expected = format!("at least one channel for every {JOINTS_PER_CHANNEL} joints");
        return Err(scanner.error(
            expected,
            format!(
                "{} for {} joints",
                counted(total, "channel"),
                skeleton.len()
            ),
        ));
    }
    let (frame_time, motion) = motion(&mut scanner, total)?;
    Ok(Bvh {
        name: name.into(),
        skeleton,
        channels,
        frame_time,
        motion,
    })
}

/// Refuses what begins as no text does: other programs' binary files, prepared sets.
fn check_text(bytes: &[u8], name: &str) -> Result<(), BvhError> {
    let head = &bytes[..bytes.len().min(HEAD as usize)];
    // A short file may be filled up with zeros.
    let end = head.iter().rposition(|&byte| byte != 0);
    let head = &head[..end.map_or(0, |last| last + 1)];
    if !head.iter().any(|byte| *byte < b'\t') {
        return Ok(());
    }
    let readable = head.iter().take_while(|byte| matches!(byte, b' '..=b'~'));
    let readable: String = readable.map(|&byte| char::from(byte)).collect();
    Err(BvhError::Syntax {
        file: name.into(),
        line: 1,
        expected: "a BVH file, text that begins with HIERARCHY".into(),
        found: match readable.is_empty() {
            true => "bytes that are no text".into(),
            false => format!("bytes that are no text after {readable:?}"),
        },
    })
}

fn text<'a>(bytes: &'a [u8], name: &str) -> Result<&'a str, BvhError> {
    std::str::from_utf8(bytes).map_err(|error| {
        let valid = &bytes[..error.valid_up_to()];
        BvhError::Syntax {
            file: name.into(),
            line: 1 + line_ends(valid),
            expected: "text in UTF-8".into(),
            found: format!(
                "the byte {:#04x}",
                bytes.get(valid.len()).copied().unwrap_or_default()
            ),
        }
    })
}

/// Line ends in a text: LF, CR LF, or CR alone.
fn line_ends(text: &[u8]) -> usize {
    let ends = text.iter().filter(|&&byte| byte == b'\n' || byte == b'\r');
    ends.count() - text.windows(2).filter(|pair| pair == b"\r\n").count()
}
