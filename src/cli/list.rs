//! Items of lists that commas part; blanks around them are no part of them.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

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

/// A name.
pub fn name(text: &str) -> Result<String, String> {
    match text.trim() {
        "" => Err("expected a name between the commas".into()),
        name => Ok(name.into()),
    }
}
