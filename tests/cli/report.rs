//! Figures: well-formed SVG that shows what it was given.

use glam::DVec3;
use keydance::evaluation::Protocol as _;
use keydance::evaluation::equations::Equations;
use keydance::motion::{DANCE_PARENTS, JOINTS};
use keydance::report::{
    FigureError, MotionFigure, MotionRow, PathView, Placing, RootPaths, ScoreSeries, Series, Shown,
    loss_curve, score_curve, thousands,
};
use roxmltree::{Document, Node};

/// A figure of sticks: each joint a step up and to the side of its parent, the root walking along
/// X.
fn dancers(frames: usize, lean: f64) -> Vec<[DVec3; JOINTS]> {
    (0..frames)
        .map(|time| {
            let mut joints = [DVec3::new(5.0 * time as f64, 90.0, 0.0); JOINTS];
            for (joint, parent) in DANCE_PARENTS.iter().enumerate() {
                if let Some(parent) = parent {
                    let up = if joint < 9 { -20.0 } else { 10.0 };
                    joints[joint] = joints[*parent] + DVec3::new(lean, up, 2.0 * joint as f64);
                }
            }
            joints
        })
        .collect()
}

fn figure() -> MotionFigure {
    let row = |label: &str, lean, generated| {
        MotionRow::between_keyframes(label, dancers(21, lean), generated)
    };
    MotionFigure {
        title: "N = 20 <of> \"a & b\"".into(),
        rows: vec![
            row("Ground truth", 0.0, false),
            row("Interpolation", 3.0, true),
            row("Whole model", -3.0, true),
        ],
        caption: String::new(),
        shown: Shown::Every(6),
        placing: Placing::OnFirstPath,
        music: None,
    }
}

fn groups<'a>(document: &'a Document, class: &str) -> Vec<Node<'a, 'a>> {
    let named = |node: &Node| node.attribute("class") == Some(class);
    document.descendants().filter(named).collect()
}

fn texts(document: &Document) -> Vec<String> {
    let text = document
        .descendants()
        .filter(|node| node.has_tag_name("text"));
    text.filter_map(|node| node.text().map(str::to_string))
        .collect()
}

/// Fill-like colours of a dancer: those of its bones' upper strokes and its head.
fn has_colour(node: Node, colour: &str) -> bool {
    node.descendants().any(|part| {
        part.attribute("stroke") == Some(colour) || part.attribute("fill") == Some(colour)
    })
}

#[test]
fn the_motion_figure_has_keyframes_in_red_generated_frames_in_amber_recorded_ones_in_neither() {
    let svg = figure().svg().unwrap();
    let document = Document::parse(&svg).unwrap();
    let (red, amber) = ("#e03c31", "#ffc21a");
    // Frames 0, 6, 12, 18 and the keyframe 20: two keyframes in each of 3 rows, 3 others.
    let keyframes = groups(&document, "keyframe");
    assert_eq!(keyframes.len(), 6);
    assert!(
        keyframes
            .iter()
            .all(|node| has_colour(*node, red) && !has_colour(*node, amber))
    );
    let generated = groups(&document, "generated");
    assert_eq!(generated.len(), 6);
    assert!(
        generated
            .iter()
            .all(|node| has_colour(*node, amber) && !has_colour(*node, red))
    );
    let recorded = groups(&document, "recorded");
    assert_eq!(recorded.len(), 3);
    assert!(
        recorded
            .iter()
            .all(|node| !has_colour(*node, amber) && !has_colour(*node, red))
    );
    let texts = texts(&document);
    for expected in [
        "Ground truth",
        "Interpolation",
        "Whole model",
        "18",
        "20",
        "N = 20 <of> \"a & b\"",
    ] {
        assert!(
            texts.iter().any(|text| text == expected),
            "{expected} in {texts:?}"
        );
    }
}

#[test]
fn every_dancer_lies_within_the_figure() {
    let svg = figure().svg().unwrap();
    let document = Document::parse(&svg).unwrap();
    let size = |name| -> f64 {
        document
            .root_element()
            .attribute(name)
            .unwrap()
            .parse()
            .unwrap()
    };
    let (width, height) = (size("width"), size("height"));
    let mut points = 0;
    for line in document
        .descendants()
        .filter(|node| node.has_tag_name("polyline"))
    {
        for point in line.attribute("points").unwrap().split(' ') {
            let (x, y) = point.split_once(',').unwrap();
            let (x, y): (f64, f64) = (x.parse().unwrap(), y.parse().unwrap());
            assert!(
                (0.0..=width).contains(&x) && (0.0..=height).contains(&y),
                "{x}, {y}"
            );
            points += 1;
        }
    }
    assert!(points > 2 * 23 * 15, "{points} points");
}

