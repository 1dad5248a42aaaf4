//! `keydance figures` and `keydance generate --viewer` through the binary, on generated clips.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use roxmltree::Document;
use tempfile::TempDir;

use crate::generated_data::write_clips;
use crate::trained_run::{TrainedRun, keydance};

const FIGURES: [&str; 9] = [
    "figure_4b",
    "figure_5",
    "figure_6",
    "figure_7",
    "figure_8",
    "figure_9",
    "figure_10",
    "figure_11",
    "figure_12",
];
const ZERO_VELOCITY: &str =
    "name = 'zero_velocity'\n[data]\nsplit = { share = 0.8 }\n[model]\nkind = 'zero_velocity'\n";

/// `keydance figures` of a run or config of the fixture.
fn figures(fixture: &TrainedRun, run: &str, out: &str) -> Command {
    let mut command = keydance("figures");
    command
        .arg(fixture.path(run))
        .arg("--data")
        .arg(fixture.path("data"));
    command
        .arg("--out")
        .arg(fixture.path(out))
        .args(["--length", "60"]);
    command
}

/// With the figures of interpolation and of the run.
static FIXTURE: LazyLock<TrainedRun> = LazyLock::new(|| {
    let fixture = TrainedRun::new();
    figures(&fixture, "interpolation.toml", "plain")
        .assert()
        .success();
    figures(&fixture, "run", "trained")
        .arg("--compare")
        .arg(fixture.path("interpolation.toml"))
        .arg("--viewer")
        .arg(fixture.path("viewer.html"))
        .assert()
        .success();
    fixture
});

fn read(folder: &str, file: &str) -> String {
    fs::read_to_string(FIXTURE.path(folder).join(file)).unwrap()
}

/// Lines of a CSV file as fields.
fn table(folder: &str, figure: &str) -> Vec<Vec<String>> {
    let text = read(folder, &format!("{figure}.csv"));
    csv::ReaderBuilder::new()
        .has_headers(false)
        .from_reader(text.as_bytes())
        .deserialize()
        .collect::<Result<_, _>>()
        .unwrap()
}

/// Values of a measure: row, part, value.
fn values(folder: &str, figure: &str, measure: &str) -> Vec<(String, String, f64)> {
    table(folder, figure)
        .into_iter()
        .filter(|line| line[1] == measure)
        .map(|line| (line[0].clone(), line[2].clone(), line[4].parse().unwrap()))
        .collect()
}

/// The caption in a figure, its lines joined.
fn caption(folder: &str, figure: &str) -> String {
    let svg = read(folder, &format!("{figure}.svg"));
    let document = Document::parse(&svg).unwrap();
    let caption = document
        .descendants()
        .find(|node| node.attribute("class") == Some("caption"))
        .unwrap();
    let lines = caption
        .descendants()
        .filter(|node| node.has_tag_name("text"));
    let lines: Vec<&str> = lines.filter_map(|node| node.text()).collect();
    lines.join(" ")
}

#[test]
fn every_figure_is_well_formed_and_has_its_caption_and_its_numbers_beside_it() {
    let index = read("trained", "index.md");
    for figure in FIGURES {
        let caption = caption("trained", figure);
        let number = figure.trim_start_matches("figure_").replace("4b", "4 (b)");
        assert!(
            caption.starts_with(&format!("Figure {number}. ")),
            "{caption}"
        );
        assert!(
            index.contains(&format!("({figure}.svg)"))
                && index.contains(&format!("({figure}.csv)"))
        );
        let table = table("trained", figure);
        assert_eq!(
            table[0],
            ["row", "measure", "part", "frame", "value", "unit"]
        );
        assert!(table.len() > 2, "{figure}");
        for line in &table[1..] {
            assert!(
                line[4].parse::<f64>().unwrap().is_finite(),
                "{figure}: {line:?}"
            );
            // Only what was generated stands here frame by frame.
            let series = line[3].is_empty() || line[1] == "velocity_factor" && line[0] == "small";
            assert!(series, "{figure}: {line:?}");
        }
    }
}

