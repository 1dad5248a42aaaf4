//! Files that were damaged or made to do harm: an error or a sound result, no panic, never more
//! than 1 GiB of memory for a file under 1 MiB.
//!
//! A program of its own, because its allocator counts what all threads of the process hold.

#[path = "common/damage.rs"]
mod damage;

use std::alloc::{GlobalAlloc, Layout, System};
use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use damage::{Damage, damage, damages};
use keydance::autograd::Parameters;
use keydance::data::DataConfig;
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::experiment::ExperimentConfig;
use keydance::models::Streams;
use keydance::models::transition::DanceClip;
use keydance::models::transition::{Standardisation, TransitionSettings};
use keydance::models::weights::{SavedWeights, to_safetensors};
use keydance::motion::bvh::{self, Axis, Bvh, channel_layout};
use keydance::motion::{Clip, DANCE_JOINTS, Mapping};
use keydance::nn::Initialiser;
use keydance::run::RunFolder;
use keydance::run::checkpoint::{STATE_FILE, WEIGHTS_FILE};
use keydance::run::state::{self, Header, Moments};
use proptest::prelude::*;
use safetensors::tensor::{Dtype, TensorView};
use sha2::{Digest, Sha256};

/// Bytes that a file under 1 MiB may take.
const MOST_MEMORY: usize = 1 << 30;

static HELD: AtomicUsize = AtomicUsize::new(0);
/// The most that was held at once, over all tests of this file together.
static PEAK: AtomicUsize = AtomicUsize::new(0);

struct Counting;

impl Counting {
    fn add(bytes: usize) {
        let held = HELD.fetch_add(bytes, Ordering::Relaxed) + bytes;
        PEAK.fetch_max(held, Ordering::Relaxed);
    }
}

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());
        // SAFETY: as the caller promised.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::add(size);
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promised.
        unsafe { System.realloc(place, layout, size) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn memory_was_enough() {
    let peak = PEAK.load(Ordering::Relaxed);
    assert!(peak < MOST_MEMORY, "{} MiB", peak >> 20);
}

fn dance_clip(frames: usize) -> Clip {
    let config = ChoreographyConfig {
        clips: 1,
        frames_per_clip: frames,
        seed: 4,
    };
    generate(&config).unwrap().remove(0).clip
}

static BVH: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let clip = dance_clip(3);
    let channels = channel_layout(&clip, [Axis::Z, Axis::X, Axis::Y]);
    Bvh::from_clip(&clip, channels)
        .unwrap()
        .to_text()
        .into_bytes()
});

static CONFIG: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let config = ExperimentConfig::default().to_toml().unwrap();
    config.into_bytes()
});

static MAPPING: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let joint = |name: &&str| match *name {
        "Spine1" => format!("{name} = {{ between = [\"Spine\", \"Spine2\"], at = 0.5 }}\n"),
        _ => format!("{name} = \"{name}\"\n"),
    };
    let joints: String = DANCE_JOINTS.iter().map(joint).collect();
    format!("scale = 2.54\n[joints]\n{joints}").into_bytes()
});

/// A config whose model is as small as it can be, with some keys in place of others.
fn small_config(model: &str) -> ExperimentConfig {
    let text = "[model]\nkind = 'pan2021'\nhidden = 1\ncode = 1\nheads = 1\nfeed_forward = 1\nwindow = 1\n\
        encoder_layers = 1\ndecoder_layers = 1\n";
    ExperimentConfig::parse(&format!("{text}{model}"), "small").unwrap()
}

static WEIGHTS: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let config = small_config("");
    let standardisation = Standardisation::fit([]);
    let mut parameters = Parameters::new();
    let mut init = Initialiser::new(&mut parameters, Streams::new(1).initialisation());
    let model = &TransitionSettings::of(&config).unwrap().model;
    model.build(&mut init, &standardisation).unwrap();
    let statistics = standardisation.statistics();
    to_safetensors(&parameters, &statistics, &config.to_toml().unwrap()).unwrap()
});

