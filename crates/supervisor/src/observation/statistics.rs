// SPDX-License-Identifier: Apache-2.0
//! Statistics of a system: firings, overruns and jitter of every interrupt source, instances, devices, whether it is stopped or paused.
use crate::definitions::system_definitions::Definitions;
use crate::observation::block_times::{self, BlockTimes};
use crate::observation::states::{DeviceState, InstanceState, PausesInForce};
use crate::pausing::modes::Mode;
use crate::system::System;
use indexmap::IndexMap;
use model::configuration::SourceKind;
use serde::Serialize;

/// Statistics of a system.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Statistics {
    /// Time on the system's clock, s.
    pub now_s: f64,
    /// Interrupt sources by name, `rtp.source`.
    pub sources: IndexMap<String, SourceStatistics>,
    /// Verb instances in the order in which they were created.
    pub instances: Vec<InstanceStatistics>,
    /// States of the logical devices.
    pub devices: IndexMap<String, DeviceState>,
    pub physical_devices: IndexMap<String, PhysicalDeviceStatistics>,
    /// Processors by the process that they run in, of those that do not run in the supervisor's.
    pub processes: IndexMap<String, Vec<String>>,
    /// Cause of the latched emergency stop; null: it is not latched.
    pub emergency: Option<String>,
    pub paused: PausesInForce,
    pub mode: Mode,
    /// Rights that the supervisor's thread asked of the operating system and did not get.
    pub supervisor_rights_missing: Vec<String>,
}

/// Statistics of an interrupt source. Bin i of a histogram counts times from 2^i to 2^(i+1) ns; the first also shorter ones, the last also
/// longer ones.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SourceStatistics {
    /// Steps of its firing table.
    pub steps: usize,
    /// Firings, without those of `execute`.
    pub firings: u64,
    /// Releases that were skipped because the firing before was not over.
    pub overruns: u64,
    /// Ratio values that were absent when their reader asked for them.
    pub late: u64,
    /// Invocations that faulted.
    pub faults: u64,
    /// Conditions and other events that found no place and were lost.
    pub lost: u64,
    /// A fault stopped it.
    pub stopped: bool,
    /// Rights that its thread asked of the operating system and did not get.
    pub rights_missing: Vec<String>,
    #[serde(flatten)]
    pub jitter: Jitter,
    #[serde(flatten)]
    pub durations: Durations,
    /// Absent of a source that is being deleted.
    #[serde(flatten)]
    pub placed: Option<SourcePlace>,
    /// True while a probe measures its blocks.
    pub probed: bool,
    /// Times of the blocks that a probe has measured since they were installed.
    pub blocks: Vec<BlockTimes>,
}

/// Lateness of the starts of firings.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Jitter {
    /// Start of the last firing behind its release, ns.
    pub jitter_last_ns: u64,
    /// Maximum jitter, ns.
    pub jitter_max_ns: u64,
    /// Histogram of the jitter.
    pub jitter_bins: Vec<u64>,
    /// Upper end of the bin that the median jitter lies in, ns; 0 before the first firing.
    pub jitter_median_ns: u64,
}

/// Durations of firings.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Durations {
    /// Duration of all firings together, ns.
    pub duration_sum_ns: u64,
    /// Duration of the last firing, ns.
    pub duration_last_ns: u64,
    /// Longest duration, ns.
    pub duration_max_ns: u64,
    /// Histogram of the duration.
    pub duration_bins: Vec<u64>,
    /// Upper end of the bin that the median duration lies in, ns; 0 before the first firing.
    pub duration_median_ns: u64,
}

/// Where an interrupt source runs, and what its thread asked of the operating system.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SourcePlace {
    pub processor: String,
    /// The core that its processor is bound to.
    pub core: Option<usize>,
    pub kind: KindOfSource,
    /// Period of a timer, ns.
    pub period_ns: Option<u64>,
    pub priority: u8,
    /// Rights that its thread asked of the operating system; none under the virtual clock.
    pub rights_asked: Vec<String>,
}

/// Kind of an interrupt source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum KindOfSource {
    Timer,
    /// An event of a device.
    Trigger,
    /// A request by another source.
    Software,
}

/// A verb instance, in one line.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstanceStatistics {
    pub id: u64,
    pub name: String,
    pub verb: String,
    pub state: InstanceState,
    /// The command list that runs, or ran last.
    pub list: String,
    /// The logical device whose own verb it is.
    pub owner: Option<String>,
    /// Time for which it has run since its start, without the time that it was suspended, s.
    pub running_s: f64,
}

