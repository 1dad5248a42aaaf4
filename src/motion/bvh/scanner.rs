//! The text of a BVH file, word by word and line by line, with the number of the line for errors.

use std::iter::Peekable;
use std::str::SplitWhitespace;

use super::document::{LARGEST_NUMBER, is_sound};
use super::error::BvhError;

/// How much of a word an error shows.
const SHOWN: usize = 40;

pub(super) struct Scanner<'a> {
    file: &'a str,
    /// What follows the current line.
    rest: &'a str,
    words: Peekable<SplitWhitespace<'a>>,
    /// Number of the current line, from 1; 0 before the first.
    line: usize,
}

impl<'a> Scanner<'a> {
    /// A scanner before the first line of `text`; `file` names it in errors.
    pub fn new(file: &'a str, text: &'a str) -> Self {
        let text = without_end_mark(text.strip_prefix('\u{feff}').unwrap_or(text));
        Self {
            file,
            rest: text,
            words: "".split_whitespace().peekable(),
            line: 0,
        }
    }

    pub fn line(&self) -> usize {
        self.line
    }

    /// The next word, on this line or a later one.
    pub fn word(&mut self) -> Option<&'a str> {
        loop {
            if let Some(word) = self.words.next() {
                return Some(word);
            }
            self.words = self.line_after()?.split_whitespace().peekable();
        }
    }

    /// The next word of the current line.
    pub fn word_on_line(&mut self) -> Option<&'a str> {
        self.words.next()
    }

    /// The next word of the current line, left in place.
    pub fn peek_on_line(&mut self) -> Option<&'a str> {
        self.words.peek().copied()
    }

    /// The next line that is not blank; what is left of the current one is given up.
    pub fn full_line(&mut self) -> Option<&'a str> {
        self.words = "".split_whitespace().peekable();
        loop {
            let line = self.line_after()?.trim();
            if !line.is_empty() {
                return Some(line);
            }
        }
    }

    fn line_after(&mut self) -> Option<&'a str> {
        if self.rest.is_empty() {
            return None;
        }
        let (line, rest) = split_line(self.rest);
        self.rest = rest;
        self.line += 1;
        Some(line)
    }

    /// Takes the next word if it is `expected`, in capitals or not.
    pub fn keyword(&mut self, expected: &str) -> Result<(), BvhError> {
        match self.word() {
            Some(word) if word.eq_ignore_ascii_case(expected) => Ok(()),
            other => Err(self.unexpected(expected, other)),
        }
    }

    /// Reads a word as a finite number of a believable size; `what` names it in the error.
    pub fn number(&self, word: Option<&str>, what: impl Fn() -> String) -> Result<f64, BvhError> {
        let expected = || {
            format!(
                "{}, a number between -{LARGEST_NUMBER} and {LARGEST_NUMBER}",
                what()
            )
        };
        let text = word.ok_or_else(|| self.error(expected(), "the end of the line".into()))?;
        match text.parse::<f64>() {
            Ok(number) if is_sound(number) => Ok(number),
            _ => Err(self.unexpected(&expected(), word)),
        }
    }

    /// The error for a word in the wrong place, or for the end of the file.
    pub fn unexpected(&self, expected: &str, found: Option<&str>) -> BvhError {
        self.error(
            expected.into(),
            found.map_or_else(|| "the end of the file".into(), quoted),
        )
    }

    pub fn error(&self, expected: String, found: String) -> BvhError {
        BvhError::Syntax {
            file: self.file.into(),
            line: self.line.max(1),
            expected,
            found,
        }
    }
}

/// The first line of a text and what follows its end: LF, CR LF, or CR alone as old programs write
/// it.
fn split_line(text: &str) -> (&str, &str) {
    let Some(end) = text.find(['\n', '\r']) else {
        return (text, "");
    };
    let (line, rest) = text.split_at(end);
    let rest = rest.strip_prefix('\r').unwrap_or(rest);
    (line, rest.strip_prefix('\n').unwrap_or(rest))
}

/// A text without the end-of-file mark of DOS, and the zeros that fill up a block after it.
fn without_end_mark(text: &str) -> &str {
    let padding = |letter: char| matches!(letter, '\u{1a}' | '\0') || letter.is_whitespace();
    let cut = text.trim_end_matches(padding);
    match text[cut.len()..].contains(['\u{1a}', '\0']) {
        true => cut,
        false => text,
    }
}

/// A word as errors show it: escaped, and cut where it is long.
pub(super) fn quoted(word: &str) -> String {
    let cut: String = word.chars().take(SHOWN).collect();
    let dots = if cut.len() < word.len() { "..." } else { "" };
    format!("{cut:?}{dots}")
}
