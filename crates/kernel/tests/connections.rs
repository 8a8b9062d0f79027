// SPDX-License-Identifier: Apache-2.0
//! Connections: latched once a firing, published once a firing, queues by order and by number.
#![allow(clippy::undocumented_unsafe_blocks, clippy::macro_metavars_in_unsafe, reason = "test blocks are written by hand against the ABI")]
mod support;
use interconnect::{ConnectionSpec, EndError, Receiver, Sender};
use kernel::*;
use runtime::{Host, Remote};
use std::sync::Arc;
use support::*;

const MS: i64 = 1_000_000;

fn count() -> &'static opengpac::abi::Descriptor {
    block!(|this, _| {
        this.state += 1;
        this.y = this.state;
        0
    })
}

/// Returns a block that sums its inputs: the sum shows each value taken, and how often.
fn sum() -> &'static opengpac::abi::Descriptor {
    block!(|this, _| {
        this.state = this.state * 100 + this.u;
        this.y = this.state;
        0
    })
}

struct Pair {
    host: Host,
    writer: SourceId,
    reader: SourceId,
    /// Output of the writer, the reader's copy of it, output of the reader.
    cells: Vec<Cell>,
    on: Arc<Activation>,
}

/// Makes a counter on a timer of 2 ms; the caller connects.
fn pair(reader: SourceSpec) -> Pair {
    let host = virtual_host(1);
    let writer = host.add_source(timer("writer", 2 * MS as u64, 50)).unwrap();
    let reader = host.add_source(reader).unwrap();
    Pair { host, writer, reader, cells: cells(3), on: interval() }
}

fn write(p: &Pair, outbound: Arc<Outbound>) {
    let block = Arc::new(install(1, count(), None, Some(&p.cells[0])));
    let steps = vec![step(&block, &p.on, &Process::new(1, 1), &[])];
    let table = Table::new(steps, vec![], vec![outbound], vec![], None);
    p.host.submit(p.writer, script(vec![Op::Table(Box::new(table)), Op::On(p.on.clone(), 1)]));
}

fn read(p: &Pair, inbound: Arc<Inbound>, activation: Arc<Activation>) {
    let block = Arc::new(install(2, sum(), Some(&p.cells[1]), Some(&p.cells[2])));
    let steps = vec![step(&block, &activation, &Process::new(2, 2), &[])];
    let table = Table::new(steps, vec![inbound], vec![], vec![], None);
    p.host.submit(p.reader, script(vec![Op::Table(Box::new(table)), Op::On(activation, 1)]));
}

fn spec(asynchronous_len: usize, members: usize) -> ConnectionSpec {
    ConnectionSpec {
        writer: 0,
        reader: 1,
        asynchronous_len,
        queue_row_len: if members == 0 { 0 } else { row_prefix(members) + 8 * members },
        queue_depth: if members == 0 { 0 } else { 4 },
    }
}

fn member(cell: &Cell, activation: Option<Arc<Activation>>, ratio: u32) -> Vec<QueueMember> {
    vec![QueueMember { cell: cell.clone(), offset: row_prefix(1), activation, ratio }]
}

#[test]
fn an_asynchronous_reader_gets_the_newest_publication() {
    let p = pair(timer("reader", MS as u64, 80));
    let (sender, receiver) = p.host.connect(&spec(8, 0));
    write(&p, Outbound::new(sender, vec![p.cells[0].clone()], vec![], None));
    read(&p, Inbound::new(receiver, vec![p.cells[1].clone()], vec![]), interval());
    run_until(&p.host, 5 * MS);
    // If both release at once, the reader fires first: 0 at 1 and 2, 1 at 3 and 4, 2 at 5 ms.
    assert_eq!(value(&p.cells[2]), 1_01_02);
}

#[test]
fn a_new_connection_starts_from_the_present_values() {
    let p = pair(timer("reader", MS as u64, 80));
    p.cells[0].store(&42i64.to_ne_bytes());
    let (sender, receiver) = p.host.connect(&spec(8, 0));
    let table = Table::new(vec![], vec![], vec![Outbound::new(sender, vec![p.cells[0].clone()], vec![], None)], vec![], None);
    p.host.submit(p.writer, script(vec![Op::Table(Box::new(table))]));
    read(&p, Inbound::new(receiver, vec![p.cells[1].clone()], vec![]), interval());
    assert_eq!(value(&p.cells[1]), 42, "latched by the swap itself");
}

#[test]
fn a_connection_that_was_never_published_leaves_the_readers_own_values() {
    let p = pair(timer("reader", MS as u64, 80));
    p.cells[1].store(&7i64.to_ne_bytes());
    let (_sender, receiver) = p.host.connect(&spec(8, 0));
    read(&p, Inbound::new(receiver, vec![p.cells[1].clone()], vec![]), interval());
    run_until(&p.host, 2 * MS);
    assert_eq!(value(&p.cells[2]), 7_07);
}

#[test]
fn a_synchronous_reader_on_a_software_source_takes_each_value_once() {
    let p = pair(software("reader", 40));
    let (sender, receiver) = p.host.connect(&spec(0, 1));
    write(&p, Outbound::new(sender, vec![], member(&p.cells[0], Some(p.on.clone()), 0), Some(p.reader)));
    let inbound = Inbound::new(receiver, vec![], member(&p.cells[1], None, 0));
    let queued = Activation::new(Due::Queued { members: vec![(inbound.clone(), 0)], by: vec![] }, None);
    read(&p, inbound, queued);
    p.host.request(p.reader);
    run_until(&p.host, 7 * MS);
    assert_eq!(value(&p.cells[2]), 1_02_03);
    assert_eq!(p.host.statistics(p.reader).firings, 4, "the request without a value did nothing");
}

