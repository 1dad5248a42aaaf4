//! The motion viewer: a page that holds what it was given, escapes what users wrote, and plays in a
//! browser.

use std::f64::consts::FRAC_PI_2;
use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::{DQuat, DVec3};
use keydance::data::DataConfig;
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::evaluation::transitions::window_request;
use keydance::models::baselines::interpolation::Interpolation;
use keydance::models::transition::TransitionModel;
use keydance::models::transition::window_features;
use keydance::models::transition::{DanceClip, TransitionRequest};
use keydance::motion::JOINTS;
use keydance::motion::bvh::{self, Axis as BvhAxis, Bvh};
use keydance::motion::placement::world_positions;
use keydance::motion::skeleton::{Joint, Skeleton};
use keydance::report::{
    Asked, FigureError, MotionKind, Viewer, ViewerBody, ViewerKeyframe, ViewerMotion,
};
use ndarray::{Axis, concatenate, s};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::browser::{self, Loaded};
use crate::generated_data::write_clips;
use crate::trained_run::keydance;
use crate::viewer_page::page_data;

const LENGTH: usize = 250;

/// A generated clip as ground truth, as model and, interpolated, as a baseline.
fn viewer() -> Viewer {
    let choreography = ChoreographyConfig {
        clips: 1,
        frames_per_clip: 280,
        seed: 5,
    };
    let clip = generate(&choreography).unwrap().remove(0).clip;
    let clip = DanceClip::new(clip, None, &DataConfig::default()).unwrap();
    let window = window_features(&clip.features, 20, LENGTH);
    let request = window_request(&clip.clip, 20, window.view()).unwrap();
    let request = TransitionRequest::of(&request).unwrap();
    let between = Interpolation::default()
        .transitions(std::slice::from_ref(&request))
        .unwrap()
        .remove(0);
    let first = window.slice(s![..1, ..149]);
    let interpolated = concatenate(Axis(0), &[first, between.frames.view()]).unwrap();
    let motion = |name, kind, frames| ViewerMotion::from_features(name, kind, frames);
    Viewer {
        title: "waltz.bvh, frames 20 to 270".into(),
        frame_time: 1.0 / 30.0,
        body: ViewerBody::dance(),
        motions: vec![
            motion("Ground truth", MotionKind::Recorded, window.view()),
            motion("Interpolation", MotionKind::Other, interpolated.view()),
            motion("Model", MotionKind::Model, window.view()),
        ],
        keyframes: [0, LENGTH]
            .map(|frame| ViewerKeyframe {
                frame,
                positions: world_positions(window.row(frame)).to_vec(),
            })
            .to_vec(),
        asked: Some(Asked::new(
            request.root_trajectory.view(),
            request.velocity_factors.view(),
        )),
        music: None,
        picks: None,
    }
}

#[test]
fn three_motions_of_250_frames_fit_into_a_page_of_half_a_megabyte_that_needs_no_network() {
    let page = viewer().html().unwrap();
    assert!(page.len() < 500_000, "{} bytes", page.len());
    let data = page_data(&page);
    assert_eq!(data["frames"], 251);
    assert_eq!(data["motions"].as_array().unwrap().len(), 3);
    assert_eq!(data["motions"][1]["factors"].as_array().unwrap().len(), 251);
    assert_eq!(data["trajectory"].as_array().unwrap().len(), 251);
    assert_eq!(data["keyframes"][1]["frame"], 250);
    for outside in ["http://", "https://", "src=", "@import", "url("] {
        let found = page.replace("http://www.w3.org", "").contains(outside);
        assert!(!found, "{outside}");
    }
    assert!(page.contains("default-src 'none'"));
    assert!(!page.contains("{{"));
}

#[test]
fn names_that_look_like_markup_stay_names() {
    let mut viewer = viewer();
    let name = "</script><script>alert(1)</script><!-- & \"{{data}}\" \u{2028}.bvh";
    viewer.title = name.into();
    viewer.motions[0].name = name.into();
    let page = viewer.html().unwrap();
    let plain = self::viewer().html().unwrap();
    let count = |text: &str, what: &str| text.to_lowercase().matches(what).count();
    for tag in ["<script", "</script", "<!--", "<title"] {
        assert_eq!(count(&page, tag), count(&plain, tag), "{tag}");
    }
    assert_eq!(page_data(&page)["motions"][0]["name"], name);
    assert!(page.contains("<title>&lt;/script&gt;&lt;script&gt;alert(1)"));
}

