// SPDX-License-Identifier: Apache-2.0
//! Checks the numbers in options against the ranges that drivers declare, at every nesting depth, before a driver uses them.
use crate::accepted::accepted;
use crate::option_word::{Inside, Kind, OptionWord, Reach};
use crate::registry::find;
use hints::{Interval, short};
use serde_json::Value;

/// Units of time, each with its length in ns.
const TIMES: [(&str, f64); 4] = [("ns", 1.0), ("us", 1e3), ("ms", 1e6), ("s", 1e9)];

/// A number that is out of range.
#[derive(Debug, PartialEq)]
pub(crate) struct Outside {
    /// Path of the number in the options: `servos.elbow.id`.
    pub path: String,
    /// Human-readable reason.
    pub problem: String,
}

impl OptionWord {
    /// Returns true if the value is a number, or a list of numbers.
    pub fn is_numeric(&self) -> bool {
        matches!(self.kind, Kind::Number | Kind::Whole) || self.kind == Kind::List && (self.range.is_some() || !self.unit.is_empty())
    }

    /// Returns the range; if no range is declared for a time, it must not be negative.
    pub fn interval(&self) -> Interval {
        let least = if matches!(self.unit, "ns" | "s") { 0.0 } else { f64::NEG_INFINITY };
        self.range.unwrap_or(Interval::closed(least, f64::INFINITY))
    }
}

/// Finds the first number in the value of an option that is out of range.
pub(crate) fn outside(at: &str, word: &OptionWord, value: &Value) -> Option<Outside> {
    let path = if at.is_empty() { word.name.to_owned() } else { format!("{at}.{}", word.name) };
    if word.is_numeric()
        && let Some(problem) = problem(word, value)
    {
        return Some(Outside { path, problem });
    }
    match word.inside {
        Inside::Fields(words) => return within(&path, words, value),
        Inside::Entries(words) => {
            let mut entries = entries(value);
            return entries.find_map(|(name, entry)| within(&format!("{path}{name}"), words, entry));
        }
        Inside::Nothing => {}
    }
    let inner = Some(word).filter(|word| word.reach == Reach::Driver).and_then(|_| value["kind"].as_str());
    let of = inner.filter(|kind| !kind.contains('@')).and_then(|kind| find(kind).ok())?;
    accepted(of).find_map(|word| in_table(&format!("{path}.options"), word, &value["options"]))
}

fn within(at: &str, words: &[&[OptionWord]], table: &Value) -> Option<Outside> {
    words.iter().copied().flatten().find_map(|word| in_table(at, word, table))
}

fn in_table(at: &str, word: &OptionWord, table: &Value) -> Option<Outside> {
    table.get(word.name).and_then(|value| outside(at, word, value))
}

/// Returns the entries of a list or table, each with the segment that it adds to the path. An entry of a list is identified by its
/// `name`, or by its index if it has none.
fn entries(value: &Value) -> Box<dyn Iterator<Item = (String, &Value)> + '_> {
    match value {
        Value::Object(table) => Box::new(table.iter().map(|(name, entry)| (format!(".{name}"), entry))),
        Value::Array(list) => Box::new(list.iter().enumerate().map(|(index, entry)| {
            let name = entry["name"].as_str().map_or_else(|| format!("[{index}]"), |name| format!(".{name}"));
            (name, entry)
        })),
        _ => Box::new(std::iter::empty()),
    }
}

/// Returns the reason why a number, or the first invalid number in a list, is refused. Values that are not numbers are refused by the
/// check of their kind.
fn problem(word: &OptionWord, value: &Value) -> Option<String> {
    let range = word.interval();
    match value {
        Value::Array(list) => list.iter().find_map(|value| problem(word, value)),
        _ => value.as_f64().filter(|number| !range.contains(*number)).map(|number| refusal(word, range, number)),
    }
}

fn refusal(word: &OptionWord, range: Interval, number: f64) -> String {
    let meant = meant(word, range, number).map_or_else(String::new, |meant| format!("; {meant}"));
    let (given, range) = (shown(number, word.unit), range.in_words(|end| shown(end, word.unit)));
    format!("it cannot be {given}: its range is {range}{meant}")
}

