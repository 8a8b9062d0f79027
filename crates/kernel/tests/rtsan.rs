// SPDX-License-Identifier: Apache-2.0
//! The dispatch path under the real-time sanitizer: no allocation, lock or blocking call, not even in C blocks. The sanitizer ends the
//! process at the first report, so each scenario runs in its own process.
//!
//! `RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=realtime --cfg rtsan" cargo test -p kernel --target x86_64-unknown-linux-gnu --test rtsan`
#![cfg(rtsan)]
#![allow(clippy::undocumented_unsafe_blocks, clippy::macro_metavars_in_unsafe, reason = "test blocks are written by hand against the ABI")]
#[path = "support/modules.rs"]
mod modules;
mod support;
use interconnect::ConnectionSpec;
use kernel::*;
use opengpac::abi::Descriptor;
use runtime::Host;
use std::ffi::CStr;
use std::process::Command;
use std::sync::Arc;
use support::*;

const MS: i64 = 1_000_000;
const SCENARIO: &str = "KERNEL_SCENARIO";

/// Runs the scenario of the test `name` in its own process; returns the sanitizer's report if it ended the process.
fn alone(name: &str, scenario: fn()) -> Option<String> {
    if std::env::var(SCENARIO).is_ok_and(|running| running == name) {
        scenario();
        std::process::exit(0);
    }
    let process =
        Command::new(std::env::current_exe().unwrap()).args(["--exact", name, "--nocapture", "--test-threads=1"]).env(SCENARIO, name).output().unwrap();
    let said = String::from_utf8_lossy(&process.stderr).into_owned();
    (!process.status.success()).then_some(said)
}

fn c_block(name: &str) -> &'static Descriptor {
    let blocks = modules::blocks_of("module", &modules::AS_A_USER);
    blocks.into_iter().find(|block| unsafe { CStr::from_ptr(block.name) }.to_str() == Ok(name)).unwrap()
}

fn count() -> &'static Descriptor {
    block!(|this, invocation| {
        this.state += 1;
        this.y = this.state;
        match invocation.number {
            3 => FAULT,
            5 => DONE,
            _ => 0,
        }
    })
}

