// SPDX-License-Identifier: Apache-2.0
//! Ranges of values: declared after a unit, `"rad/s (0, 10]"`, and checked wherever a value enters. A refusal suggests the unit that was
//! probably intended.
use crate::quantity::number_in;
use crate::refusal::{Class, Refusal};
use crate::value::Value;
use hints::Interval;
pub(crate) use hints::short;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Maximum absolute value of numbers with a unit, unless a narrower range is declared.
const FARTHEST: f64 = 1e15;

/// Maximum absolute coordinate of a goal pose in its frame, m.
const POSE_REACH: f64 = 1000.0;

/// Tolerance for the norm of a unit quaternion.
const LENGTH_TOLERANCE: f64 = 1e-3;

/// Permitted values of an item. As text: `[0, 1]`, `(0, inf)`, `[pose]`; a parenthesis excludes the bound.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(with = "String"))]
#[serde(try_from = "String", into = "String")]
pub enum Range {
    /// Numbers in an interval.
    Interval(Interval),
    /// Seven numbers: x, y, z in m, and a unit quaternion w, x, y, z.
    Pose,
}

impl Range {
    /// Any finite number.
    pub const ANY: Range = Range::closed(f64::NEG_INFINITY, f64::INFINITY);

    /// Returns the range from `least` to `most`, inclusive.
    pub const fn closed(least: f64, most: f64) -> Range {
        Range::Interval(Interval::closed(least, most))
    }

    /// Splits a declared unit: `"rad/s (0, 10]"` into `rad/s` and its range. A range that cannot be parsed is left in the unit, which
    /// [`check_unit`](crate::quantity::check_unit) then refuses.
    pub fn split(declared: &str) -> (&str, Option<Range>) {
        let begin = declared.rfind(['[', '(']).filter(|at| *at == 0 || declared[..*at].ends_with(' '));
        let read = begin.and_then(|at| Some((declared[..at].trim_end(), declared[at..].parse().ok()?)));
        let declared = declared.trim();
        read.map_or((declared, None), |(unit, range)| (unit, Some(range)))
    }

    /// Returns the minimum and maximum if both are finite.
    pub fn ends(&self) -> Option<(f64, f64)> {
        match *self {
            Range::Interval(Interval { least, most, .. }) if least.is_finite() && most.is_finite() => Some((least, most)),
            _ => None,
        }
    }

    /// Returns the bounds if the lower one exceeds the upper one, or if either is NaN.
    pub fn reversed(&self) -> Option<(f64, f64)> {
        match *self {
            Range::Interval(Interval { least, most, .. }) if least > most || least.is_nan() || most.is_nan() => Some((least, most)),
            _ => None,
        }
    }

    /// Returns true if a number is within the range. NaN is never within a range.
    pub fn contains(&self, number: f64) -> bool {
        match self {
            Range::Interval(interval) => interval.contains(number),
            Range::Pose => number.is_finite(),
        }
    }

    /// Checks all numbers of a value whose unit is `unit`. Values that are not numbers are left to the type check.
    ///
    /// # Errors
    /// `OutOfRange` with `what`, the number, the range, and the value that was probably intended.
    pub fn check(&self, what: &str, unit: &str, value: &Value) -> Result<(), Refusal> {
        match (self, value) {
            (Range::Pose, Value::List(numbers)) if !numbers.iter().any(|n| matches!(n, Value::List(_))) => check_pose(what, numbers),
            (_, Value::List(elements)) => elements.iter().try_for_each(|element| self.check(what, unit, element)),
            (Range::Pose, _) => Ok(()),
            (range, value) => {
                let given = match value {
                    Value::Text(text) => number_in(text, unit).ok(),
                    other => number(other),
                };
                match given.filter(|given| !range.contains(*given)) {
                    Some(given) => Err(range.refusal(what, unit, given, is_plain(value), "")),
                    None => Ok(()),
                }
            }
        }
    }

    /// Returns the refusal of a number; `whence` describes the origin of the bounds.
    pub fn refusal(&self, what: &str, unit: &str, given: f64, is_plain: bool, whence: &str) -> Refusal {
        let shown = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let whence = if whence.is_empty() { String::new() } else { format!(" ({whence})") };
        let message = format!("{what} cannot be {}{shown}: its range is {}{shown}{whence}", short(given), self.in_words());
        let meant = self.meant(given, 0.0, unit).filter(|_| is_plain);
        Refusal::new(Class::OutOfRange, message).remedy(meant.unwrap_or_else(|| "give a value within the range".to_owned()))
    }

    fn in_words(&self) -> String {
        match self {
            Range::Interval(interval) => interval.in_words(short),
            Range::Pose => "a position in m and a unit quaternion".to_owned(),
        }
    }

    /// Returns a question for a plain number that is far outside the range but would be within it in a smaller unit: `did you mean '200
    /// mm/s'?`. The range applies to the sum of `from` and the number.
    pub fn meant(&self, given: f64, from: f64, unit: &str) -> Option<String> {
        let Range::Interval(interval) = self else { return None };
        let (meant, _) = interval.meant(given, from, unit)?;
        Some(format!("did you mean '{meant}'?"))
    }
}

/// Returns the default range of numbers in this unit. Without a unit, any finite number is allowed.
pub fn plausible(unit: &str) -> Range {
    if unit.is_empty() { Range::ANY } else { Range::closed(-FARTHEST, FARTHEST) }
}

/// Checks a plain number that is an angle of an orientation, rad: at most one turn in either direction.
///
/// # Errors
/// `OutOfRange` if degrees were probably intended.
pub fn check_angle(what: &str, angle: f64) -> Result<(), Refusal> {
    let range = Range::closed(-std::f64::consts::TAU, std::f64::consts::TAU);
    if range.contains(angle) {
        return Ok(());
    }
    let refusal = range.refusal(what, "rad", angle, true, "");
    Err(refusal.remedy(format!("did you mean '{} deg'?", short(angle))))
}

