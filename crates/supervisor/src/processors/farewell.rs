// SPDX-License-Identifier: Apache-2.0
//! Fate of an instance on a remote processor when this process exits.
use crate::instances::instance::Instance;
use crate::movements::sequence::{Builder, Movement};
use crate::processors::remote::Remote;
use crate::registry::Registry;
use kernel::Script;
use model::definition::IfCutOff;

/// Informs remote processors of the fate of an instance if this process exits, as declared by its verb's `if_cut_off`.
pub(crate) fn bid(remote: &Remote, registry: &Registry, instance: &Instance) {
    if remote.processors.is_empty() {
        return;
    }
    let of = instance.installed_verb(&registry.physical);
    for &source in &instance.installed.sources {
        let Some(remote) = remote.at(registry.source_name(source)) else { continue };
        let script = (instance.if_cut_off() != IfCutOff::Continue).then(|| {
            let mut builder = Builder::default();
            of.stop_in(&mut builder, source);
            let scripts = builder.finish().into_iter().filter_map(|movement| if let Movement::Scripts(scripts) = movement { Some(scripts) } else { None });
            Script { id: 0, ops: scripts.flatten().flat_map(|(_, ops)| ops).collect() }
        });
        remote.farewell(instance.installed.process.id(), source, Some(script.as_ref()));
    }
}

/// Removes these instructions for an instance that has ended.
pub(crate) fn forget(remote: &Remote, registry: &Registry, instance: &Instance) {
    if remote.processors.is_empty() {
        return;
    }
    for &source in &instance.installed.sources {
        if let Some(remote) = remote.at(registry.source_name(source)) {
            remote.farewell(instance.installed.process.id(), source, None);
        }
    }
}
