//! What is heard in sounds, against librosa where its numbers are there and against sounds whose
//! beats are known; sound files of every kind and every fault.

use std::f64::consts::TAU;
use std::fs;
use std::path::PathBuf;

use keydance::music::features::{accents, beat_curve};
use keydance::music::twentieths::{Twentieths, rises};
use keydance::music::{Analysis, Cache, FeatureSet, HOP, MusicError, RATE, Sound, parse};
use ndarray::Array2;
use ndarray_npy::ReadNpyExt as _;
use proptest::prelude::*;
use tempfile::tempdir;

use crate::real_data::dance_folder;

/// The folder of librosa's numbers for a waltz of five seconds.
fn reference_folder() -> Option<PathBuf> {
    let folder = dance_folder()?.join("../music_dance/reference");
    if folder.is_dir() {
        Some(folder)
    } else {
        eprintln!("skipped: no librosa reference in {}", folder.display());
        None
    }
}

#[test]
fn features_of_the_reference_are_librosas() {
    let Some(folder) = reference_folder() else {
        return;
    };
    let heard = Cache::none()
        .analysis(&folder.join("waltz_5s.wav"))
        .unwrap();
    assert_eq!(heard.warnings, Vec::<String>::new());
    let heard = heard.analysis;
    let sets = [
        ("paper15", FeatureSet::Paper15, 1e-4),
        ("fact35", FeatureSet::Fact35, 1e-4),
        ("mel_db", FeatureSet::Mel128, 1e-3),
    ];
    for (name, set, bound) in sets {
        let file = fs::File::open(folder.join(format!("waltz_5s.{name}.npy"))).unwrap();
        let expected = Array2::<f32>::read_npy(file).unwrap();
        let features = heard.features(set);
        assert_eq!(features.dim(), expected.dim(), "{name}");
        let errors = features.iter().zip(&expected).map(|(a, b)| (a - b).abs());
        let error = errors.fold(0.0, f32::max);
        assert!(error < bound, "{name}: {error}");
    }
    let json = fs::read_to_string(folder.join("waltz_5s.json")).unwrap();
    let expected: serde_json::Value = serde_json::from_str(&json).unwrap();
    let ours = serde_json::json!({
        "frames": heard.frames(), "tempo_bpm": heard.tempo, "metre": heard.metre,
        "beats": heard.beats, "downbeats": heard.downbeats, "onset_peaks": heard.onset_peaks,
    });
    for (name, value) in ours.as_object().unwrap() {
        assert_eq!(value, &expected[name], "{name}");
    }
}

fn sine(hertz: f64, rate: u32, samples: usize) -> Vec<f32> {
    let at = |n: usize| 0.5 * (TAU * hertz * n as f64 / f64::from(rate)).sin();
    (0..samples).map(|n| at(n) as f32).collect()
}

#[test]
fn a_sine_of_another_rate_stays_the_same_sine_at_the_same_time() {
    for rate in [8_000, 11_025, 44_100, 44_101, 48_000, 96_000, 192_000] {
        let sound = Sound::new("sine", &sine(1_000.0, rate, rate as usize), rate).unwrap();
        assert_eq!(sound.samples().len(), RATE as usize, "{rate}");
        let expected = sine(1_000.0, RATE, RATE as usize);
        // The sound's ends are edges to silence.
        let inner = 1_000..RATE as usize - 1_000;
        let (ours, theirs) = (&sound.samples()[inner.clone()], &expected[inner]);
        let errors = ours.iter().zip(theirs).map(|(a, b)| (a - b).abs());
        let error = errors.fold(0.0, f32::max);
        assert!(error < 2e-5, "{rate}: {error}");
    }
}

#[test]
fn what_is_above_half_the_rate_is_filtered_out() {
    let sound = Sound::new("high", &sine(12_000.0, 44_100, 44_100), 44_100).unwrap();
    let inner = &sound.samples()[1_000..RATE as usize - 1_000];
    assert!(inner.iter().all(|sample| sample.abs() < 1e-5));
    let sound = Sound::new("low", &sine(9_500.0, 44_100, 44_100), 44_100).unwrap();
    let power: f32 = sound.samples().iter().map(|x| x * x).sum();
    assert!((power / RATE as f32 - 0.125).abs() < 1e-3);
}

