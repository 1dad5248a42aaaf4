//! Parsers of values: items of lists that commas part, without blanks around them; files with
//! frames.

use std::ffi::OsString;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use clap::builder::{OsStringValueParser, TypedValueParser};

/// A parser of whole numbers in a range.
pub fn within<T>(range: RangeInclusive<T>) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Display + Clone,
{
    move |text| {
        let number = text.trim().parse().ok();
        let fitting = number.filter(|number| range.contains(number));
        let (least, most) = (range.start(), range.end());
        fitting.ok_or_else(|| format!("expected whole numbers from {least} to {most}"))
    }
}

/// A parser of what begins with a file's name, which need not be UTF-8.
pub fn with_file<T>() -> impl TypedValueParser<Value = T>
where
    T: TryFrom<OsString, Error = String> + Clone + Send + Sync + 'static,
{
    OsStringValueParser::new().try_map(T::try_from)
}

/// A name.
pub fn name(text: &str) -> Result<String, String> {
    match text.trim() {
        "" => Err("expected a name between the commas".into()),
        name => Ok(name.into()),
    }
}
