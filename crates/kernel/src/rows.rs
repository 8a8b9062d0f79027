// SPDX-License-Identifier: Apache-2.0
//! Rings of rows, as a kernel writes them.
use crate::memory::Span;
use std::cell::UnsafeCell;
use std::sync::Arc;

/// The writing end of a ring of rows, used by one source at a time.
pub struct RowsEnd(pub(crate) UnsafeCell<interconnect::RowsWriter>);

// SAFETY: used by the kernel of one source at a time.
unsafe impl Send for RowsEnd {}
// SAFETY: as for `Send`.
unsafe impl Sync for RowsEnd {}

impl RowsEnd {
    /// Wraps the writing end created by `interconnect::rows`.
    pub fn new(writer: interconnect::RowsWriter) -> Arc<RowsEnd> {
        Arc::new(RowsEnd(UnsafeCell::new(writer)))
    }

    /// Returns the size of a row in bytes, and the number of rows that the ring holds.
    pub fn shape(&self) -> (usize, usize) {
        // SAFETY: neither ever changes.
        let writer = unsafe { &*self.0.get() };
        (writer.row_len(), writer.depth())
    }

    /// Returns a reader of the ring.
    pub fn reader(&self) -> interconnect::RowsReader {
        // SAFETY: the shared part of a writer never changes.
        unsafe { &*self.0.get() }.reader()
    }

    /// Writes a row received from a remote kernel, `lost` rows after the previous one. Called only by the thread that receives from that
    /// kernel. Ignores rows of the wrong length.
    pub fn repeat(&self, lost: u64, number: u64, time_ns: i64, bytes: &[u8]) {
        // SAFETY: the caller is the one that touches it: the ring's source has no kernel here.
        let writer = unsafe { &mut *self.0.get() };
        writer.skip(lost.min(u64::from(u32::MAX)));
        if bytes.len() == writer.row_len() {
            writer.write(number, time_ns, |sink| sink.put(bytes));
        }
    }

    /// Prefetches the memory of the next row before the steps run.
    ///
    /// # Safety
    /// Must be called only by the kernel of the source that uses the ring.
    #[inline]
    pub(crate) unsafe fn expect(&self) {
        // SAFETY: the caller is the one that touches it.
        unsafe { &*self.0.get() }.expect();
    }

    /// Writes one row of `spans`.
    ///
    /// # Safety
    /// Must be called only by the kernel of the source that uses the ring.
    #[inline]
    pub(crate) unsafe fn write(&self, number: u64, now_ns: i64, spans: &[Span]) {
        // SAFETY: the caller is the one that touches it.
        let writer = unsafe { &mut *self.0.get() };
        writer.write(number, now_ns, |sink| {
            for span in spans {
                // SAFETY: a span lies within its cells, which the table holds.
                sink.put(unsafe { std::slice::from_raw_parts(span.start, span.len) });
            }
        });
    }
}