/// Returns the probable intention and the number to use. Needed because options are numbers without units.
fn meant(word: &OptionWord, range: Interval, number: f64) -> Option<String> {
    if word.unit == "ns" {
        let larger = |(unit, ns): &(&str, f64)| range.contains(number * ns).then(|| format!("give {} for {} {unit}", number * ns, short(number)));
        return TIMES[2..].iter().find_map(larger).filter(|_| number > 0.0);
    }
    let (text, number) = range.meant(number, 0.0, word.unit)?;
    Some(format!("did you mean {text}, which is {}?", short(number)))
}

/// Formats a number with its unit for messages: 10000000 ns becomes 10 ms.
fn shown(number: f64, unit: &str) -> String {
    let (number, unit) = match unit {
        "ns" => TIMES.iter().rev().find(|(_, ns)| number.abs() >= *ns).map_or((number, "ns"), |(unit, ns)| (number / ns, *unit)),
        unit => (number, unit),
    };
    format!("{} {unit}", short(number)).trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const ID: [OptionWord; 1] = [OptionWord::needed("id", Kind::Whole, "its number").within(0.0, 252.0)];
    const MIN: [OptionWord; 1] = [OptionWord::needed("min", Kind::Number, "its end").unit("rad").within(-10.0, 10.0)];
    const SERVO: [OptionWord; 2] = [ID[0], MIN[0]];

    fn refused(word: OptionWord, value: Value) -> (String, String) {
        let Outside { path, problem } = outside("", &word, &value).expect("it is outside");
        (path, problem)
    }

    #[test]
    fn a_number_out_of_its_range_is_named_with_its_path_its_range_and_what_was_meant() {
        let said = |word: OptionWord, value: Value| refused(word, value).1;
        let speed = OptionWord::needed("speed", Kind::Number, "").unit("m/s").above(0.0, 10.0);
        assert_eq!(said(speed, json!(200)), "it cannot be 200 m/s: its range is above 0 m/s to 10 m/s; did you mean 200 mm/s, which is 0.2?");
        assert_eq!(said(speed, json!(0)), "it cannot be 0 m/s: its range is above 0 m/s to 10 m/s");
        let period = OptionWord::needed("period_ns", Kind::Whole, "").unit("ns").within(1e5, 1e10);
        assert_eq!(said(period, json!(10)), "it cannot be 10 ns: its range is 100 us to 10 s; give 10000000 for 10 ms");
        assert_eq!(said(period, json!(-20_000_000)), "it cannot be -20 ms: its range is 100 us to 10 s");
        let time = OptionWord::needed("settle", Kind::Number, "").unit("s");
        assert_eq!(said(time, json!(-0.5)), "it cannot be -0.5 s: its range is at least 0 s");
        let starts = OptionWord::needed("initial", Kind::List, "").unit("rad").within(-7.0, 7.0);
        assert_eq!(said(starts, json!([0, 90])), "it cannot be 90 rad: its range is -7 rad to 7 rad; did you mean 90 deg, which is 1.5708?");
    }

    #[test]
    fn numbers_in_tables_have_their_path() {
        let servos = OptionWord::needed("servos", Kind::Table, "").entries(&[&SERVO]);
        let both = json!({ "shoulder": { "id": 1 }, "elbow": { "id": 2, "min": 90 } });
        assert_eq!(refused(servos, both).0, "servos.elbow.min");
        let axes = OptionWord::needed("axes", Kind::List, "").entries(&[&ID, &MIN]);
        assert_eq!(refused(axes, json!([{ "id": 1 }, { "id": -1 }])).0, "axes[1].id");
        assert_eq!(refused(axes, json!([{ "name": "lift", "min": 1e300 }])).0, "axes.lift.min");
        let one = OptionWord::needed("checksum", Kind::Table, "").fields(&[&SERVO]);
        assert_eq!(refused(one, json!({ "id": 300 })).0, "checksum.id");
        assert!(outside("", &axes, &json!([{ "id": "x" }, 3])).is_none());
    }
}
