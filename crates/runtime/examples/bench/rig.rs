// SPDX-License-Identifier: Apache-2.0
//! Test rig for the rows: a host, sources on a pinned core, tables of blocks, bursts of firings.
use crate::blocks::{FIRST_NS, LAST_NS, LEFT};
use kernel::*;
use opengpac::abi::{Descriptor, Item, kind};
use runtime::{ClockKind, Host};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Priority of the measuring thread: above that of its sources, so that requests accumulate while it makes them.
const PRIORITY: u8 = 70;
/// Priority of the sources.
const SOURCE_PRIORITY: u8 = 60;

/// Time that exceeds the duration of most bursts, ns.
pub const BURST_NS: i64 = 8_000_000;

/// Returns the last core that this process may use.
pub fn core() -> usize {
    static CORE: std::sync::OnceLock<usize> = std::sync::OnceLock::new();
    // SAFETY: fills in a local set.
    *CORE.get_or_init(|| unsafe {
        let mut cores: libc::cpu_set_t = std::mem::zeroed();
        libc::sched_getaffinity(0, size_of::<libc::cpu_set_t>(), &mut cores);
        (0..libc::CPU_SETSIZE as usize).rev().find(|core| libc::CPU_ISSET(*core, &cores)).unwrap_or(0)
    })
}

/// Pins this thread to `core`, and gives it a real-time priority; returns false if the priority is not permitted.
pub fn pin(core: usize, priority: u8) -> bool {
    scheduling::pin(core);
    scheduling::prioritise(priority, scheduling::Children::Ordinary)
}

/// A host whose sources and measuring thread share one core.
pub struct Rig {
    pub host: Host,
    pub source: SourceId,
}

impl Rig {
    pub fn new() -> Rig {
        let core = core();
        pin(core, PRIORITY);
        let host = Host::new(ClockKind::Monotonic, Box::new(interconnect::Memory));
        let source = host.add_source(software("measured", core, SOURCE_PRIORITY)).expect("a thread can be made");
        Rig { host, source }
    }

    /// Submits a script and waits until it has been carried out.
    pub fn carry_out(&self, source: SourceId, ops: Vec<Op>) {
        self.host.submit(source, Box::new(Script { id: 1, ops }));
        loop {
            match self.host.poll() {
                Some(Event::Done { .. }) => return,
                Some(_) => {}
                None => self.host.park(None),
            }
        }
    }

    /// Returns the duration of `firings` firings, ns: from the stopwatch of an additional first firing to the stopwatch of the last one.
    pub fn burst(&self, firings: usize) -> f64 {
        LEFT.store(firings as u64 + 1, Ordering::Release);
        for _ in 0..=firings {
            self.host.request(self.source);
        }
        // Checking takes the core from the source, so the sleep is longer than most bursts.
        while LEFT.load(Ordering::Acquire) > 0 {
            rest(BURST_NS);
        }
        while self.host.poll().is_some() {}
        (LAST_NS.load(Ordering::Relaxed) - FIRST_NS.load(Ordering::Relaxed)) as f64
    }
}

/// Sleeps, so that other threads can run.
pub fn rest(ns: i64) {
    let time = libc::timespec { tv_sec: 0, tv_nsec: ns };
    // SAFETY: reads a local struct.
    unsafe { libc::nanosleep(&time, std::ptr::null_mut()) };
}

pub fn software(name: &str, core: usize, priority: u8) -> SourceSpec {
    SourceSpec { rtp: 0, name: name.into(), kind: SourceKind::Software, priority, core: Some(core), virtual_cost_ns: 0 }
}

/// Returns the items of a block.
fn items(descriptor: &'static Descriptor) -> &'static [Item] {
    // SAFETY: a descriptor's table has `item_count` items.
    unsafe { std::slice::from_raw_parts(descriptor.items, descriptor.item_count as usize) }
}

/// Blocks in one extent, side by side, preceded by `values` cells of one double each, as the supervisor lays out a verb instance.
pub struct Image {
    pub values: Vec<Cell>,
    pub blocks: Vec<Arc<Block>>,
}

/// Installs `kinds`. Block i reads value `reads[i]` and writes value `writes[i]`; all values are 1.
pub fn image(kinds: &[&'static Descriptor], reads: &[u32], writes: &[u32], values: usize) -> Image {
    let mut len = 8 * values;
    let places: Vec<usize> = kinds
        .iter()
        .map(|kind| {
            let at = len.next_multiple_of(kind.instance_align as usize);
            len = at + kind.instance_size as usize;
            at
        })
        .collect();
    let extent = Extent::new(len);
    let values: Vec<Cell> = (0..values).map(|at| extent.cell(8 * at, 8)).collect();
    values.iter().for_each(|value| value.store(&1.0f64.to_ne_bytes()));
    let module: Arc<dyn std::any::Any + Send + Sync> = Arc::new(());
    let blocks = kinds.iter().zip(&places).enumerate().map(|(index, (kind, at))| {
        let memory = extent.cell(*at, kind.instance_size as usize);
        let mut block = Block::install(BlockId(index as u32), "b", kind, module.clone(), memory);
        for (item, declared) in items(kind).iter().enumerate() {
            match declared.kind {
                kind::INPUT => block.bind(item, &values[reads[index] as usize]),
                kind::OUTPUT => block.bind(item, &values[writes[index] as usize]),
                _ => {}
            }
        }
        Arc::new(block)
    });
    let blocks = blocks.collect();
    Image { values, blocks }
}

/// Returns a block without bindings.
pub fn single(id: u32, descriptor: &'static Descriptor) -> Block {
    let size = descriptor.instance_size as usize;
    Block::install(BlockId(id), "single", descriptor, Arc::new(()), Extent::new(size).cell(0, size))
}

pub fn step(block: Arc<Block>, activation: &Arc<Activation>, process: &Arc<Process>, drivers: Vec<u32>) -> Step {
    Step { kind: StepKind::Block(block), activation: activation.clone(), process: process.clone(), drivers }
}

pub fn interval() -> Arc<Activation> {
    Activation::new(Due::Interval, None)
}
