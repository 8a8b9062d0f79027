// SPDX-License-Identifier: Apache-2.0
//! Installation of blocks of known types into a running system, up to their first cycle: memory, addresses, a new table with the running
//! and the new blocks, its swap, and its first firing.
use crate::Bench;
use crate::blocks::{MARKED, MARKS, Marker, now_ns};
use crate::report::{Line, median, thousands, time};
use crate::rig::{Image, Rig, core, image, interval, pin, rest, single, step};
use kernel::*;
use opengpac::FunctionBlock;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Priority of the installing thread.
const PRIORITY: u8 = 50;
/// Number of blocks that already run.
const RUNNING: usize = 100;

pub fn rows(bench: &Bench) {
    for (n, bar, bar_text) in [(1, Some(20_000.0), "≤ 20 µs"), (1_000, Some(1_000.0), "≤ 1 µs a block"), (10_000, None, "")] {
        let rounds = bench.rounds * if n == 1 { 20 } else { 2 };
        let times: Vec<f64> = (0..=rounds).map(|_| once(bench, n)).skip(1).collect();
        let each = median(times) / n as f64;
        Line {
            row: "install",
            what: format!("{} {} into a running system, to the first cycle", thousands(n), if n == 1 { "block" } else { "blocks" }),
            ours: format!("{} a block", time(each)),
            peer: String::new(),
            value: each,
            shown: time(each),
            bar,
            bar_text,
            note: format!("{RUNNING} blocks run there already; by the kernel, from a plan"),
        }
        .print();
    }
}

fn once(bench: &Bench, n: usize) -> f64 {
    let rig = Rig::new();
    // Below the priority of the source: a submitted script is taken at once, as a supervisor on another core would see it.
    pin(core(), PRIORITY);
    let gain = bench.loaded.block("gain");
    let chain = |n: usize| -> (Vec<u32>, Vec<u32>) { ((0..n as u32).collect(), (1..=n as u32).collect()) };
    let (reads, writes) = chain(RUNNING);
    let running = image(&[gain; RUNNING], &reads, &writes, RUNNING + 1);
    let (process, on) = (Process::new(1, 1), interval());
    let steps = |image: &Image| -> Vec<Step> { image.blocks.iter().map(|block| step(block.clone(), &on, &process, vec![])).collect() };
    rig.carry_out(rig.source, vec![Op::Table(Box::new(Table::new(steps(&running), vec![], vec![], vec![], None))), Op::On(on.clone(), 1)]);
    rig.host.request(rig.source);
    rest(100_000);
    let (reads, writes) = chain(n);
    let kinds = vec![gain; n];
    MARKED.store(0, Ordering::Release);
    let started_ns = now_ns();
    let added = image(&kinds, &reads, &writes, n + 1);
    let (newcomer, new_on) = (Process::new(2, 2), interval());
    let mut all = steps(&running);
    all.extend(added.blocks.iter().map(|block| step(block.clone(), &new_on, &newcomer, vec![])));
    all.push(step(Arc::new(single(u32::MAX - 1, Marker::descriptor())), &new_on, &newcomer, vec![]));
    let table = Table::new(all, vec![], vec![], vec![], None);
    rig.host.submit(rig.source, Box::new(Script { id: 2, ops: vec![Op::Table(Box::new(table)), Op::StartClock(newcomer), Op::On(new_on, 1)] }));
    rig.host.request(rig.source);
    while MARKED.load(Ordering::Acquire) == 0 {
        rest(100_000);
    }
    (MARKS[0].load(Ordering::Relaxed) - started_ns) as f64
}