#[test]
fn a_rate_that_no_sound_has_is_refused() {
    for rate in [0, 999, 384_001, u32::MAX] {
        let error = Sound::new("odd", &[0.0; 5_000], rate).unwrap_err();
        assert!(matches!(error, MusicError::Rate { .. }), "{error}");
    }
}

/// Clicks at a tempo, the first of each bar louder and on a chord of its own.
fn bars(bpm: f64, metre: usize, seconds: usize) -> Sound {
    let rate = f64::from(RATE);
    let beat = 60.0 / bpm * rate;
    let sample = |n: usize| {
        let count = (n as f64 / beat).floor();
        let since = (n as f64 - count * beat) / rate;
        let (bar, place) = (count as usize / metre, count as usize % metre);
        let click = if place == 0 { 0.6 } else { 0.2 } * (-40.0 * since).exp();
        let chord = 220.0 * 2f64.powf((bar % 4 * 5 % 12) as f64 / 12.0);
        let time = n as f64 / rate;
        let tone = (TAU * chord * time).sin() + (TAU * 1.5 * chord * time).sin();
        (click * (TAU * 1_900.0 * time).sin() + 0.05 * tone) as f32
    };
    let samples: Vec<f32> = (0..seconds * RATE as usize).map(sample).collect();
    Sound::new("bars", &samples, RATE).unwrap()
}

#[test]
fn tempo_beats_and_metre_of_accented_clicks_are_found() {
    // Another tempo's double or half may be nearer to that of the start.
    for (bpm, metre) in [(90.0, 3), (100.0, 4), (112.5, 3), (120.0, 4)] {
        let heard = Analysis::of(&bars(bpm, metre, 40)).unwrap();
        assert_eq!((heard.tempo, heard.metre), (bpm, metre));
        let period = 1_800.0 / bpm;
        let near = |frames: &[usize], period: f64| {
            let off = |&&frame: &&usize| {
                let place = frame as f64 / period;
                (place - place.round()).abs() * period <= 1.0
            };
            frames.iter().filter(off).count()
        };
        let (beats, downbeats) = (&heard.beats, &heard.downbeats);
        assert!(
            beats.len() as f64 > 0.85 * 40.0 * 30.0 / period,
            "{bpm}: {beats:?}"
        );
        assert!(
            near(beats, period) * 20 >= beats.len() * 19,
            "{bpm}: {beats:?}"
        );
        let bars = near(downbeats, period * metre as f64);
        assert_eq!(bars, downbeats.len(), "{bpm}: {downbeats:?}");
    }
}

#[test]
fn silence_has_finite_features_no_beats_and_the_tempo_of_the_start() {
    for samples in [HOP, 3_000, 10 * RATE as usize] {
        let heard = Analysis::of(&Sound::new("silence", &vec![0.0; samples], RATE).unwrap());
        let heard = heard.unwrap();
        assert!(heard.silent && !heard.has_onsets());
        assert_eq!((heard.tempo, heard.metre), (100.0, 4));
        assert!(heard.beats.is_empty() && heard.onset_peaks.is_empty());
        for set in [FeatureSet::Paper15, FeatureSet::Fact35, FeatureSet::Mel128] {
            let features = heard.features(set);
            assert_eq!(features.dim(), (samples / HOP, set.numbers()));
            assert!(features.iter().all(|x| x.is_finite()), "{set}");
        }
    }
}

#[test]
fn a_sound_shorter_than_a_frame_is_refused() {
    let sound = Sound::new("click.wav", &[0.5; HOP - 1], RATE).unwrap();
    let error = Analysis::of(&sound).unwrap_err().to_string();
    assert!(error.contains("click.wav has 734 samples"), "{error}");
}

