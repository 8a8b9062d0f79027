// SPDX-License-Identifier: Apache-2.0
//! Dispatch against hand-written C loops: one JSON object a line. Ratios only mean something within one run: what is compared is
//! measured in turns (A B C D A B C D …), of each the median round counts.
//!
//! `cargo run --release -p kernel --example bench_dispatch`
mod dispatch;
mod loops;
mod transition;

fn main() {
    let module = loops::Module::load();
    let rounds = std::env::args().nth(1).and_then(|rounds| rounds.parse().ok()).unwrap_or(5);
    dispatch::run(&module, rounds);
    dispatch::preempted(&module, rounds);
    transition::run(&module, rounds);
}

/// The median of each column of `rounds` rounds of `measures`, run in turns.
fn in_turns(rounds: usize, measures: &mut [Box<dyn FnMut() -> f64 + '_>]) -> Vec<f64> {
    let mut columns = vec![Vec::new(); measures.len()];
    for _ in 0..rounds {
        for (measure, column) in measures.iter_mut().zip(&mut columns) {
            column.push(measure());
        }
    }
    columns.into_iter().map(median).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
