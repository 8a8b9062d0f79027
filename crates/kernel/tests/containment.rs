// SPDX-License-Identifier: Apache-2.0
//! Block faults raised by a signal, and endless loops: contained under both clocks.
#![allow(clippy::disallowed_methods, reason = "threads without a core have no real-time priority")]
#![allow(clippy::undocumented_unsafe_blocks, clippy::macro_metavars_in_unsafe, reason = "test blocks are written by hand against the ABI")]
mod support;
use device::{Channel, DeviceError, Direction, Driver};
use kernel::*;
use opengpac::abi::Descriptor;
use runtime::Host;
use std::hint::black_box;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use support::*;

const MS: u64 = 1_000_000;

fn count() -> &'static Descriptor {
    block!(|this, _| {
        this.state += 1;
        this.y = this.state;
        0
    })
}

fn null_pointer() -> &'static Descriptor {
    block!(|this, _| {
        this.y = black_box(std::ptr::dangling::<i64>()).read_volatile();
        0
    })
}

fn division_by_zero() -> &'static Descriptor {
    block!(|this, _| {
        let mut quotient: u64;
        std::arch::asm!("div {0}", in(reg) black_box(0u64), inout("rax") 1u64 => quotient, inout("rdx") 0u64 => _);
        quotient += 1;
        this.y = quotient as i64;
        0
    })
}

fn endless_loop() -> &'static Descriptor {
    block!(|this, _| {
        while black_box(this.state) == 0 {
            std::hint::spin_loop();
        }
        0
    })
}

fn panic() -> &'static Descriptor {
    unsafe extern "C" fn run(_: *mut std::ffi::c_void, _: *const opengpac::abi::Invocation) -> u64 {
        // As generated entries do: the panic ends inside its module.
        std::panic::catch_unwind(|| std::panic::resume_unwind(Box::new("silent"))).map_or(opengpac::abi::outcome::PANIC, |()| 0)
    }
    describe(run)
}

/// Writes 1 while claimed; counts transitions to its safe state.
struct Brake {
    channels: Vec<Channel>,
    safe: Arc<AtomicU64>,
    written: Arc<Mutex<Vec<f64>>>,
}

impl Driver for Brake {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }
    fn open(&mut self, _: i64) -> Result<(), DeviceError> {
        Ok(())
    }
    fn read(&mut self, _: i64, _: &mut [u8]) -> Result<(), DeviceError> {
        Ok(())
    }
    fn write(&mut self, _: i64, commands: &[u8], _: &[bool]) -> Result<(), DeviceError> {
        self.written.lock().unwrap().push(f64::from_ne_bytes(commands.try_into().unwrap()));
        Ok(())
    }
    fn safe_state(&mut self) {
        self.safe.fetch_add(1, Ordering::SeqCst);
    }
    fn close(&mut self) {}
}

fn brake() -> (Arc<Device>, Arc<AtomicU64>, Arc<Mutex<Vec<f64>>>) {
    let text = String::new;
    let channel = Channel {
        name: "brake.force".into(),
        direction: Direction::Write,
        type_text: "double".into(),
        unit: text(),
        doc: text(),
        offset: 0,
        len: 8,
        safe: 0f64.to_ne_bytes().into(),
        slew_max: None,
    };
    let (safe, written) = (Arc::new(AtomicU64::new(0)), Arc::default());
    let driver = Brake { channels: vec![channel], safe: safe.clone(), written: Arc::clone(&written) };
    (Device::open("brake", Box::new(driver), 0).unwrap(), safe, written)
}

/// Drives a host until the callback accepts an event or, called without one, reports that it has enough.
type Until<'a> = &'a dyn Fn(&Host, &mut dyn FnMut(Event) -> bool);

