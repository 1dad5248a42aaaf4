//! Which clips train, validate and test.

use glam::DVec3;
use keydance::data::{DataConfig, DataError, Dataset, Recording, Split};

use crate::dance_clip::turning_clip;
use crate::lafan1_data::lafan1_folder;

fn config(split: Split) -> DataConfig {
    DataConfig {
        split,
        ..DataConfig::default()
    }
}

fn names(count: usize) -> Vec<String> {
    (0..count)
        .map(|index| format!("{}.bvh", char::from(b'a' + index as u8)))
        .collect()
}

/// Names of the clips that train, validate and test.
#[derive(Debug)]
struct Parts {
    train: Vec<String>,
    validation: Vec<String>,
    test: Vec<String>,
}

/// Splits clips of these names, sorted bytewise.
fn split(names: &[String], config: &DataConfig) -> Result<Parts, DataError> {
    let clip = |name: &String| turning_clip(name, 2, |_| (DVec3::Y * 90.0, 0.0));
    let dataset = Dataset::from_clips(names.iter().map(clip).collect(), config)?;
    let names = |part: &[Recording]| part.iter().map(|clip| clip.name().into()).collect();
    Ok(Parts {
        train: names(&dataset.train),
        validation: names(&dataset.validation),
        test: names(&dataset.test),
    })
}

#[test]
fn clips_are_split_by_their_number_as_text() {
    let config = config(Split::Share(0.25));
    let parts = split(&names(12), &config).unwrap();
    assert_eq!(parts.train, ["j.bvh", "k.bvh", "l.bvh"]);
    assert_eq!(parts.test[..2], ["a.bvh", "b.bvh"]);
}

#[test]
fn validation_clips_are_taken_from_the_training_clips_only() {
    let plain = config(Split::Share(0.5));
    let without = split(&names(20), &plain).unwrap();
    let with = split(
        &names(20),
        &DataConfig {
            validation_share: 0.3,
            ..plain
        },
    )
    .unwrap();
    assert_eq!(with.test, without.test);
    assert_eq!(with.validation.len(), 3);
    let mut rejoined = [with.train, with.validation].concat();
    rejoined.sort_unstable();
    let mut train = without.train;
    train.sort_unstable();
    assert_eq!(rejoined, train);
}

#[test]
fn unseen_dancers_are_tested_on_and_neither_trained_nor_mixed_with_the_test_clips() {
    let names: Vec<String> = (0..123)
        .map(|index| format!("{}_{index:03}.bvh", ["Eva", "Evan", "Ida"][index % 3]))
        .collect();
    let parts = |split_by: Split| {
        let config = DataConfig {
            validation_share: 0.1,
            ..config(split_by)
        };
        split(&names, &config)
    };
    // 98 of the 123, as the dance split; that also counts frames.
    let dance = parts(Split::Share(0.8)).unwrap();
    let unseen = parts(Split::UnseenDancers(vec!["Eva".into()])).unwrap();
    assert!(unseen.test.iter().all(|name| name.starts_with("Eva_")));
    let mut all = [unseen.train.clone(), unseen.validation.clone()].concat();
    assert!(all.iter().all(|name| !name.starts_with("Eva_")));
    assert!(!unseen.validation.is_empty());
    all.extend(unseen.test);
    all.sort_unstable();
    let mut training = [dance.train, dance.validation].concat();
    training.sort_unstable();
    assert_eq!(all, training);
    let message = |dancers: &[&str]| {
        let dancers = dancers.iter().map(|&dancer| dancer.into()).collect();
        parts(Split::UnseenDancers(dancers))
            .unwrap_err()
            .to_string()
    };
    let text = message(&["Eva", "Ev"]);
    assert!(
        text.contains("show Ev,") && text.contains("the set of clips"),
        "{text}"
    );
    for dancers in [&[][..], &["Eva", "Evan", "Ida"]] {
        assert!(message(dancers).contains("split.unseen_dancers"));
    }
}

