//! How many of a thing there are, as a message says it.

use std::fmt::Display;

/// "1 frame", "2 frames".
pub(crate) fn counted<N: Display + PartialEq + From<u8>>(number: N, thing: &str) -> String {
    let plural = if number == N::from(1) { "" } else { "s" };
    format!("{number} {thing}{plural}")
}

#[cfg(test)]
mod tests {
    use super::counted;

    #[test]
    fn one_thing_is_no_several() {
        let counts = [0, 1, 2, 21].map(|number: u64| counted(number, "frame"));
        assert_eq!(counts, ["0 frames", "1 frame", "2 frames", "21 frames"]);
    }
}
