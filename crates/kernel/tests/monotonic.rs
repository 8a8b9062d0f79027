// SPDX-License-Identifier: Apache-2.0
//! The same tests under the monotonic clock, with threads. Bounded by counts, never by time.
#![allow(clippy::undocumented_unsafe_blocks, clippy::macro_metavars_in_unsafe, reason = "test blocks are written by hand against the ABI")]
mod support;
use kernel::*;
use std::sync::Arc;
use support::*;

/// Returns a block that counts, and reports when the count reaches its parameter.
fn count_to() -> &'static opengpac::abi::Descriptor {
    block!(|this, _| {
        this.state += 1;
        this.y = this.state;
        if this.state == this.parameter { DONE } else { 0 }
    })
}

#[test]
fn a_timer_fires_and_its_table_is_swapped_while_it_runs() {
    let host = monotonic_host();
    let source = host.add_source(timer("fast", 200_000, 80)).unwrap();
    let cells = cells(1);
    let process = Process::new(1, 1);
    let activation = interval();
    for round in 1..=50 {
        let mut block = install(round, count_to(), None, Some(&cells[0]));
        block.set(PARAMETER, &3i64.to_ne_bytes());
        let steps = vec![step(&Arc::new(block), &activation, &process, &[])];
        host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::On(activation.clone(), 1)]));
        let block = await_event(&host, |event| if let Event::Unwatched { block, .. } = event { Some(block) } else { None });
        assert_eq!(block, BlockId(round));
    }
    host.close();
    assert!(host.statistics(source).firings >= 150);
}

#[test]
fn requests_of_a_software_source_are_one_firing_each() {
    let host = monotonic_host();
    let source = host.add_source(software("soft", 50)).unwrap();
    let cells = cells(1);
    let mut block = install(1, count_to(), None, Some(&cells[0]));
    block.set(PARAMETER, &1000i64.to_ne_bytes());
    let activation = interval();
    let steps = vec![step(&Arc::new(block), &activation, &Process::new(1, 1), &[])];
    host.submit(source, script(vec![Op::Table(Box::new(table(steps))), Op::On(activation, 1)]));
    (0..1000).for_each(|_| host.request(source));
    let number = await_event(&host, |event| if let Event::Unwatched { number, .. } = event { Some(number) } else { None });
    assert_eq!(number, 999);
    host.close();
    assert_eq!(host.statistics(source).firings, 1000);
}

#[test]
fn an_idle_source_carries_out_scripts_at_once() {
    let host = monotonic_host();
    // Its first release is in a year.
    let source = host.add_source(timer("slow", 365 * 24 * 3_600_000_000_000, 50)).unwrap();
    let cells = cells(1);
    for value in 0..100i64 {
        host.submit(source, script(vec![Op::Store(cells[0].clone(), value.to_ne_bytes().into()), Op::Capture(vec![cells[0].clone()])]));
        let captured = await_event(&host, |event| if let Event::Done { captured, .. } = event { Some(captured) } else { None });
        assert_eq!(captured, value.to_ne_bytes());
    }
    assert_eq!(host.statistics(source).firings, 0);
}

#[test]
fn what_is_told_reaches_a_parked_supervisor_though_a_thread_attends_that_never_looks() {
    let host = monotonic_host();
    let year_ns = 365 * 24 * 3_600_000_000_000;
    let sources = [software("soft", 50), timer("slow", year_ns, 50), timer("fast", 200_000, 50)].map(|spec| host.add_source(spec).unwrap());
    host.attend();
    for source in sources.into_iter().cycle().take(60) {
        host.submit(source, script(vec![]));
        loop {
            let seen = host.rings();
            if host.poll().is_some() {
                break;
            }
            // Would block forever if the source did not repeat its notification.
            host.park_since(seen, None);
        }
    }
    host.stop_attending(host.rings());
    host.close();
}

#[test]
fn unpark_wakes_a_parked_supervisor() {
    let host = monotonic_host();
    // Read before anything else, so that any later event wakes the thread, even one before the poll.
    let seen = host.rings();
    std::thread::scope(|scope| {
        scope.spawn(|| host.unpark());
        assert!(host.poll().is_none());
        host.park_since(seen, None);
    });
}
