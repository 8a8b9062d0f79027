// SPDX-License-Identifier: Apache-2.0
//! Nobody sees part of a firing: a writer of 8 to 64 SVVs whose checksum must agree; readers of higher and of lower priority on its core
//! and one on another. Reads that begin inside a firing, and inside a publication, are counted and required.
#![allow(
    clippy::undocumented_unsafe_blocks,
    clippy::macro_metavars_in_unsafe,
    clippy::declare_interior_mutable_const,
    reason = "test blocks are written by hand against the ABI"
)]
mod support;
use interconnect::{Carrier, ConnectionSpec, Full, Header, Memory, Receiver, Sender};
use kernel::*;
use opengpac::abi::{Descriptor, Invocation};
use runtime::{ClockKind, Host};
use std::ffi::c_void;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::SeqCst};
use std::sync::{Arc, Mutex, MutexGuard};
use support::*;

/// State shared by the blocks and the carrier of the single running test. Relaxed ordering would suffice for the counts; this is not a
/// benchmark.
struct TestState {
    /// True while the writer is in its firing; the next while it is in a publication.
    firing: AtomicBool,
    publishing: AtomicBool,
    /// True while the reader of lower priority is in its firing; the next while it is in its latch.
    low_firing: AtomicBool,
    low_latching: AtomicBool,
    readers: [Reader; 3],
    /// Delay added to a publication and a latch, so that others begin inside.
    linger: AtomicU64,
    invocations: AtomicU64,
    newest: AtomicU64,
}

/// Writer firings that one reader met. For the reader of lower priority, which no writer firing can contain: writer firings that began
/// inside its firing, and inside its latch.
struct Reader {
    inside_firing: AtomicU64,
    inside_publication: AtomicU64,
    reads: AtomicU64,
    torn: AtomicU64,
    oldest: AtomicU64,
    first: AtomicU64,
}

const HIGH: usize = 0;
const LOW: usize = 1;
const OTHER: usize = 2;

static SHARED: TestState = {
    const ZERO: AtomicU64 = AtomicU64::new(0);
    const NO: AtomicBool = AtomicBool::new(false);
    const READER: Reader = Reader { inside_firing: ZERO, inside_publication: ZERO, reads: ZERO, torn: ZERO, oldest: ZERO, first: ZERO };
    TestState { firing: NO, publishing: NO, low_firing: NO, low_latching: NO, readers: [READER; 3], linger: ZERO, invocations: ZERO, newest: ZERO }
};

/// Lets one test run at a time, with its state reset.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    let guard = ALONE.lock().unwrap_or_else(|broken| broken.into_inner());
    for reader in &SHARED.readers {
        [&reader.inside_firing, &reader.inside_publication, &reader.reads, &reader.torn, &reader.oldest, &reader.first]
            .into_iter()
            .for_each(|count| count.store(0, SeqCst));
    }
    [&SHARED.linger, &SHARED.invocations, &SHARED.newest].into_iter().for_each(|count| count.store(0, SeqCst));
    [&SHARED.firing, &SHARED.publishing, &SHARED.low_firing, &SHARED.low_latching].into_iter().for_each(|flag| flag.store(false, SeqCst));
    guard
}

fn linger() {
    for _ in 0..SHARED.linger.load(SeqCst) {
        std::hint::spin_loop();
    }
}

/// Memory that marks when it is in a publication, and records inside what a latch begins.
struct WatchedMemory;

struct WatchedSender(Box<dyn Sender>, usize);
struct WatchedReceiver(Box<dyn Receiver>, usize);

impl Carrier for WatchedMemory {
    fn connect(&mut self, spec: &ConnectionSpec) -> (Box<dyn Sender>, Box<dyn Receiver>) {
        let (sender, receiver) = Memory.connect(spec);
        let place = spec.reader as usize - 1;
        (Box::new(WatchedSender(sender, place)), Box::new(WatchedReceiver(receiver, place)))
    }
    fn next_arrival(&self) -> Option<i64> {
        None
    }
    fn deliver(&mut self, _: i64, _: &mut dyn FnMut(u32)) {}
}

