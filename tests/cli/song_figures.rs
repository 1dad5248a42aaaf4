//! `keydance figures` of a model that dances to music: of its loss, over rows of a table, and of one
//! dance.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use assert_cmd::Command;
use predicates::str::contains;
use roxmltree::{Document, Node};
use tempfile::TempDir;

use crate::song::FIXTURE;

/// Rows of a table, with their consistency errors.
const ROWS: [(&str, f64); 5] = [
    ("lambda0_sigma005", 4.0),
    ("lambda0_sigma01", 8.0),
    ("lambda0_sigma02", 6.0),
    ("lambda3_sigma01", 3.0),
    ("small", 2.0),
];

/// An evaluated run, rows of a table, and the figures of both.
struct Figures {
    folder: TempDir,
}

static FIGURES: LazyLock<Figures> = LazyLock::new(|| {
    let figures = Figures {
        folder: TempDir::new().unwrap(),
    };
    copy(&FIXTURE.path("run"), &figures.path("run"));
    let mut command = FIXTURE.command("evaluate");
    command.arg(figures.path("run")).arg("--data");
    command.arg(FIXTURE.path("data")).assert().success();
    for (name, error) in ROWS {
        figures.write_row(name, error);
    }
    let mut command = figures.draw(&figures.path("run"), "drawn");
    command.arg("--rows").arg(figures.path("rows"));
    command.assert().success();
    figures
});

impl Figures {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A folder as `keydance reproduce` writes it: the run's scores with another consistency error.
    fn write_row(&self, name: &str, error: f64) {
        let row = self.path("rows").join(name);
        fs::create_dir_all(&row).unwrap();
        let read = |file: &str| fs::read_to_string(self.path("run").join(file)).unwrap();
        let config = read("config.toml").replace("name = \"pu\"", &format!("name = {name:?}"));
        assert!(config.contains(name));
        fs::write(row.join("config.toml"), config).unwrap();
        fs::write(
            row.join("evaluation_data.json"),
            read("evaluation_data.json"),
        )
        .unwrap();
        let mut scores: serde_json::Value = serde_json::from_str(&read("evaluation.json")).unwrap();
        scores["music_dance"]["consistency"]["all"] = error.into();
        fs::write(row.join("evaluation.json"), scores.to_string()).unwrap();
    }

    fn draw(&self, run: &Path, out: &str) -> Command {
        let mut command = FIXTURE.command("figures");
        command.arg(run).arg("--data").arg(FIXTURE.path("data"));
        command.arg("--out").arg(self.path(out));
        command
    }

    fn svg(&self, figure: &str) -> String {
        fs::read_to_string(self.path("drawn").join(format!("{figure}.svg"))).unwrap()
    }

    /// Lines of a figure's CSV: row, measure, frame, value.
    fn numbers(&self, figure: &str) -> Vec<(String, String, String, f64)> {
        let path = self.path("drawn").join(format!("{figure}.csv"));
        let lines = csv::Reader::from_path(path).unwrap().into_records();
        let lines = lines.map(|line| line.unwrap());
        let text = |line: &csv::StringRecord, at: usize| line[at].to_string();
        lines
            .map(|it| {
                (
                    text(&it, 0),
                    text(&it, 1),
                    text(&it, 3),
                    it[4].parse().unwrap(),
                )
            })
            .collect()
    }

    fn number(&self, figure: &str, row: &str, measure: &str) -> f64 {
        let numbers = self.numbers(figure).into_iter();
        let mut of = numbers.filter(|(own, what, ..)| own == row && what == measure);
        let (.., value) = of
            .next()
            .unwrap_or_else(|| panic!("{figure}: {row}, {measure}"));
        value
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        match path.is_dir() {
            true => copy(&path, &target),
            false => drop(fs::copy(&path, target).unwrap()),
        }
    }
}

fn groups<'a>(document: &'a Document, class: &str) -> Vec<Node<'a, 'a>> {
    let named = |node: &Node| node.attribute("class") == Some(class);
    document.descendants().filter(named).collect()
}

fn caption(document: &Document) -> String {
    let caption = groups(document, "caption")[0];
    let lines = caption.descendants().filter(|it| it.has_tag_name("text"));
    let lines: Vec<&str> = lines.filter_map(|line| line.text()).collect();
    lines.join(" ").replace('\u{a0}', " ")
}

#[test]
fn every_figure_is_well_formed_and_has_its_caption_and_its_numbers_beside_it() {
    let index = fs::read_to_string(FIGURES.path("drawn").join("index.md")).unwrap();
    for number in 4..=9 {
        let figure = format!("figure_{number}");
        let svg = FIGURES.svg(&figure);
        let document = Document::parse(&svg).unwrap();
        let caption = caption(&document);
        assert!(
            caption.starts_with(&format!("Figure {number}. ")),
            "{caption}"
        );
        assert!(index.contains(&format!("({figure}.svg)")));
        let numbers = FIGURES.numbers(&figure);
        assert!(numbers.len() > 2, "{figure}");
        for (row, measure, frame, value) in numbers {
            assert!(value.is_finite());
            // Only what was generated stands here frame by frame.
            let series = frame.is_empty() || row == "generated" && measure == "speed";
            assert!(series, "{figure}: {row}, {measure}");
        }
    }
    assert!(!index.contains("left out"), "{index}");
}

#[test]
fn a_key_frame_weighs_one_and_lambda() {
    for (row, lambda) in [("lambda 1, sigma 0.05", 1.0), ("lambda 5, sigma 0.2", 5.0)] {
        let most = FIGURES.number("figure_4", row, "weight_most");
        assert_eq!(most, 1.0 + lambda);
        let mean = FIGURES.number("figure_4", row, "weight_mean");
        assert!(1.0 < mean && mean < most, "{row}: {mean}");
    }
}

