// SPDX-License-Identifier: Apache-2.0
//! Writing end of a connection.
use crate::bell::{BellNumber, Bells};
use crate::connection::Connection;
use crate::layout::{Layout, published_at};
use interconnect::{ConnectionSpec, Full, Header, QueueWriter, Sender, TripleWriter};
use std::sync::Arc;
use std::sync::atomic::Ordering;

pub(crate) struct SharedSender {
    group: TripleWriter<Layout>,
    group_len: usize,
    queue: Option<QueueWriter<Layout>>,
    bells: Arc<Bells>,
    connection: Connection,
}

impl SharedSender {
    pub fn new(connection: Connection, bells: Arc<Bells>, spec: &ConnectionSpec) -> Self {
        let layout = || connection.layout.clone();
        // SAFETY: `connection` has claimed the writing end, and found the buffer that is nobody else's.
        let group = unsafe { TripleWriter::in_memory(layout(), connection.index) };
        // SAFETY: as above; the counts stay when an end is killed.
        let queue = (spec.queue_depth > 0).then(|| unsafe { QueueWriter::in_memory(layout()) });
        SharedSender { group, group_len: spec.asynchronous_len, queue, bells, connection }
    }
}

impl Sender for SharedSender {
    fn group(&mut self) -> &mut [u8] {
        &mut self.group.back()[..self.group_len]
    }

    fn publish(&mut self, number: u64, now_ns: i64) {
        if self.connection.layout.is_lost() {
            return;
        }
        let buffer = self.group.back();
        Header { number, time_ns: now_ns }.write(buffer, Header::behind(self.group_len));
        buffer[published_at(self.group_len)] = 1;
        self.group.publish();
        self.connection.layout.back().store(self.group.index(), Ordering::Release);
    }

    fn push(&mut self, number: u64, _now_ns: i64, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full> {
        self.queue.as_mut().expect("rows are pushed only into a connection that was made with a queue").push(number, fill)?;
        self.bells.ring(BellNumber(self.connection.layout.bell().load(Ordering::SeqCst)));
        Ok(())
    }

    /// Returns false, because the listener of the reader's process raises the reader.
    fn arrived(&self) -> bool {
        false
    }
}
