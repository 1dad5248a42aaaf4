//! `state.bin`: what a training needs beside the weights to go on to the bit.

use std::path::Path;

use keydance::run::state::{Header, decode, encode};
use proptest::prelude::*;
use sha2::{Digest as _, Sha256};

/// What a state file of this version begins with.
const BEGINNING: &[u8] = b"KDSTATE\0\x01\0\0\0";

fn header() -> Header {
    Header {
        steps: 12,
        epoch: 3,
        position: 2,
        frame_steps: 4000,
        config_digest: "c".into(),
        data_digest: "d".into(),
        weights_file_digest: "w".into(),
    }
}

/// Content with a checksum that fits, whatever it holds.
fn sealed(payload: &[u8]) -> Vec<u8> {
    let mut content = [BEGINNING, payload].concat();
    let checksum = Sha256::digest(&content);
    content.extend_from_slice(&checksum);
    content
}

fn problem(content: &[u8]) -> String {
    decode(content, Path::new("state.bin"))
        .unwrap_err()
        .to_string()
}

#[test]
fn a_state_reads_back_to_the_bit() {
    let moments = [
        vec![vec![1.5f32, -0.0], vec![]],
        vec![vec![f32::MIN_POSITIVE, 2.0], vec![]],
    ];
    let content = encode(&header(), [&moments[0], &moments[1]]).unwrap();
    assert_eq!(
        decode(&content, Path::new("x")).unwrap(),
        (header(), moments)
    );
}

#[test]
fn lengths_beyond_the_file_are_an_error_at_once_even_with_a_checksum_that_fits() {
    let head = bincode::serde::encode_to_vec(header(), bincode::config::standard()).unwrap();
    // 253 begins a u64: a list of 2^60 lists.
    let huge = [[253u8].as_slice(), &(1u64 << 60).to_le_bytes()].concat();
    assert!(problem(&sealed(&[head.as_slice(), &huge].concat())).contains("moments"));
    assert!(problem(&sealed(&[head.as_slice(), &[1], &huge].concat())).contains("moments"));
    let text = problem(&sealed(&[&[1u8, 1, 1, 1][..], &huge].concat()));
    assert!(text.contains("header"), "{text}");
}

#[test]
fn other_files_and_versions_are_named() {
    assert!(problem(b"PK\x03\x04").contains("no training state"));
    assert!(problem(b"").contains("no training state"));
    let mut content = encode(&header(), [&[], &[]]).unwrap();
    content[8] = 9;
    assert!(problem(&content).contains("format 9"));
}

proptest! {
    #[test]
    fn a_changed_or_cut_state_is_an_error(at in 0usize..200, change in 1u8..255, cut in 0usize..200) {
        let moments = vec![vec![0.25f32; 20]];
        let content = encode(&header(), [&moments, &moments]).unwrap();
        let mut changed = content.clone();
        let at = at % content.len();
        changed[at] ^= change;
        prop_assert!(decode(&changed, Path::new("x")).is_err());
        prop_assert!(decode(&content[..cut % content.len()], Path::new("x")).is_err());
    }
}
