//! The user study: a page that does not say whose clips it shows, and what made-up ratings say.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::browser::{self, Loaded};
use crate::trained_run::keydance;

/// Folders of generated dances: `first` and `second` with one name a dance, music beside the first.
struct Dances {
    folder: TempDir,
}

impl Dances {
    fn new(clips: &str, frames: &str) -> Self {
        let folder = TempDir::new().unwrap();
        for (name, seed) in [("first", "1"), ("second", "2")] {
            let mut command = keydance("choreography");
            command.args(["--clips", clips, "--frames", frames, "--seed", seed]);
            command.arg("--music").arg("--out");
            command.arg(folder.path().join(name)).assert().success();
        }
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `keydance study page` of the models Lovelace and Hopper, into `out`.
    fn page(&self, out: &str, more: &[&str]) -> Command {
        let mut command = keydance("study");
        command.arg("page");
        for (name, folder) in [("Lovelace", "first"), ("Hopper", "second")] {
            let folder = self.path(folder);
            command
                .arg("--model")
                .arg(format!("{name}={}", folder.display()));
        }
        command.args(more).arg("--out").arg(self.path(out));
        command
    }

    fn music(&self) -> String {
        self.path("first").display().to_string()
    }

    fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    fn key(&self, out: &str) -> Value {
        serde_json::from_str(&self.text(&format!("{out}/key.json"))).unwrap()
    }
}

const SILENT: [&str; 2] = ["--questions", "naturalness,diversity"];

/// What the page's scripts read.
fn data_of(page: &str) -> Value {
    let begin = r#"id="study-data">"#;
    let start = page.find(begin).unwrap() + begin.len();
    let end = start + page[start..].find("</script>").unwrap();
    serde_json::from_str(&page[start..end]).unwrap()
}

fn ids(study: &Value) -> Vec<&str> {
    let clips = study["clips"].as_array().unwrap().iter();
    clips.map(|clip| clip["id"].as_str().unwrap()).collect()
}

#[test]
fn the_page_tells_neither_model_nor_dance_and_the_key_tells_both() {
    let dances = Dances::new("3", "150");
    dances.page("study", &SILENT).assert().success();
    let (page, key) = (dances.text("study/study.html"), dances.key("study"));
    let study = data_of(&page);
    for telling in [
        "Lovelace",
        "Hopper",
        "first/",
        "second/",
        "choreography",
        ".bvh",
    ] {
        assert!(!page.contains(telling), "{telling}");
    }
    let clips = key["clips"].as_object().unwrap();
    assert_eq!(clips.len(), 6);
    let whose = |id: &str| {
        let clip = &clips[id];
        let text = |name: &str| clip[name].as_str().unwrap().to_string();
        (text("model"), text("stimulus"))
    };
    let shown = ids(&study);
    let pairs: BTreeSet<_> = shown.iter().map(|id| whose(id)).collect();
    assert_eq!(pairs.len(), 6, "every dance of every model once");
    assert!(shown.is_sorted(), "no order of models");
    assert_eq!(study["study"], key["study"]);

    dances.page("again", &SILENT).assert().success();
    assert_eq!(dances.text("again/study.html"), page);
    let more = [&SILENT[..], &["--seed", "2"]].concat();
    dances.page("other", &more).assert().success();
    let other = data_of(&dances.text("other/study.html"));
    let [one, other] =
        [&study, &other].map(|study| ids(study).into_iter().collect::<BTreeSet<_>>());
    assert!(one.is_disjoint(&other), "another study has other names");
}

#[test]
fn clips_are_cut_alike_and_diversity_is_asked_of_two_disjoint_pieces() {
    let dances = Dances::new("1", "150");
    let more = ["--seconds", "2", "--skip", "0.5"];
    let more = [&more[..], &SILENT].concat();
    dances.page("study", &more).assert().success();
    let study = data_of(&dances.text("study/study.html"));
    for clip in study["clips"].as_array().unwrap() {
        assert_eq!(clip["whole"]["frames"], 60);
        assert_eq!(clip["pair"]["frames"], 60);
        let motions = clip["pair"]["motions"].as_array().unwrap();
        assert_eq!(motions.len(), 2);
        // The first piece is what the other question shows; the second is another one.
        let steps = |motion: &Value| motion["positions"]["steps"].as_str().unwrap().to_string();
        let whole = steps(&clip["whole"]["motions"][0]);
        assert_eq!(steps(&motions[0]), whole);
        assert_ne!(steps(&motions[1]), whole);
        assert_eq!(clip["whole"]["motions"][0]["kind"], "model");
    }
    // 135 frames are left of 150: two pieces of 67, whatever longer ones are asked for.
    let more = ["--skip", "0.5", "--questions", "diversity"];
    let output = dances.page("long", &more).assert().success();
    output.stderr(contains("clips of 4.5 s, as long as the shortest dance"));
    let study = data_of(&dances.text("long/study.html"));
    assert_eq!(study["clips"][0]["pair"]["frames"], 67);
    assert_eq!(study["clips"][0]["whole"], Value::Null);
}

#[test]
fn music_is_named_from_the_page_or_put_into_it_where_asked() {
    let dances = Dances::new("2", "120");
    let music = dances.music();
    dances
        .page("study", &["--music", &music])
        .assert()
        .success();
    let study = data_of(&dances.text("study/study.html"));
    let questions = study["questions"].as_array().unwrap().iter();
    let asked: Vec<_> = questions
        .map(|it| (it["name"].as_str().unwrap(), it["sound"].as_bool().unwrap()))
        .collect();
    let expected = [
        ("naturalness", false),
        ("appropriateness", true),
        ("diversity", false),
    ];
    assert_eq!(asked, expected);
    let songs = study["songs"].as_array().unwrap();
    assert_eq!(songs.len(), 2);
    for song in songs {
        let song = song.as_str().unwrap();
        assert!(song.starts_with("../first/"), "{song}");
        assert!(dances.path("study").join(song).is_file(), "{song}");
    }
    let clips = study["clips"].as_array().unwrap().iter();
    let songs: Vec<_> = clips.map(|clip| clip["song"].as_u64().unwrap()).collect();
    assert_eq!(songs.iter().filter(|song| **song == 0).count(), 2);

    let more = ["--music", &music, "--embed-music"];
    dances.page("embedded", &more).assert().success();
    let study = data_of(&dances.text("embedded/study.html"));
    let song = study["songs"][1].as_str().unwrap();
    assert!(
        song.starts_with("data:audio/wav;base64,"),
        "{}",
        &song[..30]
    );
}

#[test]
fn what_makes_no_study_is_said_and_nothing_is_written() {
    let dances = Dances::new("2", "60");
    let refused = |more: &[&str], message: &str| {
        let output = dances.page("study", more).assert().failure();
        output.stderr(contains(message));
        assert!(!dances.path("study").exists(), "{message}");
    };
    refused(&[], "appropriateness is about the music: name the folder");
    refused(&["--questions", "beauty"], "invalid value 'beauty'");
    refused(
        &["--questions", "diversity,naturalness,diversity"],
        "diversity is asked twice",
    );
    let silent = |more: &[&'static str]| [&SILENT[..], more].concat();
    refused(
        &silent(&["--seconds", "0.5"]),
        "clips of 0.5 s: expected at least 1 s",
    );
    refused(&silent(&["--seconds", "NaN"]), "clips of NaN s");
    refused(
        &silent(&["--skip", "1e300"]),
        "the shortest dance of this name has 0 frames",
    );
    refused(
        &silent(&["--skip", "0.1"]),
        "has 57 frames behind the first 0.1 s",
    );
    refused(
        &silent(&["--model", "Lovelace=."]),
        "two models are called \"Lovelace\"",
    );
    refused(&silent(&["--model", "Lovelace"]), "expected NAME=FOLDER");
    refused(
        &silent(&["--model", "Empty=nowhere"]),
        "the dances of Empty",
    );

    let dance = fs::read_dir(dances.path("second")).unwrap();
    let files: BTreeSet<PathBuf> = dance.map(|entry| entry.unwrap().path()).collect();
    let of = |ending: &str| {
        files
            .iter()
            .find(|file| file.extension().unwrap() == ending)
    };
    fs::remove_file(of("bvh").unwrap()).unwrap();
    let name = of("bvh").unwrap().file_name().unwrap().to_str().unwrap();
    refused(&SILENT, &format!("Hopper lacks {name}, which Lovelace has"));
    fs::copy(dances.path("first").join(name), of("bvh").unwrap()).unwrap();
    fs::write(of("wav").unwrap(), "no sound").unwrap();
    let music = dances.path("second").display().to_string();
    refused(&["--music", &music], "not wav, flac, mp3 or ogg");
    fs::remove_file(of("wav").unwrap()).unwrap();
    let music = dances.path("second").display().to_string();
    refused(&["--music", &music], &format!("holds no music of {name}"));

    dances.page("study", &SILENT).assert().success();
    let output = dances.page("study", &SILENT).assert().failure();
    output.stderr(contains("is there already; --force replaces it"));
    let more = [&SILENT[..], &["--force"]].concat();
    dances.page("study", &more).assert().success();
}

/// Runs the page with a script of a participant's behind its own; what the script leaves in an
/// element `left`.
fn driven(browser: &Path, page: &Path, script: &str) -> (Loaded, String) {
    let text = fs::read_to_string(page).unwrap();
    let script = format!(
        "<script type=\"module\">
        const begin = (name) => {{
          document.getElementById('participant').value = name;
          document.querySelector('form button').click();
        }};
        const press = (key) =>
          document.body.dispatchEvent(new KeyboardEvent('keydown', {{ key, bubbles: true }}));
        const saved = () => decodeURIComponent(document.getElementById('save').href.split(',')[1]);
        const leave = (text) => {{
          const left = document.createElement('pre');
          left.id = 'left';
          left.textContent = text;
          document.body.append(left);
        }};
        {script}
        </script></body>"
    );
    let driven = page.with_file_name("driven.html");
    fs::write(&driven, text.replace("</body>", &script)).unwrap();
    let begin = "<pre id=\"left\">";
    let has_left = |page: &Loaded| page.document.contains(begin);
    let loaded = browser::load(browser, &driven, "", has_left);
    let start = loaded.document.find(begin).expect(&loaded.log) + begin.len();
    let end = start + loaded.document[start..].find("</pre>").unwrap();
    let left = loaded.document[start..end].to_string();
    (loaded, left)
}

/// Participant, clip and question of each line, and its order.
fn lines(csv: &str) -> Vec<([String; 3], usize)> {
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let lines = reader.records().map(|line| {
        let line = line.unwrap();
        let cells = [0, 1, 2].map(|cell| line[cell].to_string());
        (cells, line[4].parse().unwrap())
    });
    lines.collect()
}

#[test]
fn a_participant_rates_by_keyboard_in_an_order_of_their_own_and_the_ratings_are_analysed() {
    let Some(browser) = browser::browser() else {
        return;
    };
    let dances = Dances::new("4", "90");
    dances.page("study", &SILENT).assert().success();
    let page = dances.path("study/study.html");
    let rate_all = |name: &str| {
        let script = format!(
            "begin({name:?});
             for (let clip = 0; clip < 16; clip++) press(String(1 + clip % 5));
             leave(saved());"
        );
        let (loaded, csv) = driven(&browser, &page, &script);
        assert!(loaded.console().is_empty(), "{:?}", loaded.console());
        assert_eq!(loaded.attribute("data-error"), None);
        assert_eq!(loaded.attribute("data-rated"), Some("16"));
        assert!(loaded.document.contains("Everything is rated"));
        csv
    };
    let csv = rate_all("seven, \"the\" 7th");
    let rated = lines(&csv);
    assert_eq!(rated.len(), 16);
    let mut orders = Vec::new();
    for (question, lines) in ["naturalness", "diversity"].iter().zip(rated.chunks(8)) {
        let order: Vec<_> = lines.iter().map(|(cells, _)| cells[1].as_str()).collect();
        let places: Vec<_> = lines.iter().map(|(_, place)| *place).collect();
        assert_eq!(places, [1, 2, 3, 4, 5, 6, 7, 8]);
        assert!(lines.iter().all(|(cells, _)| cells[2] == *question));
        assert_eq!(order.iter().collect::<BTreeSet<_>>().len(), 8, "each once");
        assert!(!order.is_sorted(), "shuffled");
        orders.push(order);
    }
    assert_ne!(orders[0], orders[1], "an order a question");
    assert_eq!(rated[0].0[0], "seven, \"the\" 7th");
    assert_eq!(
        lines(&rate_all("seven, \"the\" 7th")),
        rated,
        "the same again"
    );
    let other = rate_all("8");
    let other_order: Vec<_> = lines(&other)
        .into_iter()
        .map(|(cells, _)| cells[1].clone())
        .collect();
    assert_ne!(other_order[..8], orders[0], "an order a participant");

    let files = [("7.csv", csv), ("8.csv", other)].map(|(name, csv)| {
        let file = dances.path(name);
        fs::write(&file, csv).unwrap();
        file
    });
    let mut command = keydance("study");
    command.arg("analyse").args(files);
    command.arg("--key").arg(dances.path("study/key.json"));
    let output = command.assert().success();
    output.stdout(contains("32 ratings of 2 participants").and(contains("F(1, 14)")));
}

#[test]
fn a_page_plays_goes_back_keeps_what_was_rated_and_goes_on_after_a_reload() {
    let Some(browser) = browser::browser() else {
        return;
    };
    let dances = Dances::new("2", "90");
    dances.page("study", &SILENT).assert().success();
    let page = dances.path("study/study.html");
    let script = "
        const again = sessionStorage.getItem('again');
        begin('3');
        if (!again) {
          for (const key of ['1', '2', '7', 'ArrowLeft', '5', 'ArrowRight', '4']) press(key);
          sessionStorage.setItem('again', 'yes');
          location.reload();
        } else {
          // Behind the page's own drawing of the first frame.
          requestAnimationFrame(() => {
            const place = document.getElementById('place').textContent;
            leave([place, document.documentElement.dataset.playing, saved()].join('\\n'));
          });
        }";
    let (loaded, left) = driven(&browser, &page, script);
    assert!(loaded.console().is_empty(), "{:?}", loaded.console());
    // The second was rated anew, the third passed over; it is the first without a rating.
    let (place, rest) = left.split_once('\n').unwrap();
    let (playing, csv) = rest.split_once('\n').unwrap();
    assert!(place.starts_with("Question 1 of 2, clip 3 of 4"), "{place}");
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let rated: Vec<_> = reader
        .records()
        .map(|line| {
            let line = line.unwrap();
            (line[4].to_string(), line[3].to_string())
        })
        .collect();
    let expected = [("1", "1"), ("2", "5"), ("4", "4")];
    assert_eq!(
        rated,
        expected.map(|(order, rating)| (order.into(), rating.into()))
    );
    assert_eq!(playing, "true", "a clip plays when it is shown");
}

#[test]
fn what_is_about_the_music_cannot_be_rated_where_it_cannot_be_heard() {
    let Some(browser) = browser::browser() else {
        return;
    };
    let dances = Dances::new("2", "90");
    let music = dances.music();
    let more = [
        "--music",
        &music,
        "--questions",
        "naturalness,appropriateness",
    ];
    dances.page("study", &more).assert().success();
    for file in fs::read_dir(dances.path("first")).unwrap() {
        fs::remove_file(file.unwrap().path()).unwrap();
    }
    let script = "
        begin('3');
        for (const key of ['1', '2', '3', '4']) press(key);
        setTimeout(() => {
          press('5');
          leave(document.getElementById('summary').textContent);
        }, 1000);";
    let (loaded, left) = driven(&browser, &dances.path("study/study.html"), script);
    assert!(left.starts_with("The music cannot be played"), "{left}");
    assert_eq!(loaded.attribute("data-rated"), Some("4"));
}

/// A key of models with a clip each, named as the model and `-clip`.
fn key_of(models: &[&str]) -> Value {
    let list = models
        .iter()
        .map(|name| json!({"name": name, "folder": "dances"}));
    let clips = models.iter().map(|name| {
        let clip = json!({"model": name, "stimulus": "waltz.bvh"});
        (format!("{name}-clip"), clip)
    });
    json!({
        "study": "made-up", "seed": 1, "seconds": 15.0, "skip": 0.0,
        "questions": ["naturalness", "appropriateness"],
        "models": list.collect::<Vec<_>>(),
        "clips": clips.collect::<serde_json::Map<_, _>>(),
    })
}

/// `keydance study analyse` of ratings, with what it is to write.
fn analyse(folder: &TempDir, key: &Value, csv: &str, more: &[&str]) -> Command {
    let [ratings, place] = ["ratings.csv", "key.json"].map(|name| folder.path().join(name));
    fs::write(&place, key.to_string()).unwrap();
    fs::write(&ratings, csv).unwrap();
    let mut command = keydance("study");
    command.arg("analyse").arg(ratings).arg("--key").arg(place);
    command.args(more).current_dir(folder.path());
    command
}

/// Ratings of naturalness: each of a participant of its own.
fn naturalness(ratings: &[(&str, &[u8])]) -> String {
    let mut csv = String::from("rating,clip,question,participant\n");
    for (model, ratings) in ratings {
        for (participant, rating) in ratings.iter().enumerate() {
            csv += &format!("{rating},{model}-clip,naturalness,{participant}\n");
        }
    }
    csv
}

fn near(found: &Value, expected: f64) {
    let found = found.as_f64().unwrap();
    let apart = (found - expected).abs();
    assert!(apart <= 1e-9 * expected.abs(), "{found} {expected}");
}

#[test]
fn means_intervals_and_tests_are_those_of_scipy_and_statsmodels() {
    let folder = TempDir::new().unwrap();
    let csv = naturalness(&[
        ("a", &[5, 4, 5, 4, 3, 5, 4, 4]),
        ("b", &[3, 3, 2, 4, 3, 2, 3]),
        ("c", &[1, 2, 1, 2, 3, 1, 2, 2, 1]),
        ("d", &[3, 2, 3, 3, 4, 2]),
    ]);
    let key = key_of(&["a", "b", "c", "d", "unrated"]);
    let more = ["--json", "analysis.json", "--csv", "means.csv"];
    let output = analyse(&folder, &key, &csv, &more).assert().success();
    output.stdout(
        contains("study made-up: 30 ratings of 9 participants")
            .and(contains(
                "  a              8   4.25       0.71  3.66 to 4.84\n",
            ))
            .and(contains("  unrated        0      -          -  -\n"))
            .and(contains("F(3, 26) = 18.58, p < 0.001"))
            .and(contains("b less d: +0.02, t(26) = 0.06, p = 0.953"))
            .and(contains("no test: fewer than two models have ratings")),
    );
    let text = fs::read_to_string(folder.path().join("analysis.json")).unwrap();
    let analysis: Value = serde_json::from_str(&text).unwrap();
    let question = &analysis["questions"][0];
    // scipy 1.17.1: numpy's mean and std(ddof=1), t.interval, f_oneway.
    let models = [
        (4.25, 0.5_f64.sqrt(), 3.6588439371018042, 4.841156062898196),
        (
            2.857142857142857,
            0.6900655593423541,
            2.218938658524368,
            3.4953470557613464,
        ),
        (
            1.6666666666666667,
            0.5_f64.sqrt(),
            1.123136279517638,
            2.2101970538156954,
        ),
        (
            2.8333333333333335,
            0.752772652709081,
            2.0433468828413814,
            3.6233197838252855,
        ),
    ];
    for (model, (mean, deviation, low, high)) in models.into_iter().enumerate() {
        let model = &question["models"][model];
        near(&model["mean"], mean);
        near(&model["deviation"], deviation);
        near(&model["interval"][0], low);
        near(&model["interval"][1], high);
    }
    let tested = &question["comparison"]["tested"];
    near(&tested["variance"]["f"], 18.5785800240674);
    near(&tested["variance"]["p"], 1.1991413855013014e-06);
    assert_eq!(tested["variance"]["freedom"], json!([3, 26]));
    // The pooled t statistic with scipy's t.sf, statsmodels' multipletests(method="holm").
    let pairs = [
        (
            ["a", "b"],
            3.7784301364493804,
            0.0008309713553008465,
            0.004154856776504233,
        ),
        (
            ["a", "c"],
            7.46412101787931,
            6.328899831109271e-08,
            3.797339898665563e-07,
        ),
        (
            ["a", "d"],
            3.6828218658125267,
            0.001063086916263729,
            0.004252347665054916,
        ),
        (
            ["b", "c"],
            3.3165567591196288,
            0.0026945783175611115,
            0.008083734952683334,
        ),
        (
            ["b", "d"],
            0.06008417681261075,
            0.9525480551861042,
            0.9525480551861042,
        ),
        (
            ["c", "d"],
            -3.1078101220172116,
            0.004523058927646764,
            0.009046117855293528,
        ),
    ];
    assert_eq!(tested["pairs"].as_array().unwrap().len(), pairs.len());
    for (pair, (models, t, p, corrected)) in pairs.into_iter().enumerate() {
        let pair = &tested["pairs"][pair];
        assert_eq!(pair["models"], json!(models));
        near(&pair["t"], t);
        near(&pair["p"], p);
        near(&pair["corrected_p"], corrected);
    }
    let means = fs::read_to_string(folder.path().join("means.csv")).unwrap();
    let mut lines = means.lines();
    let header = "question,model,ratings,mean,deviation,low,high";
    assert_eq!(lines.next(), Some(header));
    assert!(
        lines
            .next()
            .unwrap()
            .starts_with("naturalness,a,8,4.25,0.707")
    );
    assert!(means.contains("naturalness,unrated,0,,,,\n"));
    let output = analyse(&folder, &key, &csv, &more).assert().failure();
    output.stderr(contains("--force replaces it"));
}

#[test]
fn too_few_ratings_and_equal_ones_are_stated() {
    type Files<'f> = &'f [(&'f str, &'f [u8])];
    let cases: [(Files<'_>, &str, &str); 5] = [
        (
            &[("a", &[4, 5, 3])],
            "fewer than two models have ratings",
            "1.52 to 6.48",
        ),
        (
            &[("a", &[4])],
            "fewer than two models have ratings",
            "   4.00          -  -",
        ),
        (
            &[("a", &[4]), ("b", &[2])],
            "no model has two ratings",
            "   2.00          -  -",
        ),
        (
            &[("a", &[4, 4]), ("b", &[4, 4])],
            "each model are all equal",
            "0.00  4.00 to 4.00",
        ),
        (
            &[("a", &[5, 5]), ("b", &[1, 1, 1])],
            "each model are all equal",
            "1.00 to 1.00",
        ),
    ];
    for (ratings, why, row) in cases {
        let folder = TempDir::new().unwrap();
        let key = key_of(&["a", "b"]);
        let mut command = analyse(&folder, &key, &naturalness(ratings), &["--json", "it.json"]);
        let output = command.assert().success();
        output.stdout(contains(why).and(contains(row)).and(contains("NaN").not()));
        let text = fs::read_to_string(folder.path().join("it.json")).unwrap();
        assert!(text.contains("untested"), "{text}");
    }
    // One model's ratings may be equal as long as another's are not; equal means do not differ.
    let folder = TempDir::new().unwrap();
    let csv = naturalness(&[("a", &[3, 3]), ("b", &[2, 4])]);
    let output = analyse(&folder, &key_of(&["a", "b"]), &csv, &[])
        .assert()
        .success();
    output.stdout(contains("F(1, 2) = 0.00, p = 1.000").and(contains("t(2) = 0.00, p = 1.000")));
}

#[test]
fn a_line_that_is_no_rating_of_the_study_is_named() {
    let good = "participant,clip,question,rating\n7,a-clip,naturalness,3\n";
    let cases = [
        ("", "line 1: there is no column \"participant\""),
        (
            "participant,clip,question\n7,a-clip,naturalness\n",
            "there is no column \"rating\"",
        ),
        ("participant;clip;question;rating\n", "parted by commas"),
        (
            "participant,clip,question,rating\n",
            "the files hold no ratings",
        ),
        (
            &format!("{good}7,b-clip,naturalness,7\n"),
            "line 3: the rating is \"7\"; expected a whole",
        ),
        (
            &format!("{good}\n7,b-clip,naturalness,2.5\n"),
            "line 4: the rating is \"2.5\"",
        ),
        (
            &format!("{good}7,b-clip,naturalness,\n"),
            "line 3: the rating is \"\"",
        ),
        (
            &format!("{good}7,z-clip,naturalness,2\n"),
            "clip \"z-clip\" is none of the study made-up",
        ),
        (
            &format!("{good}7,b-clip,diversity,2\n"),
            "\"diversity\"; the study asks naturalness, app",
        ),
        (
            &format!("{good},b-clip,naturalness,2\n"),
            "line 3: there is no participant",
        ),
        (
            &format!("{good}7,b-clip,naturalness\n"),
            "ratings.csv is no table",
        ),
        (
            &format!("{good} 7,a-clip,naturalness,4\n"),
            "has rated the naturalness of clip a-clip already",
        ),
    ];
    for (csv, message) in cases {
        let folder = TempDir::new().unwrap();
        let mut command = analyse(&folder, &key_of(&["a", "b"]), csv, &["--json", "it.json"]);
        let output = command.assert().failure().code(1);
        output.stderr(contains(message).and(contains("panicked").not()));
        assert!(!folder.path().join("it.json").exists());
    }
    // As spreadsheets save it.
    let folder = TempDir::new().unwrap();
    let csv = format!("\u{feff}{}", good.replace('\n', "\r\n"));
    let key = key_of(&["a", "b"]);
    analyse(&folder, &key, &csv, &[]).assert().success();

    let mut foreign = key.clone();
    foreign["clips"]["a-clip"]["model"] = "z".into();
    let output = analyse(&folder, &foreign, good, &[]).assert().failure();
    output.stderr(contains(
        "clip a-clip is of \"z\", which is none of its models",
    ));
    let output = analyse(&folder, &json!({"a": 1}), good, &[])
        .assert()
        .failure();
    output.stderr(contains("is not the key of a study"));
}