#[test]
fn measured_velocity_factors_are_those_of_the_features() {
    let viewer = viewer();
    let asked = &viewer.asked.as_ref().unwrap().velocity_factors;
    let measured = &viewer.motions[0].velocity_factors;
    for frame in 1..=LENGTH {
        for part in 0..5 {
            let difference = measured[frame][part] - asked[frame][part];
            assert!(difference.abs() < 1e-9, "frame {frame}, part {part}");
        }
    }
    assert_eq!(measured[0], measured[1]);
}

#[test]
fn what_does_not_fit_together_is_an_error_that_names_it() {
    let message = |change: &dyn Fn(&mut Viewer)| {
        let mut viewer = viewer();
        change(&mut viewer);
        viewer.html().unwrap_err().to_string()
    };
    let text = message(&|viewer| viewer.motions[2].positions.truncate(9));
    assert!(text.contains("Model has 9 frames"), "{text}");
    let text = message(&|viewer| viewer.keyframes[1].frame = 251);
    assert!(text.contains("keyframe 251"), "{text}");
    let text = message(&|viewer| viewer.motions[1].positions[7][3].y = f64::NAN);
    assert!(text.contains("Interpolation has a NaN"), "{text}");
    let text = message(&|viewer| {
        viewer.asked.as_mut().unwrap().root_trajectory[0] = DVec3::INFINITY;
    });
    assert!(text.contains("what was asked for"), "{text}");
    let empty = Viewer {
        motions: Vec::new(),
        ..viewer()
    };
    assert!(matches!(empty.html(), Err(FigureError::Empty { .. })));
}

/// A page of two clips from one folder.
fn clips_page(folder: &Path) -> PathBuf {
    write_clips(folder, 40, 3);
    let mut clips: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|it| it.unwrap().path())
        .collect();
    clips.sort();
    let mut short = bvh::read(&clips[1]).unwrap().to_clip();
    short.poses.truncate(25);
    let channels = bvh::channel_layout(&short, [BvhAxis::Z, BvhAxis::X, BvhAxis::Y]);
    let short_file = folder.join("short.bvh");
    bvh::write(&short_file, &Bvh::from_clip(&short, channels).unwrap()).unwrap();
    let page = folder.join("page.html");
    let mut view = keydance("view");
    view.args([&clips[0], &short_file]).arg("--out").arg(&page);
    view.assert().success();
    page
}

#[test]
fn clips_are_shown_together_and_a_shorter_one_stands_still_at_its_end() {
    let folder = TempDir::new().unwrap();
    let page = fs::read_to_string(clips_page(folder.path())).unwrap();
    let data = page_data(&page);
    assert_eq!(
        (&data["frames"], &data["picks"]),
        (&json!(40), &json!("--keyframes"))
    );
    assert_eq!(data["motions"].as_array().unwrap().len(), 2);
    let factors = data["motions"][1]["factors"].as_array().unwrap();
    let fastest = |frame: usize| {
        let parts = factors[frame].as_array().unwrap().iter();
        parts.map(|it| it.as_f64().unwrap()).fold(0.0, f64::max)
    };
    assert!(fastest(10) > 0.3 && fastest(35) < 0.05);
}

#[test]
fn a_frame_is_picked_by_a_key() {
    let Some(browser) = browser::browser() else {
        return;
    };
    let folder = TempDir::new().unwrap();
    let file = clips_page(folder.path());
    let press = "<script type=\"module\">setTimeout(() => document.body.dispatchEvent(\
                 new KeyboardEvent(\"keydown\", { key: \"m\", bubbles: true })), 300)</script></body>";
    let page = fs::read_to_string(&file).unwrap().replace("</body>", press);
    fs::write(&file, page).unwrap();
    let picked = |page: &Loaded| {
        let at = page.document.find("id=\"picked\"")?;
        let end = page.document[at..].find('>')?;
        Some(page.document[at..at + end].to_string())
    };
    let is_shown = |page: &Loaded| picked(page).is_some_and(|tag| !tag.contains("hidden"));
    let loaded = browser::load(&browser, &file, "#frame=12", is_shown);
    assert_eq!(loaded.attribute("data-error"), None, "{}", loaded.log);
    assert!(is_shown(&loaded), "{:?}", picked(&loaded));
}

