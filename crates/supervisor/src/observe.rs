// SPDX-License-Identifier: Apache-2.0
//! Looking at a running system: snapshots, histories, what there is, how it does. Nothing here disturbs what runs.
use crate::block_times;
use crate::refuse::unknown;
use crate::system::{Definitions, System, Waited};
use crate::values::Reading;
use kernel::Statistics;
use model::configuration::SourceKind;
use model::refusal::Refusals;
use model::types::Type;
use serde_json::{Value as Json, json};
use std::time::Duration;

/// A value in the history of an SVV: number, time in ns, bytes.
pub type Past = (u64, i64, Vec<u8>);

impl System {
    /// One consistent snapshot: its time, and each SVV's bytes, number and time. SVVs of different sources are taken at the next
    /// boundary of each.
    pub fn read(&self, names: &[String]) -> Result<(i64, Vec<Reading>), Refusals> {
        let snapshot = self.shared.command(|core| core.ask(names))?;
        let waited = self.shared.wait_for(None, READ_MAX, |core| Ok(core.snapshot(&snapshot, names.len())))?;
        match waited {
            Waited::Done(read) => Ok(read),
            _ => {
                let mut core = self.shared.locked();
                let why = core.unanswered(&snapshot);
                core.forget_snapshot(&snapshot);
                Err(why)
            }
        }
    }

    /// Up to `count` last values, oldest first.
    pub fn history(&self, name: &str, count: usize) -> Result<Vec<Past>, Refusals> {
        self.shared.locked().history(name, count)
    }

    /// Kind, type, unit, history, writers and readers of an SVV, a private cell (`move#1:coefficients`) or a channel (`plant.elbow.position`).
    pub fn svv_json(&self, name: &str) -> Result<Json, Refusals> {
        let definitions = self.shared.definitions();
        let core = self.shared.locked();
        let name = core.name_of(name)?;
        let (Some(svv), Some(record)) = (definitions.configuration.svvs.get(name), core.svvs.get(name)) else {
            return core.other_cell(name).map(|named| named.about).ok_or_else(|| unknown("SVV", name, core.svvs.keys().map(String::as_str)));
        };
        let of = Type::parse(&svv.type_text, &svv.types).map_err(|r| vec![r])?;
        let writers: Vec<String> = (definitions.configuration.writers.get(name).into_iter().flatten()).map(|w| format!("{}.{}", w.instance, w.port)).collect();
        let [_, readers] = core.ends_of(name);
        Ok(json!({
            "name": name, "id": svv.id, "kind": "svv", "type_text": svv.type_text, "types": svv.types, "type": type_tree(&of), "unit": svv.unit, "history": record.history,
            "device": svv.device, "writers": writers, "readers": readers, "bound": record.bound, "within": record.within,
            "source": record.home.map(|home| core.source_name(home)),
        }))
    }

    /// Name, verb, state and blocks of an instance.
    pub fn instance_json(&self, instance: u64) -> Result<Json, Refusals> {
        let core = self.shared.locked();
        let i = core.instance(instance)?;
        let blocks: Vec<Json> = i.plan.blocks.iter().map(|b| json!({"label": b.label, "block": b.block, "source": b.source})).collect();
        let lists: Vec<&str> = i.plan.lists.iter().map(|l| l.name.as_str()).collect();
        let conditions: indexmap::IndexSet<&str> = i.plan.conditions.iter().map(|c| c.name.as_str()).collect();
        Ok(json!({
            "name": i.name, "verb": i.plan.verb, "state": i.state.name(), "blocks": blocks, "lists": lists, "list": i.plan.lists[i.list].name,
            "conditions": conditions, "outputs": i.plan.outputs.iter().map(|o| o.name.as_str()).collect::<indexmap::IndexSet<_>>(),
            "owner": i.owner, "starts": i.starts, "running_s": i.running.at(core.host.now_ns()) as f64 * 1e-9,
            "remarks": i.plan.remarks.iter().map(|r| r.text.as_str()).collect::<Vec<_>>(),
        }))
    }

