// SPDX-License-Identifier: Apache-2.0
//! A firing ended by its budget at any instant: the stored values of a block come from one invocation and have the number of that
//! invocation.
//!
//! `OPENGPAC_BUDGET_FAULTS=100000 OPENGPAC_SEED=7 cargo test -p kernel --test stores -- --nocapture` is the large campaign.
#![allow(clippy::undocumented_unsafe_blocks, reason = "a timer that raises a signal, and a module that is loaded by hand")]
#[path = "support/modules.rs"]
mod by_hand;
mod support;
use kernel::*;
use modules::fused::fuse;
use opengpac::abi::{Descriptor, kind};
use opengpac::{FunctionBlock, Invocation, Outcome};
use runtime::{Host, groups};
use std::ffi::CStr;
use std::path::Path;
use std::sync::{Arc, Once};
use std::time::Instant;
use support::*;

const MS: i64 = 1_000_000;

/// Fills wide outputs with the number of the invocation: y = number.
#[derive(FunctionBlock)]
struct Wide {
    /// first output
    #[output]
    a: [f64; 2000],
    /// second output
    #[output]
    b: [f64; 2000],
}

impl opengpac::Step for Wide {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        (self.a, self.b) = ([invocation.number as f64; 2000], [invocation.number as f64; 2000]);
        Outcome::Done
    }
}

/// Returns the same block in C, built as a user's module is.
fn in_c() -> &'static Descriptor {
    by_hand::blocks_of("wide", &by_hand::AS_A_USER)[0]
}

/// The outputs of a block: their storage and their stamp.
struct StoredOutputs {
    block: Arc<Block>,
    cells: Vec<Cell>,
    stamp: Cell,
}

impl StoredOutputs {
    /// Creates a stored block. `before` is the cell that its input reads, if it has one.
    fn new(id: u32, descriptor: &'static Descriptor, before: Option<&Cell>) -> StoredOutputs {
        let memory = Extent::new(descriptor.instance_size as usize).cell(0, descriptor.instance_size as usize);
        let mut block = Block::install(BlockId(id), &format!("b{id}"), descriptor, Arc::new(()), memory);
        let mut cells = Vec::new();
        for (item, declared) in block.items().iter().enumerate() {
            let own = || Extent::new(declared.size as usize).cell(0, declared.size as usize);
            if declared.kind == kind::OUTPUT {
                cells.push(own());
            }
            let input = || before.cloned().unwrap_or_else(own);
            block.bind(item, &if declared.kind == kind::OUTPUT { cells[cells.len() - 1].clone() } else { input() });
        }
        let stamp = Extent::new(24).cell(0, 24);
        stamp.store(&unstamped());
        StoredOutputs { block: Arc::new(block), cells, stamp }
    }

    /// Returns the number that every reader would see; fails if it does not match the values.
    fn number(&self) -> Result<u64, String> {
        let stamp = self.stamp.load();
        let number = u64::from_ne_bytes(stamp[..8].try_into().unwrap());
        for (at, cell) in self.cells.iter().enumerate() {
            let bytes = cell.load();
            let values = bytes.chunks_exact(8).map(|bytes| f64::from_ne_bytes(bytes.try_into().unwrap()));
            if let Some((index, value)) = values.enumerate().find(|(_, value)| *value != number as f64) {
                return Err(format!("element {index} of output {at} of {:?} is of invocation {value}, its number is {number}", self.block.id()));
            }
        }
        Ok(number)
    }
}

/// A timer that sends SIGXCPU to this thread: the containment takes it for a spent budget without looking at a clock.
struct Alarm(libc::timer_t);

impl Alarm {
    fn new() -> Alarm {
        unsafe {
            let mut event: libc::sigevent = std::mem::zeroed();
            event.sigev_notify = libc::SIGEV_THREAD_ID;
            event.sigev_signo = libc::SIGXCPU;
            event.sigev_notify_thread_id = libc::syscall(libc::SYS_gettid) as i32;
            let mut timer = std::mem::zeroed();
            assert_eq!(libc::timer_create(libc::CLOCK_MONOTONIC, &mut event, &mut timer), 0);
            Alarm(timer)
        }
    }

    fn set(&self, in_ns: i64) {
        let time = |ns| libc::timespec { tv_sec: 0, tv_nsec: ns };
        let once = libc::itimerspec { it_interval: time(0), it_value: time(in_ns.max(1)) };
        assert_eq!(unsafe { libc::timer_settime(self.0, 0, &once, std::ptr::null_mut()) }, 0);
    }
}

impl Drop for Alarm {
    fn drop(&mut self) {
        unsafe { libc::timer_delete(self.0) };
    }
}

struct Program {
    host: Host,
    source: SourceId,
    stored: Vec<StoredOutputs>,
    now_ns: i64,
}

