// SPDX-License-Identifier: Apache-2.0
//! The memory of a driver in C: its struct, from the making to its end.
use super::abi;
use device::Counters;
use std::alloc::{Layout as Memory, alloc_zeroed, dealloc};
use std::ffi::{CString, c_void};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Every type of C begins at a multiple of it.
const ALIGNED: usize = 64;

/// The struct of a driver. Its source and its services share it; what both use in it is theirs to make atomic, as the header says.
pub(super) struct Instance {
    pub(super) of: &'static abi::Driver,
    memory: *mut c_void,
    size: Memory,
    /// Texts that it may have kept from `make`.
    pub(super) texts: Vec<CString>,
    pub(super) counters: Arc<Counters>,
    pub(super) is_closed: AtomicBool,
    /// Held while it is closed, and while a service runs.
    pub(super) busy: Mutex<()>,
}

// SAFETY: the memory is of the driver alone, which is told which of its functions run on which threads.
unsafe impl Send for Instance {}
// SAFETY: as above.
unsafe impl Sync for Instance {}

impl Instance {
    /// Memory of its size, all 0; not yet told to make itself.
    ///
    /// # Errors
    /// For people: there is no such memory.
    pub(super) fn new(of: &'static abi::Driver, counters: Counters) -> Result<Instance, String> {
        let size = Memory::from_size_align(usize::try_from(of.instance_size).unwrap_or(0).max(1), ALIGNED).map_err(|why| why.to_string())?;
        // SAFETY: its size is not 0.
        let memory: *mut c_void = unsafe { alloc_zeroed(size) }.cast();
        if memory.is_null() {
            return Err(format!("there is no memory for its {} bytes", size.size()));
        }
        Ok(Instance { of, memory, size, texts: Vec::new(), counters: Arc::new(counters), is_closed: AtomicBool::new(false), busy: Mutex::default() })
    }

    pub(super) fn memory(&self) -> *mut c_void {
        self.memory
    }

    /// Once, and not while a service runs.
    pub(super) fn close(&self) {
        let _held = self.busy.lock().unwrap_or_else(PoisonError::into_inner);
        if !self.is_closed.swap(true, Ordering::AcqRel)
            && let Some(close) = self.of.close
        {
            // SAFETY: its own memory, which it made.
            unsafe { close(self.memory) };
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        self.close();
        // SAFETY: it was allocated with this size.
        unsafe { dealloc(self.memory.cast(), self.size) };
    }
}