/// Runs a faulty block between two good ones of two processes on one source, and a good one on another source.
fn contains(host: &Host, faulty: &'static Descriptor, expected: Fault, until: Until) {
    let source = host.add_source(timer("fast", MS, 80)).unwrap();
    let other = host.add_source(timer("other", MS, 60)).unwrap();
    let cells = cells(4);
    let (victim, beside, elsewhere) = (Process::new(1, 1), Process::new(2, 2), Process::new(3, 3));
    let fault = || Watch { block: None, item: Watch::FAULT, condition: 9, priority: 0, response: Response::Tell };
    for process in [&victim, &beside] {
        process.set_stages(vec![Stage { watches: vec![fault()] }]);
    }
    let on = interval();
    let good = |id, cell: usize| Arc::new(install(id, count(), None, Some(&cells[cell])));
    let bad = Arc::new(install(2, faulty, None, Some(&cells[1])));
    let steps = vec![step(&good(1, 0), &on, &victim, &[]), step(&bad, &on, &victim, &[]), step(&good(3, 2), &on, &beside, &[])];
    let (device, safe, written) = brake();
    device.engage(0, true);
    device.cell(0).store(&1f64.to_ne_bytes());
    let table = Table::new(steps, vec![], vec![], vec![device], None);
    let stage = |process: &Arc<Process>| Op::Stage { process: process.clone(), stage: 0, generation: Some(1) };
    host.submit(other, {
        let on = interval();
        let steps = vec![step(&good(4, 3), &on, &elsewhere, &[])];
        script(vec![Op::Table(Box::new(support::table(steps))), Op::On(on, 1)])
    });
    host.submit(source, script(vec![Op::Table(Box::new(table)), stage(&victim), stage(&beside), Op::On(on, 1)]));

    let (mut stopped, mut told) = (None, Vec::new());
    until(host, &mut |event| {
        match event {
            Event::Stopped { block, process, fault, .. } => stopped = Some((block, process, fault)),
            Event::Condition { process, block, fault, acted, number, .. } => told.push((process, block, fault, acted, number)),
            _ => {}
        }
        told.len() == 2
    });
    assert_eq!(stopped, Some((BlockId(2), 1, expected)));
    let number = told[0].4;
    assert_eq!(told, [(1, BlockId(2), Some(expected), true, number), (2, BlockId(2), Some(expected), true, number)]);
    assert_eq!(safe.load(Ordering::SeqCst), 1, "the devices of the source are safe");
    assert!(written.lock().unwrap().is_empty(), "nothing is written in the firing that was ended");
    assert!(host.statistics(source).stopped);

    // The other source continues, and scripts are still executed on the one that stopped.
    let before = host.statistics(other).firings;
    host.submit(source, script(vec![Op::Capture(vec![cells[2].clone()])]));
    let mut captured = None;
    until(host, &mut |event| {
        if let Event::Done { captured: bytes, .. } = event
            && bytes.len() == 8
        {
            captured = Some(bytes);
        }
        captured.is_some() && host.statistics(other).firings > before + 2
    });
    assert_eq!(captured, Some(0i64.to_ne_bytes().to_vec()), "the step behind the faulty one never ran");

    // After a new table and a restart it works again.
    let on = interval();
    let steps = vec![step(&good(5, 0), &on, &beside, &[])];
    host.restart(source);
    host.submit(source, script(vec![Op::Table(Box::new(support::table(steps))), Op::On(on, 1)]));
    let firings = host.statistics(source).firings;
    until(host, &mut |_| host.statistics(source).firings > firings + 3);
    host.submit(source, script(vec![Op::Capture(vec![cells[0].clone()]), Op::Table(Box::new(support::table(vec![])))]));
    let mut count = 0;
    until(host, &mut |event| {
        if let Event::Done { captured, .. } = event
            && captured.len() == 8
        {
            count = i64::from_ne_bytes(captured.try_into().unwrap());
        }
        count > 0
    });
    assert!(count >= 2);
}

fn virtually(faulty: &'static Descriptor, expected: Fault) {
    contains(&virtual_host(1), faulty, expected, &|host, done| {
        loop {
            while let Some(event) = host.poll() {
                if done(event) {
                    return;
                }
            }
            if done(Event::Lost { source: SourceId(0), count: 0 }) {
                return;
            }
            assert!(host.fire_next(1_000 * MS as i64).unwrap());
        }
    });
}

fn in_threads(faulty: &'static Descriptor, expected: Fault) {
    contains(&monotonic_host(), faulty, expected, &|host, done| {
        loop {
            while let Some(event) = host.poll() {
                if done(event) {
                    return;
                }
            }
            if done(Event::Lost { source: SourceId(0), count: 0 }) {
                return;
            }
            host.park(Some(host.now_ns() + MS as i64));
        }
    });
}

#[test]
fn a_null_pointer_is_contained() {
    virtually(null_pointer(), Fault::Signal(libc::SIGSEGV));
    in_threads(null_pointer(), Fault::Signal(libc::SIGSEGV));
}

#[test]
fn a_division_by_zero_is_contained() {
    virtually(division_by_zero(), Fault::Signal(libc::SIGFPE));
    in_threads(division_by_zero(), Fault::Signal(libc::SIGFPE));
}

#[test]
fn an_endless_loop_is_contained() {
    virtually(endless_loop(), Fault::Budget);
    in_threads(endless_loop(), Fault::Budget);
}

