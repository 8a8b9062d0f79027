// SPDX-License-Identifier: Apache-2.0
//! Memory of a driver in C: its struct, from construction to destruction.
use super::abi;
use device::Counters;
use std::alloc::{Layout as Memory, alloc_zeroed, dealloc};
use std::ffi::{CString, c_void};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Alignment sufficient for every C type.
const ALIGNED: usize = 64;

/// Struct of a driver. It is shared by the driver's source and its services; the driver must make the fields that both use atomic, as the
/// header requires.
pub(super) struct Instance {
    pub(super) of: &'static abi::Driver,
    memory: *mut c_void,
    size: Memory,
    /// Strings from `make` to which the driver may have stored pointers.
    pub(super) texts: Vec<CString>,
    pub(super) counters: Arc<Counters>,
    pub(super) is_closed: AtomicBool,
    /// Lock held while the driver is being closed, and while a service runs.
    pub(super) busy: Mutex<()>,
}

// SAFETY: the memory belongs to the driver alone, and the header specifies which of its functions run on which threads.
unsafe impl Send for Instance {}
// SAFETY: as above.
unsafe impl Sync for Instance {}

impl Instance {
    /// Allocates zeroed memory of the driver's size; the driver itself is not created yet.
    ///
    /// # Errors
    /// Fails with a human-readable message if there is not enough memory.
    pub(super) fn new(of: &'static abi::Driver, counters: Counters) -> Result<Instance, String> {
        let size = Memory::from_size_align(usize::try_from(of.instance_size).unwrap_or(0).max(1), ALIGNED).map_err(|why| why.to_string())?;
        // SAFETY: its size is not 0.
        let memory: *mut c_void = unsafe { alloc_zeroed(size) }.cast();
        if memory.is_null() {
            return Err(format!("there is not enough memory for its {} bytes", size.size()));
        }
        Ok(Instance { of, memory, size, texts: Vec::new(), counters: Arc::new(counters), is_closed: AtomicBool::new(false), busy: Mutex::default() })
    }

    pub(super) fn memory(&self) -> *mut c_void {
        self.memory
    }

    /// Closes the driver once; waits for a running service.
    pub(super) fn close(&self) {
        let _held = self.busy.lock().unwrap_or_else(PoisonError::into_inner);
        if !self.is_closed.swap(true, Ordering::AcqRel)
            && let Some(close) = self.of.close
        {
            // SAFETY: the memory is the driver's own, which it has made.
            unsafe { close(self.memory) };
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        self.close();
        // SAFETY: the memory was allocated with this size.
        unsafe { dealloc(self.memory.cast(), self.size) };
    }
}