#[test]
fn a_queue_that_nobody_takes_from_overruns_and_names_both_ends() {
    let p = pair(software("reader", 40));
    let (sender, _receiver) = p.host.connect(&spec(0, 1));
    write(&p, Outbound::new(sender, vec![], member(&p.cells[0], Some(p.on.clone()), 0), Some(p.reader)));
    run_until(&p.host, 10 * MS);
    let told = events(&p.host);
    assert!(
        matches!(told.last(), Some(Event::Overrun { source, reader, member: 0, time_ns: 10_000_000 }) if *source == p.writer && *reader == p.reader),
        "{told:?}"
    );
}

#[test]
fn a_ratio_reader_takes_values_by_number() {
    let p = pair(timer("reader", MS as u64, 80));
    let (sender, receiver) = p.host.connect(&spec(0, 1));
    write(&p, Outbound::new(sender, vec![], member(&p.cells[0], Some(p.on.clone()), 0), None));
    let activation = interval();
    read(&p, Inbound::new(receiver, vec![], member(&p.cells[1], Some(activation.clone()), 2)), activation);
    run_until(&p.host, 8 * MS);
    // Invocation j takes number j/2 - 1: nothing for j = 0, 1; number 0 (value 1) for j = 2, 3; and so on.
    assert_eq!(value(&p.cells[2]), 1_01_02_02_03_03);
    assert!(!events(&p.host).iter().any(|event| matches!(event, Event::Late { .. })));
}

#[test]
fn an_absent_ratio_value_is_late_once_and_the_old_one_is_kept() {
    let p = pair(timer("reader", MS as u64, 80));
    let (_sender, receiver) = p.host.connect(&spec(0, 1));
    let activation = interval();
    read(&p, Inbound::new(receiver, vec![], member(&p.cells[1], Some(activation.clone()), 2)), activation);
    run_until(&p.host, 6 * MS);
    let late: Vec<_> =
        events(&p.host).into_iter().filter_map(|event| if let Event::Late { time_ns, .. } = event { Some(time_ns / MS) } else { None }).collect();
    assert_eq!(late, [3, 5]);
}

#[test]
fn a_store_between_firings_is_published_before_it_is_acknowledged() {
    let p = pair(timer("reader", MS as u64, 80));
    let (sender, receiver) = p.host.connect(&spec(8, 0));
    let table = Table::new(vec![], vec![], vec![Outbound::new(sender, vec![p.cells[0].clone()], vec![], None)], vec![], None);
    p.host.submit(p.writer, script(vec![Op::Table(Box::new(table))]));
    p.host.submit(p.writer, script(vec![Op::Store(p.cells[0].clone(), 5i64.to_ne_bytes().into())]));
    read(&p, Inbound::new(receiver, vec![p.cells[1].clone()], vec![]), interval());
    run_until(&p.host, MS);
    assert_eq!(value(&p.cells[2]), 5);
}

/// A processor to which nothing can be connected.
struct Unreachable;

impl RemoteWord for Unreachable {
    fn take(&self, _process: u64, _generation: u32, _insist: bool) -> Option<TakeResult> {
        None
    }
}

impl Remote for Unreachable {
    fn submit(&self, _source: SourceId, _script: Box<Script>) {}
    fn request(&self, _source: SourceId) {}
    fn restart(&self, _source: SourceId) {}
    fn statistics(&self, _source: SourceId) -> Statistics {
        Statistics::default()
    }
    fn probe(&self, _source: SourceId, _for_ns: u64) {}
    fn block_times(&self, _block: BlockId) -> BlockTimes {
        BlockTimes::default()
    }
    fn enter(&self, _process: u64, _stage: u16, _generation: u32) {}
    fn stop(&self, _set: bool) {}
    fn host(&self) -> Option<&str> {
        None
    }
    fn sender(&self, _number: u64, _spec: &ConnectionSpec) -> Result<Box<dyn Sender>, EndError> {
        Err(EndError { message: "it is gone".into() })
    }
    fn receiver(&self, _number: u64, _spec: &ConnectionSpec, _raise: Box<dyn Fn() + Send + Sync>) -> Result<Box<dyn Receiver>, EndError> {
        Err(EndError { message: "it is gone".into() })
    }
    fn close(&self) {}
}

#[test]
fn an_end_that_cannot_be_made_is_told_and_the_kernel_here_goes_on() {
    let p = pair(timer("reader", 2 * MS as u64, 80));
    let far = p.host.add_remote_source(timer("far", 2 * MS as u64, 50), Arc::new(Unreachable));
    let (away, _) = p.host.connect(&ConnectionSpec { reader: far.0, writer: p.writer.0, ..spec(8, 0) });
    let (_, back) = p.host.connect(&ConnectionSpec { writer: far.0, reader: p.reader.0, ..spec(8, 0) });
    write(&p, Outbound::new(away, vec![p.cells[0].clone()], vec![], None));
    read(&p, Inbound::new(back, vec![p.cells[1].clone()], vec![]), interval());
    run_until(&p.host, 7 * MS);
    assert_eq!((p.host.statistics(p.writer).firings, p.host.statistics(p.reader).firings), (3, 3));
    assert_eq!(value(&p.cells[2]), 0, "what never came is the initial value");
    let unconnected = |event: &Event| match event {
        Event::Unconnected { writer, reader, message } => Some((*writer, *reader, message.clone())),
        _ => None,
    };
    let told: Vec<_> = events(&p.host).iter().filter_map(unconnected).collect();
    assert_eq!(told, [(p.writer, far, "it is gone".to_owned()), (far, p.reader, "it is gone".to_owned())]);
}
