// SPDX-License-Identifier: Apache-2.0
//! Installed verb: its plan, the objects in memory that execute it, and the devices on which it acts.
use crate::registry::PhysicalRecord;
use crate::wiring::installed::InstalledPlan;
use indexmap::IndexMap;
use model::plan::Plan;

/// A plan in memory, with the physical devices whose channels it writes.
pub(crate) struct InstalledVerb<'a> {
    pub plan: &'a Plan,
    pub installed: &'a InstalledPlan,
    pub devices: &'a IndexMap<String, PhysicalRecord>,
}
