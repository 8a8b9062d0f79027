// SPDX-License-Identifier: Apache-2.0
//! Reopening of a lost device by the processor that runs it: tables and claims are kept.
use crate::agent::Agent;
use crate::protocol::Answer;
use crate::serve::BOUNDARY;
use crate::shared::locked;
use crate::take_over::holds_within;
use kernel::{Device, Op, Script, SourceId};
use runtime::{Holding, Renewal};
use std::sync::Arc;
use std::sync::atomic::Ordering;

impl Agent {
    /// Reopens a device. Fails with the driver's message; the device is then still lost.
    pub(crate) fn reopen(&mut self, device: &Arc<Device>, kind: &str, options: &serde_json::Value) -> Result<Answer, String> {
        let (retired, before) = Renewal::retire(device);
        self.renew(device, retired)?;
        // Many machines accept only one driver at a time, so the old one is closed first.
        before.close();
        let (driver, description) = drivers::open(kind, options).map_err(|why| why.to_string())?;
        let beside = device::Beside::of(kind, &*driver);
        let fresh = Device::open(device.name(), driver, self.shared.host.now_ns()).map_err(|why| why.message)?;
        let opened = Renewal::open(device, fresh)?;
        (self.terms.device)(device, true);
        self.renew(device, opened)?;
        locked(&self.shared.besides).insert(device.name().to_owned(), beside);
        Ok(Answer::Opened { channels: device.channels().to_vec(), description: description.to_string() })
    }

    fn renew(&self, device: &Arc<Device>, renewal: Renewal) -> Result<(), String> {
        let done = renewal.is_done();
        match self.source_of(device) {
            Some(source) => self.shared.host.submit(source, Box::new(Script { id: 0, ops: vec![Op::Renew(Box::new(renewal))] })),
            // SAFETY: tables come by this thread alone, and none has the device.
            None => unsafe { renewal.alone() },
        }
        let is_done = holds_within(BOUNDARY, || done.load(Ordering::Acquire));
        is_done.then_some(()).ok_or_else(|| format!("its source did not respond within {} s; check whether its processor is overloaded", BOUNDARY.as_secs()))
    }

    fn source_of(&self, device: &Arc<Device>) -> Option<SourceId> {
        let holds = |holding: &Holding| holding.devices().iter().any(|held| Arc::ptr_eq(held, device));
        self.held.iter().find(|(_, holding)| holds(holding)).map(|(source, _)| *source)
    }
}