impl Program {
    fn new(kinds: &[&'static Descriptor]) -> Program {
        let host = virtual_host(1);
        let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
        let mut stored: Vec<StoredOutputs> = Vec::new();
        for (kind, id) in kinds.iter().zip(1..) {
            let next = StoredOutputs::new(id, kind, stored.last().map(|before| &before.cells[0]));
            stored.push(next);
        }
        let (process, activation) = (Process::new(1, 1), Activation::with_budget(Due::Interval, None, Some(1)));
        let steps = stored.iter().map(|stored| step(&stored.block, &activation, &process, &[])).collect();
        let stamped = stored.iter().map(|of| StampedValue { block: of.block.clone(), ratio: 1, stamp: of.stamp.clone(), history: None }).collect();
        let fused = |blocks: &[&Arc<Block>]| groups(blocks).into_iter().map(|group| (group.blocks, fuse(&group.members).unwrap())).collect();
        let table = support::table(steps).with_stamped(stamped).fused(fused);
        host.submit(source, script(vec![Op::Table(Box::new(table)), Op::On(activation, 1)]));
        Program { host, source, stored, now_ns: 0 }
    }

    /// Runs one firing; returns the block in which its budget ended it.
    fn fire(&mut self) -> Option<BlockId> {
        self.now_ns += MS;
        assert!(self.host.fire_next(self.now_ns).unwrap());
        let mut ended = None;
        for event in events(&self.host) {
            if let Event::Stopped { block, fault, .. } = event {
                assert_eq!(fault, Fault::Budget);
                ended = Some(block);
            }
        }
        ended
    }

    /// Returns the duration of a firing, plus a margin. The watchdog of the program watches this source too, and every firing exceeds its
    /// budget: a firing that the watchdog ended is not counted.
    fn long_ns(&mut self) -> u64 {
        let mut took = Vec::new();
        while took.len() < 20 {
            let start = Instant::now();
            match self.fire() {
                None => took.push(start.elapsed().as_nanos() as u64),
                Some(_) => self.host.restart(self.source),
            }
        }
        took.sort_unstable();
        took[10] * 5 / 4 + 1000
    }

    fn numbers(&self) -> Vec<u64> {
        self.stored.iter().map(|stored| stored.number().unwrap()).collect()
    }
}

#[test]
fn a_budget_that_ends_at_any_instant_tears_nothing() {
    let c = in_c();
    assert_eq!(unsafe { CStr::from_ptr(c.name) }, c"wide");
    nothing_is_torn(&[c, Wide::descriptor(), c]);
}

#[test]
fn nor_does_it_in_a_bank() {
    assert!(opengpac::bank::of(Wide::descriptor().run).is_some());
    nothing_is_torn(&[Wide::descriptor(); 5]);
}

#[test]
fn nor_does_it_in_fused_blocks() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/blocks/linked.c");
    let loaded = modules::load(&path, &modules::LoadOptions::default()).unwrap();
    let linked = loaded.blocks[0].descriptor;
    assert_eq!(modules::fused::fit(linked), Ok(()));
    // The maximum of one entry: a firing shorter than the alarm's delay of some microseconds is hardly ever ended.
    nothing_is_torn(&[linked; 100]);
}

fn nothing_is_torn(kinds: &[&'static Descriptor]) {
    // An alarm that comes between two firings is passed on to the handler before the containment's, which there must be none of.
    static IGNORED: Once = Once::new();
    IGNORED.call_once(|| assert_ne!(unsafe { libc::signal(libc::SIGXCPU, libc::SIG_IGN) }, libc::SIG_ERR));
    let (count, mut seed) = (setting("OPENGPAC_BUDGET_FAULTS", 300), setting("OPENGPAC_SEED", 1).max(1));
    let mut program = Program::new(kinds);
    let alarm = Alarm::new();
    let long_ns = program.long_ns();
    let (mut faults, mut through, mut firings) = (0, 0, 0u64);
    while faults < count {
        let before = program.numbers();
        alarm.set((random(&mut seed) % long_ns) as i64);
        let ended = program.fire();
        alarm.set(1);
        firings += 1;
        let after = program.numbers();
        if let Some(block) = ended {
            faults += 1;
            // The block that was ended had stored everything or nothing; those before it had stored everything.
            let at = program.stored.iter().position(|stored| stored.block.id() == block).unwrap();
            assert!((0..at).all(|earlier| after[earlier] > before[earlier]), "{before:?} {after:?} ended in {at}");
            through += u64::from(after[at] > before[at]);
            program.host.restart(program.source);
            if faults % 10_000 == 0 {
                println!("{faults} budget faults in {firings} firings, {through} of them while a block stored: none torn");
            }
        } else {
            assert!(after.iter().zip(&before).all(|(after, before)| after > before), "{before:?} {after:?}");
        }
    }
    println!("{faults} budget faults in {firings} firings, {through} of them while a block stored: none torn");
    assert!(through > 0, "signals came while blocks stored");
    assert!(through < faults, "and while they did not");
}
