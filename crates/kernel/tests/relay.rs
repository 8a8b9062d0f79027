// SPDX-License-Identifier: Apache-2.0
//! Remote sources: taking over a process there, and connections between a process of this host and another host, relayed by this one.
#![allow(clippy::undocumented_unsafe_blocks, clippy::macro_metavars_in_unsafe, reason = "test blocks are written by hand against the ABI")]
mod support;
use interconnect::{Carrier, ConnectionSpec, EndError, Memory, Receiver, Sender};
use kernel::*;
use runtime::{Host, Remote};
use std::sync::{Arc, Mutex};
use support::*;

type Raise = Box<dyn Fn() + Send + Sync>;
type Lying = (u64, Box<dyn Sender>, Raise);
type Ends = (End<dyn Sender>, End<dyn Receiver>);

/// A remote place with the ends of the connections made to it.
#[derive(Default)]
struct RelayPlace {
    host: Option<&'static str>,
    senders: Mutex<Vec<Lying>>,
    receivers: Mutex<Vec<(u64, Box<dyn Receiver>)>>,
    /// Result for the caller that takes over a process.
    taken: Option<TakeResult>,
    /// Held by each local reading end of a connection from there.
    reading: Arc<()>,
}

/// A reading end whose lifetime the place can observe.
struct TrackedEnd {
    end: Box<dyn Receiver>,
    _place: Arc<()>,
}

impl Receiver for TrackedEnd {
    fn latch(&mut self, now_ns: i64) -> Option<interconnect::Header> {
        self.end.latch(now_ns)
    }
    fn group(&self) -> &[u8] {
        self.end.group()
    }
    fn peek_row(&mut self) -> Option<(u64, &[u8])> {
        self.end.peek_row()
    }
    fn pop_row(&mut self) -> bool {
        self.end.pop_row()
    }
    fn rows(&self) -> usize {
        self.end.rows()
    }
}

impl RemoteWord for RelayPlace {
    fn take(&self, _process: u64, _generation: u32, _insist: bool) -> Option<TakeResult> {
        self.taken
    }
}

impl Remote for RelayPlace {
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
        self.host
    }
    fn sender(&self, number: u64, spec: &ConnectionSpec) -> Result<Box<dyn Sender>, EndError> {
        let (sender, receiver) = Memory.connect(spec);
        self.receivers.lock().unwrap().push((number, receiver));
        Ok(sender)
    }
    fn receiver(&self, number: u64, spec: &ConnectionSpec, raise: Raise) -> Result<Box<dyn Receiver>, EndError> {
        let (sender, receiver) = Memory.connect(spec);
        self.senders.lock().unwrap().push((number, sender, raise));
        Ok(Box::new(TrackedEnd { end: receiver, _place: self.reading.clone() }))
    }
    fn close(&self) {}
}

/// Creates a local process and a remote host, with a source each, and a connection from one to the other.
fn between(group_len: usize, depth: usize) -> (Host, Arc<RelayPlace>, Arc<RelayPlace>, Ends) {
    let host = monotonic_host();
    let (process, other) = (Arc::new(RelayPlace::default()), Arc::new(RelayPlace { host: Some("cell-b"), ..RelayPlace::default() }));
    let writer = host.add_remote_source(software("near", 50), process.clone());
    let reader = host.add_remote_source(software("far", 50), other.clone());
    let spec = ConnectionSpec { writer: writer.0, reader: reader.0, asynchronous_len: group_len, queue_row_len: 8 * depth.min(1), queue_depth: depth };
    let ends = host.connect(&spec);
    (host, process, other, ends)
}

/// Polls until there is a result; nothing here takes long, unless it never comes and the test hangs.
fn until<T>(mut found: impl FnMut() -> Option<T>) -> T {
    loop {
        if let Some(found) = found() {
            return found;
        }
        std::thread::yield_now();
    }
}

fn row(place: &RelayPlace) -> Option<(u64, u64)> {
    let mut receivers = place.receivers.lock().unwrap();
    let (_, receiver) = &mut receivers[0];
    let row = receiver.peek_row().map(|(number, bytes)| (number, u64::from_ne_bytes(bytes.try_into().unwrap())))?;
    // Pops only the row that was read: the next one may have arrived meanwhile.
    receiver.pop_row();
    Some(row)
}

#[test]
fn what_is_taken_elsewhere_is_in_the_stage_that_a_kernel_there_had_moved_it_to() {
    let host = monotonic_host();
    let source = host.add_remote_source(software("far", 50), Arc::new(RelayPlace { taken: Some(TakeResult::From(3)), ..RelayPlace::default() }));
    let process = host.process(1, 1, &[source]);
    assert_eq!(process.take(1, false), TakeResult::From(3), "the event that tells of the move has not come yet");
    assert_eq!(process.now(), (2, 3), "what goes on from here goes on there");
}

#[test]
fn each_end_is_on_a_way_of_its_own_to_here() {
    let (_host, process, other, (sender, receiver)) = between(8, 0);
    assert_eq!((sender.way.unwrap().reach, receiver.way.unwrap().reach), (Reach::Host, Reach::Network));
    let numbers = (process.senders.lock().unwrap()[0].0, other.receivers.lock().unwrap()[0].0);
    assert_eq!(numbers, (sender.way.unwrap().number, receiver.way.unwrap().number));
}

#[test]
fn a_group_keeps_its_number_and_time() {
    let (_host, process, other, _ends) = between(8, 0);
    for number in [7u64, 8] {
        let (_, sender, _) = &mut process.senders.lock().unwrap()[0];
        sender.group().copy_from_slice(&number.to_ne_bytes());
        sender.publish(number, 1000 + number as i64);
        let receiver = &mut other.receivers.lock().unwrap()[0].1;
        let header = until(|| receiver.latch(0));
        assert_eq!((header.number, header.time_ns, receiver.group()), (number, 1000 + number as i64, number.to_ne_bytes().as_slice()));
    }
}

#[test]
fn rows_come_in_order_each_once_and_those_that_find_no_room_wait() {
    const ROWS: u64 = 100;
    let (_host, process, other, _ends) = between(0, 4);
    let (mut pushed, mut refused, mut read) = (0, 0, Vec::new());
    while read.len() < ROWS as usize {
        let (_, sender, raise) = &mut process.senders.lock().unwrap()[0];
        if pushed < ROWS {
            match sender.push(pushed, 0, &mut |row| row.copy_from_slice(&pushed.to_ne_bytes())) {
                Ok(()) => pushed += 1,
                Err(_) => refused += 1,
            }
            raise();
        }
        // Nothing is read until both queues are full.
        if refused > 0 && pushed >= 8 || pushed == ROWS {
            read.extend(row(&other));
        }
    }
    assert_eq!(read, (0..ROWS).map(|number| (number, number)).collect::<Vec<_>>());
}

#[test]
fn it_ends_when_neither_end_is_kept_any_more() {
    let (_host, process, other, (sender, receiver)) = between(0, 1);
    drop(sender);
    {
        let (_, writing, raise) = &mut process.senders.lock().unwrap()[0];
        writing.push(3, 0, &mut |row| row.copy_from_slice(&3u64.to_ne_bytes())).unwrap();
        raise();
    }
    assert_eq!(until(|| row(&other)), (3, 3), "its reader may still have what comes");
    drop(receiver);
    until(|| (Arc::strong_count(&process.reading) == 1).then_some(()));
}

#[test]
fn closing_the_host_ends_those_that_are_wanted() {
    let (host, process, _other, _ends) = between(8, 1);
    host.close();
    assert_eq!(Arc::strong_count(&process.reading), 1);
}