/// What lies between mark and checksum of a training state.
static STATE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let header = Header {
        steps: 12,
        epoch: 3,
        position: 2,
        frame_steps: 4000,
        config_digest: "c".repeat(64),
        data_digest: "d".repeat(64),
        weights_file_digest: "w".repeat(64),
    };
    let moments: Moments = [vec![vec![0.5; 20], vec![]], vec![vec![0.25; 20], vec![]]];
    let format = bincode::config::standard();
    let mut payload = bincode::serde::encode_to_vec(&header, format).unwrap();
    payload.extend(bincode::serde::encode_to_vec(&moments, format).unwrap());
    payload
});

/// A training state with a mark and a checksum that fit, whatever it holds.
fn sealed(payload: &[u8]) -> Vec<u8> {
    let mut content = [b"KDSTATE\0".as_slice(), &1u32.to_le_bytes(), payload].concat();
    let checksum = Sha256::digest(&content);
    content.extend_from_slice(&checksum);
    content
}

/// Text where the bytes are some.
fn text(bytes: &[u8]) -> Option<&str> {
    std::str::from_utf8(bytes).ok()
}

fn damaged(content: &[u8], list: &[Damage]) -> Vec<u8> {
    list.iter().fold(content.to_vec(), damage)
}

/// One to four damages.
fn some_damages() -> impl Strategy<Value = Vec<Damage>> {
    prop::collection::vec(damages(), 1..5)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(1000) })]

    #[test]
    fn a_damaged_bvh_file_is_an_error_or_a_clip_of_finite_numbers(list in some_damages()) {
        match bvh::parse(&damaged(&BVH, &list), "bad.bvh") {
            Err(error) => prop_assert!(error.to_string().starts_with("bad.bvh, line ")),
            Ok(document) => {
                let clip = DanceClip::new(document.to_clip(), None, &DataConfig::default());
                if let Ok(clip) = clip {
                    prop_assert!(clip.features.iter().all(|number| number.is_finite()));
                }
            }
        }
        memory_was_enough();
    }

    #[test]
    fn a_damaged_config_is_an_error_that_names_it_or_a_valid_config(list in some_damages()) {
        if let Some(text) = text(&damaged(&CONFIG, &list)) {
            match ExperimentConfig::parse(text, "bad.toml") {
                Err(error) => prop_assert!(error.to_string().contains("bad.toml"), "{error}"),
                Ok(config) => {
                    prop_assert!(config.validate().is_ok());
                    let written = config.to_toml().unwrap();
                    prop_assert_eq!(ExperimentConfig::parse(&written, "again").unwrap(), config);
                }
            }
        }
        memory_was_enough();
    }

    #[test]
    fn a_damaged_mapping_is_an_error_that_names_it_or_gives_a_dancer(list in some_damages()) {
        static CLIP: LazyLock<Clip> = LazyLock::new(|| dance_clip(2));
        if let Some(text) = text(&damaged(&MAPPING, &list)) {
            match Mapping::parse(text, "bad.toml").and_then(|mapping| mapping.apply(&CLIP)) {
                Err(error) => prop_assert!(error.to_string().contains("bad.toml"), "{error}"),
                Ok(clip) => prop_assert!(clip.skeleton.is_dance_skeleton()),
            }
        }
        memory_was_enough();
    }

    #[test]
    fn damaged_weights_are_an_error_that_names_them_or_whole(list in some_damages()) {
        match SavedWeights::parse(&damaged(&WEIGHTS, &list), Path::new("bad.safetensors")) {
            Err(error) => prop_assert!(error.to_string().contains("bad.safetensors"), "{error}"),
            Ok(saved) => {
                if let Ok(config) = ExperimentConfig::parse(&saved.config, "its config") {
                    let _ = config.model.trained("bad", &saved);
                }
            }
        }
        memory_was_enough();
    }

    #[test]
    fn a_damaged_training_state_is_an_error_even_where_its_checksum_fits(list in some_damages()) {
        let path = Path::new("bad.bin");
        let whole = sealed(&STATE);
        let changed = damaged(&whole, &list);
        prop_assert!(changed == whole || state::decode(&changed, path).is_err());
        let payload = damaged(&STATE, &list);
        match state::decode(&sealed(&payload), path) {
            Err(error) => prop_assert!(error.to_string().contains("bad.bin is damaged"), "{error}"),
            Ok((_, moments)) => {
                let numbers: usize = moments.iter().flatten().map(Vec::len).sum();
                prop_assert!(4 * numbers <= payload.len());
            }
        }
        memory_was_enough();
    }
}