impl Sender for WatchedSender {
    fn group(&mut self) -> &mut [u8] {
        SHARED.publishing.store(true, SeqCst);
        linger();
        self.0.group()
    }
    fn publish(&mut self, number: u64, now_ns: i64) {
        self.0.publish(number, now_ns);
        SHARED.publishing.store(false, SeqCst);
        if self.1 == OTHER {
            // After the last publication the firing has ended.
            SHARED.firing.store(false, SeqCst);
        }
    }
    fn push(&mut self, number: u64, now_ns: i64, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full> {
        self.0.push(number, now_ns, fill)
    }
}

impl Receiver for WatchedReceiver {
    fn latch(&mut self, now_ns: i64) -> Option<Header> {
        let reader = &SHARED.readers[self.1];
        if self.1 == LOW {
            SHARED.low_firing.store(true, SeqCst);
            SHARED.low_latching.store(true, SeqCst);
            linger();
        } else {
            reader.inside_firing.fetch_add(u64::from(SHARED.firing.load(SeqCst)), SeqCst);
            reader.inside_publication.fetch_add(u64::from(SHARED.publishing.load(SeqCst)), SeqCst);
        }
        self.0.latch(now_ns)
    }
    fn group(&self) -> &[u8] {
        self.0.group()
    }
    fn peek_row(&mut self) -> Option<(u64, &[u8])> {
        self.0.peek_row()
    }
    fn pop_row(&mut self) -> bool {
        self.0.pop_row()
    }
    fn rows(&self) -> usize {
        self.0.rows()
    }
}

/// Returns SVV i of the writer's firing n.
fn svv(n: i64, i: i64) -> i64 {
    (n ^ (i << 40)).wrapping_mul(0x5851_f42d_4c95_7f2d)
}

/// Returns a block that writes the number of the firing, and starts it.
fn write_number() -> &'static Descriptor {
    block!(|this, _| {
        SHARED.firing.store(true, SeqCst);
        SHARED.readers[LOW].inside_firing.fetch_add(u64::from(SHARED.low_firing.load(SeqCst)), SeqCst);
        SHARED.readers[LOW].inside_publication.fetch_add(u64::from(SHARED.low_latching.load(SeqCst)), SeqCst);
        this.state += 1;
        this.y = this.state;
        SHARED.newest.store(this.state as u64, SeqCst);
        0
    })
}

/// Returns a block that writes the SVV that its parameter selects.
fn write_svv() -> &'static Descriptor {
    block!(|this, _| {
        this.y = svv(this.u, this.parameter);
        0
    })
}

/// Reads the number and the SVVs at its input in place, as many as its parameter states, and counts torn reads.
unsafe extern "C" fn check(instance: *mut c_void, _: *const Invocation) -> u64 {
    let this = unsafe { &mut *instance.cast::<Instance>() };
    this.header.number += 1;
    let (count, place) = ((this.parameter & 0xff) as usize, (this.parameter >> 8) as usize & 3);
    let values = unsafe { std::slice::from_raw_parts(this.input as *const i64, count + 1) };
    let number = values[0];
    let reader = &SHARED.readers[place];
    let torn = number != 0 && (0..count).any(|i| values[i + 1] != svv(number, i as i64)) || number < this.state;
    // The second read of a firing must see the same values as the first.
    let second = this.parameter >> 16 != 0;
    if second {
        reader.torn.fetch_add(u64::from(reader.first.load(SeqCst) != number as u64), SeqCst);
        if place == LOW {
            SHARED.low_firing.store(false, SeqCst);
        }
    } else {
        if place == LOW {
            SHARED.low_latching.store(false, SeqCst);
        }
        reader.first.store(number as u64, SeqCst);
        reader.reads.fetch_add(1, SeqCst);
        reader.oldest.fetch_max(SHARED.newest.load(SeqCst) - number as u64, SeqCst);
    }
    reader.torn.fetch_add(u64::from(torn), SeqCst);
    this.state = number;
    0
}

/// Creates the whole program on `host`: source 0 writes, 1 to 3 read. `idle` further blocks run in each firing of the writer.
fn program(host: &Host, specs: [SourceSpec; 4], svvs: usize, idle: usize) -> [SourceId; 4] {
    let sources = specs.map(|spec| host.add_source(spec).unwrap());
    let image = Extent::new(8 * (svvs + 1));
    let (process, on) = (Process::new(1, 1), interval());
    let cell = |at: usize| image.cell(8 * at, 8);
    let mut steps = vec![step(&Arc::new(install(0, write_number(), None, Some(&cell(0)))), &on, &process, &[])];
    let private = cells(1);
    for at in 0..svvs + idle {
        let output = if at < svvs { cell(at + 1) } else { private[0].clone() };
        let mut block = install(at as u32 + 1, write_svv(), Some(&cell(0)), Some(&output));
        block.set(PARAMETER, &(at as i64).to_ne_bytes());
        steps.push(step(&Arc::new(block), &on, &process, &[]));
    }
    let mut outbound = Vec::new();
    for place in [HIGH, LOW, OTHER] {
        let spec = ConnectionSpec { writer: 0, reader: place as u32 + 1, asynchronous_len: 8 * (svvs + 1), queue_row_len: 0, queue_depth: 0 };
        let (sender, receiver) = host.connect(&spec);
        outbound.push(Outbound::new(sender, (0..=svvs).map(cell).collect(), vec![], None));
        read(host, sources[place + 1], place, svvs, receiver);
    }
    // The image of the first publication, before any firing, has number 0.
    let table = Table::new(steps, vec![], outbound, vec![], None);
    host.submit(sources[0], script(vec![Op::Table(Box::new(table)), Op::On(on, 1)]));
    sources
}

