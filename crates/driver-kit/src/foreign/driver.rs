// SPDX-License-Identifier: Apache-2.0
//! A driver in C behind the trait that every driver has.
use super::abi;
use super::host::Host;
use super::services::Calls;
use device::{Channel, Counters, DeviceError, Driver, DriverError, Opened, SafeHandle, Services};
use serde_json::{Map, Value, json};
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
    /// What it may have kept from `make`.
    _texts: Vec<CString>,
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
    pub(super) fn memory(&self) -> *mut c_void {
        self.memory
    }

    /// Once, and not while a service runs.
    fn close(&self) {
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

pub(super) struct ForeignDriver {
    instance: Arc<Instance>,
    channels: Vec<Channel>,
    watchdog_ns: Option<i64>,
    services: Option<Arc<Calls>>,
    is_open: bool,
}

/// Makes one; `given` has the defaults in it.
pub(super) fn make(
    of: &'static abi::Driver,
    name: &str,
    given: Map<String, Value>,
    counters: Counters,
    calls: impl FnOnce(Arc<Instance>) -> Option<Arc<Calls>>,
) -> Result<Opened, DriverError> {
    let failed = |what: String| DriverError::Failed(format!("driver '{name}': {what}"));
    let size = Memory::from_size_align(usize::try_from(of.instance_size).unwrap_or(0).max(1), ALIGNED).map_err(|why| failed(why.to_string()))?;
    // SAFETY: its size is not 0.
    let memory: *mut c_void = unsafe { alloc_zeroed(size) }.cast();
    if memory.is_null() {
        return Err(failed(format!("there is no memory for its {} bytes", size.size())));
    }
    let counters = Arc::new(counters);
    let mut host = Host { given, layout: Some(device::Layout::default()), counters: Some(&counters), ..Host::default() };
    // SAFETY: the function takes its own memory, 0 and of its size, and a host that outlives the call.
    let made = host.call(|host| of.make.map_or(std::ptr::null(), |make| unsafe { make(memory, host) }));
    let (layout, parts, watchdog_ns, texts) = (host.layout.take(), std::mem::take(&mut host.parts), host.watchdog_ns, std::mem::take(&mut host.texts));
    let instance =
        Arc::new(Instance { of, memory, size, _texts: texts, counters: counters.clone(), is_closed: AtomicBool::new(false), busy: Mutex::default() });
    made.map_err(failed)?;
    let channels = layout.unwrap_or_default().into_channels();
    if channels.iter().any(|channel| channel.direction == device::Direction::Write) && (of.safe_state.is_none() || of.write.is_none()) {
        return Err(failed(format!("it has channels that are written, and no function {name}_write or {name}_safe_state")));
    }
    let services = calls(instance.clone());
    Ok((Box::new(ForeignDriver { instance, channels, watchdog_ns, services, is_open: false }), json!({ "parts": parts })))
}

fn lost(cause: abi::Cause) -> Result<(), DeviceError> {
    if cause.is_null() {
        return Ok(());
    }
    // SAFETY: a cause is a text.
    Err(DeviceError { message: unsafe { abi::text(cause) } })
}

impl ForeignDriver {
    fn opened(&self) -> Result<(), DeviceError> {
        if self.is_open { Ok(()) } else { Err(DeviceError { message: "it is not open".to_owned() }) }
    }
}

impl Driver for ForeignDriver {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        if self.is_open || self.instance.is_closed.load(Ordering::Acquire) {
            return Err(DeviceError { message: "it was opened before; open the device anew".to_owned() });
        }
        // SAFETY: its own memory; the same holds for each call below.
        lost(self.instance.of.open.map_or(std::ptr::null(), |open| unsafe { open(self.instance.memory, now_ns) }))?;
        self.is_open = true;
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        self.opened()?;
        // SAFETY: see `open`; as many bytes as its channels have lie there.
        lost(self.instance.of.read.map_or(std::ptr::null(), |read| unsafe { read(self.instance.memory, release_ns, readings.as_mut_ptr()) }))
    }

    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        self.opened()?;
        let write = |write: unsafe extern "C" fn(*mut c_void, i64, *const u8, *const u8) -> abi::Cause| {
            // SAFETY: see `read`; there is one flag for each channel that is written.
            unsafe { write(self.instance.memory, release_ns, commands.as_ptr(), engaged.as_ptr().cast()) }
        };
        lost(self.instance.of.write.map_or(std::ptr::null(), write))
    }

    fn safe_state(&mut self) {
        if let (Some(safe_state), false) = (self.instance.of.safe_state, self.instance.is_closed.load(Ordering::Acquire)) {
            // SAFETY: see `open`.
            unsafe { safe_state(self.instance.memory) };
        }
    }

    fn close(&mut self) {
        self.is_open = false;
        self.instance.close();
    }

    fn safe_handles(&self) -> Vec<SafeHandle> {
        let mut host = Host::default();
        // SAFETY: see `open`.
        let told = host.call(|host| self.instance.of.handles.map_or(std::ptr::null(), |handles| unsafe { handles(self.instance.memory, host) }));
        // One that fails has none: what is declared of the guard does not hold then, which the conformance kit finds.
        if told.is_ok() { host.handles } else { Vec::new() }
    }

    fn watchdog_ns(&self) -> Option<i64> {
        self.watchdog_ns
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        self.services.clone().map(|calls| calls as Arc<dyn Services>)
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        (!self.instance.counters.words().is_empty()).then(|| self.instance.counters.clone())
    }
}

impl Drop for ForeignDriver {
    fn drop(&mut self) {
        if self.is_open {
            self.safe_state();
        }
        self.close();
    }
}