/// Progress of the block that is kept from its core: it has begun, and it may return.
static BEGUN: AtomicBool = AtomicBool::new(false);
static RETURNS: AtomicBool = AtomicBool::new(false);

/// Runs behind every other thread of its core until it may return.
fn without_a_core() -> &'static Descriptor {
    block!(|this, _| {
        let scheduled = |policy| assert_eq!(libc::sched_setscheduler(0, policy, &libc::sched_param { sched_priority: 0 }), 0);
        if !BEGUN.swap(true, Ordering::SeqCst) {
            scheduled(libc::SCHED_IDLE);
            while !RETURNS.load(Ordering::SeqCst) {
                std::hint::spin_loop();
            }
            scheduled(libc::SCHED_OTHER);
        }
        this.state += 1;
        this.y = this.state;
        0
    })
}

/// Pins the calling thread to the first core that it may run on.
fn pin() {
    unsafe {
        let mut cores: libc::cpu_set_t = std::mem::zeroed();
        assert_eq!(libc::sched_getaffinity(0, size_of_val(&cores), &mut cores), 0);
        let first = (0..libc::CPU_SETSIZE as usize).find(|core| libc::CPU_ISSET(*core, &cores)).unwrap();
        cores = std::mem::zeroed();
        libc::CPU_SET(first, &mut cores);
        assert_eq!(libc::sched_setaffinity(0, size_of_val(&cores), &cores), 0);
    }
}

#[test]
fn a_block_that_has_no_core_spends_nothing_of_a_simulated_budget() {
    let busy = std::thread::spawn(|| {
        pin();
        while !BEGUN.load(Ordering::SeqCst) {
            std::thread::yield_now();
        }
        // More than twice the budget of a firing under the virtual clock, in which the block gets hardly any of this core.
        let begun = std::time::Instant::now();
        while begun.elapsed() < std::time::Duration::from_millis(2_200) {
            std::hint::spin_loop();
        }
        RETURNS.store(true, Ordering::SeqCst);
    });
    let firing = std::thread::spawn(|| {
        pin();
        let host = virtual_host(1);
        let source = host.add_source(timer("fast", MS, 80)).unwrap();
        let (cells, on, process) = (cells(1), interval(), Process::new(1, 1));
        let steps = vec![step(&Arc::new(install(1, without_a_core(), None, Some(&cells[0]))), &on, &process, &[])];
        host.submit(source, script(vec![Op::Table(Box::new(support::table(steps))), Op::On(on, 1)]));
        run_until(&host, 3 * MS as i64);
        assert!(!events(&host).iter().any(|event| matches!(event, Event::Stopped { .. })), "it only waited");
        assert_eq!(value(&cells[0]), 3);
    });
    firing.join().unwrap();
    busy.join().unwrap();
}

#[test]
fn a_panic_ends_inside_its_entry_and_its_firing_goes_on() {
    let host = virtual_host(1);
    let source = host.add_source(timer("fast", MS, 80)).unwrap();
    let (cells, on, process) = (cells(1), interval(), Process::new(1, 1));
    let steps = vec![
        step(&Arc::new(install(1, panic(), None, None)), &on, &process, &[]),
        step(&Arc::new(install(2, count(), None, Some(&cells[0]))), &on, &process, &[]),
    ];
    host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::On(on, 1)]));
    run_until(&host, 3 * MS as i64);
    assert_eq!(value(&cells[0]), 3);
    assert_eq!(host.statistics(source).faults, 3);
    assert!(matches!(events(&host).last(), Some(Event::Unwatched { fault: Some(Fault::Panic), .. })));
}

#[test]
fn conditions_that_find_no_place_are_counted_and_told() {
    const FIRINGS: i64 = 3000;
    let host = virtual_host(1);
    let source = host.add_source(timer("fast", MS, 80)).unwrap();
    let (on, process) = (interval(), Process::new(1, 1));
    let steps = vec![step(&Arc::new(install(1, panic(), None, None)), &on, &process, &[])];
    host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::On(on, 1)]));
    // No event is read meanwhile.
    run_until(&host, FIRINGS * MS as i64);
    let lost = host.statistics(source).lost;
    let told = events(&host).iter().filter(|event| matches!(event, Event::Unwatched { .. })).count() as u64;
    assert!(lost > 0 && told + lost == FIRINGS as u64, "{told} told, {lost} lost");
    run_until(&host, (FIRINGS + 1) * MS as i64);
    let said: u64 = events(&host).iter().map(|event| if let Event::Lost { count, .. } = event { *count } else { 0 }).sum();
    assert_eq!(said, lost);
}
