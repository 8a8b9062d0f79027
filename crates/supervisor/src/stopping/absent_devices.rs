// SPDX-License-Identifier: Apache-2.0
//! Refuses starts that need lost physical devices.
use crate::instances::instance::Instance;
use crate::refuse::refuse;
use crate::registry::Registry;
use model::plan::CellKind;
use model::refusal::{Class, Refusals};

const REMEDY: &str = "check its power and cable, then open it again: reset(), or reopen() of the device";

impl Instance {
    /// Returns the physical devices to whose channels the instance is bound.
    pub fn physical_devices(&self) -> impl Iterator<Item = &str> {
        self.plan.cells.iter().filter_map(|cell| if let CellKind::Channel { device, .. } = &cell.kind { Some(device.as_str()) } else { None })
    }
}

/// Checks that none of the devices that an instance reads and writes are lost, because it must not start from stale readings.
pub(crate) fn check_devices(registry: &Registry, instance: &Instance) -> Result<(), Refusals> {
    let lost = |device: &str| registry.physical.get(device)?.lost.as_ref().map(|why| (device.to_owned(), why.clone()));
    let Some((device, why)) = instance.physical_devices().find_map(lost) else { return Ok(()) };
    let what = match &instance.owner {
        Some(owner) => format!("enable '{owner}'"),
        None => format!("start '{}'", instance.name),
    };
    Err(refuse(Class::DeviceFailed, format!("cannot {what}: physical device '{device}' is lost: {why}"), REMEDY))
}
