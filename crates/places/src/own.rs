// SPDX-License-Identifier: Apache-2.0
//! Guarding of this process, for processors that are threads of the program.
use device::SafeHandle;
use guard::{Bounds, Guard};
use process_kit::Heartbeat;
use rtp::{Holder, ProcessorHold};
use std::sync::Arc;

/// A guarded processor of this process.
pub(crate) struct Own {
    guard: Arc<Guard>,
    ward: u64,
    heart: Heartbeat,
}

impl Own {
    /// Guards this process on behalf of one of its processors. Fails with a message if it cannot be guarded.
    pub fn guarded(guard: Arc<Guard>, ward: u64, processor: &str, bounds: Bounds) -> Result<Own, String> {
        let heart = Heartbeat::new().map_err(crate::text)?;
        let watched = Heartbeat::received(heart.descriptor().map_err(crate::text)?).map_err(crate::text)?;
        guard.watch_this(ward, processor, watched, bounds).map_err(crate::text)?;
        Ok(Own { guard, ward, heart })
    }
}

impl ProcessorHold for Own {
    fn holder(&self) -> Holder {
        let (guard, ward) = (self.guard.clone(), self.ward);
        Box::new(move |device: &str, handles: &[SafeHandle]| {
            let copy = |of: &SafeHandle| Ok(SafeHandle { descriptor: of.descriptor.try_clone()?, writes: of.writes.clone(), latches: of.latches });
            let copies = handles.iter().map(copy).collect::<std::io::Result<Vec<_>>>().map_err(crate::text)?;
            guard.hold(ward, device, copies).map_err(crate::text)
        })
    }

    fn beat(&self) {
        self.heart.beat();
    }
}

impl Drop for Own {
    fn drop(&mut self) {
        // If the guard has exited, there is nothing to forget.
        let _forgotten = self.guard.forget(self.ward);
    }
}
