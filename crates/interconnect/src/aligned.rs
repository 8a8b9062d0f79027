// SPDX-License-Identifier: Apache-2.0
//! Byte buffers that share no cache line with other data.

/// Size of a cache line in bytes.
pub(crate) const LINE: usize = 64;

/// `len` zeroed bytes that start on a cache line and share no cache line with other data.
pub(crate) struct AlignedBytes {
    /// Memory, one line longer than requested, so that the start can be aligned.
    memory: Box<[u8]>,
    start: usize,
    len: usize,
}

impl AlignedBytes {
    pub(crate) fn new(len: usize) -> Self {
        let memory = vec![0u8; len.next_multiple_of(LINE) + LINE].into_boxed_slice();
        // The memory of a box does not move, so the offset holds for its lifetime.
        let address = memory.as_ptr().addr();
        AlignedBytes { start: address.next_multiple_of(LINE) - address, memory, len }
    }

    #[inline]
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.memory[self.start..self.start + self.len]
    }

    #[inline]
    pub(crate) fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.memory[self.start..self.start + self.len]
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn bytes_start_on_a_line_and_end_before_the_next_allocation() {
        for len in [0, 1, 63, 64, 65, 1000] {
            let aligned = AlignedBytes::new(len);
            assert_eq!(aligned.bytes().len(), len);
            assert_eq!(aligned.bytes().as_ptr().addr() % LINE, 0);
            assert!(aligned.start + len.next_multiple_of(LINE) <= aligned.memory.len());
        }
    }
}
