// SPDX-License-Identifier: Apache-2.0
//! Blocks that are ended while they are in library code, or that end themselves: the remaining state is usable, or nothing waits for it.
//!
//! `OPENGPAC_LOOPS=1000 cargo test -p kernel --test foreign -- --nocapture` is the large campaign.
#![allow(clippy::undocumented_unsafe_blocks, reason = "a module that is loaded by hand, and calls of the C library")]
#[path = "support/modules.rs"]
mod modules;
mod support;
use kernel::*;
use opengpac::abi::Descriptor;
use runtime::Host;
use std::ffi::CStr;
use std::process::{Command, Output};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use support::*;

const MS: u64 = 1_000_000;
const SCENARIO: &str = "OPENGPAC_FOREIGN_SCENARIO";

fn block(name: &str) -> &'static Descriptor {
    static LOADED: OnceLock<Vec<&'static Descriptor>> = OnceLock::new();
    let blocks = LOADED.get_or_init(|| modules::blocks_of("foreign", &["-std=gnu11", "-O2", "-w", "-fno-builtin"]));
    blocks.iter().find(|block| unsafe { CStr::from_ptr(block.name) }.to_str() == Ok(name)).unwrap()
}

/// Creates a source that runs this block with a budget of 1 ms until it is asked to stop.
fn runs(host: &Host, name: &str) -> SourceId {
    let source = host.add_source(timer(name, MS, 80)).unwrap();
    let (descriptor, output) = (block(name), Extent::new(8).cell(0, 8));
    let size = descriptor.instance_size as usize;
    let mut block = Block::install(BlockId(1), name, descriptor, Arc::new(()), Extent::new(size).cell(0, size));
    block.bind(0, &output);
    let (process, activation) = (Process::new(1, 1), Activation::with_budget(Due::Interval, None, Some(MS)));
    let steps = vec![step(&Arc::new(block), &activation, &process, &[])];
    host.submit(source, script(vec![Op::Table(Box::new(support::table(steps))), Op::On(activation, 1)]));
    source
}

/// Returns the next fault of this source; an earlier source may have faulted once more between its restart and its empty table.
fn ended(host: &Host, source: SourceId) -> Fault {
    await_event(host, |event| match event {
        Event::Stopped { source: of, fault, .. } if of == source => Some(fault),
        _ => None,
    })
}

/// Checks that every lock of malloc and stdio is free, by taking it.
fn nothing_is_locked() {
    unsafe {
        libc::malloc_trim(0);
        assert_eq!(libc::fflush(std::ptr::null_mut()), 0);
    }
}

fn loops() -> u32 {
    std::env::var("OPENGPAC_LOOPS").map_or(3, |given| given.parse().expect("a number"))
}

/// Repeatedly ends a block in its loop; each time the source must stop, and every lock must be free.
fn comes_back(name: &str) {
    let host = monotonic_host();
    let source = runs(&host, name);
    let (mut longest, start) = (Duration::ZERO, Instant::now());
    for _ in 0..loops() {
        let begin = Instant::now();
        assert_eq!(ended(&host, source), Fault::Budget, "{name}");
        longest = longest.max(begin.elapsed());
        nothing_is_locked();
        host.restart(source);
    }
    println!("{name}: ended {} times in {:.1?}, each within {longest:.1?}; no lock was held", loops(), start.elapsed());
}

#[test]
fn a_loop_around_malloc_is_ended_where_no_lock_is_held() {
    comes_back("allocates");
    comes_back("allocates_much");
}

#[test]
fn a_loop_around_stdio_is_ended_where_no_lock_is_held() {
    comes_back("prints");
    comes_back("prints_unbuffered");
    comes_back("formats");
}

#[test]
fn a_wait_is_interrupted() {
    comes_back("waits");
}

#[test]
fn what_is_known_to_hold_no_lock_is_left_at_once() {
    let host = monotonic_host();
    let expected = [
        ("measures_nothing", libc::SIGSEGV),
        ("copies_to_nothing", libc::SIGSEGV),
        ("calls_nothing", libc::SIGSEGV),
        ("aborts", libc::SIGABRT),
        ("asserts", libc::SIGABRT),
        ("traps", libc::SIGTRAP),
        ("raises", libc::SIGSEGV),
    ];
    for (name, signal) in expected {
        let source = runs(&host, name);
        for _ in 0..loops() {
            assert_eq!(ended(&host, source), Fault::Signal(signal), "{name}");
            nothing_is_locked();
            host.restart(source);
        }
        // An empty table, so that it does not fault again.
        host.submit(source, script(vec![Op::Table(Box::new(support::table(vec![])))]));
    }
}

/// Runs `scenario` in its own process; a status tells whether it reached its end.
fn alone(name: &str, scenario: fn()) -> Option<Output> {
    if std::env::var(SCENARIO).is_ok_and(|running| running == name) {
        scenario();
        std::process::exit(7);
    }
    let mut process = Command::new(std::env::current_exe().unwrap());
    Some(process.args(["--exact", name, "--nocapture", "--test-threads=1"]).env(SCENARIO, name).output().unwrap())
}

/// Checks that the source ends permanently with this fault, everything else continues, and the host and the program can end.
fn is_lost(name: &'static str, fault: Fault) {
    let host = monotonic_host();
    let source = runs(&host, name);
    assert_eq!(ended(&host, source), fault);
    host.restart(source);
    host.submit(source, script(vec![]));
    await_event(&host, |event| matches!(event, Event::Done { .. }).then_some(()));
    assert!(host.statistics(source).stopped, "it runs nothing any more");
    host.close();
}

#[test]
fn what_crashes_with_a_lock_held_costs_its_source_and_the_program_still_ends() {
    let scenario = || {
        is_lost("prints_nothing", Fault::Lost(libc::SIGSEGV));
        is_lost("is_stuck", Fault::Lost(0));
        is_lost("frees_twice", Fault::Lost(libc::SIGABRT));
    };
    let output = alone("what_crashes_with_a_lock_held_costs_its_source_and_the_program_still_ends", scenario).unwrap();
    assert_eq!(output.status.code(), Some(7), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn who_masks_the_signal_is_told_of_and_the_program_still_ends() {
    let scenario = || {
        let host = monotonic_host();
        let source = runs(&host, "is_deaf");
        await_event(&host, |event| matches!(event, Event::Deaf { source: deaf, .. } if deaf == source).then_some(()));
        host.close();
    };
    let output = alone("who_masks_the_signal_is_told_of_and_the_program_still_ends", scenario).unwrap();
    assert_eq!(output.status.code(), Some(7), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_process_of_its_own_ends_where_a_lock_may_be_held() {
    let scenario = || {
        retire_when_lost();
        let host = monotonic_host();
        let source = runs(&host, "is_stuck");
        ended(&host, source);
    };
    let output = alone("a_process_of_its_own_ends_where_a_lock_may_be_held", scenario).unwrap();
    assert_eq!(output.status.code(), Some(RETIRED), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn no_block_ends_the_program_without_a_word() {
    let scenario = || {
        let host = monotonic_host();
        let source = runs(&host, "exits");
        ended(&host, source);
    };
    let output = alone("no_block_ends_the_program_without_a_word", scenario).unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3));
    assert!(said.contains("was ended by exit() while a block ran on interrupt source 'exits'"), "{said}");
}
