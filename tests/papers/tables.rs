//! Tables 2 to 4: the paper's values, ours and the difference.

use keydance::evaluation::equations::Equations;
use keydance::evaluation::published::Published;
use keydance::evaluation::{
    PrintedTables, Protocol, ProtocolScores, ScoreRow, Scores, TableRow, Tables,
};
use keydance::models::pan2021::PAPER;

/// The transition lengths of the paper's tables, frames.
const LENGTHS: [usize; 4] = [10, 50, 100, 150];

fn printed() -> PrintedTables {
    PrintedTables::parse(PAPER.printed, "paper.toml").unwrap()
}

fn row(name: &str, lengths: &[usize], lrp: &[f64], share: f64, note: &str) -> TableRow {
    let row =
        |values: &[f64]| ScoreRow::new(lengths.iter().zip(values.iter().copied())).with_average();
    let shares = row(&vec![share; lengths.len()]);
    let rows = [("lrp", row(lrp)), ("avf", shares.clone()), ("art", shares)];
    let windows = lengths.iter().map(|&length| (length, 1000 / length));
    TableRow {
        name: name.into(),
        seed: None,
        scores: Some(ProtocolScores::new([(
            "published",
            Scores::new(rows, windows),
        )])),
        schedule_note: note.into(),
    }
}

fn markdown(rows: &[TableRow], subject: &str) -> String {
    in_tables(|tables| tables.markdown(rows, subject))
}

fn terminal(rows: &[TableRow]) -> String {
    in_tables(|tables| tables.terminal(rows))
}