/// Runs all parts of a firing: two timers with a connection each way, a queue to a software source, rows, a device, a reaction that
/// executes and captures, a C block.
fn everything(block: &'static Descriptor, host: Host, drive: fn(&Host, SourceId)) {
    let fast = host.add_source(timer("fast", MS as u64, 80)).unwrap();
    let slow = host.add_source(timer("slow", 5 * MS as u64, 60)).unwrap();
    let soft = host.add_source(software("soft", 40)).unwrap();
    let (ours, theirs, queued) = (cells(4), cells(4), cells(2));
    let connect = |from: SourceId, to: SourceId, members: usize| {
        host.connect(&ConnectionSpec {
            writer: from.0,
            reader: to.0,
            asynchronous_len: 8,
            queue_row_len: members * (row_prefix(1) + 8),
            queue_depth: 4 * members,
        })
    };
    let process = Process::new(1, 1);
    let on = interval();
    let counting = Arc::new(install(1, count(), None, Some(&ours[0])));
    let in_c = Arc::new(install(2, block, Some(&ours[0]), Some(&ours[1])));
    let executed = Arc::new(install(3, count(), None, Some(&ours[2])));
    let off = interval();
    let steps = vec![step(&counting, &on, &process, &[]), step(&in_c, &on, &process, &[0]), step(&executed, &off, &process, &[])];
    let reaction = Script {
        id: 0,
        ops: vec![
            Op::Execute(vec![executed.clone()]),
            Op::Capture(vec![ours[0].clone()]),
            Op::Store(ours[3].clone(), Box::new([1; 8])),
            Op::Reset(executed),
            Op::Off(off.clone()),
            Op::On(off, 1),
        ],
    };
    let watch = |item, response| Watch { block: Some(BlockId(1)), item, condition: 0, priority: 0, response };
    process.set_stages(vec![Stage {
        watches: vec![watch(CONDITION as u8, Response::React { script: Arc::new(reaction), next: Some(0) }), watch(Watch::FAULT, Response::Remember)],
    }]);
    let (there, here) = (connect(fast, slow, 0), connect(slow, fast, 0));
    let queue = connect(fast, soft, 1);
    let member = |cell: &Cell, activation| vec![QueueMember { cell: cell.clone(), offset: row_prefix(1), activation, ratio: 0 }];
    let outbound = vec![
        Outbound::new(there.0, vec![ours[0].clone()], vec![], None),
        Outbound::new(queue.0, vec![ours[0].clone()], member(&ours[0], Some(on.clone())), Some(soft)),
    ];
    let inbound = vec![Inbound::new(here.1, vec![ours[3].clone()], vec![])];
    let (writer, reader) = interconnect::rows(32, 16);
    let rows = Rows { cells: ours.clone(), writer: RowsEnd::new(writer) };
    let stage = Op::Stage { process: process.clone(), stage: 0, generation: Some(1) };
    let table = Table::new(steps, inbound, outbound, vec![], Some(rows));

    let theirs_on = interval();
    let steps = vec![step(&Arc::new(install(4, count(), None, Some(&theirs[0]))), &theirs_on, &process, &[])];
    let back = Table::new(
        steps,
        vec![Inbound::new(there.1, vec![theirs[1].clone()], vec![])],
        vec![Outbound::new(here.0, vec![theirs[0].clone()], vec![], None)],
        vec![],
        None,
    );
    host.submit(slow, script(vec![Op::Table(Box::new(back)), Op::On(theirs_on, 1)]));

    let inbound = Inbound::new(queue.1, vec![queued[1].clone()], member(&queued[0], None));
    let due = Activation::new(Due::Queued { members: vec![(inbound.clone(), 0)], by: vec![] }, None);
    let steps = vec![step(&Arc::new(install(5, count(), Some(&queued[0]), None)), &due, &process, &[])];
    host.submit(soft, script(vec![Op::Table(Box::new(Table::new(steps, vec![inbound], vec![], vec![], None))), Op::On(due, 1)]));

    host.submit(fast, script(vec![Op::Table(Box::new(table)), stage, Op::StartClock(process), Op::On(on, 1)]));
    drive(&host, fast);
    assert!(reader.written() > 10);
    assert!(host.statistics(soft).firings > 5);
    host.close();
}

fn virtually(host: &Host, _: SourceId) {
    run_until(host, 50 * MS);
}

fn in_threads(host: &Host, source: SourceId) {
    while host.statistics(source).firings < 50 {
        while host.poll().is_some() {}
        host.park(Some(host.now_ns() + MS));
    }
}

#[test]
fn everything_under_the_virtual_clock() {
    assert_eq!(alone("everything_under_the_virtual_clock", || everything(c_block("gain"), virtual_host(1), virtually)), None);
}

#[test]
fn everything_in_threads() {
    assert_eq!(alone("everything_in_threads", || everything(c_block("gain"), monotonic_host(), in_threads)), None);
}

#[test]
fn a_c_block_that_allocates_is_caught() {
    let said = alone("a_c_block_that_allocates_is_caught", || everything(c_block("allocating"), virtual_host(1), virtually));
    assert!(said.as_ref().is_some_and(|said| said.contains("RealtimeSanitizer") && said.contains("malloc")), "{said:?}");
}

#[test]
fn a_rust_block_that_allocates_is_caught() {
    let said = alone("a_rust_block_that_allocates_is_caught", || {
        let allocating = block!(|this, _| {
            this.y = std::hint::black_box(vec![this.u; 100])[50];
            0
        });
        everything(allocating, virtual_host(1), virtually);
    });
    assert!(said.as_ref().is_some_and(|said| said.contains("RealtimeSanitizer")), "{said:?}");
}

#[test]
fn a_segfault_is_contained_without_a_call_that_blocks() {
    let said = alone("a_segfault_is_contained_without_a_call_that_blocks", || {
        let null = block!(|this, _| {
            this.y = std::hint::black_box(std::ptr::dangling::<i64>()).read_volatile();
            0
        });
        let host = virtual_host(1);
        let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
        let on = interval();
        let steps = vec![step(&Arc::new(install(1, null, None, None)), &on, &Process::new(1, 1), &[])];
        host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::On(on, 1)]));
        run_until(&host, 3 * MS);
        assert!(host.statistics(source).stopped);
    });
    assert_eq!(said, None);
}