/// A wav file of 16 bits; `channels` are interleaved.
fn wav(samples: &[i16], channels: u16, rate: u32) -> Vec<u8> {
    let data: Vec<u8> = samples.iter().flat_map(|x| x.to_le_bytes()).collect();
    let mut file = b"RIFF".to_vec();
    file.extend((36 + data.len() as u32).to_le_bytes());
    file.extend(b"WAVEfmt \x10\0\0\0\x01\0");
    file.extend(channels.to_le_bytes());
    file.extend(rate.to_le_bytes());
    file.extend((rate * u32::from(channels) * 2).to_le_bytes());
    file.extend((channels * 2).to_le_bytes());
    file.extend(b"\x10\0data");
    file.extend((data.len() as u32).to_le_bytes());
    file.extend(data);
    file
}

/// Files of a fifth of a second of a sine, as other programs encode it.
fn encoded(ending: &str) -> Vec<u8> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/music");
    fs::read(folder.join(format!("sine.{ending}"))).unwrap()
}

#[test]
fn flac_ogg_and_mp3_are_decoded_in_place_without_what_an_encoder_adds() {
    for (ending, bound) in [("flac", 1e-4), ("ogg", 0.02), ("mp3", 0.02)] {
        // The name's ending says nothing.
        let sound = parse(&encoded(ending), "sine.wav").unwrap();
        assert_eq!(sound.warnings(), Vec::<String>::new(), "{ending}");
        let samples = sound.samples();
        assert_eq!(samples.len(), 4_410, "{ending}");
        let expected = sine(440.0, RATE, samples.len());
        let inner = 300..4_100;
        let pairs = samples[inner.clone()].iter().zip(&expected[inner]);
        let error = pairs.map(|(a, b)| (a - 0.6 * b).abs()).fold(0.0, f32::max);
        assert!(error < bound, "{ending}: {error}");
    }
}

#[test]
fn encoded_files_that_are_damaged_are_refused_or_heard() {
    for ending in ["flac", "ogg", "mp3"] {
        let whole = encoded(ending);
        for length in (0..whole.len()).step_by(97) {
            let _ = parse(&whole[..length], "cut");
            let mut flipped = whole.clone();
            flipped[length] ^= 0x55;
            if let Ok(sound) = parse(&flipped, "flipped") {
                assert!(sound.samples().iter().all(|x| x.is_finite()));
            }
        }
    }
}

fn noise(samples: usize) -> Vec<i16> {
    let mut state = 1u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 18) as i16
    };
    (0..samples).map(|_| next()).collect()
}

#[test]
fn channels_become_their_mean() {
    let sound = parse(&wav(&[100, 300, -50, 50, 7, 8], 2, RATE), "stereo.wav").unwrap();
    let expected = [200.0, 0.0, 7.5].map(|x: f32| x / 32_768.0);
    assert_eq!(sound.samples(), expected);
    let six: Vec<i16> = (0..60).collect();
    let sound = parse(&wav(&six, 6, RATE), "six.wav").unwrap();
    assert_eq!(sound.samples()[0], 2.5 / 32_768.0);
    assert_eq!(sound.warnings(), Vec::<String>::new());
}

#[test]
fn a_file_that_is_cut_off_is_used_as_far_as_it_goes_with_a_warning_of_both_lengths() {
    let whole = wav(&noise(3 * RATE as usize), 1, RATE);
    let sound = parse(&whole[..whole.len() / 3], "cut.wav").unwrap();
    assert_eq!(sound.samples().len(), RATE as usize - 15);
    let [warning] = sound.warnings() else {
        panic!("{:?}", sound.warnings());
    };
    assert!(
        warning.contains("lasts 3.00 s, 1.00 s are there"),
        "{warning}"
    );
}