fn in_tables(show: impl FnOnce(Tables<'_>) -> String) -> String {
    let protocols: [Box<dyn Protocol>; 2] = [
        Box::new(Equations::default()),
        Box::new(Published::default()),
    ];
    show(Tables {
        protocols: &protocols,
        printed: &printed(),
    })
}

/// The table's lines that follow the line of this model, as cells.
fn lines(table: &str, model: &str) -> Vec<Vec<String>> {
    let mut lines = table
        .lines()
        .filter(|line| line.starts_with('|'))
        .map(|line| {
            let cells = line.trim_matches('|').split('|');
            cells
                .map(|cell| cell.trim().to_string())
                .collect::<Vec<_>>()
        })
        .skip_while(|cells| cells[0] != model);
    let first = lines
        .next()
        .unwrap_or_else(|| panic!("no line of {model} in {table}"));
    [first]
        .into_iter()
        .chain(lines.take_while(|cells| cells[0].is_empty()))
        .collect()
}

fn tables(rows: &[TableRow]) -> [String; 3] {
    let text = markdown(rows, "3 clips");
    let parts: Vec<&str> = text.split("## Table ").skip(1).collect();
    assert_eq!(parts.len(), 3);
    [parts[0].into(), parts[1].into(), parts[2].into()]
}

#[test]
fn the_papers_averages_are_the_means_of_its_lengths() {
    for row in printed().rows {
        for values in row.values.values() {
            let mean = values[..4].iter().sum::<f64>() / 4.0;
            assert!(
                (mean - values[4]).abs() < 0.0101,
                "{}: {values:?}",
                row.name
            );
        }
    }
}

#[test]
fn a_model_of_the_paper_has_its_value_ours_and_the_difference() {
    let ours = row(
        "whole_model",
        &LENGTHS,
        &[30.07, 50.06, 60.0, 80.0],
        0.8,
        "0.002 of the schedule",
    );
    let [lrp, avf, art] = tables(&[ours]);
    let found = lines(&lrp, "Whole model");
    assert_eq!(
        found[0],
        [
            "Whole model",
            "paper",
            "27.07",
            "50.06",
            "63.01",
            "74.37",
            "53.63"
        ]
    );
    assert_eq!(
        found[1],
        ["", "ours", "30.07", "50.06", "60.00", "80.00", "55.03"]
    );
    assert_eq!(
        found[2],
        [
            "",
            "difference",
            "+3.00",
            "+0.00",
            "-3.01",
            "+5.63",
            "+1.40"
        ]
    );
    assert_eq!(
        lines(&avf, "Whole model")[2][2..],
        ["+0.08", "+0.04", "+0.05", "+0.08", "+0.06"]
    );
    assert_eq!(
        lines(&art, "Whole model")[0][2..],
        ["0.86", "0.85", "0.80", "0.72", "0.81"]
    );
    assert!(art.contains("- Whole model: 0.002 of the schedule"));
    for table in [&lrp, &avf, &art] {
        assert!(table.contains("Ours on 3 clips") && table.contains("By `published`"));
        assert_eq!(
            lines(table, "Condition-FC").len(),
            1,
            "ours where there are none"
        );
    }
}

#[test]
fn interpolation_has_no_paper_value_for_avf_and_art() {
    let [lrp, avf, _] = tables(&[row(
        "interpolation",
        &LENGTHS,
        &[1.0; 4],
        0.5,
        "not trained",
    )]);
    assert_eq!(lines(&lrp, "Interpolation").len(), 3);
    assert_eq!(
        lines(&avf, "Interpolation"),
        [[
            "Interpolation",
            "ours",
            "0.50",
            "0.50",
            "0.50",
            "0.50",
            "0.50"
        ]]
    );
    assert!(!avf.contains("Harvey"));
}

#[test]
fn an_average_over_other_lengths_is_not_compared() {
    let [lrp, ..] = tables(&[row("whole_model", &[10, 30], &[27.0, 40.0], 0.5, "demo")]);
    let found = lines(&lrp, "Whole model");
    assert_eq!(found[0][2..], ["27.07", "-", "53.63"]);
    assert_eq!(found[1][2..], ["27.00", "40.00", "33.50"]);
    assert_eq!(found[2][2..], ["-0.07", "-", "-"]);
}

#[test]
fn runs_of_one_model_and_models_of_our_own_are_all_there() {
    let rows = [
        row("whole_model", &LENGTHS, &[1.0; 4], 0.5, "short"),
        row("whole_model", &LENGTHS, &[2.0; 4], 0.5, "long"),
        row("preferred", &LENGTHS, &[3.0; 4], 0.5, "long"),
    ];
    let [lrp, ..] = tables(&rows);
    let kinds: Vec<String> = lines(&lrp, "Whole model")
        .into_iter()
        .map(|cells| cells[1].clone())
        .collect();
    assert_eq!(
        kinds,
        ["paper", "ours (1)", "difference", "ours (2)", "difference"]
    );
    assert_eq!(lines(&lrp, "preferred")[0][1..3], ["ours", "3.00"]);
}

#[test]
fn seeds_of_one_model_have_their_mean_spread_and_the_difference_of_the_mean() {
    let seeded = |seed, lrp: [f64; 4]| TableRow {
        seed: Some(seed),
        ..row("whole_model", &LENGTHS, &lrp, 0.5, "short")
    };
    let mut rows = vec![
        seeded(1, [30.0, 50.0, 60.0, 70.0]),
        seeded(2, [31.0, 50.0, 60.0, 70.0]),
        seeded(3, [35.0, 50.0, 60.0, 70.0]),
    ];
    let [lrp, _, end] = tables(&rows);
    let found = lines(&lrp, "Whole model");
    let expected = [
        ["paper", "27.07"],
        ["ours, seed 1", "30.00"],
        ["ours, seed 2", "31.00"],
        ["ours, seed 3", "35.00"],
        ["ours, mean ± sd", "32.00 ± 2.65"],
        ["ours, min to max", "30.00 to 35.00"],
        ["difference of the mean", "+4.93"],
    ];
    for (found, expected) in found.iter().zip(expected) {
        assert_eq!(found[1..3], expected);
    }
    assert_eq!(found[4][3], "50.00 ± 0.00");
    let note = "- Whole model (seed 1), Whole model (seed 2), Whole model (seed 3): short";
    assert!(end.contains(note), "{end}");
    // A seed that is still missing leaves its line, and the spread of the others.
    rows[1].scores = None;
    rows[1].schedule_note = "not trained yet".into();
    let [lrp, ..] = tables(&rows);
    let found = lines(&lrp, "Whole model");
    assert_eq!(found[2][1..3], ["ours, seed 2", "—"]);
    assert_eq!(found[4][2], "32.50 ± 3.54");
}

#[test]
fn a_model_that_is_not_trained_yet_keeps_its_row() {
    let absent = TableRow {
        scores: None,
        ..row("condition_fc", &LENGTHS, &[0.0; 4], 0.5, "not trained yet")
    };
    let [lrp, avf, end] = tables(&[absent]);
    for table in [&lrp, &avf] {
        let found = lines(table, "Condition-FC");
        assert_eq!(found[1][1..3], ["ours", "—"]);
        assert_eq!(found[2][1..3], ["difference", "—"]);
    }
    assert!(end.contains("- Condition-FC: not trained yet"), "{end}");
}

#[test]
fn the_terminal_shows_all_three_scores_and_the_windows() {
    let rows = [row(
        "interpolation",
        &LENGTHS,
        &[22.85, 95.81, 116.83, 123.99],
        0.25,
        "",
    )];
    let text = terminal(&rows);
    let cells = |start: &str| -> Vec<String> {
        let line = text.lines().find(|line| line.starts_with(start)).unwrap();
        line[start.len()..]
            .split_whitespace()
            .map(str::to_string)
            .collect()
    };
    assert_eq!(
        cells("interpolation"),
        ["22.85", "95.81", "116.83", "123.99", "89.87"]
    );
    assert_eq!(
        cells("  paper"),
        ["13.83", "87.59", "113.59", "124.47", "84.87"]
    );
    assert_eq!(cells("windows, interpolation"), ["100", "20", "10", "6"]);
    for score in [
        "LRP (cm)",
        "AVF (share of velocity factors)",
        "ART (share of frames)",
    ] {
        assert_eq!(cells(score), ["10", "50", "100", "150", "AVG"]);
    }
}

#[test]
fn scores_by_another_protocol_stand_in_tables_of_their_own_without_the_papers_numbers() {
    let of = |name: &str, protocol: &'static str, lrp: [f64; 4]| {
        let whole = row(name, &LENGTHS, &lrp, 0.5, "short");
        let scores = whole.scores.as_ref().unwrap().by("published").unwrap();
        let scores = ProtocolScores::new([(protocol, scores.clone())]);
        TableRow {
            scores: Some(scores),
            ..whole
        }
    };
    let rows = [
        of("whole_model", "published", [30.0, 50.0, 60.0, 70.0]),
        of("one_lstm", "equations", [40.0; 4]),
    ];
    let text = markdown(&rows, "3 clips");
    let (compared, own) = text.split_once("## LRP by `equations`").unwrap();
    assert_eq!(lines(compared, "Whole model").len(), 3);
    assert_eq!(lines(compared, "One LSTM").len(), 1, "the paper's alone");
    assert_eq!(
        lines(own, "One LSTM"),
        [[
            "One LSTM", "ours", "40.00", "40.00", "40.00", "40.00", "40.00"
        ]]
    );
    assert!(!own.contains("Whole model |") && !own.contains("the paper's."));
}
