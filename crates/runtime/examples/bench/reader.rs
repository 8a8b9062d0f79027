// SPDX-License-Identifier: Apache-2.0
//! A preempting reader, compared with no reader: a reader of higher priority on the writer's core latches 64 of its values, 10,000 times
//! per second, in the middle of its firings.
use crate::Bench;
use crate::blocks::{Gain, Stopwatch};
use crate::report::{Line, median, time};
use crate::rig::{Image, Rig, core, image, interval, rest, single, step};
use interconnect::ConnectionSpec;
use kernel::*;
use opengpac::FunctionBlock;
use std::sync::Arc;

const BLOCKS: usize = 1_000;
const VALUES: usize = 64;
const FIRINGS: usize = 2_000;
const PERIOD_NS: u64 = 100_000;
/// Priority above the measured source and below the measuring thread.
const PRIORITY: u8 = 65;

pub fn rows(bench: &Bench) {
    let turns: Vec<[f64; 3]> = (0..=bench.rounds).map(|_| turn()).skip(1).collect();
    let of = |column: usize| median(turns.iter().map(|turn| turn[column]));
    let ratio = median(turns.iter().map(|turn| turn[1] / turn[0]));
    Line {
        row: "reader",
        what: format!("{BLOCKS} gains with a reader of {VALUES} values that preempts at 10 kHz"),
        ours: format!("{} a firing", time(of(1))),
        peer: format!("no reader: {}", time(of(0))),
        value: ratio,
        shown: format!("{ratio:.2} ×"),
        bar: None,
        bar_text: "",
        note: format!("a firing of the reader takes its core {}, two switches of thread included", time(of(2))),
    }
    .print();
}

/// Returns the ns per firing without and with the reader, and the ns of CPU time used by each firing of the reader.
fn turn() -> [f64; 3] {
    let rig = Rig::new();
    let chain: Vec<u32> = (0..BLOCKS as u32).collect();
    let image = image(&[Gain::descriptor(); BLOCKS], &chain, &chain.iter().map(|i| i + 1).collect::<Vec<_>>(), BLOCKS + 1);
    let spec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: 8 * VALUES, queue_row_len: 0, queue_depth: 0 };
    let (sender, receiver) = rig.host.connect(&spec);
    let outbound = Outbound::new(sender, image.values[..VALUES].to_vec(), vec![], None);
    let (process, on) = (Process::new(1, 1), interval());
    let mut steps: Vec<Step> = image.blocks.iter().map(|block| step(block.clone(), &on, &process, vec![])).collect();
    steps.push(step(Arc::new(single(u32::MAX - 1, Stopwatch::descriptor())), &on, &process, vec![]));
    let table = Table::new(steps, vec![], vec![outbound], vec![], None);
    rig.carry_out(rig.source, vec![Op::Table(Box::new(table)), Op::StartClock(process), Op::On(on, 1)]);
    rig.burst(FIRINGS / 10);
    let without = rig.burst(FIRINGS) / FIRINGS as f64;
    rest(1_000_000);
    let reader = add_reader(&rig, receiver);
    rig.burst(FIRINGS / 10);
    let before = rig.host.statistics(reader).firings;
    let with = rig.burst(FIRINGS) / FIRINGS as f64;
    let firings = (rig.host.statistics(reader).firings - before).max(1);
    [without, with, (with - without) * FIRINGS as f64 / firings as f64]
}

fn add_reader(rig: &Rig, receiver: kernel::End<dyn interconnect::Receiver>) -> SourceId {
    let kind = SourceKind::Timer { period_ns: PERIOD_NS };
    let spec = SourceSpec { rtp: 0, name: "reader".into(), kind, priority: PRIORITY, core: Some(core()), virtual_cost_ns: 0 };
    let reader = rig.host.add_source(spec).expect("a thread can be made");
    let numbers: Vec<u32> = (0..VALUES as u32).collect();
    let Image { values, blocks } = image(&[Gain::descriptor(); VALUES], &numbers, &numbers.iter().map(|i| i + VALUES as u32).collect::<Vec<_>>(), 2 * VALUES);
    let inbound = Inbound::new(receiver, values[..VALUES].to_vec(), vec![]);
    let (process, on) = (Process::new(2, 2), interval());
    let steps = blocks.iter().map(|block| step(block.clone(), &on, &process, vec![])).collect();
    let table = Table::new(steps, vec![inbound], vec![], vec![], None);
    rig.carry_out(reader, vec![Op::Table(Box::new(table)), Op::StartClock(process), Op::On(on, 1)]);
    reader
}
