//! How captions of figures say numbers.

use keydance::models::transition::effect::Response;
use keydance::report::figures::pan2021::wording::{percent, verdict};

#[test]
fn a_verdict_says_none_all_or_how_many() {
    let text = |measured: [f64; 3]| {
        let responses = measured.map(|measured| Response {
            asked: 3.0,
            measured,
        });
        verdict("M", "the speed", &responses)
    };
    assert!(text([0.9, -3.0, 0.0]).starts_with("M does not follow the speed"));
    assert!(text([1.1, 3.0, 2.0]).starts_with("M follows the speed"));
    assert!(text([1.1, 3.0, 0.2]).ends_with("in 2 of 3 cases only"));
    assert_eq!(percent(-0.001), "0\u{a0}%");
}
