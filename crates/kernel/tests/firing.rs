// SPDX-License-Identifier: Apache-2.0
//! Firings under the virtual clock: order, intervals, numbers, faults.
#![allow(clippy::undocumented_unsafe_blocks, clippy::macro_metavars_in_unsafe, reason = "test blocks are written by hand against the ABI")]
mod support;
use kernel::*;
use std::sync::Arc;
use support::*;

const MS: i64 = 1_000_000;

fn count() -> &'static opengpac::abi::Descriptor {
    block!(|this, invocation| {
        this.state += 1;
        this.y = this.state;
        assert_eq!(invocation.number as i64 + 1, this.state);
        0
    })
}

fn add_one() -> &'static opengpac::abi::Descriptor {
    block!(|this, _| {
        this.y = this.u + 1;
        0
    })
}

#[test]
fn a_chain_runs_in_order_at_every_release() {
    let host = virtual_host(1);
    let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
    let cells = cells(3);
    let process = Process::new(1, 1);
    let activation = interval();
    let driven = Activation::new(Due::Driven { by: vec![(activation.clone(), 1)] }, None);
    let first = Arc::new(install(1, count(), None, Some(&cells[0])));
    let second = Arc::new(install(2, add_one(), Some(&cells[0]), Some(&cells[1])));
    let third = Arc::new(install(3, add_one(), Some(&cells[1]), Some(&cells[2])));
    let steps = vec![step(&first, &activation, &process, &[]), step(&second, &driven, &process, &[0]), step(&third, &driven, &process, &[1])];
    host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::StartClock(process), Op::On(activation, 2), Op::On(driven, 1)]));
    run_until(&host, 10 * MS);
    assert_eq!(cells.iter().map(value).collect::<Vec<_>>(), [5, 6, 7]);
    assert_eq!(host.statistics(source).firings, 10);
    assert!(matches!(events(&host).as_slice(), [Event::Done { time_ns: 0, .. }]));
}

#[test]
fn a_fault_publishes_nothing_and_skips_what_it_drives() {
    let host = virtual_host(1);
    let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
    let cells = cells(3);
    let process = Process::new(7, 1);
    let activation = interval();
    let faulty = block!(|this, invocation| {
        this.y = 100 + invocation.number as i64;
        if invocation.number == 2 { FAULT } else { 0 }
    });
    let first = Arc::new(install(1, faulty, None, Some(&cells[0])));
    let second = Arc::new(install(2, add_one(), Some(&cells[0]), Some(&cells[1])));
    let other = Arc::new(install(3, count(), None, Some(&cells[2])));
    let steps = vec![step(&first, &activation, &process, &[]), step(&second, &activation, &process, &[0]), step(&other, &activation, &process, &[])];
    host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::On(activation, 1)]));
    run_until(&host, 3 * MS);
    assert_eq!(cells.iter().map(value).collect::<Vec<_>>(), [101, 102, 3]);
    run_until(&host, 4 * MS);
    assert_eq!(cells.iter().map(value).collect::<Vec<_>>(), [103, 104, 4]);
    let told = events(&host);
    assert!(
        matches!(
            told[1],
            Event::Unwatched { process: 7, block: BlockId(1), item: Watch::FAULT, fault: Some(Fault::Returned(7)), number: 2, time_ns: 3_000_000, .. }
        ),
        "{told:?}"
    );
    assert_eq!(host.statistics(source).faults, 1);
}