fn read(host: &Host, source: SourceId, place: usize, svvs: usize, receiver: kernel::End<dyn interconnect::Receiver>) {
    let copy = Extent::new(8 * (svvs + 1));
    let (process, on) = (Process::new(2, 2), interval());
    let look = |second: i64| {
        let mut block = install(second as u32, describe(check), Some(&copy.cell(0, 8 * (svvs + 1))), None);
        block.set(PARAMETER, &(second << 16 | (place as i64) << 8 | svvs as i64).to_ne_bytes());
        step(&Arc::new(block), &on, &process, &[])
    };
    let inbound = Inbound::new(receiver, (0..=svvs).map(|at| copy.cell(8 * at, 8)).collect(), vec![]);
    let table = Table::new(vec![look(0), look(1)], vec![inbound], vec![], vec![], None);
    host.submit(source, script(vec![Op::Table(Box::new(table)), Op::On(on, 1)]));
}

fn enough(invocations: u64) -> bool {
    SHARED.invocations.load(SeqCst) >= invocations
        && SHARED.readers.iter().all(|reader| reader.inside_firing.load(SeqCst) >= 1_000 && reader.inside_publication.load(SeqCst) >= 100)
}

fn assert_none_torn(age_max: u64) {
    for (reader, name) in SHARED.readers.iter().zip(["higher", "lower", "other"]) {
        assert!(reader.reads.load(SeqCst) > 0);
        assert_eq!(reader.torn.load(SeqCst), 0, "the reader '{name}' saw part of a firing");
        assert!(reader.oldest.load(SeqCst) <= age_max, "the reader '{name}' read a value {} firings old", reader.oldest.load(SeqCst));
    }
}

/// Runs by seed. The writer costs 90 % of its period, the reader of lower priority 80 % of its own.
fn by_seed(seed: u64, svvs: usize, invocations: u64) -> Vec<[u64; 3]> {
    let _alone = alone();
    let host = Host::new(ClockKind::Virtual { seed }, Box::new(WatchedMemory));
    let spec = |rtp, name, period, priority, virtual_cost_ns| SourceSpec { rtp, virtual_cost_ns, ..timer(name, period, priority) };
    let specs =
        [spec(0, "writer", 100_000, 50, 90_000), spec(0, "high", 17_000, 80, 0), spec(0, "low", 500_000, 20, 400_000), spec(1, "other", 13_000, 50, 5_000)];
    let [writer, ..] = program(&host, specs, svvs, 0);
    while !enough(invocations) {
        assert!(host.fire_next(i64::MAX).unwrap());
        SHARED.invocations.store(host.statistics(writer).firings * (svvs as u64 + 1), SeqCst);
    }
    // Inside a firing a reader sees the previous firing or, on another RTP, whose latch may span several firings, a slightly older one.
    assert_none_torn(8);
    SHARED.readers.iter().map(|reader| [reader.inside_firing.load(SeqCst), reader.inside_publication.load(SeqCst), reader.reads.load(SeqCst)]).collect()
}

#[test]
fn eight_svvs_by_seed() {
    (1..=4).for_each(|seed| drop(by_seed(seed, 8, 1_000_000)));
}

#[test]
fn sixty_four_svvs_by_seed() {
    by_seed(5, 64, 10_000_000);
}

#[test]
fn a_seed_gives_the_same_interleaving_again() {
    assert_eq!(by_seed(9, 8, 10_000), by_seed(9, 8, 10_000));
}

/// Runs with threads if permitted: real preemption on one core, real concurrency with another.
#[test]
fn by_threads_with_real_time_rights() {
    const IDLE: usize = 600;
    const SVVS: usize = 64;
    let _alone = alone();
    // A few microseconds, so that some hundred reads per second begin inside a publication.
    SHARED.linger.store(100, SeqCst);
    let host = Host::new(ClockKind::Monotonic, Box::new(WatchedMemory));
    let spec = |core, name, period, priority| SourceSpec { core: Some(core), ..timer(name, period, priority) };
    // Incommensurable periods: the phases between them take every value.
    let specs = [spec(0, "writer", 101_000, 50), spec(0, "high", 73_000, 80), spec(0, "low", 131_000, 20), spec(1, "other", 67_000, 50)];
    let sources = program(&host, specs, SVVS, IDLE);
    loop {
        if sources.iter().any(|source| host.statistics(*source).rights_missing.iter().any(|missing| missing.starts_with("source"))) {
            eprintln!("no real-time rights: shown by seed alone");
            return;
        }
        SHARED.invocations.store(host.statistics(sources[0]).firings * (SVVS + IDLE + 1) as u64, SeqCst);
        if enough(10_000_000) {
            break;
        }
        host.park(Some(host.now_ns() + 1_000_000));
    }
    host.close();
    // The kernel does not bound the age in firings here: the operating system may keep any thread from its core.
    assert_none_torn(u64::MAX);
}
