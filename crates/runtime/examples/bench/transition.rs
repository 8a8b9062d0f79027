// SPDX-License-Identifier: Apache-2.0
//! A transition, timed from the last step of the firing in which the condition was met to the first step of the next firing, in which the
//! new process runs. The next firing is requested beforehand, so that only publication, the transition, the event to the supervisor, and
//! the start of a firing lie between the two steps.
use crate::Bench;
use crate::blocks::{Every, MARKED, MARKS, Marker, WatchedGain};
use crate::report::{Line, median, thousands, time};
use crate::rig::{BURST_NS, Image, Rig, image, interval, rest, single, step};
use kernel::*;
use opengpac::FunctionBlock;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Number of firings in a burst; also the number of firings per transition.
const FIRINGS: usize = 400;
const PERIOD: usize = 4;
/// Indices of the conditions of `WatchedGain` and of `Every`.
const BROKEN: u8 = 3;
const REACHED: u8 = 1;
const CONDITIONS: usize = 100;
const EVERY: u32 = 1_000_000;

pub fn rows(bench: &Bench) {
    for (n, apart) in [(10, true), (100, true), (100, false)] {
        measure(bench, n, apart);
    }
}

/// Measures a transition with `n` blocks out and `n` blocks in, each activated by a separate command (`apart`) or all as one graph.
fn measure(bench: &Bench, n: usize, apart: bool) {
    let rig = Rig::new();
    let (reads, writes): (Vec<u32>, Vec<u32>) = ((0..2 * n as u32).collect(), (2 * n as u32..4 * n as u32).collect());
    let image = image(&vec![WatchedGain::descriptor(); 2 * n], &reads, &writes, 4 * n);
    let process = Process::new(1, 1);
    let activations: Vec<Vec<Arc<Activation>>> = (0..2).map(|_| if apart { (0..n).map(|_| interval()).collect() } else { vec![interval()] }).collect();
    process.set_stages((0..2).map(|from| stage(&image, &activations, n, from)).collect());
    let always = interval();
    let mut ops = vec![Op::Table(Box::new(table(&image, &activations, &always, &process, n))), Op::On(always, 1)];
    ops.extend([Op::Stage { process: process.clone(), stage: 0, generation: Some(1) }, Op::StartClock(process.clone())]);
    ops.extend(activations[0].iter().map(|activation| Op::On(activation.clone(), 1)));
    rig.carry_out(rig.source, ops);
    let (mut with, mut without) = (Vec::new(), Vec::new());
    for round in 0..=bench.rounds {
        let (these, those) = burst(&rig);
        if round > 0 {
            with.push(median(these));
            without.push(median(those));
        }
        rest(1_000_000);
    }
    let (with, without) = (median(with), median(without));
    Line {
        row: "transition",
        what: format!("{} blocks out and in, {}, {CONDITIONS} conditions watched", thousands(n), if apart { "each by a command" } else { "as one graph" }),
        ours: time(with),
        peer: format!("no transition: {}", time(without)),
        value: with,
        shown: time(with),
        bar: Some(5_000.0),
        bar_text: "≤ 5 µs",
        note: "last step of a firing to first step of the next".into(),
    }
    .print();
}

/// Returns the watches of one stage: 99 conditions that are never met, then the condition that is met.
fn stage(image: &Image, activations: &[Vec<Arc<Activation>>], n: usize, from: usize) -> Stage {
    let of_blocks = (0..CONDITIONS - 1).map(|index| Watch {
        block: Some(image.blocks[from * n + index % n].id()),
        item: BROKEN,
        condition: index as u16,
        priority: 0,
        response: Response::Tell,
    });
    let off = activations[from].iter().map(|activation| Op::Off(activation.clone()));
    let on = activations[1 - from].iter().map(|activation| Op::On(activation.clone(), 1));
    let script = Arc::new(Script { id: 0, ops: off.chain(on).collect() });
    let response = Response::React { script, next: Some(1 - from as u16) };
    let reached = Watch { block: Some(BlockId(EVERY)), item: REACHED, condition: CONDITIONS as u16, priority: 0, response };
    Stage { watches: of_blocks.chain([reached]).collect() }
}

/// Builds a table that contains a marker, the blocks of both lists, the reporting block, and a second marker.
fn table(image: &Image, activations: &[Vec<Arc<Activation>>], always: &Arc<Activation>, process: &Arc<Process>, n: usize) -> Table {
    let every = Arc::new(single(EVERY, Every::descriptor()));
    let marker = |id| step(Arc::new(single(id, Marker::descriptor())), always, process, vec![]);
    let mut steps = vec![marker(EVERY + 1)];
    for (list, activations) in activations.iter().enumerate() {
        steps.extend((0..n).map(|index| step(image.blocks[list * n + index].clone(), &activations[index % activations.len()], process, vec![])));
    }
    steps.push(step(every, always, process, vec![]));
    steps.push(marker(EVERY + 2));
    Table::new(steps, vec![], vec![], vec![], None)
}

/// Runs a burst and returns the gaps after firings with a transition, and those after firings without one.
fn burst(rig: &Rig) -> (Vec<f64>, Vec<f64>) {
    MARKED.store(0, Ordering::Release);
    for _ in 0..FIRINGS {
        rig.host.request(rig.source);
    }
    while MARKED.load(Ordering::Acquire) < 2 * FIRINGS as u64 {
        rest(BURST_NS);
    }
    while rig.host.poll().is_some() {}
    let mark = |place: usize| MARKS[place].load(Ordering::Relaxed);
    let gaps = (0..FIRINGS - 1).map(|firing| ((firing + 1) % PERIOD == 0, (mark(2 * firing + 2) - mark(2 * firing + 1)) as f64));
    let (with, without): (Vec<_>, Vec<_>) = gaps.partition(|(transition, _)| *transition);
    (with.into_iter().map(|(_, gap)| gap).collect(), without.into_iter().map(|(_, gap)| gap).collect())
}