/// Statistics of a physical device.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PhysicalDeviceStatistics {
    /// Cause of its loss; null: it is not lost.
    pub lost: Option<String>,
    /// Number of commands that were held back by the limit of their slope.
    pub slew_limited: u64,
    /// Counters of its driver, by name.
    pub counters: IndexMap<String, u64>,
}

impl System {
    /// Firings, overruns, jitter of every source; instances; devices; processes with their processors; the emergency stop.
    pub fn statistics(&self) -> Statistics {
        let missing = self.shared.post.lock().expect("nobody panics with the lock held").missing.clone();
        let definitions = self.shared.definitions();
        let mut blocks = block_times::by_source(&self.shared);
        let core = self.shared.locked();
        let sources = core.registry.sources.iter().map(|(name, id)| {
            let placed = placed(&definitions, name, self.shared.is_virtual);
            let of = of_source(core.host.statistics(*id), core.wiring.tables[id].steps.len());
            (name.clone(), SourceStatistics { placed, probed: core.host.probes(*id), blocks: blocks.remove(id).unwrap_or_default(), ..of })
        });
        let now_ns = core.host.now_ns();
        let instances = core.instances.values().map(|i| InstanceStatistics {
            id: i.id,
            name: i.name.clone(),
            verb: i.plan.verb.clone(),
            state: InstanceState::named(i.state().name()),
            list: i.plan.lists[i.position.list].name.clone(),
            owner: i.owner.clone(),
            running_s: seconds(i.times.running.at(now_ns)),
        });
        let devices =
            core.registry.logical.keys().filter_map(|name| Some((name.clone(), DeviceState::named(core.instances.device_state(&core.registry, name).ok()?))));
        let physical = core.registry.physical.iter().map(|(name, p)| {
            let slew_limited = (0..p.device.channels().len()).map(|c| p.device.slew_limited(c)).sum();
            let far = core.remote.at(core.registry.source_name(p.source));
            let counted = far.map_or_else(|| p.beside.counted(), |far| far.counted(name));
            (name.clone(), PhysicalDeviceStatistics { lost: p.lost.clone(), slew_limited, counters: counted.into_iter().collect() })
        });
        Statistics {
            now_s: seconds(now_ns),
            sources: sources.collect(),
            instances: instances.collect(),
            devices: devices.collect(),
            physical_devices: physical.collect(),
            processes: core.remote.processes.clone(),
            emergency: core.safety.emergency.reason.clone(),
            paused: core.safety.pause.shown(),
            mode: core.safety.modes.mode,
            supervisor_rights_missing: missing,
        }
    }
}

fn of_source(of: kernel::Statistics, steps: usize) -> SourceStatistics {
    SourceStatistics {
        steps,
        firings: of.firings,
        overruns: of.overruns,
        late: of.late,
        faults: of.faults,
        lost: of.lost,
        stopped: of.stopped,
        rights_missing: of.rights_missing,
        jitter: Jitter {
            jitter_last_ns: of.jitter_last_ns,
            jitter_max_ns: of.jitter_max_ns,
            jitter_bins: of.jitter_bins.to_vec(),
            jitter_median_ns: median(&of.jitter_bins),
        },
        durations: Durations {
            duration_sum_ns: of.duration_sum_ns,
            duration_last_ns: of.duration_last_ns,
            duration_max_ns: of.duration_max_ns,
            duration_bins: of.duration_bins.to_vec(),
            duration_median_ns: median(&of.duration_bins),
        },
        placed: None,
        probed: false,
        blocks: Vec::new(),
    }
}

/// Returns where a source runs and what its thread asked of the operating system, beside what it did not get.
fn placed(definitions: &Definitions, name: &str, is_virtual: bool) -> Option<SourcePlace> {
    let of = definitions.configuration.sources.get(name)?;
    let core = definitions.processors.get(&of.processor).and_then(|processor| processor.core);
    let (kind, period_ns) = match of.kind {
        SourceKind::Timer { period_ns } => (KindOfSource::Timer, Some(period_ns)),
        SourceKind::Trigger => (KindOfSource::Trigger, None),
        SourceKind::Software => (KindOfSource::Software, None),
    };
    let mut rights_asked = Vec::new();
    if !is_virtual {
        rights_asked.extend(["locked memory".to_owned(), format!("real-time priority {}", of.priority)]);
        rights_asked.extend(core.map(|core| format!("core {core}")));
    }
    Some(SourcePlace { processor: of.processor.clone(), core, kind, period_ns, priority: of.priority, rights_asked })
}

/// Returns the upper end of the bin that the median falls into.
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

/// Returns a time in seconds, for people.
#[allow(clippy::cast_precision_loss, reason = "a time in seconds")]
pub(crate) fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