#[test]
fn interpolation_goes_all_the_way_on_any_trajectory_and_ignores_velocity_factors() {
    for figure in ["figure_6", "figure_7"] {
        let shares = values("plain", figure, "root_change_share");
        assert!(shares.len() >= 2);
        assert!(
            shares.iter().all(|(_, _, share)| *share == 1.0),
            "{shares:?}"
        );
        assert!(caption("plain", figure).contains("interpolation follows"));
    }
    let shares = values("plain", "figure_8", "velocity_factor_change_share");
    assert_eq!(shares.len(), 10, "two constants, five parts");
    assert!(
        shares.iter().all(|(_, _, share)| share.abs() < 1e-9),
        "{shares:?}"
    );
    for figure in ["figure_8", "figure_9"] {
        let caption = caption("plain", figure);
        assert!(
            caption.contains("interpolation does not follow"),
            "{caption}"
        );
    }
    let distance = values("plain", "figure_5", "root_distance_max");
    assert!(distance.iter().all(|(_, _, cm)| *cm == 0.0), "{distance:?}");
    let miss = values("plain", "figure_12", "keyframe_miss");
    assert!(miss.iter().all(|(_, _, cm)| *cm < 1e-3), "{miss:?}");
}

#[test]
fn asked_for_changes_are_what_the_figures_say() {
    let asked = values("trained", "figure_8", "velocity_factor_mean_asked");
    let of = |row: &str| -> Vec<f64> {
        let of_row = asked.iter().filter(|(name, ..)| name == row);
        of_row.map(|(.., value)| *value).collect()
    };
    for ((plain, half), more) in of("x 1.0").iter().zip(of("x 0.5")).zip(of("x 1.5")) {
        assert!((half - 0.5 * plain).abs() < 2e-4 && (more - 1.5 * plain).abs() < 2e-4);
    }
    let faster = values("trained", "figure_9", "velocity_factor_change_share");
    let parts: Vec<&str> = faster.iter().map(|(_, part, _)| part.as_str()).collect();
    assert_eq!(parts, ["left_leg", "right_arm"]);
    let lengths = values("trained", "figure_10", "velocity_factor_share_of_asked");
    let rows: Vec<&str> = lengths.iter().map(|(row, ..)| row.as_str()).collect();
    assert_eq!(rows, ["N = 100", "N = 150", "N = 200", "N = 250"]);
    for half in ["", "_second_half"] {
        let [shares, asked, given] = [
            "velocity_factor_share_of_asked",
            "velocity_factor_mean_asked",
            "velocity_factor_mean",
        ]
        .map(|measure| values("trained", "figure_10", &format!("{measure}{half}")));
        for (row, _, share) in &shares {
            let sum = |of: &[(String, String, f64)]| -> f64 {
                let of_row = of.iter().filter(|(name, ..)| name == row);
                of_row.map(|(.., value)| value).sum()
            };
            // Both over the same frames; the file has four decimals.
            let expected = sum(&given) / sum(&asked);
            assert!((share - expected).abs() < 1e-3, "{row}{half}: {share}");
        }
    }
    let pairs = values("trained", "figure_7", "body_distance");
    assert_eq!(pairs.len(), 6, "all pairs of four trajectories");
}

