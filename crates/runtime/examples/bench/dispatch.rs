// SPDX-License-Identifier: Apache-2.0
//! Dispatch: cost of one block in a cycle, compared with the same work in a hand-written C loop.
use crate::Bench;
use crate::blocks::{Gain, Pid, Stopwatch};
use crate::loaded::{Loop, Peer};
use crate::report::{Line, least, median, thousands, time};
use crate::rig::{Image, Rig, image, interval, rest, single, step};
use kernel::*;
use opengpac::FunctionBlock;
use opengpac::abi::Descriptor;
use std::sync::Arc;

const SIZES: [usize; 5] = [10, 100, 1_000, 10_000, 100_000];
/// Number of invocations in one burst; also the number of bursts in a round. Bursts are short because the other hardware thread of the
/// core, used by this machine or by a neighbouring one, takes up to a quarter of a burst; among many short bursts, some run undisturbed.
const WORK: usize = 250_000;
const BURSTS: usize = 4;
const KINDS: [&str; 4] = ["gain", "pid", "lowpass", "limit"];

/// Structure of the bindings between blocks.
#[derive(Clone, Copy, PartialEq)]
pub enum Shape {
    /// Each block reads the output of the previous one.
    Chain,
    /// Each block has its own values.
    Independent,
}

/// A measured program.
struct Program<'a> {
    name: &'a str,
    shape: Shape,
    /// Kind of the block at an index.
    kind: fn(usize) -> usize,
    rust: bool,
}

/// Returns kinds in an order without a regular pattern.
fn mixed(index: usize) -> usize {
    ((index as u64 ^ 0x55).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 61) as usize % KINDS.len()
}

pub fn rows(bench: &Bench) {
    let programs = [
        Program { name: "gain in C, chain", shape: Shape::Chain, kind: |_| 0, rust: false },
        Program { name: "gain in Rust, chain", shape: Shape::Chain, kind: |_| 0, rust: true },
        Program { name: "PID in C, chain", shape: Shape::Chain, kind: |_| 1, rust: false },
        Program { name: "PID in Rust, chain", shape: Shape::Chain, kind: |_| 1, rust: true },
        Program { name: "four kinds in C, chain", shape: Shape::Chain, kind: mixed, rust: false },
        Program { name: "gain in C, independent", shape: Shape::Independent, kind: |_| 0, rust: false },
        Program { name: "gain in Rust, independent", shape: Shape::Independent, kind: |_| 0, rust: true },
        Program { name: "PID in C, independent", shape: Shape::Independent, kind: |_| 1, rust: false },
        Program { name: "four kinds in C, independent", shape: Shape::Independent, kind: mixed, rust: false },
    ];
    let rig = Rig::new();
    empty(bench, &rig);
    for program in programs {
        SIZES.iter().for_each(|&n| measure(bench, &rig, &program, n));
    }
    recorded(bench, &rig);
    probed(bench, &rig);
}

pub fn wiring(shape: Shape, n: usize) -> (Vec<u32>, Vec<u32>, usize) {
    let (from, n32) = ((0..n as u32), n as u32);
    match shape {
        Shape::Chain => (from.clone().collect(), from.map(|i| i + 1).collect(), n + 1),
        Shape::Independent => (from.clone().collect(), from.map(|i| n32 + i).collect(), 2 * n),
    }
}

fn descriptor(bench: &Bench, program: &Program, index: usize) -> &'static Descriptor {
    match (program.rust, (program.kind)(index)) {
        (true, 0) => Gain::descriptor(),
        (true, _) => Pid::descriptor(),
        (false, kind) => bench.loaded.block(KINDS[kind]),
    }
}

