// SPDX-License-Identifier: Apache-2.0
//! A block that forks: the copy of the process ends before it fires, commands or publishes anything, and the block is named.
#![allow(clippy::undocumented_unsafe_blocks, reason = "a module that is loaded by hand, and calls of the C library")]
#[path = "support/modules.rs"]
mod modules;
mod support;
use device::{Channel, DeviceError, Direction, Driver};
use kernel::*;
use opengpac::abi::Descriptor;
use runtime::Host;
use std::ffi::CStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use support::*;

const MS: u64 = 1_000_000;
/// Time limit that no test comes near.
const NET: Duration = Duration::from_secs(300);

fn block(name: &str) -> &'static Descriptor {
    static LOADED: OnceLock<Vec<&'static Descriptor>> = OnceLock::new();
    let blocks = LOADED.get_or_init(|| modules::blocks_of("forks", &["-std=gnu11", "-O2"]));
    blocks.iter().find(|block| unsafe { CStr::from_ptr(block.name) }.to_str() == Ok(name)).unwrap()
}

/// Counters in memory shared with a child, which survive it.
struct SharedCounters(*mut u8);

impl SharedCounters {
    fn new() -> SharedCounters {
        let (access, way) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_SHARED | libc::MAP_ANONYMOUS);
        let memory = unsafe { libc::mmap(std::ptr::null_mut(), 4096, access, way, -1, 0) };
        assert_ne!(memory, libc::MAP_FAILED);
        SharedCounters(memory.cast())
    }

    fn word(&self, index: usize) -> &'static AtomicU64 {
        unsafe { AtomicU64::from_ptr(self.0.cast::<u64>().add(index)) }
    }
}

/// A device that counts its writes, by this process and by others.
struct Counting {
    channels: Vec<Channel>,
    home: u32,
    own: &'static AtomicU64,
    others: &'static AtomicU64,
    /// Number of the write that clones the process; the clone returns here.
    forks_at: u64,
    child: &'static AtomicU64,
}

impl Counting {
    fn count(&self) -> u64 {
        let counter = if std::process::id() == self.home { self.own } else { self.others };
        counter.fetch_add(1, Ordering::SeqCst)
    }
}

impl Driver for Counting {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }
    fn open(&mut self, _: i64) -> Result<(), DeviceError> {
        Ok(())
    }
    fn read(&mut self, _: i64, _: &mut [u8]) -> Result<(), DeviceError> {
        Ok(())
    }
    fn write(&mut self, _: i64, _: &[u8], _: &[bool]) -> Result<(), DeviceError> {
        if self.count() == self.forks_at {
            let child = unsafe { libc::syscall(libc::SYS_clone, libc::SIGCHLD, 0, 0, 0, 0) };
            if child > 0 {
                self.child.store(child as u64, Ordering::SeqCst);
            }
        }
        Ok(())
    }
    fn safe_state(&mut self) {
        self.count();
    }
    fn close(&mut self) {}
}

fn counting(name: &str, shared: &SharedCounters, at: usize, forks_at: u64) -> Arc<Device> {
    let channel = Channel {
        name: "brake.force".into(),
        direction: Direction::Write,
        type_text: "double".into(),
        unit: String::new(),
        doc: String::new(),
        offset: 0,
        len: 8,
        safe: 0f64.to_ne_bytes().into(),
        slew_max: None,
    };
    let (own, others, child) = (shared.word(at), shared.word(at + 1), shared.word(at + 2));
    let driver = Counting { channels: vec![channel], home: std::process::id(), own, others, forks_at, child };
    Device::open(name, Box::new(driver), 0).unwrap()
}

/// Returns the exit status of the process `child`.
fn status_of(child: i64) -> i32 {
    assert!(child > 0, "no process was made");
    let (mut status, begun) = (0, Instant::now());
    loop {
        match unsafe { libc::waitpid(child as i32, &mut status, libc::WNOHANG) } {
            0 if begun.elapsed() < NET => std::thread::yield_now(),
            0 => {
                unsafe { libc::kill(child as i32, libc::SIGKILL) };
                panic!("the copy goes on");
            }
            ended => {
                assert_eq!(i64::from(ended), child);
                return status;
            }
        }
    }
}

fn has_ended_by_us(child: i64) {
    let status = status_of(child);
    assert!(libc::WIFEXITED(status) && libc::WEXITSTATUS(status) == forks::ENDED, "status {status:#x}");
}

