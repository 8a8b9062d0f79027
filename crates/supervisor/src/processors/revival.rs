// SPDX-License-Identifier: Apache-2.0
//! Revival of a lost processor in a new process.
use crate::alarms::causes::alarm_closed;
use crate::core::Core;
use crate::processors::remote::processor_of;
use crate::scripts::Purpose;
use kernel::SourceId;

/// Revives a processor in a new process: restores the tables of its sources and the last known values.
pub(crate) fn revived(core: &mut Core, processor: &str) {
    let sources: Vec<SourceId> =
        core.registry.sources.values().copied().filter(|source| processor_of(core.registry.source_name(*source)) == processor).collect();
    for source in &sources {
        core.safety.lost.remove(source);
        let mut ops = vec![core.carrier().table_op(*source)];
        let known = core.registry.svvs.values().flat_map(|svv| svv.known_ops(*source));
        ops.extend(known);
        core.submit(*source, ops, Purpose::Nothing);
    }
    let open: Vec<String> =
        core.registry.physical.iter().filter(|(_, physical)| sources.contains(&physical.source)).map(|(device, _)| device.clone()).collect();
    for device in open {
        core.registry.physical[&device].lost = None;
        alarm_closed(core, &device);
    }
    let now_ns = core.host.now_ns();
    core.observation.log.add(now_ns, "processor", processor, "has a new process".to_owned());
}
