// SPDX-License-Identifier: Apache-2.0
//! Take-over: processes that ran without a supervisor continue in the sources that a new supervisor has created in addition.
use crate::agent::Agent;
use crate::protocol::TakenOver;
use crate::serve::BOUNDARY;
use crate::shared::locked;
use kernel::{Device, Op, Script};
use runtime::{Heritage, Holding};
use std::collections::HashSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Timeout for the first write to a device, and the poll period.
const FIRST_WRITE: Duration = Duration::from_secs(1);
const LOOK: Duration = Duration::from_micros(200);

impl Agent {
    /// Replaces the agent whose blocks already run here, and resumes the blocks from their previous state. Fails with a message, and
    /// changes nothing, if there is no such agent or its emergency stop is latched.
    pub(crate) fn take_over(&mut self) -> Result<TakenOver, String> {
        let Some(before) = &self.before else { return Err("nothing runs there that another system had started".to_owned()) };
        if before.stop.load(Ordering::Acquire) && !self.stop.load(Ordering::Acquire) {
            return Err(
                "its emergency stop is in force since its system was lost; call emergency_stop() here first, and reset() when the cause is removed".to_owned()
            );
        }
        let ahead_ns = self.shared.host.epoch_ns() - before.shared.host.epoch_ns();
        let held: Vec<Holding> = before.held.values().cloned().collect();
        let mut report = TakenOver::default();
        let mut heritages = Vec::new();
        for (source, holding) in &self.held {
            let (heritage, passed) = Heritage::between(holding, &held, ahead_ns);
            report.carried.extend(passed.carried);
            report.anew.extend(passed.anew);
            heritages.push((*source, heritage));
        }
        let present: HashSet<&str> = self.held.values().flat_map(Holding::labels).collect();
        report.ended = held.iter().flat_map(Holding::labels).filter(|label| !present.contains(label)).map(str::to_owned).collect();
        // From here there must be no delay: the outputs hold the last written values.
        let mut before = self.before.take().expect("it is there: seen above");
        self.shared.leads.store(true, Ordering::Release);
        before.shared.host.leave();
        let done: Vec<Arc<AtomicBool>> = heritages.iter().map(|(_, heritage)| heritage.is_done()).collect();
        for (source, heritage) in heritages {
            self.shared.host.submit(source, Box::new(Script { id: 0, ops: vec![Op::Inherit(Box::new(heritage))] }));
        }
        let is_done = holds_within(BOUNDARY, || done.iter().all(|done| done.load(Ordering::Acquire)));
        self.take_over_idle(ahead_ns);
        drop(held);
        self.forget(&mut before);
        drop(before);
        report.gap_ns = self.gap_ns();
        if is_done {
            Ok(report)
        } else {
            Err(format!("its sources did not take it over within {} s; check whether its processor is overloaded", BOUNDARY.as_secs()))
        }
    }

    /// Takes over, without a kernel, devices that do not belong to any source of this system.
    fn take_over_idle(&self, ahead_ns: i64) {
        let is_held = |device: &Arc<Device>| self.held.values().flat_map(Holding::devices).any(|held| Arc::ptr_eq(held, device));
        for device in locked(&self.shared.devices).values().filter(|device| !is_held(device)) {
            // SAFETY: tables come by this thread alone, and none has the device; the host before has left.
            unsafe { Heritage::alone(device, ahead_ns) };
        }
    }

    /// Ends the take-over: devices that were not taken over are made safe when the last reference to them is dropped.
    fn forget(&self, before: &mut Agent) {
        before.hush();
        before.held.clear();
        let devices = std::mem::take(&mut *locked(&before.shared.devices));
        let own = locked(&self.shared.devices);
        for (name, device) in devices {
            if !own.contains_key(&name) {
                (self.terms.device)(&device, false);
            }
        }
    }

    /// Returns the maximum time for which a device was not written.
    fn gap_ns(&self) -> Option<i64> {
        let devices: Vec<Arc<Device>> = self.held.values().flat_map(Holding::devices).cloned().collect();
        holds_within(FIRST_WRITE, || devices.iter().all(|device| device.seen().gap_ns().is_some()));
        devices.iter().filter_map(|device| device.seen().gap_ns()).max()
    }
}

/// Returns true if the condition becomes true within the limit.
pub(crate) fn holds_within(limit: Duration, holds: impl Fn() -> bool) -> bool {
    let until = Instant::now() + limit;
    loop {
        if holds() {
            return true;
        }
        if Instant::now() >= until {
            return false;
        }
        std::thread::sleep(LOOK);
    }
}