#[test]
fn a_bvh_file_of_many_short_rows_stays_within_memory() {
    // 16 joints on one channel, and as many frames as 1 MiB holds.
    let mut text = String::from("HIERARCHY\nROOT j\n{\nOFFSET 0 0 0\nCHANNELS 1 Yrotation\n");
    for joint in 1..16 {
        text += &format!("JOINT j{joint}\n{{\nOFFSET 0 1 0\n}}\n");
    }
    text += "}\nMOTION\n";
    let rows = ((1 << 20) - text.len() - 100) / 2;
    text += &format!("Frames: {rows}\nFrame Time: 0.0333333\n");
    text += &"0\n".repeat(rows);
    assert!(text.len() < 1 << 20);
    let clip = bvh::parse(text.as_bytes(), "long.bvh").unwrap().to_clip();
    assert_eq!(clip.poses.len(), rows);
    memory_was_enough();
}

#[test]
fn few_frames_a_second_do_not_become_a_clip_that_fills_memory() {
    let mut clip = dance_clip(3);
    let pose = clip.poses[0].clone();
    clip.poses = vec![pose; 2500];
    clip.frame_time = 3.9;
    let error = DanceClip::new(clip, None, &DataConfig::default()).unwrap_err();
    assert!(error.to_string().contains("cut it into parts"), "{error}");
    memory_was_enough();
}

/// A weights file with one more tensor entry, or another in place of one: `"name":{...}` as it
/// stands in the header.
fn with_header(change: impl FnOnce(String) -> String) -> Vec<u8> {
    let (length, rest) = WEIGHTS.split_first_chunk::<8>().unwrap();
    let (header, data) = rest.split_at(u64::from_le_bytes(*length) as usize);
    let header = change(String::from_utf8(header.to_vec()).unwrap());
    let length = (header.len() as u64).to_le_bytes();
    [length.as_slice(), header.as_bytes(), data].concat()
}

#[test]
fn weights_with_absurd_lengths_shapes_and_overlaps_are_an_error_at_once() {
    let parse = |content: &[u8]| SavedWeights::parse(content, Path::new("w.safetensors"));
    assert!(parse(&with_header(|header| header)).is_ok());
    let mut huge = WEIGHTS.clone();
    huge[..8].copy_from_slice(&(1u64 << 60).to_le_bytes());
    let shape = |shape: &'static str| {
        with_header(move |header| {
            let found = header.find("\"shape\":[").unwrap();
            let end = found + header[found..].find(']').unwrap() + 1;
            format!("{}\"shape\":{shape}{}", &header[..found], &header[end..])
        })
    };
    let offsets = |offsets: &'static str| {
        with_header(move |header| {
            let found = header.find("\"data_offsets\":[").unwrap();
            let end = found + header[found..].find(']').unwrap() + 1;
            format!(
                "{}\"data_offsets\":{offsets}{}",
                &header[..found],
                &header[end..]
            )
        })
    };
    for content in [
        huge,
        shape("[1152921504606846976]"),
        // Two factors whose product wraps around.
        shape("[4294967296,4294967296]"),
        shape("[-1]"),
        shape("[[1]]"),
        offsets("[0,1152921504606846976]"),
        offsets("[1152921504606846976,0]"),
        offsets("[0,0]"),
        with_header(|header| {
            header.replacen(
                "{\"",
                "{\"again\":{\"dtype\":\"F32\",\"shape\":[1],\"data_offsets\":[0,4]},\"",
                1,
            )
        }),
        with_header(|_| "[".repeat(100_000)),
        with_header(|_| "{\"a\":".repeat(100_000)),
    ] {
        let text = parse(&content).unwrap_err().to_string();
        assert!(text.starts_with("w.safetensors"), "{text}");
    }
    memory_was_enough();
}

