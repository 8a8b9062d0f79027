// SPDX-License-Identifier: Apache-2.0
//! Lost physical devices: nothing starts that needs one, and each can be opened again without taking the configuration apart.
use crate::core::{Core, Purpose};
use crate::instance::Instance;
use crate::refuse::{invalid_state, refuse, unknown};
use crate::system::{System, Waited};
use kernel::{Device, Op, Renewal, SourceId};
use model::plan::CellKind;
use model::refusal::{Class, Refusals};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// How long a source may take to give a driver back: something that it does between two firings.
const BOUNDARY: Duration = Duration::from_secs(5);

const REMEDY: &str = "look at its power and cable, then open it again: reset(), or reopen() of the device";

impl Instance {
    /// The physical devices whose channels it is bound to.
    pub fn physical_devices(&self) -> impl Iterator<Item = &str> {
        self.plan.cells.iter().filter_map(|cell| if let CellKind::Channel { device, .. } = &cell.kind { Some(device.as_str()) } else { None })
    }
}

impl Core {
    /// What an instance reads and writes is there: frozen readings are no present to start from.
    pub fn check_devices(&self, instance: &Instance) -> Result<(), Refusals> {
        let lost = |device: &str| self.physical.get(device)?.lost.as_ref().map(|why| (device.to_owned(), why.clone()));
        let Some((device, why)) = instance.physical_devices().find_map(lost) else { return Ok(()) };
        let what = match &instance.owner {
            Some(owner) => format!("enable '{owner}'"),
            None => format!("start '{}'", instance.name),
        };
        Err(refuse(Class::DeviceFailed, format!("cannot {what}: physical device '{device}' is lost: {why}"), REMEDY))
    }

    fn reopened(&mut self, name: &str) {
        let Some(physical) = self.physical.get_mut(name) else { return };
        physical.lost = None;
        self.alarm_closed(name);
        let now_ns = self.host.now_ns();
        self.log.add(now_ns, "device", name, format!("device '{name}' is open again"));
    }
}

impl System {
    /// Opens a lost physical device again, as it was opened first: cells, claims and what is bound to it stay. Nothing where it is not lost.
    pub fn reopen(&self, name: &str) -> Result<(), Refusals> {
        let (device, source, (kind, options)) = {
            let core = self.shared.locked();
            let Some(physical) = core.physical.get(name) else {
                return Err(unknown("physical device", name, core.physical.keys().map(String::as_str)));
            };
            if physical.lost.is_none() {
                return Ok(());
            }
            if core.lost.contains(&physical.source) {
                let what = format!("lost with source '{}'", core.source_name(physical.source));
                return Err(invalid_state(&format!("physical device '{name}'"), &what, "open", "call reset(), which starts its processor anew"));
            }
            (physical.device.clone(), physical.source, physical.driver.clone())
        };
        let far = self.shared.locked().far_of(source);
        let opened = match far {
            Some(far) => far.open(name, &kind, &options.to_string()).map(|_| device.renew()),
            None => self.reopen_here(name, &device, source, &kind, &options)?,
        };
        opened.map_err(|why| refuse(Class::DeviceFailed, format!("cannot open device '{name}' again: {why}"), "look at its power and cable, and try again"))?;
        self.shared.command(|core| {
            core.reopened(name);
            Ok(())
        })
    }

    /// Of a device of this process. The inner error: what its driver says.
    fn reopen_here(&self, name: &str, device: &Arc<Device>, source: SourceId, kind: &str, options: &serde_json::Value) -> Result<Result<(), String>, Refusals> {
        let (retired, before) = Renewal::retire(device);
        self.renew(source, retired)?;
        // A machine is often open to one driver at a time: the old one is closed first.
        before.close();
        let fresh = drivers::open(kind, options)
            .map_err(|why| why.to_string())
            .and_then(|(driver, _)| Device::open(name, driver, self.shared.host.now_ns()).map_err(|why| why.message));
        match fresh.and_then(|fresh| Renewal::open(device, fresh)) {
            Ok(renewal) => self.renew(source, renewal).map(Ok),
            Err(why) => Ok(Err(why)),
        }
    }

    /// Lets the kernel of the device's source carry it out, and waits for that.
    fn renew(&self, source: SourceId, renewal: Renewal) -> Result<(), Refusals> {
        let done = renewal.is_done();
        self.shared.command(|core| {
            core.submit(source, vec![Op::Renew(Box::new(renewal))], Purpose::Nothing);
            Ok(())
        })?;
        match self.shared.wait_for(None, BOUNDARY, |_| Ok(done.load(Ordering::Acquire).then_some(())))? {
            Waited::Done(()) => Ok(()),
            _ => Err(refuse(Class::InvalidState, "a kernel did not answer", "is its processor overloaded? see statistics()")),
        }
    }

    /// Opens every lost device whose processor is there; one that is still gone stays lost, and says so in the log.
    pub(crate) fn reopen_lost(&self) -> Result<(), Refusals> {
        // What was told of losses is taken in first.
        self.shared.command(|_| Ok(()))?;
        let lost: Vec<String> = {
            let core = self.shared.locked();
            core.physical
                .iter()
                .filter(|(_, physical)| physical.lost.is_some() && !core.lost.contains(&physical.source))
                .map(|(name, _)| name.clone())
                .collect()
        };
        for name in lost {
            if let Err(why) = self.reopen(&name) {
                let text = why.iter().map(|refusal| refusal.message.as_str()).collect::<Vec<_>>().join("; ");
                self.shared.command(|core| {
                    let now_ns = core.host.now_ns();
                    core.log.add(now_ns, "device", &name, text);
                    Ok(())
                })?;
            }
        }
        Ok(())
    }
}