#[test]
fn releases_that_a_long_firing_missed_consume_their_numbers() {
    let host = virtual_host(1);
    // Firing 1 lasts until 3.5 ms: of releases 2 and 3 only the last is served, late; that firing lasts until 5.5 ms, and so on.
    let source = host.add_source(SourceSpec { virtual_cost_ns: 5 * MS as u64 / 2, ..timer("slow", MS as u64, 80) }).unwrap();
    let (cells, process, on) = (cells(2), Process::new(1, 1), interval());
    let number = block!(|this, invocation| {
        this.y = this.y * 100 + invocation.number as i64;
        0
    });
    let driven = Activation::new(Due::Driven { by: vec![(on.clone(), 1)] }, Some(Extent::new(STAMP_LEN).cell(0, STAMP_LEN)));
    let first = Arc::new(install(1, number, None, Some(&cells[0])));
    let second = Arc::new(install(2, number, None, Some(&cells[1])));
    let steps = vec![step(&first, &on, &process, &[]), step(&second, &driven, &process, &[0])];
    host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::On(on, 1), Op::On(driven, 1)]));
    run_until(&host, 7 * MS);
    assert_eq!(cells.iter().map(value).collect::<Vec<_>>(), [2, 2], "numbers 0, 2; the firing that lasts until 7.5 ms is not to be seen");
    run_until(&host, 10 * MS);
    assert_eq!(cells.iter().map(value).collect::<Vec<_>>(), [2_04_06, 2_04_06], "numbers 0, 2, 4, 6");
    let statistics = host.statistics(source);
    assert_eq!((statistics.firings, statistics.overruns), (4, 4));
}

#[test]
fn a_ratio_driven_block_is_due_on_each_nth_invocation_and_stamped_so() {
    let host = virtual_host(1);
    let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
    let (cells, process, on) = (cells(2), Process::new(1, 1), interval());
    let stamp = Extent::new(STAMP_LEN).cell(0, STAMP_LEN);
    let driven = Activation::new(Due::Driven { by: vec![(on.clone(), 3)] }, Some(stamp.clone()));
    let first = Arc::new(install(1, count(), None, Some(&cells[0])));
    let second = Arc::new(install(2, count(), None, Some(&cells[1])));
    let steps = vec![step(&first, &on, &process, &[]), step(&second, &driven, &process, &[0])];
    host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::On(on, 1), Op::On(driven, 1)]));
    run_until(&host, 11 * MS);
    // The third, sixth and ninth invocations of the first block.
    assert_eq!(cells.iter().map(value).collect::<Vec<_>>(), [11, 3]);
    assert_eq!(value(&stamp.part(0, 8)), 2);
    assert_eq!(value(&stamp.part(8, 8)), 9 * MS);
}

#[test]
fn running_time_stands_still_while_the_process_is_suspended() {
    let host = virtual_host(1);
    let source = host.add_source(timer("fast", MS as u64, 80)).unwrap();
    let (cells, process, on) = (cells(1), Process::new(1, 1), interval());
    let time = block!(|this, invocation| {
        this.y = invocation.time_ns;
        assert_eq!(invocation.now_ns % MS, 0);
        0
    });
    let steps = vec![step(&Arc::new(install(1, time, None, Some(&cells[0]))), &on, &process, &[])];
    host.set_now(2 * MS);
    host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::StartClock(process.clone()), Op::On(on.clone(), 1)]));
    run_until(&host, 5 * MS);
    assert_eq!(value(&cells[0]), 3 * MS);
    host.submit(source, script(vec![Op::StopClock(process.clone()), Op::Off(on.clone())]));
    run_until(&host, 8 * MS);
    host.submit(source, script(vec![Op::ResumeClock(process), Op::On(on, 1)]));
    run_until(&host, 9 * MS);
    assert_eq!(value(&cells[0]), 4 * MS);
}

#[test]
fn sources_that_raise_each_other_without_end_are_named() {
    let host = virtual_host(1);
    let (a, b) = (host.add_source(software("ping", 1)).unwrap(), host.add_source(software("pong", 1)).unwrap());
    for (from, to) in [(a, b), (b, a)] {
        let spec = interconnect::ConnectionSpec { writer: from.0, reader: to.0, asynchronous_len: 8, queue_row_len: 0, queue_depth: 0 };
        let (sender, _) = host.connect(&spec);
        let outbound = Outbound::new(sender, cells(1), vec![], Some(to));
        host.submit(from, script(vec![Op::Table(Box::new(Table::new(vec![], vec![], vec![outbound], vec![], None)))]));
    }
    host.request(a);
    let error = std::iter::from_fn(|| Some(host.fire_next(0))).find_map(Result::err).unwrap();
    assert!(error.contains("more than 10000 requested firings at 0 ns") && error.contains("'ping'") && error.contains("1 requests are refused"), "{error}");
    assert_eq!(host.fire_next(0), Ok(false), "nothing is left of it");
    host.request(a);
    assert_eq!(host.fire_next(0), Ok(true), "others may go on");
}