#[test]
fn a_training_state_with_absurd_lengths_is_an_error_at_once() {
    // 253 begins a u64.
    let huge = [[253u8].as_slice(), &(1u64 << 60).to_le_bytes()].concat();
    for at in 0..STATE.len() {
        let payload = [&STATE[..at], &huge, &STATE[at..]].concat();
        if let Ok((_, moments)) = state::decode(&sealed(&payload), Path::new("s.bin")) {
            let numbers: usize = moments.iter().flatten().map(Vec::len).sum();
            assert!(4 * numbers <= payload.len());
        }
    }
    let zeros = sealed(&vec![0; 900_000]);
    assert!(state::decode(&zeros, Path::new("s.bin")).is_err());
    // The deepest that lists go, as many as fit: each is a list without numbers.
    let mut lists = STATE[..STATE.len() - 1].to_vec();
    lists.truncate(STATE.len() - 100);
    lists.extend(vec![0; 900_000]);
    assert!(state::decode(&sealed(&lists), Path::new("s.bin")).is_err());
    memory_was_enough();
}

/// The error of a run's folder whose config and weights file name sizes that its weights do not
/// have.
fn run_of_sizes(model: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let config = small_config("");
    let text = config.to_toml().unwrap();
    let large = model.split(' ').fold(text.clone(), |text, size| {
        let (key, value) = size.split_once('=').unwrap();
        text.replacen(
            &format!("\n{key} = 1\n"),
            &format!("\n{key} = {value}\n"),
            1,
        )
    });
    assert_ne!(text, large);
    let tensors = safetensors::SafeTensors::deserialize(&WEIGHTS).unwrap();
    let tensors: Vec<(String, TensorView)> = tensors
        .iter()
        .map(|(name, view)| {
            let view = TensorView::new(Dtype::F32, view.shape().to_vec(), view.data());
            (name.to_string(), view.unwrap())
        })
        .collect();
    let metadata = serde_json::json!({ "config": large, "version": "0.1.0" }).to_string();
    let metadata = HashMap::from([("keydance".to_string(), metadata)]);
    let content = safetensors::serialize(tensors, Some(metadata)).unwrap();
    fs::write(folder.path().join(WEIGHTS_FILE), content).unwrap();
    fs::write(folder.path().join("config.toml"), &large).unwrap();
    let run = RunFolder::open(folder.path());
    let error = match run.config() {
        Ok(config) => run.trained_model(&config).err().unwrap(),
        Err(error) => error,
    };
    error.to_string()
}

#[test]
fn a_small_file_whose_config_names_a_huge_model_takes_no_memory() {
    for (sizes, words) in [
        (
            "hidden=65536 code=4096 feed_forward=65536",
            "has more than 10",
        ),
        ("encoder_layers=64 decoder_layers=64", "layers.1.self_attn"),
    ] {
        let text = run_of_sizes(sizes);
        assert!(text.contains(words), "{text}");
    }
    let text = run_of_sizes("code=65536");
    assert!(
        text.contains("model.code = 65536: expected 1 to 4096"),
        "{text}"
    );
    memory_was_enough();
}

#[test]
fn a_checkpoint_larger_than_its_model_is_refused_unread() {
    use keydance::run::checkpoint::Checkpoint;
    let folder = tempfile::tempdir().unwrap();
    let state = fs::File::create(folder.path().join(STATE_FILE)).unwrap();
    // Takes no room on the disk.
    state.set_len(1 << 40).unwrap();
    let mut parameters = Parameters::new();
    parameters.add("w", ndarray::ArrayD::zeros(vec![3]));
    let text = Checkpoint::read(folder.path(), &parameters)
        .unwrap_err()
        .to_string();
    assert!(
        text.contains("a training state of this model has at most"),
        "{text}"
    );
    fs::write(folder.path().join(STATE_FILE), sealed(&STATE)).unwrap();
    let weights = fs::File::create(folder.path().join(WEIGHTS_FILE)).unwrap();
    weights.set_len(1 << 40).unwrap();
    let text = Checkpoint::read(folder.path(), &parameters)
        .unwrap_err()
        .to_string();
    assert!(
        text.contains("weights.safetensors has 1099511627776 bytes"),
        "{text}"
    );
    memory_was_enough();
}
