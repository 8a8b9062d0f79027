// SPDX-License-Identifier: Apache-2.0
//! Transitions: a condition leads to another command list. The outputs that the condition returns are read when its list is left, and the
//! end report lists the route.
use crate::instances::cause::Cause;
use crate::instances::course::Course;
use crate::instances::installed_verb::InstalledVerb;
use crate::movements::sequence::Builder;
use kernel::SourceId;

impl Course<'_> {
    /// Makes the transition to `list`. The process must already have been taken.
    pub fn lead_on(&mut self, cause: &Cause, list: usize) {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let of = InstalledVerb { plan: &instance.plan, installed: &instance.installed, devices: &self.core.registry.physical };
        let way = &mut instance.findings.way;
        way.lead_on(&of, instance.position.list, cause);
        let mut builder = Builder::default();
        for &source in &instance.installed.sources {
            let outputs = of.outputs_in(source, cause.condition);
            of.capture_in(&mut builder, source, &outputs);
            way.captures.expect(source, outputs);
        }
        self.go_from(builder, list, 0);
    }

    /// Catches up with a kernel that has made the transition in the firing in which the condition occurred.
    pub fn led_on_by_kernel(&mut self, source: SourceId, cause: &Cause, captured: &[u8]) {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let of = InstalledVerb { plan: &instance.plan, installed: &instance.installed, devices: &self.core.registry.physical };
        instance.findings.way.lead_on(&of, instance.position.list, cause);
        instance.findings.way.captures.take(&of, &of.outputs_in(source, cause.condition), captured);
    }

    /// Records a transition that a kernel made in the firing in which the condition occurred, before the supervisor took the process for
    /// another reason. Returns false if the supervisor has not taken the process from `generation`.
    pub fn led_on_before_take(&mut self, source: SourceId, generation: u32, list: usize, cause: &Cause, captured: &[u8]) -> bool {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return false };
        let of = InstalledVerb { plan: &instance.plan, installed: &instance.installed, devices: &self.core.registry.physical };
        instance.findings.way.lead_on_before(&of, generation, list, cause, source, captured)
    }
}
