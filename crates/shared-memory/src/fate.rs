// SPDX-License-Identifier: Apache-2.0
//! Loss of a connection because a word of its memory contains a value that no end would write. The cause is kept until it is queried.
use interconnect::{ConnectionSpec, LostConnection};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};

/// Loss state of one end of a connection.
pub(crate) struct Fate {
    number: u64,
    spec: ConnectionSpec,
    /// Process that created the memory; `None` if this end created it.
    maker: Option<u32>,
    lost: AtomicBool,
    told: AtomicBool,
    word: AtomicU32,
    value: AtomicU64,
}

/// Word with an impossible value.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum Word {
    /// Index of the buffer in the middle.
    Middle,
    /// A count of rows; the value recorded with it is the number of waiting rows that follows from the count.
    Rows,
}

impl Fate {
    pub fn new(number: u64, spec: &ConnectionSpec, maker: Option<u32>) -> Fate {
        let (lost, told) = (AtomicBool::new(false), AtomicBool::new(false));
        Fate { number, spec: *spec, maker, lost, told, word: AtomicU32::new(0), value: AtomicU64::new(0) }
    }

    /// Returns true if the connection is lost. Takes one load of a line that only this process writes.
    #[inline]
    pub fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    /// Marks the connection as lost. The first cause is kept. Real-time safe.
    #[cold]
    pub fn lose(&self, word: Word, value: u64) {
        if !self.is_lost() {
            self.word.store(word as u32, Ordering::Relaxed);
            self.value.store(value, Ordering::Relaxed);
            self.lost.store(true, Ordering::Release);
        }
    }

    /// Returns the cause of the connection's loss, once.
    pub fn news(&self) -> Option<LostConnection> {
        if !self.lost.load(Ordering::Acquire) || self.told.swap(true, Ordering::Relaxed) {
            return None;
        }
        let (value, depth) = (self.value.load(Ordering::Relaxed), self.spec.queue_depth);
        let what = match self.word.load(Ordering::Relaxed) {
            word if word == Word::Middle as u32 => format!("the word of its buffers is {value:#x}"),
            _ => format!("{value} rows are marked as waiting, but there is room for only {depth}"),
        };
        let maker = self.maker.map_or(String::new(), |process| format!(", which process {process} created,"));
        let message =
            format!("the memory of connection {}{maker} was overwritten: {what}; find the process at fault and end it, then reset its processor", self.number);
        Some(LostConnection { writer: self.spec.writer, reader: self.spec.reader, message })
    }
}