#[test]
fn a_root_off_the_path_shows_as_a_dancer_off_its_place() {
    let first_bone = |figure: &MotionFigure, row: usize| -> f64 {
        let svg = figure.svg().unwrap();
        let document = Document::parse(&svg).unwrap();
        let row = groups(&document, "row")[row];
        let head = row
            .descendants()
            .filter(|node| node.has_tag_name("ellipse"))
            .nth(1);
        head.unwrap().attribute("cx").unwrap().parse().unwrap()
    };
    let on_path = figure();
    let mut off_path = figure();
    off_path.rows[1].frames[6]
        .iter_mut()
        .for_each(|joint| joint.x += 20.0);
    assert_eq!(first_bone(&on_path, 0), first_bone(&off_path, 0));
    assert!(first_bone(&off_path, 1) > first_bone(&on_path, 1) + 5.0);
}

#[test]
fn rows_that_do_not_show_the_same_frames_are_an_error() {
    let mut uneven = figure();
    uneven.rows[2].frames.pop();
    let error = uneven.svg().unwrap_err();
    assert!(
        error.to_string().contains("Whole model has 20 frames"),
        "{error}"
    );
    let mut wild = figure();
    wild.rows[1].frames[3][5].y = f64::NAN;
    assert!(matches!(wild.svg(), Err(FigureError::NotFinite { .. })));
    let empty = MotionFigure {
        rows: Vec::new(),
        ..figure()
    };
    assert!(matches!(empty.svg(), Err(FigureError::Empty { .. })));
}

#[test]
fn rows_of_unlike_length_show_as_many_dancers_on_their_own_paths_and_number_their_own_frames() {
    let rows = [20, 50].map(|frames| {
        MotionRow::between_keyframes(format!("N = {frames}"), dancers(frames + 1, 0.0), true)
    });
    let figure = MotionFigure {
        rows: rows.to_vec(),
        shown: Shown::Count(6),
        placing: Placing::OnOwnPath,
        ..figure()
    };
    let svg = figure.svg().unwrap();
    let document = Document::parse(&svg).unwrap();
    let rows = groups(&document, "row");
    for (row, last) in rows.iter().zip(["20", "50"]) {
        let of = |class: &str| {
            let of = |node: &Node| node.attribute("class") == Some(class);
            row.descendants().filter(of).count()
        };
        assert_eq!((of("keyframe"), of("generated")), (2, 4));
        assert!(row.descendants().any(|node| node.text() == Some(last)));
    }
}

#[test]
fn marked_parts_are_blue_between_the_keyframes_only() {
    let mut figure = figure();
    figure.rows.truncate(1);
    figure.rows[0].generated = true;
    figure.rows[0].marked = [false, true, false, true, false];
    let svg = figure.svg().unwrap();
    let document = Document::parse(&svg).unwrap();
    let (amber, blue) = ("#ffc21a", "#3f86e0");
    let bones = |node: &Node, colour: &str| {
        let of_colour = |part: &Node| part.attribute("stroke") == Some(colour);
        node.descendants().filter(of_colour).count()
    };
    for dancer in groups(&document, "generated") {
        // Left leg and right arm: four bones each.
        assert_eq!((bones(&dancer, blue), bones(&dancer, amber)), (8, 15));
    }
    for dancer in groups(&document, "keyframe") {
        assert_eq!(bones(&dancer, blue), 0);
    }
}

#[test]
fn root_trajectories_share_a_scale_and_the_caption_stands_under_the_figure() {
    let mut figure = figure();
    figure.caption = "A caption that says <what> is seen. ".repeat(12);
    let target: Vec<DVec3> = (0..21)
        .map(|t| DVec3::new(5.0 * f64::from(t), 90.0, 0.0))
        .collect();
    for (row, reach) in figure.rows.iter_mut().zip([1.0, 1.0, 0.5]) {
        row.paths = Some(RootPaths {
            view: PathView::Above,
            target_label: "root asked for",
            target: target.clone(),
            generated: target.iter().map(|place| *place * reach).collect(),
        });
    }
    let svg = figure.svg().unwrap();
    let document = Document::parse(&svg).unwrap();
    let width = |panel: &Node| {
        let line = panel
            .children()
            .filter(|node| node.has_tag_name("polyline"))
            .nth(1);
        let points = line.unwrap().attribute("points").unwrap().to_string();
        let x = |point: &str| -> f64 { point.split_once(',').unwrap().0.parse().unwrap() };
        let xs: Vec<f64> = points.split(' ').map(x).collect();
        xs[xs.len() - 1] - xs[0]
    };
    let panels = groups(&document, "root");
    assert_eq!(panels.len(), 3);
    assert!((width(&panels[0]) - 2.0 * width(&panels[2])).abs() < 0.1);
    let caption: Vec<&str> = groups(&document, "caption")[0]
        .descendants()
        .filter(|node| node.is_text())
        .filter_map(|node| node.text().map(str::trim))
        .filter(|text| !text.is_empty())
        .collect();
    assert!(caption.len() > 1, "long captions break");
    assert_eq!(caption.join(" "), figure.caption.trim());
}