/// Creates a source with devices that runs this block; returns its output cell too.
fn runs(host: &Host, name: &str, devices: Vec<Arc<Device>>) -> (SourceId, Cell) {
    let source = host.add_source(timer(name, MS, 80)).unwrap();
    let (descriptor, child) = (block(name), Extent::new(8).cell(0, 8));
    let size = descriptor.instance_size as usize;
    let mut forking = Block::install(BlockId(1), name, descriptor, Arc::new(()), Extent::new(size).cell(0, size));
    forking.bind(0, &child);
    let (process, activation) = (Process::new(1, 1), Activation::with_budget(Due::Interval, None, Some(1000 * MS)));
    let steps = vec![step(&Arc::new(forking), &activation, &process, &[])];
    let table = Table::new(steps, vec![], vec![], devices, None);
    host.submit(source, script(vec![Op::Table(Box::new(table)), Op::On(activation, 1)]));
    (source, child)
}

fn value(cell: &Cell) -> i64 {
    i64::from_ne_bytes(cell.load().try_into().unwrap())
}

/// Waits until this process has written the device of `shared` `more` times.
fn writes(shared: &SharedCounters, more: u64) {
    let (begun, until) = (Instant::now(), shared.word(0).load(Ordering::SeqCst) + more);
    while shared.word(0).load(Ordering::SeqCst) < until {
        assert!(begun.elapsed() < NET, "the source does not fire");
        std::thread::yield_now();
    }
}

fn is_told(name: &str) {
    let (host, shared) = (monotonic_host(), SharedCounters::new());
    let (source, child) = runs(&host, name, vec![counting("brake", &shared, 0, u64::MAX)]);
    let fault = await_event(&host, |event| match event {
        Event::Stopped { source: of, fault, .. } if of == source => Some(fault),
        _ => None,
    });
    assert_eq!(fault, Fault::Forked);
    has_ended_by_us(value(&child));
    assert_eq!(shared.word(1).load(Ordering::SeqCst), 0, "the copy wrote a device");
}

#[test]
fn a_block_that_forks_stops_its_source_and_its_copy_has_ended() {
    is_told("calls_fork");
    is_told("forks_in_a_loop");
}

#[test]
fn under_the_virtual_clock_too() {
    let (host, shared) = (virtual_host(1), SharedCounters::new());
    let (source, child) = runs(&host, "calls_fork", vec![counting("brake", &shared, 0, u64::MAX)]);
    let mut stopped = None;
    while stopped.is_none() {
        assert!(host.fire_next(1_000 * MS as i64).unwrap());
        while let Some(event) = host.poll() {
            if let Event::Stopped { source: of, fault, .. } = event {
                stopped = Some((of, fault));
            }
        }
    }
    assert_eq!(stopped, Some((source, Fault::Forked)));
    has_ended_by_us(value(&child));
    assert_eq!(shared.word(1).load(Ordering::SeqCst), 0, "the copy wrote a device");
}

#[test]
fn a_copy_that_no_handler_saw_ends_before_it_touches_a_device() {
    let (host, shared) = (monotonic_host(), SharedCounters::new());
    let (_, child) = runs(&host, "forks_unseen", vec![counting("brake", &shared, 0, u64::MAX)]);
    writes(&shared, 5);
    has_ended_by_us(value(&child));
    writes(&shared, 5);
    assert_eq!(shared.word(1).load(Ordering::SeqCst), 0, "the copy wrote a device");
}

#[test]
fn a_copy_made_by_a_driver_writes_no_other_device_and_never_fires() {
    let (host, shared) = (monotonic_host(), SharedCounters::new());
    let devices = vec![counting("brake", &shared, 0, 3), counting("lamp", &shared, 4, u64::MAX)];
    runs(&host, "spawns", devices);
    writes(&shared, 10);
    has_ended_by_us(shared.word(2).load(Ordering::SeqCst) as i64);
    writes(&shared, 5);
    assert_eq!([1, 5].map(|at| shared.word(at).load(Ordering::SeqCst)), [0, 0], "the copy wrote a device");
}

#[test]
fn a_block_may_start_a_program() {
    let (host, shared) = (monotonic_host(), SharedCounters::new());
    let (source, child) = runs(&host, "spawns", vec![counting("brake", &shared, 0, u64::MAX)]);
    writes(&shared, 5);
    assert_eq!(status_of(value(&child)), 0);
    assert!(!host.statistics(source).stopped);
}
