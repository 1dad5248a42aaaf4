//! Windows of frames, cut at even distances.

use keydance::data::{Window, WindowCut};

fn starts(frames: usize, cut: WindowCut) -> Vec<usize> {
    let windows = cut.windows(&[frames]).into_iter();
    windows.map(|window| window.start).collect()
}

#[test]
fn a_window_that_ends_with_the_clip_is_left_out_where_that_is_asked_for() {
    let cut = |strictly| WindowCut {
        frames: 50,
        every: 10,
        strictly,
    };
    assert_eq!(starts(70, cut(false)), [0, 10, 20]);
    assert_eq!(starts(70, cut(true)), [0, 10]);
    assert_eq!(starts(71, cut(true)), [0, 10, 20]);
    assert_eq!(starts(50, cut(false)), [0]);
    assert!(starts(50, cut(true)).is_empty());
    assert!(starts(0, cut(true)).is_empty());
    assert_eq!((cut(false).needed(), cut(true).needed()), (50, 51));
    assert_eq!(cut(true).too_short(&[50, 51, 0]), [0, 2]);
}

#[test]
fn windows_stand_by_clip_then_by_start() {
    let cut = WindowCut {
        frames: 2,
        every: 2,
        strictly: false,
    };
    let found: Vec<(usize, usize)> = cut
        .windows(&[4, 1, 3])
        .into_iter()
        .map(|Window { clip, start }| (clip, start))
        .collect();
    assert_eq!(found, [(0, 0), (0, 2), (2, 0)]);
}
