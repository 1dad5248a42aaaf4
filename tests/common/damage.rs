//! Files as they come back from a bad disk or a hasty editor.

use proptest::prelude::*;

/// One way in which a file gets damaged.
#[derive(Debug, Clone)]
pub enum Damage {
    Flip(prop::sample::Index, u8),
    Cut(prop::sample::Index),
    Insert(prop::sample::Index, String),
    DoubleLine(prop::sample::Index),
    DropLine(prop::sample::Index),
    SwapLines(prop::sample::Index, prop::sample::Index),
}

pub fn damages() -> impl Strategy<Value = Damage> {
    let at = any::<prop::sample::Index>;
    prop_oneof![
        (at(), any::<u8>()).prop_map(|(place, byte)| Damage::Flip(place, byte)),
        at().prop_map(Damage::Cut),
        (at(), "[-0-9.eE{} \t\nA-Z]{1,8}").prop_map(|(place, text)| Damage::Insert(place, text)),
        at().prop_map(Damage::DoubleLine),
        at().prop_map(Damage::DropLine),
        (at(), at()).prop_map(|(one, other)| Damage::SwapLines(one, other)),
    ]
}

pub fn damage(bytes: Vec<u8>, damage: &Damage) -> Vec<u8> {
    if bytes.is_empty() {
        return bytes;
    }
    let mut bytes = bytes;
    let mut lines: Vec<Vec<u8>> = bytes
        .split_inclusive(|&byte| byte == b'\n')
        .map(<[u8]>::to_vec)
        .collect();
    match damage {
        Damage::Flip(place, byte) => {
            let place = place.index(bytes.len());
            bytes[place] ^= byte;
            return bytes;
        }
        Damage::Cut(place) => {
            bytes.truncate(place.index(bytes.len()));
            return bytes;
        }
        Damage::Insert(place, text) => {
            let place = place.index(bytes.len());
            bytes.splice(place..place, text.bytes());
            return bytes;
        }
        Damage::DoubleLine(line) => lines.insert(
            line.index(lines.len()),
            lines[line.index(lines.len())].clone(),
        ),
        Damage::DropLine(line) => {
            lines.remove(line.index(lines.len()));
        }
        Damage::SwapLines(one, other) => {
            let count = lines.len();
            lines.swap(one.index(count), other.index(count));
        }
    }
    lines.concat()
}
