// SPDX-License-Identifier: Apache-2.0
//! Blocks that damage their process: replaced signal handlers are detected, reported and restored; a thread that ends itself loses its
//! source.
#![allow(clippy::undocumented_unsafe_blocks, reason = "a module that is loaded by hand")]
#[path = "support/modules.rs"]
mod modules;
mod support;
use kernel::*;
use opengpac::abi::Descriptor;
use runtime::Host;
use std::ffi::CStr;
use std::process::Command;
use std::sync::{Arc, OnceLock};
use support::*;

const MS: u64 = 1_000_000;
const SCENARIO: &str = "OPENGPAC_SPOILS_SCENARIO";

fn block(name: &str) -> &'static Descriptor {
    static LOADED: OnceLock<Vec<&'static Descriptor>> = OnceLock::new();
    let blocks = LOADED.get_or_init(|| modules::blocks_of("spoils", &["-std=gnu11", "-O2", "-w"]));
    blocks.iter().find(|block| unsafe { CStr::from_ptr(block.name) }.to_str() == Ok(name)).unwrap()
}

fn runs(host: &Host, name: &str) -> SourceId {
    let source = host.add_source(timer(name, MS, 80)).unwrap();
    let (descriptor, output) = (block(name), Extent::new(8).cell(0, 8));
    let size = descriptor.instance_size as usize;
    let mut block = Block::install(BlockId(1), name, descriptor, Arc::new(()), Extent::new(size).cell(0, size));
    block.bind(0, &output);
    let (process, activation) = (Process::new(1, 1), Activation::new(Due::Interval, None));
    let steps = vec![step(&Arc::new(block), &activation, &process, &[])];
    host.submit(source, script(vec![Op::Table(Box::new(support::table(steps))), Op::On(activation, 1)]));
    source
}

/// Runs `scenario` in its own process; a status tells whether it reached its end.
fn alone(name: &str, scenario: fn()) {
    if std::env::var(SCENARIO).is_ok_and(|running| running == name) {
        scenario();
        std::process::exit(7);
    }
    let mut process = Command::new(std::env::current_exe().unwrap());
    let output = process.args(["--exact", name, "--nocapture", "--test-threads=1"]).env(SCENARIO, name).output().unwrap();
    assert_eq!(output.status.code(), Some(7), "{}", String::from_utf8_lossy(&output.stderr));
}

fn replaced(host: &Host) -> String {
    await_event(host, |event| if let Event::Replaced { text, .. } = event { Some(text) } else { None })
}

#[test]
fn a_handler_that_a_block_has_replaced_is_told_and_put_in_front_again() {
    alone("a_handler_that_a_block_has_replaced_is_told_and_put_in_front_again", || {
        let host = monotonic_host();
        runs(&host, "takes_a_handler");
        let told = replaced(&host);
        assert!(told.contains("signal 11") && told.contains("replaced by code of '") && told.contains("opengpac-spoils-"), "{told}");
        let source = runs(&host, "crashes");
        let fault = await_event(&host, |event| match event {
            Event::Stopped { source: of, fault, .. } if of == source => Some(fault),
            _ => None,
        });
        assert_eq!(fault, Fault::Signal(libc::SIGSEGV));
        host.close();
    });
}

#[test]
fn handlers_that_a_block_has_dropped_are_told_once() {
    alone("handlers_that_a_block_has_dropped_are_told_once", || {
        let host = monotonic_host();
        runs(&host, "drops_handlers");
        let told = replaced(&host);
        assert!(told.contains("signal 8") && told.contains("set to its default, or ignored"), "{told}");
        assert_eq!(containment::restore_handlers(), None, "all are in place again");
        host.close();
    });
}

#[test]
fn a_block_that_ends_its_thread_loses_its_source_and_the_program_still_ends() {
    alone("a_block_that_ends_its_thread_loses_its_source_and_the_program_still_ends", || {
        let host = monotonic_host();
        let source = runs(&host, "ends_its_thread");
        let fault = await_event(&host, |event| match event {
            Event::Stopped { source: of, fault, .. } if of == source => Some(fault),
            _ => None,
        });
        assert!(matches!(fault, Fault::Lost(_)), "{fault:?}");
        host.close();
    });
}

#[test]
fn a_source_whose_thread_the_system_has_ended_is_told_and_the_program_still_ends() {
    alone("a_source_whose_thread_the_system_has_ended_is_told_and_the_program_still_ends", || {
        let host = monotonic_host();
        let [gone, other] = ["gives_up_rights", "drops_handlers"].map(|name| runs(&host, name));
        await_event(&host, |event| matches!(event, Event::Ended { source, .. } if source == gone).then_some(()));
        let before = host.statistics(other).firings;
        while host.statistics(other).firings < before + 10 {
            std::thread::yield_now();
        }
        host.close();
    });
}
