//! The reader of training states, the other part of a checkpoint: the file as it is, and as the payload of a file whose mark and
//! checksum are right, behind which no random change would ever get.
#![no_main]

use std::path::Path;

use keydance::run::state::decode;
use libfuzzer_sys::fuzz_target;
use sha2::{Digest, Sha256};

fuzz_target!(|data: &[u8]| {
    let path = Path::new("fuzzed.bin");
    let _ = decode(data, path);
    let mut sealed = b"KDSTATE\0".to_vec();
    sealed.extend(1u32.to_le_bytes());
    sealed.extend(data);
    let checksum = Sha256::digest(&sealed);
    sealed.extend_from_slice(&checksum);
    if let Ok((header, moments)) = decode(&sealed, path) {
        let text = header.config_digest.len() + header.data_digest.len();
        let numbers: usize = moments.iter().flatten().map(Vec::len).sum();
        assert!(text + 4 * numbers <= data.len());
    }
});