    /// Firings, overruns, jitter of every source; instances; devices; processes with their processors; the emergency stop.
    pub fn statistics_json(&self) -> Json {
        let missing = self.shared.post.lock().expect("nobody panics with the lock held").missing.clone();
        let definitions = self.shared.definitions();
        let core = self.shared.locked();
        let mut blocks = block_times::by_source(&core);
        let sources = core.sources.iter().map(|(name, id)| {
            let mut source = source_json(&core.host.statistics(*id), core.tables[id].steps.len());
            placed(&mut source, &definitions, name, self.shared.is_virtual);
            source["probed"] = json!(core.host.probes(*id));
            source["blocks"] = json!(blocks.remove(id).unwrap_or_default());
            (name.clone(), source)
        });
        let sources: serde_json::Map<String, Json> = sources.collect();
        let instances: Vec<Json> = core
            .instances
            .iter()
            .map(|(id, i)| json!({"id": id, "name": i.name, "verb": i.plan.verb, "state": i.state.name(), "list": i.plan.lists[i.list].name, "owner": i.owner, "running_s": i.running.at(core.host.now_ns()) as f64 * 1e-9}))
            .collect();
        let devices: serde_json::Map<String, Json> = core.logical.keys().map(|d| (d.clone(), json!(core.device_state(d).unwrap_or("?")))).collect();
        let physical: serde_json::Map<String, Json> = (core.physical.iter())
            .map(|(name, p)| {
                let limited: u64 = (0..p.device.channels().len()).map(|c| p.device.slew_limited(c)).sum();
                (name.clone(), json!({"lost": p.lost, "slew_limited": limited}))
            })
            .collect();
        json!({ "now_s": core.host.now_ns() as f64 * 1e-9, "sources": sources, "instances": instances, "devices": devices, "physical_devices": physical, "processes": core.processes, "emergency": core.emergency.reason, "paused": core.pause.shown(), "mode": core.modes.mode, "supervisor_rights_missing": missing })
    }

    /// What there is, by kind.
    pub fn names_json(&self) -> Json {
        let definitions = self.shared.definitions();
        let core = self.shared.locked();
        let c = &definitions.configuration;
        let supervisor = definitions.processors.iter().find(|(_, p)| p.supervisor).map(|(name, _)| name.clone());
        json!({
            "processors": c.processors, "processes": core.processes, "supervisor": supervisor, "sources": c.sources.keys().collect::<Vec<_>>(), "devices": c.devices.keys().collect::<Vec<_>>(),
            "svvs": c.svvs.keys().collect::<Vec<_>>(), "logical_devices": c.logical_devices.keys().collect::<Vec<_>>(),
            "verbs": c.verbs.keys().collect::<Vec<_>>(), "device_types": c.device_types.keys().collect::<Vec<_>>(),
            "modules": definitions.catalog.modules.keys().collect::<Vec<_>>(), "blocks": c.interfaces.keys().collect::<Vec<_>>(),
            "instances": core.instances.values().map(|i| i.name.as_str()).collect::<Vec<_>>(),
        })
    }

    /// The verbs that there are: name, description, whether it supports devices (of which types) or acts on devices, lists, parts.
    pub fn verbs_json(&self) -> Json {
        let definitions = self.shared.definitions();
        let c = &definitions.configuration;
        let verbs = c.verbs.values().map(|verb| {
            let supports: Vec<&str> = c.device_types.values().filter(|t| t.verb.as_ref() == Some(&verb.name)).map(|t| t.name.as_str()).collect();
            json!({
                "name": verb.name, "doc": verb.doc, "class": if supports.is_empty() { "acts on devices" } else { "supports devices" }, "supports": supports,
                "simple": verb.command_lists.len() == 1, "lists": verb.command_lists.keys().collect::<Vec<_>>(), "parts": verb.parts,
            })
        });
        verbs.collect()
    }

