// SPDX-License-Identifier: Apache-2.0
//! A driver in C behind the common driver trait.
use super::abi;
use super::host::Host;
use super::instance::Instance;
use super::services::Calls;
use device::{Channel, Counters, DeviceError, Driver, DriverError, OpenedDriver, SafeHandle, Services};
use serde_json::{Map, Value, json};
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::Ordering;

pub(super) struct ForeignDriver {
    instance: Arc<Instance>,
    channels: Vec<Channel>,
    watchdog_ns: Option<i64>,
    services: Option<Arc<Calls>>,
    is_open: bool,
}

/// Creates a driver; `given` includes the defaults.
pub(super) fn make(
    of: &'static abi::Driver,
    name: &str,
    given: Map<String, Value>,
    counters: Counters,
    calls: impl FnOnce(Arc<Instance>) -> Option<Arc<Calls>>,
) -> Result<OpenedDriver, DriverError> {
    let failed = |what: String| DriverError::Failed(format!("driver '{name}': {what}"));
    let mut instance = Instance::new(of, counters).map_err(failed)?;
    let (memory, counters) = (instance.memory(), instance.counters.clone());
    let mut host = Host { given, layout: Some(device::Layout::default()), counters: Some(&counters), ..Host::default() };
    // SAFETY: the function takes its own memory, zeroed and of its size, and a host that outlives the call.
    let made = host.call(|host| of.make.map_or(std::ptr::null(), |make| unsafe { make(memory, host) }));
    let (layout, parts, watchdog_ns) = (host.layout.take(), std::mem::take(&mut host.parts), host.watchdog_ns);
    // The driver may have kept pointers to them.
    instance.texts = std::mem::take(&mut host.texts);
    let instance = Arc::new(instance);
    made.map_err(failed)?;
    let channels = layout.unwrap_or_default().into_channels();
    if channels.iter().any(|channel| channel.direction == device::Direction::Write) && (of.safe_state.is_none() || of.write.is_none()) {
        return Err(failed(format!("it has written channels but no function {name}_write or {name}_safe_state")));
    }
    let services = calls(instance.clone());
    Ok((Box::new(ForeignDriver { instance, channels, watchdog_ns, services, is_open: false }), json!({ "parts": parts })))
}

fn lost(cause: abi::Cause) -> Result<(), DeviceError> {
    if cause.is_null() {
        return Ok(());
    }
    // SAFETY: a cause is a NUL-terminated string.
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
            return Err(DeviceError { message: "it was opened before; open the device again".to_owned() });
        }
        // SAFETY: the memory is the driver's own; the same holds for each call below.
        lost(self.instance.of.open.map_or(std::ptr::null(), |open| unsafe { open(self.instance.memory(), now_ns) }))?;
        self.is_open = true;
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        self.opened()?;
        // SAFETY: see `open`; the buffer has the length of its channels.
        lost(self.instance.of.read.map_or(std::ptr::null(), |read| unsafe { read(self.instance.memory(), release_ns, readings.as_mut_ptr()) }))
    }

    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        self.opened()?;
        let write = |write: unsafe extern "C" fn(*mut c_void, i64, *const u8, *const u8) -> abi::Cause| {
            // SAFETY: see `read`; there is one flag for each written channel.
            unsafe { write(self.instance.memory(), release_ns, commands.as_ptr(), engaged.as_ptr().cast()) }
        };
        lost(self.instance.of.write.map_or(std::ptr::null(), write))
    }

    fn safe_state(&mut self) {
        if let (Some(safe_state), false) = (self.instance.of.safe_state, self.instance.is_closed.load(Ordering::Acquire)) {
            // SAFETY: see `open`.
            unsafe { safe_state(self.instance.memory()) };
        }
    }

    fn close(&mut self) {
        self.is_open = false;
        self.instance.close();
    }

    fn safe_handles(&self) -> Vec<SafeHandle> {
        let mut host = Host::default();
        // SAFETY: see `open`.
        let told = host.call(|host| self.instance.of.handles.map_or(std::ptr::null(), |handles| unsafe { handles(self.instance.memory(), host) }));
        // A driver that fails here has no handles: its declared guard then does not apply, which the conformance kit detects.
        if told.is_ok() { host.handles } else { Vec::new() }
    }

    fn watchdog_ns(&self) -> Option<i64> {
        self.watchdog_ns
    }

    fn taken_ns(&self) -> Option<i64> {
        // SAFETY: see `open`.
        self.instance.of.taken.map(|taken| unsafe { taken(self.instance.memory()) }).filter(|taken_ns| *taken_ns != i64::MIN)
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