#[test]
fn compared_models_have_rows_of_their_own_and_interpolation_given_stands_there_once() {
    let rows = |figure: &str, measure: &str| -> Vec<String> {
        let values = values("trained", figure, measure).into_iter();
        values.map(|(row, ..)| row).collect()
    };
    assert_eq!(rows("figure_12", "LRP"), ["interpolation", "small"]);
    // Its root is the target.
    assert_eq!(rows("figure_11", "root_distance_mean"), ["small"]);
    let page = fs::read_to_string(FIXTURE.path("viewer.html")).unwrap();
    for name in ["Ground truth", "interpolation", "small"] {
        assert!(page.contains(&format!(r#""name":"{name}""#)), "{name}");
    }
}

#[test]
fn a_window_that_is_not_there_is_named_with_those_that_are() {
    let fails = |arguments: &[&str], words: &[&str]| {
        let mut command = figures(&FIXTURE, "run", "never");
        let assert = command.args(arguments).assert().failure();
        let text = String::from_utf8(assert.get_output().stderr.clone()).unwrap();
        for word in words {
            assert!(text.contains(word), "{word}: {text}");
        }
        assert!(!FIXTURE.path("never").exists());
    };
    fails(
        &["--clip", "nobody.bvh"],
        &["--clip nobody.bvh", "choreography_"],
    );
    fails(
        &["--start", "150"],
        &["--start 150", "frame 119 at the latest"],
    );
    let mut long = keydance("figures");
    long.arg(FIXTURE.path("run"))
        .arg("--data")
        .arg(FIXTURE.path("data"));
    long.arg("--out")
        .arg(FIXTURE.path("never"))
        .args(["--length", "300"]);
    long.assert()
        .failure()
        .stderr(contains("301 frames of --length 300").and(contains("the longest has 180")));
}

#[test]
fn figures_of_several_clips_lie_in_a_folder_each() {
    let unknown = figures(&FIXTURE, "run", "never")
        .args(["--clip", "nobody.bvh"])
        .output();
    let unknown = String::from_utf8(unknown.unwrap().stderr).unwrap();
    let (_, listed) = unknown.trim().rsplit_once(": ").unwrap();
    let clips: Vec<&str> = listed.split(", ").take(2).collect();
    assert_eq!(clips.len(), 2, "{unknown}");
    let mut command = figures(&FIXTURE, "run", "by_clip");
    command
        .args(["--clip", &clips.join(", ")])
        .assert()
        .success();
    let index = fs::read_to_string(FIXTURE.path("by_clip/index.md")).unwrap();
    for clip in clips {
        let name = clip.strip_suffix(".bvh").unwrap();
        assert!(
            index.contains(&format!("[{name}](<{name}/index.md>)")),
            "{index}"
        );
        let folder = FIXTURE.path("by_clip").join(name);
        let page = fs::read_to_string(folder.join("index.md")).unwrap();
        assert!(page.contains(&format!("generates for {clip}")), "{page}");
        assert!(folder.join("figure_8.svg").is_file());
    }
    let mut command = figures(&FIXTURE, "run", "never");
    let output = command
        .args(["--clip", "a.bvh,b.bvh", "--start", "3"])
        .assert()
        .failure();
    output.stderr(contains("--viewer and --start are for one clip"));
}

#[test]
fn other_data_is_refused_unless_it_is_asked_for() {
    let data = TempDir::new().unwrap();
    write_clips(data.path(), 150, 9);
    let figures = |more: &[&str]| {
        let mut command = keydance("figures");
        command
            .arg(FIXTURE.path("run"))
            .arg("--data")
            .arg(data.path());
        command
            .arg("--out")
            .arg(data.path().join("out"))
            .args(["--length", "40"])
            .args(more);
        command
    };
    figures(&[])
        .assert()
        .failure()
        .stderr(contains("--other-data"));
    figures(&["--other-data"]).assert().success();
}

#[test]
fn the_caption_of_figure_5_says_how_many_clips_it_shows() {
    let caption = caption("plain", "figure_5");
    assert!(caption.contains("for two test clips"), "{caption}");
    // Of five clips four train.
    let data = TempDir::new().unwrap();
    write_clips(data.path(), 80, 3);
    fs::remove_file(first_clip(data.path())).unwrap();
    keydance("figures")
        .arg(FIXTURE.path("interpolation.toml"))
        .arg("--data")
        .arg(data.path())
        .arg("--out")
        .arg(data.path().join("out"))
        .args(["--length", "60"])
        .assert()
        .success()
        .stdout(contains("Motion generated for a test clip"));
}

#[test]
fn figure_13_sets_a_model_that_does_not_control_its_root_onto_the_recorded_one() {
    let cyclic = |name: &str, model: &str| {
        let shared = "paper = 'pan2021_cyclic'\n[data]\nsplit = { share = 0.8 }\n[model]\n";
        let path = FIXTURE.path(name).with_extension("toml");
        fs::write(&path, format!("name = '{name}'\n{shared}{model}")).unwrap();
        path
    };
    let interpolation = cyclic("slerped", "kind = 'interpolation'\n");
    let recurrent = cyclic(
        "recurrent",
        "kind = 'harvey2020'\nhidden = 8\ncode = 8\nrecurrent = 8\n\
         [schedule]\nmax_len = 6\nfraction = 0.01\nbatch_size = 8\nshards = 1\n",
    );
    keydance("train")
        .arg(recurrent)
        .arg("--data")
        .arg(FIXTURE.path("data"))
        .arg("--out")
        .arg(FIXTURE.path("recurrent"))
        .assert()
        .success();
    let drawn = |more: &[&str]| {
        let mut command = keydance("figures");
        command
            .arg(&interpolation)
            .arg("--data")
            .arg(FIXTURE.path("data"));
        command
            .arg("--compare")
            .arg(FIXTURE.path("recurrent"))
            .arg("--out")
            .arg(FIXTURE.path("cyclic"))
            .args(more);
        command.assert()
    };
    drawn(&["--length", "60"]).success();
    let caption = caption("cyclic", "figure_13");
    let replaced = "Place and facing of the root are the recorded ones for recurrent, which is";
    assert!(caption.starts_with("Figure 13. ") && caption.contains(replaced));
    let skates = values("cyclic", "figure_13", "foot_skate");
    let rows: Vec<&str> = skates.iter().map(|(row, ..)| row.as_str()).collect();
    assert_eq!(rows, ["recurrent", "slerped"]);
    let of = |folder: &str, figure: &str, row: &str| {
        let all = values(folder, figure, "LRP");
        all.into_iter().find(|(of, ..)| of == row).unwrap().2
    };
    let here = of("cyclic", "figure_13", "slerped");
    assert_eq!(here, of("trained", "figure_12", "interpolation"));
    drawn(&["--force", "--viewer", "page.html"])
        .failure()
        .stderr(contains("figure 13 has no page for --viewer"));
}

#[test]
fn generate_shows_its_motion_in_the_viewer_beside_the_recorded_one() {
    let clip = first_clip(&FIXTURE.path("data"));
    let generate = |more: &[&str]| {
        let page = FIXTURE.path("generated.html");
        let mut command = keydance("generate");
        command.arg(FIXTURE.path("run")).arg("--motion").arg(&clip);
        command
            .args(["--keyframes", "20,60,110", "--force", "--out"])
            .arg(FIXTURE.path("out.bvh"));
        command
            .arg("--viewer")
            .arg(&page)
            .args(more)
            .assert()
            .success();
        fs::read_to_string(page).unwrap()
    };
    let names = |page: &str| {
        let named = |name: &&str| page.contains(&format!(r#""name":"{name}""#));
        ["Ground truth", "Interpolation", "small"]
            .iter()
            .filter(|name| named(name))
            .count()
    };
    let page = generate(&[]);
    assert_eq!(names(&page), 3);
    assert!(page.contains(r#""frames":91,"#) && page.contains("3 keyframes"));
    // Where a keyframe is not its own, the recorded motion does not run along.
    let foreign = format!("{}:5@30", clip.display());
    assert_eq!(names(&generate(&["--keyframe", &foreign])), 2);
    // At other distances neither.
    let page = generate(&["--length", "50"]);
    assert_eq!(names(&page), 2);
    assert!(page.contains(r#""frames":101,"#));
}

#[test]
fn interpolation_stands_beside_the_other_models_without_training_too() {
    fs::write(FIXTURE.path("zero_velocity.toml"), ZERO_VELOCITY).unwrap();
    figures(&FIXTURE, "zero_velocity.toml", "still")
        .assert()
        .success();
    let rows = values("still", "figure_12", "LRP");
    let rows: Vec<&str> = rows.iter().map(|(row, ..)| row.as_str()).collect();
    assert_eq!(rows, ["Interpolation", "zero_velocity"]);
    let page = FIXTURE.path("still.html");
    keydance("generate")
        .arg(FIXTURE.path("zero_velocity.toml"))
        .arg("--motion")
        .arg(first_clip(&FIXTURE.path("data")))
        .args(["--keyframes", "20,60", "--out"])
        .arg(FIXTURE.path("still.bvh"))
        .arg("--viewer")
        .arg(&page)
        .assert()
        .success();
    let page = fs::read_to_string(page).unwrap();
    assert!(page.contains(r#""name":"Interpolation""#));
}

fn first_clip(folder: &Path) -> PathBuf {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().path()).min().unwrap()
}
