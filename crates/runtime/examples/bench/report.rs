// SPDX-License-Identifier: Apache-2.0
//! One line of the table, and statistics.

/// A line of the table, printed as JSON.
pub struct Line<'a> {
    /// Group of the line, by the name passed to `--only`.
    pub row: &'a str,
    pub what: String,
    /// Time of the kernel, as text with a unit.
    pub ours: String,
    /// Peer and its time, as text; empty if there is no peer.
    pub peer: String,
    /// Figure to which the bar applies; also the text of the bar.
    pub value: f64,
    pub shown: String,
    /// Maximum set by the bar; `None` if `DESIGN.md` has no bar.
    pub bar: Option<f64>,
    pub bar_text: &'a str,
    pub note: String,
}

impl Line<'_> {
    pub fn print(&self) {
        let text = |text: &str| format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""));
        let bar = self.bar.map_or("null".to_owned(), |bar| bar.to_string());
        println!(
            "{{\"row\": {}, \"what\": {}, \"ours\": {}, \"peer\": {}, \"value\": {}, \"shown\": {}, \"bar\": {bar}, \"bar_text\": {}, \"note\": {}}}",
            text(self.row),
            text(&self.what),
            text(&self.ours),
            text(&self.peer),
            self.value,
            text(&self.shown),
            text(self.bar_text),
            text(&self.note),
        );
    }
}

/// Returns the minimum.
pub fn least(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::INFINITY, f64::min)
}

/// Returns the median.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    assert!(!values.is_empty(), "a median is of something");
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { (values[middle - 1] + values[middle]) / 2.0 }
}

/// Formats a time as ns, µs or ms with three digits.
pub fn time(ns: f64) -> String {
    match ns {
        _ if ns < 1e3 => format!("{} ns", digits(ns)),
        _ if ns < 1e6 => format!("{} µs", digits(ns / 1e3)),
        _ => format!("{} ms", digits(ns / 1e6)),
    }
}

fn digits(value: f64) -> String {
    match value {
        _ if value < 10.0 => format!("{value:.2}"),
        _ if value < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

/// 1000 as `1,000`.
pub fn thousands(n: usize) -> String {
    let text = n.to_string();
    let mut grouped = String::new();
    for (index, digit) in text.chars().enumerate() {
        if index > 0 && (text.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}