#[test]
fn files_that_are_dropped_on_a_page_are_shown_in_place_of_its_own() {
    let Some(browser) = browser::browser() else {
        return;
    };
    let folder = TempDir::new().unwrap();
    let file = clips_page(folder.path());
    let dropped = |name: &str, text: &str, ready: fn(&Loaded) -> bool| {
        let script = format!(
            "<script type=\"module\">
            if (document.title !== {name:?}) {{
              const dataTransfer = new DataTransfer();
              dataTransfer.items.add(new File([{text:?}], {name:?}));
              dispatchEvent(new DragEvent(\"drop\", {{ dataTransfer }}));
            }}
            </script></body>"
        );
        let page = fs::read_to_string(&file).unwrap();
        let page_file = folder.path().join("dropped.html");
        fs::write(&page_file, page.replace("</body>", &script)).unwrap();
        browser::load(&browser, &page_file, "", ready)
    };
    let clip = bvh::read(&folder.path().join("short.bvh")).unwrap();
    let mut metres = clip.to_clip();
    let to_z_up = DQuat::from_rotation_x(FRAC_PI_2);
    for joint in &mut metres.skeleton.joints {
        joint.offset *= 0.01;
    }
    for pose in &mut metres.poses {
        pose.translations
            .iter_mut()
            .for_each(|place| *place *= 0.01);
        pose.translations[0] = to_z_up * pose.translations[0];
        pose.rotations[0] = to_z_up * pose.rotations[0];
    }
    let channels = bvh::channel_layout(&metres, [BvhAxis::Z, BvhAxis::X, BvhAxis::Y]);
    let text = Bvh::from_clip(&metres, channels).unwrap().to_text();
    let shown = dropped("metres.bvh", &text, |page| {
        page.document.contains("<h1>metres.bvh</h1>") && page.has_drawn()
    });
    assert_eq!(shown.attribute("data-error"), None, "{}", shown.log);
    let data = page_data(&shown.document);
    assert_eq!(data["frames"], json!(25));
    let summary = data["summary"].as_str().unwrap();
    assert!(summary.ends_with("in m, Z up"), "{summary}");
    let joints = metres.skeleton.len();
    let named = data["parents"].as_array().unwrap();
    assert!(named.len() >= joints, "the ends of limbs are shown, too");
    let root = decoded(&data["motions"][0]["positions"]);
    let expected = clip.to_clip().poses[0].translations[0];
    for (axis, wanted) in expected.to_array().into_iter().enumerate() {
        assert!(
            (root[axis] - wanted).abs() < 0.1,
            "{:?} {expected}",
            &root[..3]
        );
    }

    let refused = dropped("notes.bvh", "HIERARCHY and nothing else", |page| {
        page.document.contains("notes.bvh is no BVH file")
    });
    assert!(refused.document.contains("and is not understood"));
    assert_eq!(page_data(&refused.document)["frames"], json!(40));
}

#[test]
fn the_page_plays_in_a_browser_without_an_error() {
    let Some(browser) = browser::browser() else {
        return;
    };
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("viewer.html");
    let mut viewer = viewer();
    viewer.motions[1].name = "</script><b>\u{2028}'".into();
    fs::write(&file, viewer.html().unwrap()).unwrap();

    let frame = |page: &Loaded| page.attribute("data-frame")?.parse::<usize>().ok();
    let moves = |page: &Loaded| frame(page) >= Some(2);
    let playing = browser::load(&browser, &file, "", moves);
    assert_eq!(playing.attribute("data-error"), None, "{}", playing.log);
    assert!(playing.console().is_empty(), "{:?}", playing.console());
    assert_eq!(playing.attribute("data-playing"), Some("true"));
    // A headless browser repaints as it likes: how far the motion is after a while is not said,
    // only that it moves.
    let reached = frame(&playing);
    assert!(
        moves(&playing) && reached <= Some(LENGTH),
        "at frame {reached:?}"
    );
    assert!(playing.document.contains("&lt;/script&gt;&lt;b&gt;"));

    let still = browser::load(
        &browser,
        &file,
        "#frame=40&view=overlay&theme=dark&hide=2",
        Loaded::has_drawn,
    );
    assert!(still.console().is_empty(), "{:?}", still.console());
    assert_eq!(frame(&still), Some(40));
    assert_eq!(still.attribute("data-theme"), Some("dark"));
    assert_eq!(still.attribute("data-arrangement"), Some("overlay"));

    let foreign = folder.path().join("broken.html");
    let broken = viewer
        .html()
        .unwrap()
        .replace(r#""frames":251"#, r#""frames":"#);
    fs::write(&foreign, broken).unwrap();
    let failed = browser::load(&browser, &foreign, "", Loaded::has_drawn);
    assert!(
        failed.attribute("data-error").is_some(),
        "an error goes unnoticed"
    );
}

/// What `data.js` does.
fn decoded(steps: &Value) -> Vec<f64> {
    let bytes = STANDARD.decode(steps["steps"].as_str().unwrap()).unwrap();
    let (step, origin) = (steps["step"].as_f64().unwrap(), &steps["origin"]);
    let pairs = bytes.chunks_exact(2).enumerate();
    pairs
        .map(|(index, pair)| {
            let steps = i16::from_le_bytes([pair[0], pair[1]]);
            origin[index % 3].as_f64().unwrap() + step * f64::from(steps)
        })
        .collect()
}

#[test]
fn positions_come_back_to_half_a_step_however_wide_the_motion() {
    for width in [0.0, 40.0, 900.0, 90_000.0] {
        let place = |number: usize| {
            let share = number as f64 / 479.0;
            let depth = -width * share * share;
            DVec3::new(width * share - 7.0, 90.0 - 0.3 * share, depth)
        };
        let body = |time| (0..JOINTS).map(move |joint| place(time * JOINTS + joint));
        let frames: Vec<Vec<DVec3>> = (0..20).map(|time| body(time).collect()).collect();
        let viewer = Viewer {
            title: "wide".into(),
            frame_time: 1.0 / 30.0,
            body: ViewerBody::dance(),
            motions: vec![ViewerMotion {
                name: "Model".into(),
                kind: MotionKind::Model,
                contacts: vec![[false; 4]; frames.len()],
                velocity_factors: vec![[0.0; 5]; frames.len()],
                positions: frames.clone(),
            }],
            keyframes: Vec::new(),
            asked: None,
            music: None,
            picks: None,
        };
        let data = page_data(&viewer.html().unwrap());
        let positions = &data["motions"][0]["positions"];
        let step = positions["step"].as_f64().unwrap();
        assert!(step <= (width / 65_000.0).max(1.0 / 64.0));
        let places = frames.iter().flatten().flat_map(DVec3::to_array);
        for (expected, found) in places.zip(decoded(positions)) {
            let apart = (expected - found).abs();
            assert!(apart <= 0.51 * step, "{expected} {found}");
        }
    }
}

#[test]
fn a_body_of_any_joints_is_drawn_and_a_pose_of_others_is_refused() {
    let joint = |name: &str, parent: Option<usize>| Joint {
        name: name.into(),
        parent,
        offset: DVec3::Y,
        end_sites: Vec::new(),
    };
    let joints = vec![
        joint("Hips", None),
        joint("Spine", Some(0)),
        joint("Head", Some(1)),
    ];
    let skeleton = Skeleton { joints };
    let viewer = |positions: Vec<Vec<DVec3>>| Viewer {
        title: "three".into(),
        frame_time: 1.0 / 30.0,
        body: ViewerBody::of(&skeleton),
        motions: vec![ViewerMotion {
            name: "Model".into(),
            kind: MotionKind::Model,
            contacts: vec![[false; 4]; positions.len()],
            velocity_factors: Vec::new(),
            positions,
        }],
        keyframes: Vec::new(),
        asked: None,
        music: None,
        picks: None,
    };
    let data = page_data(&viewer(vec![vec![DVec3::ZERO; 3]; 2]).html().unwrap());
    assert_eq!(data["parents"], serde_json::json!([-1, 0, 1]));
    assert_eq!(data["head"], 2);
    assert_eq!(data["feet"], serde_json::json!([]));
    let error = viewer(vec![vec![DVec3::ZERO; 4]; 2]).html().unwrap_err();
    assert!(
        error
            .to_string()
            .contains("a pose of 4 joints is none of a body of 3"),
        "{error}"
    );
}