/// An ID3v2.4 tag around a frame of other bytes.
fn tagged(content: &[u8], sound: &[u8]) -> Vec<u8> {
    let seven_bits = |size: usize| [21, 14, 7, 0].map(|shift| (size >> shift) as u8 & 0x7f);
    let mut file = b"ID3\x04\0\0".to_vec();
    file.extend(seven_bits(content.len() + 10));
    file.extend(b"APIC");
    file.extend(seven_bits(content.len()));
    file.extend([0; 2]);
    file.extend(content);
    file.extend(sound);
    file
}

#[test]
fn what_a_tag_holds_is_not_heard_however_large_it_is() {
    let picture = vec![b'x'; 1_500_000];
    let text = b"fLaC OggS RIFF".to_vec();
    let other = wav(&noise(3_000), 1, RATE);
    for ending in ["mp3", "flac", "ogg", "wav"] {
        let sound = match ending {
            "wav" => wav(&noise(4_410), 1, RATE),
            ending => encoded(ending),
        };
        let plain = parse(&sound, "plain").unwrap();
        for content in [&picture, &text, &encoded("mp3"), &other] {
            let heard = parse(&tagged(content, &sound), "tagged").unwrap();
            assert_eq!(heard.samples(), plain.samples(), "{ending}");
            assert_eq!(heard.warnings(), plain.warnings(), "{ending}");
        }
    }
}

#[test]
fn wav_files_whose_chunks_are_not_as_they_should_be_are_heard_whole() {
    let samples = noise(3_000);
    let whole = wav(&samples, 1, RATE);
    let expected = parse(&whole, "whole.wav").unwrap();
    let with = |chunk: &[u8]| {
        let mut file = whole.clone();
        file.splice(36..36, chunk.iter().copied());
        file
    };
    let set = |at: usize, length: u32| {
        let mut file = whole.clone();
        file[at..at + 4].copy_from_slice(&length.to_le_bytes());
        file
    };
    for (what, file) in [
        (
            "a list without the byte that fills it up",
            with(b"LIST\x05\0\0\0INFOx"),
        ),
        ("an empty list", with(b"LIST\0\0\0\0")),
        (
            "a name without the byte that fills it up",
            with(b"note\x03\0\0\0abc"),
        ),
        ("a whole that is too short", set(4, 1_000)),
        ("a whole of nothing", set(4, 0)),
        ("samples whose length was never written", set(40, 0)),
    ] {
        let heard = parse(&file, "odd.wav").unwrap();
        assert_eq!(heard.samples(), expected.samples(), "{what}");
        assert_eq!(heard.warnings(), Vec::<String>::new(), "{what}");
    }
    // No samples come however far one looks.
    let mut zeros = whole[..36].to_vec();
    zeros.extend(vec![0; 100_000]);
    assert!(parse(&zeros, "zeros.wav").is_err());
    // Nothing is there but a list behind it.
    let mut empty = wav(&[], 1, RATE);
    empty.extend(b"LIST\x04\0\0\0INFO");
    let error = parse(&empty, "empty.wav").unwrap_err().to_string();
    assert!(error.contains("it holds no sample"), "{error}");
}

#[test]
fn what_is_no_sound_file_is_named() {
    let cases: [(&[u8], &str); 10] = [
        (b"", "is empty"),
        (b"Once upon a time there was a waltz.", "is a text"),
        (b"HIERARCHY\nROOT Hips\n", "is a BVH file"),
        (b"\0\0\0\x20ftypM4P \0\0\0\0", "m4p is protected"),
        (b"\x30\x26\xb2\x75\x8e\x66\xcf\x11\xa6\xd9", "Windows Media"),
        (b"FORM\0\0\0\x20AIFFCOMM", "is an AIFF file"),
        (
            b"RIFF\x24\0\0\0AVI LIST",
            "is a RIFF file without wave sound",
        ),
        (b"\x89PNG\r\n\x1a\n\0\0", "is a PNG picture"),
        (&[0; 5_000], "is no sound file that is known"),
        (&[0xff; 5_000], "is no sound file that is known"),
    ];
    for (content, words) in cases {
        let error = parse(content, "song.mp3").unwrap_err().to_string();
        assert!(error.starts_with("song.mp3 "), "{error}");
        assert!(error.contains(words), "{words}: {error}");
    }
}