/// Builds a table of these blocks, in the same way as the supervisor does from a graph, with a stopwatch after them and one connection to
/// another source (its group: the last value). Returns the operations that install and activate it.
pub fn table(rig: &Rig, image: &Image, shape: Shape, rows: Option<Rows>) -> Vec<Op> {
    let (process, first) = (Process::new(1, 1), interval());
    let driven = Activation::new(Due::Driven { by: vec![(first.clone(), 1)] }, None);
    let chained = shape == Shape::Chain;
    let steps = image.blocks.iter().enumerate().map(|(index, block)| {
        let behind = chained && index > 0;
        step(block.clone(), if behind { &driven } else { &first }, &process, if behind { vec![index as u32 - 1] } else { vec![] })
    });
    let stopwatch = Arc::new(single(u32::MAX - 1, Stopwatch::descriptor()));
    let steps = steps.chain([step(stopwatch, &first, &process, vec![])]).collect();
    let spec = interconnect::ConnectionSpec { writer: rig.source.0, reader: 99, asynchronous_len: 8, queue_row_len: 0, queue_depth: 0 };
    let (sender, _) = rig.host.connect(&spec);
    let outbound = Outbound::new(sender, image.values.last().into_iter().cloned().collect(), vec![], None);
    let table = Table::new(steps, vec![], vec![outbound], vec![], rows);
    vec![Op::Table(Box::new(table)), Op::StartClock(process), Op::On(first, 1), Op::On(driven, 1)]
}

/// Measures ns per firing and ns per cycle of each loop, alternating between them.
fn turns(bench: &Bench, rig: &Rig, peer: &Peer, n: usize) -> Vec<[f64; 4]> {
    let firings = (WORK / n).max(10);
    let mut turns = Vec::new();
    for round in 0..=bench.rounds * BURSTS {
        let ours = rig.burst(firings) / firings as f64;
        let theirs = [Loop::Calls, Loop::Checked, Loop::Inlined].map(|by| peer.run(by, firings) / firings as f64);
        rest(1_000_000);
        // The first turn warms up caches and predictors.
        if round > 0 {
            turns.push([ours, theirs[0], theirs[1], theirs[2]]);
        }
    }
    turns
}

fn measure(bench: &Bench, rig: &Rig, program: &Program, n: usize) {
    let (reads, writes, values) = wiring(program.shape, n);
    let descriptors: Vec<_> = (0..n).map(|index| descriptor(bench, program, index)).collect();
    let kinds: Vec<u8> = (0..n).map(|index| (program.kind)(index) as u8).collect();
    let image = image(&descriptors, &reads, &writes, values);
    let peer = bench.loaded.peer(&kinds, &reads, &writes, values);
    rig.carry_out(rig.source, table(rig, &image, program.shape, None));
    let turns = turns(bench, rig, &peer, n);
    // The minimum of each: disturbances only ever slow a program down.
    let of = |column: usize| least(turns.iter().map(|turn| turn[column]));
    let ratio = |column: usize| of(0) / of(column);
    let chained = program.shape == Shape::Chain;
    let bar = if chained { 1.1 } else { 1.2 };
    let by = if program.shape == Shape::Chain { 1 } else { 2 };
    let peers = ["", "calls", "checked calls"];
    Line {
        row: "dispatch",
        what: format!("{}, {} blocks", program.name, thousands(n)),
        ours: format!("{} a block", time(of(0) / n as f64)),
        peer: format!("C loop, {}: {}", peers[by], time(of(by) / n as f64)),
        value: ratio(by),
        shown: format!("{:.2} ×", ratio(by)),
        // Below a thousand blocks the firing itself dominates: the ratio is shown, not judged.
        bar: (n >= 1_000).then_some(bar),
        bar_text: match (n >= 1_000, chained) {
            (true, true) => "≤ 1.1 ×",
            (true, false) => "≤ 1.2 ×",
            _ => "",
        },
        note: format!("calls {:.2} ×, checked {:.2} ×, inlined {:.2} ×", ratio(1), ratio(2), ratio(3)),
    }
    .print();
}