fn check_pose(what: &str, numbers: &[Value]) -> Result<(), Refusal> {
    let read: Vec<f64> = numbers.iter().filter_map(number).collect();
    // The type already checks the number of elements, and that they are numbers.
    let &[x, y, z, ref quaternion @ ..] = read.as_slice() else { return Ok(()) };
    if quaternion.len() != 4 || numbers.len() != 7 {
        return Ok(());
    }
    let length = quaternion.iter().map(|q| q * q).sum::<f64>().sqrt();
    if !(1.0 - LENGTH_TOLERANCE..=1.0 + LENGTH_TOLERANCE).contains(&length) {
        let message = format!("{what} has the quaternion {}, whose length is {}", listed(quaternion), short(length));
        return Err(Refusal::new(Class::OutOfRange, message).remedy("give one of length 1, w first; no rotation is 1, 0, 0, 0"));
    }
    match [x, y, z].iter().find(|at| !(-POSE_REACH..=POSE_REACH).contains(*at)) {
        Some(at) => {
            let message = format!("{what} has the position {} m, which is more than {POSE_REACH} m away", listed(&[x, y, z]));
            Err(Refusal::new(Class::OutOfRange, message).remedy(format!("did you mean '{} mm'?", short(*at))))
        }
        None => Ok(()),
    }
}

fn listed(numbers: &[f64]) -> String {
    numbers.iter().map(|number| short(*number)).collect::<Vec<_>>().join(", ")
}

/// Returns a value as a number; `None` if it is not a number.
pub(crate) fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(integer) => Some(*integer as f64),
        Value::Unsigned(integer) => Some(*integer as f64),
        Value::Number(number) => Some(*number),
        _ => None,
    }
}

/// Returns true if a value is a number without a unit of its own.
pub(crate) fn is_plain(value: &Value) -> bool {
    number(value).is_some()
}

impl std::str::FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Range, String> {
        if text == "[pose]" { Ok(Range::Pose) } else { text.parse().map(Range::Interval) }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Range::Interval(interval) => interval.fmt(f),
            Range::Pose => f.write_str("[pose]"),
        }
    }
}

impl TryFrom<String> for Range {
    type Error = String;

    fn try_from(text: String) -> Result<Range, String> {
        text.parse()
    }
}

impl From<Range> for String {
    fn from(range: Range) -> String {
        range.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(declared: &str, value: Value) -> String {
        let (unit, range) = Range::split(declared);
        range.unwrap().check("'x'", unit, &value).map_or_else(|refusal| refusal.to_string(), |()| String::new())
    }

    #[test]
    fn a_range_stands_behind_a_unit() {
        assert_eq!(Range::split("rad/s (0, 10]"), ("rad/s", Some(Range::Interval(Interval::above(0.0, 10.0)))));
        assert_eq!(Range::split("[0, inf)"), ("", Some(Range::closed(0.0, f64::INFINITY))));
        assert_eq!(Range::split("[pose]"), ("", Some(Range::Pose)));
        for unreadable in ["N.m", "", "m[0, 1]", "m [1, 0]", "m [0, nan]", "m [0; 1]", "m [0, 1)"] {
            assert_eq!(Range::split(unreadable), (unreadable, None), "{unreadable}");
        }
        for text in ["[0, 1]", "(0, inf)", "[-inf, inf)", "[pose]", "(-0.5, 10]"] {
            assert_eq!(text.parse::<Range>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn numbers_outside_are_refused_with_what_was_meant() {
        assert_eq!(refused("m/s (0, 10]", Value::Number(0.5)), "");
        assert_eq!(refused("m/s (0, 10]", Value::Text("200 mm/s".into())), "");
        assert_eq!(refused("m/s (0, 10]", Value::Integer(200)), "'x' cannot be 200 m/s: its range is above 0 to 10 m/s; did you mean '200 mm/s'?");
        assert_eq!(
            refused("m/s (0, 10]", Value::Text("200 m/s".into())),
            "'x' cannot be 200 m/s: its range is above 0 to 10 m/s; give a value within the range"
        );
        assert_eq!(refused("rad/s (0, 100]", Value::Number(200.0)), "'x' cannot be 200 rad/s: its range is above 0 to 100 rad/s; did you mean '200 deg/s'?");
        assert_eq!(refused("[0, inf)", Value::Number(-5.0)), "'x' cannot be -5: its range is at least 0; give a value within the range");
        assert_eq!(
            refused("(0, inf)", Value::List(vec![Value::Integer(1), Value::Integer(0)])),
            "'x' cannot be 0: its range is above 0; give a value within the range"
        );
        assert!(refused("[0, 1]", Value::Number(f64::NAN)).starts_with("'x' cannot be NaN"));
    }

    #[test]
    fn a_pose_has_a_unit_quaternion_and_is_within_reach() {
        let pose = |numbers: [f64; 7]| refused("[pose]", Value::List(numbers.iter().map(|n| Value::Number(*n)).collect()));
        assert_eq!(pose([0.4, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0]), "");
        assert!(pose([0.4, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0]).starts_with("'x' has the quaternion 0, 0, 0, 0, whose length is 0; give one of length 1"));
        assert!(pose([4000.0, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0]).ends_with("did you mean '4000 mm'?"));
        assert_eq!(check_angle("'yaw'", 90.0).unwrap_err().to_string(), "'yaw' cannot be 90 rad: its range is -6.28319 to 6.28319 rad; did you mean '90 deg'?");
    }
}