#[test]
fn damaged_and_unknown_content_of_a_known_file_is_an_error() {
    let whole = wav(&noise(5_000), 1, RATE);
    let mut unknown = whole.clone();
    // The codec: MP3.
    unknown[20] = 0x55;
    let none = wav(&[], 1, RATE);
    let cases: [(&[u8], &str); 6] = [
        (&whole[..20], "is damaged: it ends too early"),
        (&unknown, "does not decode"),
        (&none, "is damaged: it holds no sample"),
        (b"fLaC", "is damaged: it ends too early"),
        (b"OggS\0\x02", "is damaged: it ends too early"),
        (b"ID3\x04\0\0\0\0\0\x01\0\xff\xfb\x90\0", "is damaged"),
    ];
    for (content, words) in cases {
        let error = parse(content, "song.wav").unwrap_err().to_string();
        assert!(error.contains(words), "{words}: {error}");
    }
    let slow = parse(&wav(&noise(5_000), 1, 100), "slow.wav").unwrap_err();
    assert!(
        slow.to_string().contains("has 100 samples a second"),
        "{slow}"
    );
}

#[test]
fn an_hour_is_the_longest_that_is_heard() {
    // At 1,000 Hz little has to be written.
    let hour = wav(&vec![0; 3_600_000], 1, 1_000);
    let sound = parse(&hour, "hour.wav").unwrap();
    assert_eq!(sound.samples().len(), 3_600 * RATE as usize);
    let more = wav(&vec![0; 3_601_001], 1, 1_000);
    let error = parse(&more, "long.wav").unwrap_err().to_string();
    assert!(
        error.contains("long.wav is longer than 60 minutes"),
        "{error}"
    );
}

#[test]
fn a_header_that_promises_hours_is_not_believed() {
    let mut lying = wav(&noise(RATE as usize), 1, RATE);
    lying[4..8].copy_from_slice(&0xffff_fffeu32.to_le_bytes());
    lying[40..44].copy_from_slice(&0xffff_ff00u32.to_le_bytes());
    let sound = parse(&lying, "lying.wav").unwrap();
    assert_eq!(sound.samples().len(), RATE as usize);
    assert!(
        sound.warnings()[0].contains("is cut off"),
        "{:?}",
        sound.warnings()
    );
}

#[test]
fn samples_that_are_no_numbers_count_as_none() {
    let sound = Sound::new("odd", &[f32::NAN, 0.25, f32::INFINITY], RATE).unwrap();
    assert_eq!(sound.samples(), [0.0, 0.25, 0.0]);
}

#[test]
fn the_same_content_is_heard_once_and_a_damaged_entry_or_another_songs_is_made_again() {
    let folder = tempdir().unwrap();
    let cache = Cache::at(&folder.path().join("a/b"));
    let (one, two) = (folder.path().join("one.wav"), folder.path().join("two.ogg"));
    let content = wav(&noise(20_000), 1, RATE);
    fs::write(&one, &content).unwrap();
    fs::write(&two, &content).unwrap();
    let heard = cache.analysis(&one).unwrap();
    let entries = || {
        let entries = fs::read_dir(folder.path().join("a/b")).unwrap();
        entries
            .map(|entry| entry.unwrap().path())
            .collect::<Vec<_>>()
    };
    let [entry] = &entries()[..] else {
        panic!("{:?}", entries());
    };
    assert_eq!(cache.analysis(&two).unwrap(), heard);
    assert_eq!(entries().len(), 1);
    let whole = fs::read(entry).unwrap();
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    let cut = whole[..whole.len() - 40].to_vec();
    let (other, elsewhere) = (folder.path().join("other.wav"), folder.path().join("c"));
    fs::write(&other, wav(&noise(30_000), 1, RATE)).unwrap();
    Cache::at(&elsewhere).analysis(&other).unwrap();
    let of_other = fs::read_dir(&elsewhere).unwrap().next().unwrap().unwrap();
    let of_other = fs::read(of_other.path()).unwrap();
    for damaged in [flipped, cut, Vec::new(), b"KDMUSIC\0".to_vec(), of_other] {
        fs::write(entry, damaged).unwrap();
        assert_eq!(cache.analysis(&one).unwrap(), heard);
        assert!(fs::read(entry).unwrap() == whole);
    }
    fs::remove_file(entry).unwrap();
    fs::create_dir(entry).unwrap();
    let again = cache.analysis(&one).unwrap();
    assert_eq!(again.analysis, heard.analysis);
    assert!(
        again.warnings[0].contains("is heard again next time"),
        "{again:?}"
    );
}