/// Measures a firing without blocks (release, guard, publication and timing), compared with the two clock reads of a bare cycle.
fn empty(bench: &Bench, rig: &Rig) {
    let image = image(&[], &[], &[], 1);
    let peer = bench.loaded.peer(&[], &[], &[], 1);
    rig.carry_out(rig.source, table(rig, &image, Shape::Independent, None));
    let turns = turns(bench, rig, &peer, 100);
    Line {
        row: "dispatch",
        what: "a firing with no block".into(),
        ours: time(median(turns.iter().map(|turn| turn[0]))),
        peer: format!("C loop, two clock reads: {}", time(median(turns.iter().map(|turn| turn[1])))),
        value: median(turns.iter().map(|turn| turn[0])),
        shown: String::new(),
        bar: None,
        bar_text: "",
        note: "what each firing below has beside its blocks".into(),
    }
    .print();
}

/// Measures a chain with every output copied into a row of the ring that the programming system and the recorder read.
fn recorded(bench: &Bench, rig: &Rig) {
    for n in [1_000, 10_000, 100_000] {
        let (reads, writes, values) = wiring(Shape::Chain, n);
        let image = image(&vec![bench.loaded.block("gain"); n], &reads, &writes, values);
        let firings = (WORK / n).max(10);
        let mut turns = Vec::new();
        for round in 0..=bench.rounds {
            let both = [false, true].map(|record| {
                let (writer, _) = interconnect::rows(8 * values, 4);
                let rows = record.then(|| Rows { cells: image.values.clone(), writer: RowsEnd::new(writer) });
                rig.carry_out(rig.source, table(rig, &image, Shape::Chain, rows));
                rig.burst(firings / 10 + 1);
                rig.burst(firings) / firings as f64
            });
            rest(1_000_000);
            if round > 0 {
                turns.push(both);
            }
        }
        let ratio = median(turns.iter().map(|[without, with]| with / without));
        Line {
            row: "dispatch",
            what: format!("gain in C, chain, {} blocks, every output recorded", thousands(n)),
            ours: format!("{} a block", time(median(turns.iter().map(|turn| turn[1])) / n as f64)),
            peer: format!("unrecorded: {}", time(median(turns.iter().map(|turn| turn[0])) / n as f64)),
            value: ratio,
            shown: format!("{ratio:.2} ×"),
            bar: Some(2.0),
            bar_text: "≤ 2 ×",
            note: format!("{} more a value", time(median(turns.iter().map(|[without, with]| (with - without).max(0.0))) / n as f64)),
        }
        .print();
    }
}

/// Measures a chain while the run times of blocks are inspected: the probe visits one block per firing.
fn probed(bench: &Bench, rig: &Rig) {
    const LOOK_NS: u64 = 100_000_000;
    for n in [1_000, 10_000, 100_000] {
        let (reads, writes, values) = wiring(Shape::Chain, n);
        let image = image(&vec![bench.loaded.block("gain"); n], &reads, &writes, values);
        let firings = (WORK / n).max(10);
        rig.carry_out(rig.source, table(rig, &image, Shape::Chain, None));
        let mut turns = Vec::new();
        for round in 0..=bench.rounds {
            let without = rig.burst(firings) / firings as f64;
            rig.host.probe(rig.source, LOOK_NS);
            let with = rig.burst(firings) / firings as f64;
            while rig.host.probes(rig.source) {
                rest(1_000_000);
            }
            if round > 0 {
                turns.push([without, with]);
            }
        }
        let ratio = median(turns.iter().map(|[without, with]| with / without));
        Line {
            row: "dispatch",
            what: format!("gain in C, chain, {} blocks, a probe visits one", thousands(n)),
            ours: format!("{} a block", time(median(turns.iter().map(|turn| turn[1])) / n as f64)),
            peer: format!("unvisited: {}", time(median(turns.iter().map(|turn| turn[0])) / n as f64)),
            value: ratio,
            shown: format!("{ratio:.2} ×"),
            bar: Some(1.2),
            bar_text: "≤ 1.2 ×",
            note: format!("{} more a firing", time(median(turns.iter().map(|[without, with]| (with - without).max(0.0))))),
        }
        .print();
    }
}
