// SPDX-License-Identifier: Apache-2.0
//! Reopening of lost physical devices without dismantling the configuration.
use crate::alarms::causes::{alarm_closed, alarm_lost};
use crate::core::Core;
use crate::processors::remote::processor_of;
use crate::refuse::{invalid_state, refuse, unknown};
use crate::scripts::Purpose;
use crate::system::{System, WaitResult};
use device::Beside;
use kernel::{Device, Op, SourceId};
use model::refusal::{Class, Refusals};
use runtime::{Renewal, remote_device};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

impl System {
    /// Reopens a lost physical device with its original options; cells, claims and bindings are kept. Does nothing if the device is not
    /// lost.
    pub fn reopen(&self, name: &str) -> Result<(), Refusals> {
        let (device, source, (kind, options)) = {
            let core = self.shared.locked();
            let Some(physical) = core.registry.physical.get(name) else {
                return Err(unknown("physical device", name, core.registry.physical.keys().map(String::as_str)));
            };
            if physical.lost.is_none() {
                return Ok(());
            }
            if core.safety.lost.contains(&physical.source) {
                let what = format!("lost with source '{}'", core.registry.source_name(physical.source));
                return Err(invalid_state(&format!("physical device '{name}'"), &what, "open", "call reset(), which restarts its processor"));
            }
            (physical.device.clone(), physical.source, physical.driver.clone())
        };
        let remote = {
            let core = self.shared.locked();
            core.remote.at(core.registry.source_name(source)).cloned()
        };
        let mut beside = None;
        let opened = match remote {
            Some(remote) => remote.open(name, &kind, &options.to_string()).map(|_| remote_device::renew(&device)),
            None => self.reopen_here(name, &device, source, &kind, &options)?.map(|of| beside = Some(of)),
        };
        self.shared.command(|core| {
            match &opened {
                Ok(()) => reopened(core, name, beside),
                Err(why) => still_lost(core, name, why),
            }
            Ok(())
        })?;
        opened.map_err(|why| refuse(Class::DeviceFailed, format!("cannot open device '{name}' again: {why}"), "check its power and cable, and try again"))
    }

    /// Reopens a device of this process, and returns the services and counters of its new driver. The inner error comes from the driver.
    fn reopen_here(
        &self,
        name: &str,
        device: &Arc<Device>,
        source: SourceId,
        kind: &str,
        options: &serde_json::Value,
    ) -> Result<Result<Beside, String>, Refusals> {
        let (retired, before) = Renewal::retire(device);
        self.renew(source, retired)?;
        // Many machines accept only one driver at a time: close the old one first.
        before.close();
        let fresh = drivers::open(kind, options).map_err(|why| why.to_string()).and_then(|(driver, _)| {
            let beside = Beside::of(kind, &*driver);
            Device::open(name, driver, self.shared.host.now_ns()).map(|fresh| (fresh, beside)).map_err(|why| why.message)
        });
        if let Ok((fresh, _)) = &fresh {
            let processor = processor_of(self.shared.locked().registry.source_name(source)).to_owned();
            self.guard_device(&processor, fresh);
        }
        match fresh.and_then(|(fresh, beside)| Ok((Renewal::open(device, fresh)?, beside))) {
            Ok((renewal, beside)) => self.renew(source, renewal).map(|()| Ok(beside)),
            Err(why) => Ok(Err(why)),
        }
    }

    /// Makes the kernel of the device's source perform the renewal, and waits for it.
    fn renew(&self, source: SourceId, renewal: Renewal) -> Result<(), Refusals> {
        let done = renewal.is_done();
        self.shared.command(|core| {
            core.submit(source, vec![Op::Renew(Box::new(renewal))], Purpose::Nothing);
            Ok(())
        })?;
        match self.shared.wait_for(None, BOUNDARY, |_| Ok(done.load(Ordering::Acquire).then_some(())))? {
            WaitResult::Done(()) => Ok(()),
            _ => Err(refuse(Class::InvalidState, "a kernel did not answer", "check with statistics() whether its processor is overloaded")),
        }
    }

    /// Reopens all lost devices whose processor is running. Returns those that are still lost, with the reasons.
    pub(crate) fn reopen_lost(&self) -> Result<BTreeMap<String, String>, Refusals> {
        // Process reported losses first.
        self.shared.command(|_| Ok(()))?;
        let lost: Vec<String> = {
            let core = self.shared.locked();
            core.registry
                .physical
                .iter()
                .filter(|(_, physical)| physical.lost.is_some() && !core.safety.lost.contains(&physical.source))
                .map(|(name, _)| name.clone())
                .collect()
        };
        let mut still = BTreeMap::new();
        for name in lost {
            if let Err(why) = self.reopen(&name) {
                still.insert(name, why.iter().map(|refusal| refusal.message.as_str()).collect::<Vec<_>>().join("; "));
            }
        }
        Ok(still)
    }
}

/// Time limit for a source to return a driver, which happens between two firings.
const BOUNDARY: Duration = Duration::from_secs(5);

/// Records that a lost device could not be reopened, with the new reason.
fn still_lost(core: &mut Core, name: &str, why: &str) {
    let Some(physical) = core.registry.physical.get_mut(name) else { return };
    physical.lost = Some(why.to_owned());
    let now_ns = core.host.now_ns();
    core.observation.log.add(now_ns, "device", name, format!("cannot open device '{name}' again: {why}"));
    alarm_lost(core, name, why);
}

fn reopened(core: &mut Core, name: &str, beside: Option<Beside>) {
    let Some(physical) = core.registry.physical.get_mut(name) else { return };
    physical.lost = None;
    if let Some(beside) = beside {
        physical.beside = beside;
    }
    alarm_closed(core, name);
    let now_ns = core.host.now_ns();
    core.observation.log.add(now_ns, "device", name, format!("device '{name}' is open again"));
}