#[test]
fn a_folder_or_a_missing_file_is_no_sound() {
    let folder = tempdir().unwrap();
    let error = Cache::none().analysis(folder.path()).unwrap_err();
    assert!(error.to_string().contains("is a folder"), "{error}");
    let error = Cache::at(folder.path()).analysis(&folder.path().join("none.wav"));
    assert!(error.unwrap_err().to_string().contains("cannot be read"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Twice as loud changes no beat and no feature but the decibels, by 6.
    #[test]
    fn what_is_heard_does_not_depend_on_the_volume(seed in 0u32..1000, frames in 30usize..400) {
        let at = |n: usize| {
            let hash = (n as u32).wrapping_mul(2_654_435_761).wrapping_add(seed) >> 8;
            let burst = (-((n % (9_000 + 7 * seed as usize)) as f32) / 700.0).exp();
            (hash as f32 / 16_777_216.0 - 0.5) * burst
        };
        let quiet: Vec<f32> = (0..frames * HOP).map(at).collect();
        let loud: Vec<f32> = quiet.iter().map(|x| 2.0 * x).collect();
        let hear = |samples: &[f32]| Analysis::of(&Sound::new("s", samples, RATE).unwrap()).unwrap();
        let (quiet, loud) = (hear(&quiet), hear(&loud));
        prop_assert_eq!(quiet.tempo, loud.tempo);
        prop_assert_eq!(&quiet.beats, &loud.beats);
        prop_assert_eq!(&quiet.onset_peaks, &loud.onset_peaks);
        let beats = quiet.beats.windows(2).all(|pair| pair[0] < pair[1]);
        prop_assert!(beats && quiet.beats.iter().all(|&beat| beat <= frames));
        prop_assert!(quiet.downbeats.iter().all(|beat| quiet.beats.contains(beat)));
        for (a, b) in quiet.chroma.iter().zip(&loud.chroma) {
            prop_assert!((a - b).abs() < 1e-5);
        }
    }

    /// Damaged files are refused or heard, never a panic and never numbers that are none.
    #[test]
    fn a_damaged_file_is_refused_or_heard(
        at in any::<prop::sample::Index>(),
        byte in any::<u8>(),
        cut in any::<prop::sample::Index>(),
        head in any::<bool>(),
    ) {
        let mut file = wav(&noise(3_000), 2, 44_100);
        let place = if head { at.index(44) } else { at.index(file.len()) };
        file[place] = byte;
        file.truncate(cut.index(file.len()) + 1);
        if let Ok(sound) = parse(&file, "damaged.wav") {
            prop_assert!(sound.samples().iter().all(|x| x.is_finite()));
            if let Ok(heard) = Analysis::of(&sound) {
                let features = heard.features(FeatureSet::Fact35);
                prop_assert!(features.iter().all(|x| x.is_finite()));
            }
        }
    }
}

#[test]
fn mel_bands_and_rises_at_20_frames_a_second_are_those_of_an_independent_program() {
    let Some(folder) = dance_folder() else {
        return;
    };
    let path = folder.join("../../spec/data/flow_example.json");
    let Ok(json) = fs::read_to_string(&path) else {
        eprintln!("skipped: no {}", path.display());
        return;
    };
    let example: serde_json::Value = serde_json::from_str(&json).unwrap();
    let example = &example["audio"];
    let numbers = |value: &serde_json::Value| -> Vec<f64> {
        let list = value.as_array().unwrap().iter();
        list.map(|it| it.as_f64().unwrap()).collect()
    };
    let count = example["samples"].as_u64().unwrap() as usize;
    let mut samples = vec![0.0; count];
    for tone in example["tones_amplitude_hz"].as_array().unwrap() {
        let tone = numbers(tone);
        for (n, sample) in samples.iter_mut().enumerate() {
            *sample += tone[0] * (TAU * tone[1] * n as f64 / f64::from(RATE)).sin();
        }
    }
    for click in numbers(&example["clicks"]) {
        let from = click as usize;
        for (n, sample) in samples[from..from + 64].iter_mut().enumerate() {
            *sample += 0.8 * 0.9_f64.powi(n as i32);
        }
    }
    let heard = Twentieths::of(&samples);
    let expected = example["mel_db"].as_array().unwrap();
    assert_eq!(heard.mel.dim(), (expected.len(), 80));
    for (row, expected) in heard.mel.rows().into_iter().zip(expected) {
        for (ours, theirs) in row.iter().zip(numbers(expected)) {
            assert!((ours - theirs).abs() < 1e-6, "{ours} for {theirs}");
        }
    }
    for (ours, theirs) in rises(heard.mel.view())
        .iter()
        .zip(numbers(&example["onset"]))
    {
        assert!((ours - theirs).abs() < 1e-6, "{ours} for {theirs}");
    }
}

#[test]
fn features_at_20_frames_a_second_have_beats_where_they_sound() {
    let heard = Analysis::of(&bars(120.0, 4, 30)).unwrap();
    let numbers = heard.features(FeatureSet::Transflower91);
    assert_eq!(numbers.dim(), (600, 91));
    // A beat every 10 frames, a bar every 40.
    let peaks = |column: usize| -> Vec<usize> {
        let column = numbers.column(column);
        (0..600).filter(|&frame| column[frame] > 0.9).collect()
    };
    let (beats, downbeats) = (peaks(81), peaks(82));
    assert!(beats.len() > 50 && beats.windows(2).all(|pair| pair[1] - pair[0] == 10));
    assert_eq!(beats.len().div_ceil(4), downbeats.len());
    assert!(
        downbeats.iter().all(|frame| frame % 40 == 0),
        "{downbeats:?}"
    );
    // Clicks rise in every band of the flux within 20 ms of the beat.
    for &frame in &beats[1..50] {
        let flux = numbers.slice(ndarray::s![frame, 83..]);
        let between = numbers.slice(ndarray::s![frame + 5, 83..]);
        assert!(
            flux.sum() > 2.0 * between.sum(),
            "{frame}: {flux} {between}"
        );
    }
    let short = heard.features(FeatureSet::OnsetBeats);
    assert_eq!(short.dim(), (600, 2));
    assert_eq!(short.column(1), numbers.column(81));
    let onset = short.column(0).mapv(f64::from);
    assert!(onset.mean().unwrap().abs() < 1e-6 && (onset.std(0.0) - 1.0).abs() < 1e-6);
}

#[test]
fn a_beat_between_two_frames_of_20_a_second_is_near_both() {
    let curve = beat_curve(&[0.125, 0.3], 8, 20.0);
    let expected = |distance: f64| (-0.5 * (distance / 0.05).powi(2)).exp() as f32;
    for (frame, distance) in [
        (0, 0.125),
        (2, 0.025),
        (3, 0.025),
        (4, 0.075),
        (6, 0.0),
        (7, 0.05),
    ] {
        assert!(
            (curve[frame] - expected(distance)).abs() < 1e-6,
            "{frame}: {curve:?}"
        );
    }
    assert_eq!(beat_curve(&[], 3, 20.0), [0.0; 3]);
    assert_eq!(accents(&[2.0; 4]), [0.0; 4]);
}
