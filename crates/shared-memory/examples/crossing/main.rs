// SPDX-License-Identifier: Apache-2.0
//! Times of a publication and of a row to another thread and to another process, as JSON lines for `bench/run.py`.
//!
//!     crossing ROUNDS [threads] [processes]
//!
//! A polled time is half a round trip of a group and an equal one that returns; both sides copy all values in and out. A waking time is
//! measured from before the push to the call that raises the reader. Each is measured alternately with its peers, on the same two cores,
//! at real-time priority if permitted: a bare word in memory followed by the values, a bare futex, and the publish-subscribe and event
//! services of iceoryx2.
mod far;
mod place;
mod polled;
#[path = "../../../runtime/examples/bench/report.rs"]
mod report;
mod waking;
mod wires;

use report::Line;
use wires::{Connections, PublishSubscribe, Word};

/// Numbers of doubles in a group.
const SIZES: [usize; 4] = [1, 8, 100, 1_000];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["far", kind, len, run, core] => {
            place::pin(core.parse().expect("a core"));
            serve(kind, len.parse().expect("a length"), run.parse().expect("a number"));
        }
        [rounds, only @ ..] => {
            let rounds = rounds.parse().expect("ROUNDS is a number");
            let wanted = |row: &str| only.is_empty() || only.contains(&row);
            if place::core() == 0 {
                return not_taken();
            }
            if wanted("threads") {
                SIZES.iter().for_each(|values| polled::between_threads(*values, rounds));
            }
            if wanted("processes") {
                SIZES.iter().for_each(|values| polled::between_processes(*values, rounds));
                waking::between_processes(rounds);
            }
            place::clear();
        }
        [] => {
            eprintln!("crossing ROUNDS [threads] [processes]");
            std::process::exit(2);
        }
    }
}

/// Runs the far process until its input ends.
fn serve(kind: &str, len: usize, run: u64) {
    match kind {
        "connections" => far::bursts(Connections::shared(1, len, run), len),
        "word" => far::bursts(Word::new("processes", 1, len, run), len),
        "publish-subscribe" => far::bursts(PublishSubscribe::new(1, len, run), len),
        _ => waking::serve(kind, run),
    }
}

fn not_taken() {
    Line {
        row: "processes",
        what: "publication to another core".into(),
        ours: String::new(),
        peer: String::new(),
        value: 0.0,
        shown: String::new(),
        bar: None,
        bar_text: "",
        note: "not taken: this process has one core".into(),
    }
    .print();
}

/// Prints a line that compares times measured alternately: the median of each side, and the median of the ratios.
fn compare(row: &str, what: &str, beside: &str, turns: &[(f64, f64)], bar: Option<(f64, &str)>, note: &str) {
    let ratio = report::median(turns.iter().map(|(ours, theirs)| ours / theirs));
    let median = |of: fn(&(f64, f64)) -> f64| report::time(report::median(turns.iter().map(of)));
    Line {
        row,
        what: what.into(),
        ours: median(|turn| turn.0),
        peer: format!("{beside}: {}", median(|turn| turn.1)),
        value: ratio,
        shown: format!("{ratio:.2} ×"),
        bar: bar.map(|bar| bar.0),
        bar_text: bar.map_or("", |bar| bar.1),
        note: note.into(),
    }
    .print();
}
