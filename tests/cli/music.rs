//! `keydance music` from outside.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use ndarray::Array2;
use ndarray_npy::ReadNpyExt as _;
use serde_json::Value;
use tempfile::{TempDir, tempdir};

use crate::small_run::{keydance, stderr};

/// Two clicks a second, the first of three louder: twelve seconds of one channel.
fn clicks(seconds: usize) -> Vec<u8> {
    let sample = |n: usize| {
        let (beat, since) = (n / 11_025, n % 11_025);
        let loudness = if beat.is_multiple_of(3) {
            20_000
        } else {
            6_000
        };
        if since < 300 && since % 10 < 5 {
            loudness
        } else {
            0
        }
    };
    let data: Vec<u8> = (0..seconds * 22_050)
        .flat_map(|n| (sample(n) as i16).to_le_bytes())
        .collect();
    let mut file = b"RIFF".to_vec();
    file.extend((36 + data.len() as u32).to_le_bytes());
    file.extend(b"WAVEfmt \x10\0\0\0\x01\0\x01\0");
    file.extend(22_050u32.to_le_bytes());
    file.extend(44_100u32.to_le_bytes());
    file.extend(b"\x02\0\x10\0data");
    file.extend((data.len() as u32).to_le_bytes());
    file.extend(data);
    file
}

struct Song {
    folder: TempDir,
    file: PathBuf,
}

impl Song {
    fn new(content: &[u8]) -> Self {
        let folder = tempdir().unwrap();
        let file = folder.path().join("song.wav");
        fs::write(&file, content).unwrap();
        Self { folder, file }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs the command with the user's cache in this song's folder.
    fn hear(&self, arguments: &[&str]) -> Output {
        let mut command = keydance();
        command.arg("music").arg(&self.file).args(arguments);
        command.env("XDG_CACHE_HOME", self.path("user"));
        command.output().unwrap()
    }
}

fn stdout(output: &Output) -> String {
    assert!(output.status.success(), "{}", stderr(output));
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn array(path: &Path) -> Array2<f32> {
    Array2::read_npy(fs::File::open(path).unwrap()).unwrap()
}

#[test]
fn tempo_metre_and_beats_are_printed_and_written() {
    let song = Song::new(&clicks(12));
    let (npy, json) = (song.path("features.npy"), song.path("beats.json"));
    let (npy_text, json_text) = (npy.to_str().unwrap(), json.to_str().unwrap());
    let text = stdout(&song.hear(&["--npy", npy_text, "--json", json_text]));
    assert!(text.starts_with("12.00 s, 360 frames"), "{text}");
    for words in [
        "tempo      120.00",
        "metre      3",
        "beats      ",
        "float32 [360, 15]",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert_eq!(array(&npy).dim(), (360, 15));
    let json: Value = serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap();
    assert_eq!(json["tempo_bpm"], 120.0);
    assert_eq!((&json["metre"], &json["frames"]), (&3.into(), &360.into()));
    let beats = json["beats"].as_array().unwrap();
    assert!(beats.len() > 15, "{beats:?}");
    let seconds = json["beat_seconds"][1].as_f64().unwrap();
    assert_eq!(seconds, beats[1].as_f64().unwrap() / 30.0);

    let there = song.hear(&["--npy", npy_text]);
    assert!(
        stderr(&there).contains("is there already"),
        "{}",
        stderr(&there)
    );
    stdout(&song.hear(&["--npy", npy_text, "--features", "fact35", "--force"]));
    assert_eq!(array(&npy).dim(), (360, 35));
}

#[test]
fn what_was_heard_is_remembered_unless_it_is_not_to_be() {
    let song = Song::new(&clicks(2));
    let own = song.path("own");
    let first = stdout(&song.hear(&["--no-cache"]));
    assert!(!song.path("user").exists());
    let again = stdout(&song.hear(&["--cache", own.to_str().unwrap()]));
    assert_eq!(
        (first.as_str(), fs::read_dir(&own).unwrap().count()),
        (&*again, 1)
    );
    assert!(!song.path("user").exists());
    assert_eq!(stdout(&song.hear(&[])), first);
    let entries = fs::read_dir(song.path("user/keydance/music")).unwrap();
    let entry = entries.last().unwrap().unwrap().path();
    fs::write(&entry, "damaged").unwrap();
    let mended = song.hear(&[]);
    assert_eq!(
        (stdout(&mended), stderr(&mended)),
        (first.clone(), String::new())
    );
    assert!(fs::metadata(&entry).unwrap().len() > 1_000);

    // A file where the folder should be: said, and gone on without.
    let blocked = song.path("blocked");
    fs::write(&blocked, "").unwrap();
    let output = song.hear(&["--cache", blocked.to_str().unwrap()]);
    assert_eq!(stdout(&output), first);
    let said = stderr(&output);
    assert!(
        said.starts_with("warning: ") && said.lines().count() == 1,
        "{said}"
    );
}

#[test]
fn silence_is_stated_and_what_is_cut_off_is_warned_of() {
    let mut silence = clicks(3);
    silence[44..].fill(0);
    let song = Song::new(&silence);
    let text = stdout(&song.hear(&["--no-cache"]));
    assert!(
        text.contains("silent: no beats; its tempo counts as 100.00"),
        "{text}"
    );
    let whole = clicks(4);
    let song = Song::new(&whole[..whole.len() / 2]);
    for _ in 0..2 {
        // Remembered with what was heard.
        let output = song.hear(&[]);
        assert!(stdout(&output).starts_with("2.00 s, 59 frames"));
        let said = stderr(&output);
        assert!(
            said.contains("song.wav is cut off: it says that it lasts 4.00 s"),
            "{said}"
        );
    }
}

#[test]
fn a_file_that_cannot_be_heard_is_an_error_and_nothing_is_written() {
    for (content, words) in [
        (&b""[..], "song.wav is empty"),
        (b"no music at all, only words", "song.wav is a text"),
        (&clicks(1)[..50], "song.wav has 3 samples"),
    ] {
        let song = Song::new(content);
        let npy = song.path("features.npy");
        let output = song.hear(&["--npy", npy.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(1));
        let said = stderr(&output);
        assert!(said.contains(words), "{words}: {said}");
        assert!(!npy.exists() && !song.path("user").exists());
    }
}

#[test]
fn the_sound_itself_is_never_written_over() {
    let song = Song::new(&clicks(1));
    let file = song.file.to_str().unwrap().to_string();
    let output = song.hear(&["--json", &file, "--force"]);
    assert!(stderr(&output).contains("is what the command reads"));
    assert_eq!(fs::read(&song.file).unwrap(), clicks(1));
}

#[test]
fn where_one_of_two_outputs_cannot_be_written_neither_is() {
    let song = Song::new(&clicks(1));
    let (npy, json) = (song.path("features.npy"), song.path("no/beats.json"));
    let output = song.hear(&[
        "--npy",
        npy.to_str().unwrap(),
        "--json",
        json.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(1));
    let said = stderr(&output);
    assert!(said.contains("beats.json cannot be written: there is no folder"));
    assert!(!npy.exists() && !song.path("user").exists());
}