#[test]
fn a_split_that_does_not_fit_names_both_sides() {
    let message = |split_by: Split, count: usize| {
        split(&names(count), &config(split_by))
            .unwrap_err()
            .to_string()
    };
    let text = message(Split::Dance, 4);
    assert!(
        text.contains("123 clips") && text.contains("the set of clips holds 4"),
        "{text}"
    );
    let list = |train: &str, test: &str| Split::List {
        train: vec![train.into()],
        validation: Vec::new(),
        test: vec![test.into()],
    };
    let text = message(list("a.bvh", "z.bvh"), 4);
    assert!(
        text.contains("z.bvh") && text.contains("its 4 clips"),
        "{text}"
    );
    assert!(message(list("a.bvh", "a.bvh"), 4).contains("a.bvh"));
    assert!(message(Split::Share(0.5), 1).contains("none for training"));
    assert!(message(Split::Share(f64::NAN), 4).contains("split.share"));
}

/// Names of clips of LaFAN1, of these themes and subjects.
fn lafan1(clips: &[(&str, usize)]) -> Vec<String> {
    let name = |(theme, subject): &(&str, usize)| format!("{theme}_subject{subject}.bvh");
    clips.iter().map(name).collect()
}

#[test]
fn lafan1_tests_on_subject_5_and_trains_on_the_others() {
    let names = lafan1(&[
        ("dance1", 1),
        ("fall_and_get_up", 5),
        ("run1", 5),
        ("walk1", 2),
    ]);
    let parts = split(&names, &config(Split::Lafan1)).unwrap();
    assert_eq!(parts.test, names[1..3]);
    assert_eq!(parts.train, [names[0].as_str(), &names[3]]);
    // Subject 5 alone: neither subject 50 nor a theme that is called so.
    let names = lafan1(&[("subject5", 1), ("walk1", 5), ("walk1", 50)]);
    let parts = split(&names, &config(Split::Lafan1)).unwrap();
    assert_eq!(parts.test, [names[1].as_str()]);
}

#[test]
fn another_number_of_lafan1_clips_is_used_with_a_warning_that_names_both() {
    let names = lafan1(&[("a", 1), ("a", 2), ("a", 5), ("b", 3)]);
    for validation_share in [0.0, 0.5] {
        let config = DataConfig {
            validation_share,
            ..config(Split::Lafan1)
        };
        let clip = |name: &String| turning_clip(name, 7, |_| (DVec3::Y * 90.0, 0.0));
        let dataset = Dataset::from_clips(names.iter().map(clip).collect(), &config).unwrap();
        let [warning] = &dataset.warnings[..] else {
            panic!("{:?}", dataset.warnings)
        };
        assert!(
            warning.contains("64 training and 13 test clips of 496672 frames"),
            "{warning}"
        );
        assert!(warning.contains("3 and 1 of 28"), "{warning}");
    }
}

#[test]
fn lafan1_without_a_clip_to_test_or_to_train_on_is_refused() {
    for (subjects, counts) in [
        ([1, 2], "0 clips of subject5 and 2"),
        ([5, 5], "2 clips of subject5 and 0"),
    ] {
        let names = lafan1(&[("a", subjects[0]), ("b", subjects[1])]);
        let text = split(&names, &config(Split::Lafan1))
            .unwrap_err()
            .to_string();
        assert!(
            text.contains(counts) && text.contains("theme_subject5"),
            "{text}"
        );
    }
}

#[test]
fn the_part_of_lafan1_that_is_here_is_split_and_warned_of() {
    let Some(folder) = lafan1_folder() else {
        return;
    };
    let dataset = Dataset::load(&folder, &config(Split::Lafan1)).unwrap();
    let frames = |clips: &[Recording]| clips.iter().map(Recording::frames).sum::<usize>();
    let found = (dataset.train.len(), dataset.test.len());
    let frames = (frames(&dataset.train), frames(&dataset.test));
    let warned = dataset.warnings.iter().any(|it| it.contains("LaFAN1 has"));
    match found.0 + found.1 {
        77 => assert_eq!(
            (found, frames.0 + frames.1, warned),
            ((64, 13), 496_672, false)
        ),
        14 => assert_eq!((found, frames, warned), ((12, 2), (47_545, 7_191), true)),
        _ => assert!(warned),
    }
}
