// SPDX-License-Identifier: Apache-2.0
//! Connections in memory, between the threads of one process.
use crate::carrier::{Carrier, ConnectionSpec, Full, Header, Receiver, Sender};
use crate::queue::{QueueReader, QueueWriter, queue};
use crate::triple::{TripleReader, TripleWriter, triple_buffer};

/// Carrier that keeps the group in a triple buffer and the rows in a queue; everything arrives within the sender's call.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory;

impl Carrier for Memory {
    fn connect(&mut self, spec: &ConnectionSpec) -> (Box<dyn Sender>, Box<dyn Receiver>) {
        let (group_writer, group_reader) = triple_buffer(Header::behind(spec.asynchronous_len) + Header::LEN);
        let (queue_writer, queue_reader) = match spec.queue_depth {
            0 => (None, None),
            depth => {
                let (writer, reader) = queue(spec.queue_row_len, depth);
                (Some(writer), Some(reader))
            }
        };
        let group_len = spec.asynchronous_len;
        let sender = MemorySender { group: group_writer, group_len, queue: queue_writer };
        (Box::new(sender), Box::new(MemoryReceiver { group: group_reader, group_len, queue: queue_reader }))
    }

    fn next_arrival(&self) -> Option<i64> {
        None
    }

    fn deliver(&mut self, _now_ns: i64, _raise: &mut dyn FnMut(u32)) {}
}

struct MemorySender {
    group: TripleWriter,
    group_len: usize,
    queue: Option<QueueWriter>,
}

impl Sender for MemorySender {
    fn group(&mut self) -> &mut [u8] {
        &mut self.group.back()[..self.group_len]
    }

    fn publish(&mut self, number: u64, now_ns: i64) {
        Header { number, time_ns: now_ns }.write(self.group.back(), Header::behind(self.group_len));
        self.group.publish();
    }

    fn push(&mut self, number: u64, _now_ns: i64, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full> {
        self.queue.as_mut().expect("rows are pushed only into a connection that was made with a queue").push(number, fill)
    }
}

struct MemoryReceiver {
    group: TripleReader,
    group_len: usize,
    queue: Option<QueueReader>,
}

impl Receiver for MemoryReceiver {
    fn latch(&mut self, _now_ns: i64) -> Option<Header> {
        if !self.group.latch() {
            return None;
        }
        Some(Header::read(self.group.front(), Header::behind(self.group_len)))
    }

    fn group(&self) -> &[u8] {
        &self.group.front()[..self.group_len]
    }

    fn peek_row(&mut self) -> Option<(u64, &[u8])> {
        self.queue.as_mut()?.peek()
    }

    fn pop_row(&mut self) -> bool {
        self.queue.as_mut().is_some_and(QueueReader::pop)
    }

    fn rows(&self) -> usize {
        self.queue.as_ref().map_or(0, QueueReader::len)
    }
}