#[test]
fn lines_over_lambda_begin_at_the_mean_of_the_seeds_and_rows_that_there_are_not_are_named() {
    let spread = ["mean", "least", "most"].map(|of| {
        let measure = format!("consistency_{of}");
        FIGURES.number("figure_5", "small, lambda 0", &measure)
    });
    assert_eq!(spread, [6.0, 4.0, 8.0]);
    let svg = FIGURES.svg("figure_5");
    let document = Document::parse(&svg).unwrap();
    let texts = document.descendants().filter(|it| it.has_tag_name("text"));
    let texts = texts.filter_map(|text| text.text());
    let texts: Vec<String> = texts.map(|text| text.replace('\u{a0}', " ")).collect();
    for name in [
        "small, λ = 0, 3 seeds",
        "small, σ = 0.05",
        "light, σ = 0.05, paper",
        "small, σ = 0.1",
    ] {
        assert!(texts.iter().any(|text| text == name), "{name}: {texts:?}");
    }
    assert!(texts.iter().all(|text| text != "small, σ = 0.2"));
    let caption = caption(&document);
    for words in [
        "small, σ = 0.1: 6.0000 to 3.0000 at λ = 3",
        "all of the larger size",
        "all of the small size but",
        "on other data (AIST++)",
    ] {
        assert!(caption.contains(words), "{words}: {caption}");
    }
}

#[test]
fn dancers_at_key_poses_are_framed_and_both_seeds_lead_to_dances_of_their_own() {
    let svg = FIGURES.svg("figure_8");
    let document = Document::parse(&svg).unwrap();
    let rows = groups(&document, "row");
    assert_eq!(rows.len(), 3);
    for (row, [recorded, generated]) in rows.iter().zip([[16, 0], [4, 12], [4, 12]]) {
        let of = |class: &str| {
            let of = |node: &Node| node.attribute("class") == Some(class);
            row.descendants().filter(of).count()
        };
        assert_eq!([of("recorded"), of("generated")], [recorded, generated]);
        assert_eq!((of("framed"), of("keyframe")), (4, 0));
    }
    assert_eq!(groups(&document, "music").len(), 1);
    let apart = FIGURES.number("figure_8", "both seeds", "joint_distance");
    assert!(apart > 0.0);
}

#[test]
fn dots_on_the_speeds_are_the_beats_that_are_counted() {
    let svg = FIGURES.svg("figure_9");
    let document = Document::parse(&svg).unwrap();
    let curves = groups(&document, "curve");
    assert_eq!(curves.len(), 3);
    for (curve, row) in curves.iter().zip(["recorded", "generated"]) {
        let dots = curve.descendants().filter(|it| it.has_tag_name("ellipse"));
        let [beats, hits] = ["motion_beats", "motion_beats_hit"]
            .map(|measure| FIGURES.number("figure_9", row, measure));
        // Those of the seed are drawn and not counted.
        assert!(hits <= beats && beats <= dots.count() as f64);
    }
    let music = FIGURES.number("figure_9", "music", "beats");
    assert!(music > 0.0 && groups(&document, "music_beat").len() as f64 >= music);
    let frames = FIGURES.numbers("figure_9").into_iter();
    let frames = frames.filter_map(|(_, _, frame, _)| frame.parse::<usize>().ok());
    assert_eq!(frames.collect::<Vec<_>>(), (60..239).collect::<Vec<_>>());
}

#[test]
fn without_rows_and_scores_three_figures_are_left_out_and_it_is_said() {
    let mut command = FIGURES.draw(&FIXTURE.path("run"), "without");
    let output = command.assert().success();
    output.stdout(contains(
        "Figure 7 is left out: pu has no scores on this data",
    ));
    let index = fs::read_to_string(FIGURES.path("without").join("index.md")).unwrap();
    for number in 4..=9 {
        let drawn = index.contains(&format!("(figure_{number}.svg)"));
        let said = index.contains(&format!("Figure {number} is left out"));
        assert_eq!(
            (drawn, said),
            (![5, 6, 7].contains(&number), !drawn),
            "{number}"
        );
    }
}

#[test]
fn what_these_figures_cannot_show_is_refused() {
    let data = FIXTURE.path("data").display().to_string();
    let run = FIGURES.path("run").display().to_string();
    let page = FIGURES.path("never.html").display().to_string();
    for (more, words) in [
        (vec!["--length", "100"], "give 105 or more"),
        (vec!["--length", "300"], "no test clip has the 300 frames"),
        (vec!["--start", "1"], "start at frame 0 at the latest"),
        (vec!["--clip", "nobody.bvh"], "--clip nobody.bvh"),
        (vec!["--compare", run.as_str()], "--rows DIR"),
        (vec!["--viewer", page.as_str()], "generate --music"),
        (vec!["--rows", data.as_str()], "no folder of a row"),
    ] {
        let mut command = FIGURES.draw(&FIGURES.path("run"), "never");
        let assert = command.args(more).assert().failure();
        assert.stderr(contains(words));
        assert!(!FIGURES.path("never").exists());
    }
}

#[test]
fn figures_of_other_papers_are_not_over_rows() {
    let config = FIGURES.path("interpolation.toml");
    let text = "name = 'interpolation'\n[data]\nsplit = { share = 0.8 }\n\
        [model]\nkind = 'interpolation'\n";
    fs::write(&config, text).unwrap();
    let mut command = FIGURES.draw(&config, "other_paper");
    command.arg("--rows").arg(FIGURES.path("rows"));
    let refused = command.args(["--other-data", "--length", "60"]).assert();
    refused
        .failure()
        .stderr(contains("--rows is for figures over rows"));
}
