// SPDX-License-Identifier: Apache-2.0
//! Human-readable messages and values for faults and reported conditions.
use crate::instances::floating_point::floats_text;
use crate::instances::following_errors::{GAP, motion_gap_text, number};
use crate::instances::instance::Instance;
use crate::instances::table::Instances;
use crate::registry::Registry;
use kernel::{BlockId, Fault, SourceId};
use model::types::Type;
use model::value::Value;
use opengpac::{CALLED_FORK, FLOATS_CHANGED, lost_text, signal_text};

impl Instance {
    /// Returns the value reported by a condition, if it has one.
    pub fn reported_value(&self, block: Option<usize>, item: u8, bytes: &[u8]) -> Option<Value> {
        let interface = self.installed.interfaces.get(block?)?;
        let declared = &interface.items.get(usize::from(item))?.type_text;
        let of = Type::parse(declared, &interface.types).ok()?;
        (!bytes.is_empty() && bytes.len() == of.size()).then(|| of.decode(bytes))
    }

    /// Returns the message for a block's report that does not match any current termination condition.
    pub fn unwatched(&self, block: BlockId, item: u8, fault: Option<(Fault, Vec<u8>)>) -> String {
        let index = self.installed.blocks.iter().position(|b| b.id() == block);
        match &fault {
            Some((fault, what)) => fault_text(self, index, fault, what),
            None => {
                let item = index.and_then(|b| item_name(self, b, item)).unwrap_or_default();
                let label = index.map_or("?", |b| self.plan.blocks[b].label.as_str());
                format!("'{label}' reported '{item}', which no termination condition currently covers")
            }
        }
    }
}

impl Instance {
    /// Returns the logical device whose own verb this instance runs, and the lost time, s, if the block has reported the condition `gap`,
    /// that is, if the servo has brought the joint to rest.
    pub fn gap_of_owner(&self, block: BlockId, item: u8, value: &[u8]) -> Option<(String, f64)> {
        let owner = self.owner.as_ref()?;
        let index = self.installed.blocks.iter().position(|b| b.id() == block)?;
        let lost_s = self.reported_value(Some(index), item, value).as_ref().and_then(number)?;
        (item_name(self, index, item)? == GAP).then(|| (owner.clone(), lost_s))
    }
}

/// Returns the message for a gap reported by a generator of an instance; empty for any other report.
pub(crate) fn gap_message(instance: &Instance, registry: &Registry, block: Option<usize>, item: u8, value: Option<&Value>) -> String {
    let is_gap = block.and_then(|index| item_name(instance, index, item)).is_some_and(|name| name == GAP);
    let Some(lost_s) = value.and_then(number).filter(|_| is_gap) else { return String::new() };
    let bounds = instance.plan.devices.iter().filter_map(|device| registry.logical.get(device)?.gap_max_s);
    motion_gap_text(lost_s, bounds.reduce(f64::min))
}

/// Returns the message for a source that was stopped.
pub(crate) fn stopped_text(instances: &Instances, registry: &Registry, source: SourceId, block: BlockId, fault: &Fault) -> String {
    let why = match instances.culprit(block) {
        _ if *fault == Fault::Floats => floats_text(instances, registry, source),
        Some((of, index)) => format!("{}, of '{}'", fault_text(of, Some(index), fault, &[]), of.name),
        None => "a deleted block".to_owned(),
    };
    format!("source '{}' stopped: {why}", registry.source_name(source))
}

/// Returns the message for a fault, which names the block and the fault code; `said` is the text of its exception.
pub(crate) fn fault_text(instance: &Instance, block: Option<usize>, fault: &Fault, said: &[u8]) -> String {
    let of = block.map(|b| &instance.plan.blocks[b]);
    let what = of.map_or("a block".to_owned(), |b| format!("block '{}' ({})", b.label, b.block));
    match fault {
        Fault::Returned(code) => match block.and_then(|b| fault_meaning(&instance.installed.interfaces[b].doc, *code)) {
            Some(meaning) => format!("{what}: {meaning} (fault {code})"),
            None => format!("{what} returned fault {code}"),
        },
        Fault::Panic => format!("{what} panicked"),
        Fault::NonFinite(item) => {
            let item = block.and_then(|b| item_name(instance, b, *item)).unwrap_or_default();
            format!("output '{item}' of {what} was not finite")
        }
        Fault::Floats => format!("{what} {FLOATS_CHANGED}"),
        Fault::Forked => format!("{what} {CALLED_FORK}"),
        Fault::Signal(signal) => format!("{what}: {}", signal_text(*signal)),
        Fault::Lost(signal) => format!("{what} {}", lost_text(*signal)),
        Fault::Budget => format!("{what} used up its time budget"),
        Fault::Threw => format!("{what} threw an exception: {}", String::from_utf8_lossy(said)),
    }
}

/// Returns the name of an item of an installed block.
pub(crate) fn item_name(instance: &Instance, block: usize, item: u8) -> Option<String> {
    instance.installed.interfaces.get(block)?.items.get(usize::from(item)).map(|i| i.name.clone())
}

/// Returns the meaning of a fault code in a block's description: `Faults: 1 a limit is not above 0; 2 a goal is out of range.`
fn fault_meaning(doc: &str, code: u32) -> Option<&str> {
    let faults = doc.lines().find_map(|line| line.strip_prefix("Faults: "))?;
    faults.split(';').find_map(|entry| entry.trim().strip_prefix(&format!("{code} "))).map(|meaning| meaning.trim_end_matches('.'))
}
