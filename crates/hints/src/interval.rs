// SPDX-License-Identifier: Apache-2.0
//! Intervals of numbers, such as `(0, 10]`, and the unit probably meant if a number is far outside its interval.
use std::f64::consts::{PI, TAU};
use std::fmt;
use std::str::FromStr;

/// An interval of numbers, from `least` to `most`. Written `[0, 1]` or `(0, inf)`: a round bracket excludes the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub least: f64,
    pub most: f64,
    /// True if `least` itself is excluded.
    pub is_above: bool,
}

impl Interval {
    /// Every number except NaN.
    pub const ANY: Interval = Interval::closed(f64::NEG_INFINITY, f64::INFINITY);

    /// Returns the interval from `least` to `most`, both included.
    pub const fn closed(least: f64, most: f64) -> Interval {
        Interval { least, most, is_above: false }
    }

    /// Returns the interval from `least`, excluded, to `most`, included.
    pub const fn above(least: f64, most: f64) -> Interval {
        Interval { least, most, is_above: true }
    }

    /// Splits a declared unit: `"rad/s (0, 10]"` is `rad/s` and its interval. An interval that cannot be parsed stays part of the unit.
    pub fn split(declared: &str) -> (&str, Option<Interval>) {
        let read = declared.rfind(['[', '(']).filter(|at| *at == 0 || declared[..*at].ends_with(' ')).and_then(|at| {
            let interval = declared[at..].parse().ok()?;
            Some((declared[..at].trim_end(), Some(interval)))
        });
        read.unwrap_or((declared.trim(), None))
    }

    /// Returns true if the interval contains the number. It never contains NaN.
    pub fn contains(&self, number: f64) -> bool {
        (self.least..=self.most).contains(&number) && !(self.is_above && number == self.least)
    }

    /// Returns a human-readable description: `above 0 to 10`, `at least 0`; `shown` formats a number.
    pub fn in_words(&self, shown: impl Fn(f64) -> String) -> String {
        match *self {
            Interval { least: f64::NEG_INFINITY, most: f64::INFINITY, .. } => "every number".to_owned(),
            Interval { least, most: f64::INFINITY, is_above } => format!("{} {}", if is_above { "above" } else { "at least" }, shown(least)),
            Interval { least: f64::NEG_INFINITY, most, .. } => format!("at most {}", shown(most)),
            Interval { least, most, is_above } => format!("{}{} to {}", if is_above { "above " } else { "" }, shown(least), shown(most)),
        }
    }

    /// Returns the probable meaning of a number without a unit that is far outside the interval, but would be inside it in a smaller
    /// unit. The result contains the meaning as text (`200 mm/s`), and the number converted to `unit`. The interval applies to the sum of
    /// `from` and the number.
    pub fn meant(&self, given: f64, from: f64, unit: &str) -> Option<(String, f64)> {
        let beyond = (from + given - self.most).max(self.least - (from + given));
        let width = if unit.contains("rad") { (self.most - self.least).max(TAU) } else { self.most - self.least };
        let (smaller, factor) = smaller(unit).filter(|_| beyond >= width)?;
        self.contains(from + given * factor).then(|| (format!("{} {smaller}", short(given)), given * factor))
    }
}

/// Returns the unit that was probably meant if a number without a unit is far too large: degrees for rad, mm for m, ms for s, g for kg.
fn smaller(unit: &str) -> Option<(String, f64)> {
    let (above, below) = unit.split_once('/').map_or((unit, String::new()), |(above, below)| (above, format!("/{below}")));
    let (smaller, factor) = match above {
        "rad" => ("deg", PI / 180.0),
        "m" => ("mm", 1e-3),
        "s" => ("ms", 1e-3),
        "kg" => ("g", 1e-3),
        _ => return None,
    };
    Some((format!("{smaller}{below}"), factor))
}

/// Formats a number for display, with at most six digits.
pub fn short(number: f64) -> String {
    if number != 0.0 && number.is_finite() && !(1e-4..1e9).contains(&number.abs()) {
        return format!("{number:e}");
    }
    let digits = 5 - number.abs().max(1e-9).log10().floor().clamp(0.0, 5.0) as usize;
    let text = format!("{number:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

impl FromStr for Interval {
    /// Human-readable message.
    type Err = String;

    fn from_str(text: &str) -> Result<Interval, String> {
        let wrong = || format!("the range '{text}' cannot be read; write, for example, '[0, 1]' or '(0, inf)'");
        let inside = text.strip_prefix(['[', '(']).and_then(|rest| rest.strip_suffix([']', ')'])).ok_or_else(wrong)?;
        let (least, most) = inside.split_once(',').ok_or_else(wrong)?;
        let end = |text: &str| text.trim().parse::<f64>().ok().filter(|end| !end.is_nan());
        match (end(least), end(most)) {
            (Some(least), Some(most)) if least < most && (text.ends_with(']') || most == f64::INFINITY) => {
                Ok(Interval { least, most, is_above: text.starts_with('(') })
            }
            _ => Err(wrong()),
        }
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (open, close) = (if self.is_above { '(' } else { '[' }, if self.most.is_infinite() { ')' } else { ']' });
        write!(f, "{open}{}, {}{close}", self.least, self.most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_is_its_text() {
        for text in ["[0, 1]", "(0, inf)", "[-inf, inf)", "(-0.5, 10]"] {
            assert_eq!(text.parse::<Interval>().map(|read| read.to_string()), Ok(text.to_owned()));
        }
        for unreadable in ["[1, 0]", "[0, nan]", "[0; 1]", "[0, 1)", "0, 1", ""] {
            assert!(unreadable.parse::<Interval>().is_err(), "{unreadable}");
        }
    }

    #[test]
    fn a_number_in_the_unit_of_the_drawing_is_recognised() {
        let speed: Interval = "(0, 10]".parse().expect("an interval");
        assert_eq!(speed.meant(200.0, 0.0, "m/s"), Some(("200 mm/s".to_owned(), 0.2)));
        assert_eq!(speed.meant(11.0, 0.0, "m/s"), None);
        assert_eq!(speed.in_words(short), "above 0 to 10");
        assert_eq!([0.1 + 0.2, 1e12, 2.0 / 3.0, 0.0, f64::INFINITY].map(short), ["0.3", "1e12", "0.66667", "0", "inf"]);
    }
}
