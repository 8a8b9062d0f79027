// SPDX-License-Identifier: Apache-2.0
//! Reading end of a connection.
use crate::connection::Connection;
use crate::layout::{Layout, published_at};
use crate::listener::Listener;
use interconnect::triple::is_news;
use interconnect::{ConnectionSpec, Header, QueueReader, Receiver, TripleMemory, TripleReader};
use std::sync::Arc;
use std::sync::atomic::Ordering;

pub(crate) struct SharedReceiver {
    group: TripleReader<Layout>,
    group_len: usize,
    queue: Option<QueueReader<Layout>>,
    /// True while the front buffer contains a publication that a previous reader had latched: it is the newest one, and new to this
    /// reader.
    inherited: bool,
    /// Group before the first publication.
    zeros: Box<[u8]>,
    watched: Option<Watch>,
    connection: Connection,
}

/// A queue for which the listener raises this end.
pub(crate) struct Watch {
    pub listener: Arc<Listener>,
    pub key: u64,
}

impl SharedReceiver {
    pub fn new(connection: Connection, watched: Option<Watch>, spec: &ConnectionSpec) -> Self {
        let layout = || connection.layout.clone();
        // SAFETY: `connection` has claimed the reading end, and found the buffer that is nobody else's.
        let group = unsafe { TripleReader::in_memory(layout(), connection.index) };
        let news = is_news(connection.layout.middle().load(Ordering::Acquire));
        let inherited = !news && group.front()[published_at(spec.asynchronous_len)] == 1;
        if !inherited {
            // SAFETY: this end's buffer, as above; the reference ends with the statement.
            unsafe { (*TripleMemory::for_writing(&connection.layout, connection.index)).fill(0) };
        }
        // SAFETY: as of the group; the counts stay when an end is killed.
        let queue = (spec.queue_depth > 0).then(|| unsafe { QueueReader::in_memory(layout()) });
        SharedReceiver { group, group_len: spec.asynchronous_len, queue, inherited, zeros: vec![0; spec.asynchronous_len].into(), watched, connection }
    }
}

impl Receiver for SharedReceiver {
    fn latch(&mut self, _now_ns: i64) -> Option<Header> {
        if self.connection.layout.is_lost() {
            return None;
        }
        if self.group.latch() {
            // The received buffer is known to be complete only if the word was valid.
            if self.connection.layout.is_lost() {
                return None;
            }
            self.connection.layout.front().store(self.group.index(), Ordering::Release);
        } else if !self.inherited {
            return None;
        }
        self.inherited = false;
        Some(Header::read(self.group.front(), Header::behind(self.group_len)))
    }

    fn group(&self) -> &[u8] {
        if self.inherited { &self.zeros } else { &self.group.front()[..self.group_len] }
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

impl Drop for SharedReceiver {
    fn drop(&mut self) {
        if let Some(Watch { listener, key }) = &self.watched {
            listener.forget(*key);
        }
    }
}
