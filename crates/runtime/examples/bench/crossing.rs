// SPDX-License-Identifier: Apache-2.0
//! A value sent from a source on one core to a source on another core, which it wakes: timed from the writer's body to the reader's body,
//! and compared with a bare word and a futex between two threads.
use crate::Bench;
use crate::blocks::{InputAge, MARKED, MARKS, Stamp, now_ns};
use crate::report::{Line, median, time};
use crate::rig::{Rig, core, interval, pin, rest, single, software, step};
use interconnect::ConnectionSpec;
use kernel::*;
use opengpac::FunctionBlock;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU32, Ordering};

const VALUES: usize = 200;
/// Pause between two values, during which the reader goes to sleep.
const PAUSE_NS: i64 = 200_000;
const PRIORITY: u8 = 60;

pub fn rows(bench: &Bench) {
    if core() == 0 {
        let (what, note) = ("SVV to a source on another core, waking it".to_owned(), "not taken: this process has one core".to_owned());
        return Line {
            row: "crossing", what, ours: String::new(), peer: String::new(), value: 0.0, shown: String::new(), bar: None, bar_text: "≤ 2 ×", note
        }
        .print();
    }
    let mut turns = Vec::new();
    for round in 0..=bench.rounds {
        let (ours, theirs) = (by_kernel(), by_futex());
        if round > 0 {
            turns.push((ours, theirs));
        }
    }
    let ratio = median(turns.iter().map(|(ours, theirs)| ours / theirs));
    Line {
        row: "crossing",
        what: "SVV to a source on another core, waking it".into(),
        ours: time(median(turns.iter().map(|turn| turn.0))),
        peer: format!("bare word and futex: {}", time(median(turns.iter().map(|turn| turn.1)))),
        value: ratio,
        shown: format!("{ratio:.2} ×"),
        bar: Some(2.0),
        bar_text: "≤ 2 ×",
        note: "from the writer's body to the reader's body".into(),
    }
    .print();
}

fn by_kernel() -> f64 {
    let rig = Rig::new();
    let writer = rig.host.add_source(software("writer", core() - 1, PRIORITY)).expect("a thread can be made");
    let spec = ConnectionSpec { writer: writer.0, reader: rig.source.0, asynchronous_len: 8, queue_row_len: 0, queue_depth: 0 };
    let (sender, receiver) = rig.host.connect(&spec);
    let cells: Vec<Cell> = (0..2).map(|_| Extent::new(8).cell(0, 8)).collect();
    let mut stamp = single(1, Stamp::descriptor());
    stamp.bind(0, &cells[0]);
    let mut seen = single(2, InputAge::descriptor());
    seen.bind(0, &cells[1]);
    let table = |block, inbound, outbound, on: &Arc<Activation>, process: &Arc<Process>| {
        Op::Table(Box::new(Table::new(vec![step(Arc::new(block), on, process, vec![])], inbound, outbound, vec![], None)))
    };
    let (on, process) = (interval(), Process::new(1, 1));
    let outbound = Outbound::new(sender, vec![cells[0].clone()], vec![], Some(rig.source));
    rig.carry_out(writer, vec![table(stamp, vec![], vec![outbound], &on, &process), Op::On(on, 1)]);
    let (on, process) = (interval(), Process::new(2, 2));
    let inbound = Inbound::new(receiver, vec![cells[1].clone()], vec![]);
    rig.carry_out(rig.source, vec![table(seen, vec![inbound], vec![], &on, &process), Op::On(on, 1)]);
    MARKED.store(0, Ordering::Release);
    for count in 1..=VALUES as u64 {
        rig.host.request(writer);
        while MARKED.load(Ordering::Acquire) < count {
            rest(PAUSE_NS);
        }
    }
    median((0..VALUES).map(|place| MARKS[place].load(Ordering::Relaxed) as f64))
}

/// Channel as a careful programmer would write it by hand: a word with the value, a counter, and a futex on it.
#[derive(Default)]
struct Word {
    sent_ns: AtomicI64,
    rings: AtomicU32,
    asked: AtomicU32,
    seen: AtomicU32,
}

fn futex(word: &AtomicU32, operation: i32, value: u32) {
    // SAFETY: waits on, or wakes, a word that outlives the call.
    unsafe { libc::syscall(libc::SYS_futex, word.as_ptr(), operation | libc::FUTEX_PRIVATE_FLAG, value, std::ptr::null::<libc::timespec>()) };
}

fn await_change(word: &AtomicU32, from: u32) {
    while word.load(Ordering::Acquire) == from {
        futex(word, libc::FUTEX_WAIT, from);
    }
}

fn by_futex() -> f64 {
    let word = Word::default();
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            pin(core(), PRIORITY);
            let mut gaps = Vec::with_capacity(VALUES);
            for count in 0..VALUES as u32 {
                await_change(&word.rings, count);
                gaps.push((now_ns() - word.sent_ns.load(Ordering::Relaxed)) as f64);
                word.seen.store(count + 1, Ordering::Release);
            }
            median(gaps)
        });
        scope.spawn(|| {
            pin(core() - 1, PRIORITY);
            for count in 0..VALUES as u32 {
                await_change(&word.asked, count);
                word.sent_ns.store(now_ns(), Ordering::Relaxed);
                word.rings.store(count + 1, Ordering::Release);
                futex(&word.rings, libc::FUTEX_WAKE, 1);
            }
        });
        rest(1_000_000);
        for count in 1..=VALUES as u32 {
            word.asked.store(count, Ordering::Release);
            futex(&word.asked, libc::FUTEX_WAKE, 1);
            while word.seen.load(Ordering::Acquire) < count {
                rest(PAUSE_NS);
            }
        }
        reader.join().expect("the reader does not panic")
    })
}
