// SPDX-License-Identifier: Apache-2.0
//! Edges: read channels of a device that raise an interrupt source when they change from zero to non-zero.
use crate::device::Device;
use crate::memory;
use crate::source::SourceId;
use std::cell::Cell as Remembered;
use std::sync::Arc;

/// Number format of a channel's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Number {
    Float,
    Double,
    /// An integer or `bool`.
    Whole,
}

/// A watched channel, and the source that it raises. Shared by successive tables of the device's source.
pub struct Edge {
    pub device: Arc<Device>,
    /// Index of the channel.
    pub index: usize,
    channel: memory::Cell,
    pub number: Number,
    pub raises: SourceId,
    /// True if the value was non-zero at the last reading; the first reading never counts as an edge.
    was_set: Remembered<Option<bool>>,
}

// SAFETY: `was_set` is touched only by the kernel of the device's source.
unsafe impl Send for Edge {}
// SAFETY: as for `Send`.
unsafe impl Sync for Edge {}

impl Edge {
    /// Watches the scalar read channel `channel` of `device`. Panics if it is not a read channel.
    pub fn new(device: &Arc<Device>, channel: usize, number: Number, raises: SourceId) -> Arc<Edge> {
        assert!(device.channels()[channel].direction == device::Direction::Read, "only a channel that is read has edges");
        let cell = device.cell(channel);
        assert!(cell.len() <= size_of::<u64>(), "only a scalar has edges");
        Arc::new(Edge { device: device.clone(), index: channel, channel: cell, number, raises, was_set: Remembered::new(None) })
    }

    /// Returns true if the channel has just changed from zero to non-zero. Called after each read of the device.
    ///
    /// # Safety
    /// Must be called only by the kernel of the device's source.
    pub(crate) unsafe fn rises(&self) -> bool {
        if self.device.is_lost() {
            return false;
        }
        let mut bytes = [0; size_of::<u64>()];
        // SAFETY: the cell is held and has at most eight bytes (checked when the edge was made); nobody writes it now.
        unsafe { self.channel.start().copy_to_nonoverlapping(bytes.as_mut_ptr(), self.channel.len()) };
        let word = u64::from_le_bytes(bytes);
        let is_set = match self.number {
            Number::Float => f32::from_bits(word as u32) != 0.0,
            Number::Double => f64::from_bits(word) != 0.0,
            Number::Whole => word != 0,
        };
        self.was_set.replace(Some(is_set)) == Some(false) && is_set
    }
}