    /// Interfaces of every block that there is: of the library, and of the code modules that were downloaded.
    pub fn blocks_json(&self) -> Json {
        json!(self.shared.definitions().configuration.interfaces.values().collect::<Vec<_>>())
    }

    /// Interfaces of the blocks of a module.
    pub fn module_json(&self, module: &str) -> Json {
        let definitions = self.shared.definitions();
        let prefix = format!("{module}.");
        let blocks: Vec<_> = definitions.configuration.interfaces.iter().filter(|(name, _)| name.starts_with(&prefix)).map(|(_, i)| i).collect();
        json!({ "name": module, "blocks": blocks, "types": definitions.catalog.modules.get(module) })
    }

    /// Enters something into the log that whoever serves the system has to tell of its journal.
    pub fn log_journal(&self, text: &str) {
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.log.add(now_ns, "journal", "system", text);
    }

    /// Entries of the log from number `sequence` on.
    pub fn log_since(&self, sequence: u64) -> Vec<crate::log::Entry> {
        self.shared.locked().log.since(sequence)
    }
}

/// Kernels answer within a firing; longer than this means that a processor does not run.
const READ_MAX: Duration = Duration::from_secs(5);

fn source_json(of: &Statistics, steps: usize) -> Json {
    json!({
        "steps": steps, "firings": of.firings, "overruns": of.overruns, "late": of.late, "faults": of.faults, "lost": of.lost, "stopped": of.stopped, "rights_missing": of.rights_missing,
        "jitter_last_ns": of.jitter_last_ns, "jitter_max_ns": of.jitter_max_ns, "jitter_bins": of.jitter_bins, "jitter_median_ns": median(&of.jitter_bins),
        "duration_sum_ns": of.duration_sum_ns,
        "duration_last_ns": of.duration_last_ns, "duration_max_ns": of.duration_max_ns, "duration_bins": of.duration_bins, "duration_median_ns": median(&of.duration_bins),
    })
}

/// Where a source runs and what its thread asked of the operating system, beside what it did not get.
fn placed(source: &mut Json, definitions: &Definitions, name: &str, is_virtual: bool) {
    let Some(of) = definitions.configuration.sources.get(name) else { return };
    let core = definitions.processors.get(&of.processor).and_then(|processor| processor.core);
    let (kind, period_ns) = match &of.kind {
        SourceKind::Timer { period_ns } => ("timer", Some(*period_ns)),
        SourceKind::Trigger => ("trigger", None),
        SourceKind::Software => ("software", None),
    };
    let mut asked = vec!["locked memory".to_owned(), format!("real-time priority {}", of.priority)];
    asked.extend(core.map(|core| format!("core {core}")));
    if is_virtual {
        asked.clear();
    }
    for (field, value) in [
        ("processor", json!(of.processor)),
        ("core", json!(core)),
        ("kind", json!(kind)),
        ("period_ns", json!(period_ns)),
        ("priority", json!(of.priority)),
        ("rights_asked", json!(asked)),
    ] {
        source[field] = value;
    }
}

/// The upper end of the bin that the median falls into.
fn median(bins: &[u64; 32]) -> u64 {
    let half = bins.iter().sum::<u64>().div_ceil(2);
    let mut seen = 0;
    bins.iter()
        .position(|count| {
            seen += count;
            seen >= half && half > 0
        })
        .map_or(0, |bin| 1 << (bin + 1))
}

/// A type as a tree, for the programming system.
pub fn type_tree(of: &Type) -> Json {
    let offsets = of.offsets();
    let mut tree = match of {
        Type::Scalar(_) => json!({ "scalar": of.normalised() }),
        Type::Array(inner, n) => json!({ "array": [type_tree(inner), n] }),
        Type::Struct(members) => {
            let members: Vec<Json> = members.iter().zip(offsets).map(|(member, offset)| json!([member.name, type_tree(&member.member_type), offset])).collect();
            json!({ "struct": members })
        }
    };
    tree["text"] = json!(of.normalised());
    tree["size"] = json!(of.size());
    tree["align"] = json!(of.align());
    tree
}