fn losses() -> Vec<Series> {
    [("total", 30.0), ("L_rec", 20.0), ("L_key", 2.0)]
        .map(|(name, from)| Series {
            name: name.into(),
            points: (1..=1000)
                .map(|step| (640.0 * f64::from(step), from / f64::from(step).sqrt()))
                .collect(),
        })
        .to_vec()
}

/// The points of each line of a chart, without the legend's.
fn lines(svg: &str) -> Vec<Vec<(f64, f64)>> {
    let document = Document::parse(svg).unwrap();
    let line = |group: Node| {
        let line = group
            .children()
            .find(|node| node.has_tag_name("polyline"))
            .unwrap();
        let points = line.attribute("points").unwrap().split(' ');
        points
            .map(|point| point.split_once(',').unwrap())
            .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
            .collect()
    };
    groups(&document, "line").into_iter().map(line).collect()
}

#[test]
fn the_loss_curve_falls_on_a_logarithmic_axis_and_names_its_terms_and_units() {
    let svg = loss_curve("demo", &losses()).unwrap();
    let lines = lines(&svg);
    assert_eq!(lines.len(), 3);
    for line in &lines {
        assert!(line.len() <= 300);
        assert!(
            line.windows(2)
                .all(|pair| pair[1].1 >= pair[0].1 && pair[1].0 > pair[0].0)
        );
    }
    // A ratio is a distance: total and L_key, 15 apart everywhere, are parallel.
    let apart: Vec<f64> = lines[0]
        .iter()
        .zip(&lines[2])
        .map(|(a, b)| b.1 - a.1)
        .collect();
    assert!(
        apart
            .iter()
            .all(|d| (d - apart[0]).abs() < 0.02 && *d > 10.0)
    );
    let texts = texts(&Document::parse(&svg).unwrap()).join("|");
    for expected in ["total", "L_rec", "L_key", "frame-steps", "log scale"] {
        assert!(texts.contains(expected), "{expected} in {texts}");
    }
}

#[test]
fn losses_of_zero_are_left_out_and_infinite_ones_are_errors() {
    let mut series = losses();
    series[1].points.iter_mut().for_each(|point| point.1 = 0.0);
    Document::parse(&loss_curve("demo", &series).unwrap()).unwrap();
    series[1].points[7].1 = f64::INFINITY;
    let error = loss_curve("demo", &series).unwrap_err();
    assert!(error.to_string().contains("L_rec"), "{error}");
    assert!(matches!(
        loss_curve("demo", &[]),
        Err(FigureError::Empty { .. })
    ));
}

#[test]
fn one_point_is_a_chart_too() {
    let single = Series {
        name: "total".into(),
        points: vec![(640.0, 3.0)],
    };
    let svg = loss_curve("short", &[single]).unwrap();
    let lines = lines(&svg);
    assert!(lines[0][0].0.is_finite() && lines[0][0].1.is_finite());
}

#[test]
fn the_curve_of_a_metric_has_the_papers_values_dashed_in_the_colour_of_ours() {
    let models = [
        ScoreSeries {
            name: "interpolation".into(),
            ours: vec![(10.0, 22.9), (50.0, 95.8), (150.0, 124.0)],
            paper: vec![(10.0, 13.83), (50.0, 87.59), (150.0, 124.47)],
        },
        ScoreSeries {
            name: "variant".into(),
            ours: vec![(10.0, 30.0), (150.0, 90.0)],
            paper: Vec::new(),
        },
    ];
    let svg = score_curve("LRP", &Equations::default().metrics()[0], &models).unwrap();
    let document = Document::parse(&svg).unwrap();
    let strokes: Vec<_> = groups(&document, "line")
        .iter()
        .map(|group| {
            let line = group
                .children()
                .find(|node| node.has_tag_name("polyline"))
                .unwrap();
            (
                line.attribute("stroke").unwrap(),
                line.has_attribute("stroke-dasharray"),
            )
        })
        .collect();
    assert_eq!(strokes.len(), 3);
    assert_eq!(strokes[0].0, strokes[1].0);
    assert_ne!(strokes[0].0, strokes[2].0);
    assert_eq!(
        [strokes[0].1, strokes[1].1, strokes[2].1],
        [false, true, false]
    );
}

#[test]
fn thousands_are_parted_from_the_right() {
    let texts = [0, 999, 1000, 123_456, 1_234_567].map(thousands);
    assert_eq!(texts, ["0", "999", "1,000", "123,456", "1,234,567"]);
}
