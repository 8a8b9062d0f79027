// SPDX-License-Identifier: Apache-2.0
//! Statistics of a system: firings, overruns and jitter of every interrupt source, instances, devices, and the state of stops and pauses.
use crate::definitions::system_definitions::Definitions;
use crate::devices::forcing_calls::{ForcedSignal, forced};
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
    /// Verb instances in order of creation.
    pub instances: Vec<InstanceStatistics>,
    /// States of the logical devices.
    pub devices: IndexMap<String, DeviceState>,
    pub physical_devices: IndexMap<String, PhysicalDeviceStatistics>,
    /// Processors outside the supervisor's process, by process.
    pub processes: IndexMap<String, Vec<String>>,
    /// Cause of the latched emergency stop; null if it is not latched.
    pub emergency: Option<String>,
    pub paused: PausesInForce,
    pub mode: Mode,
    /// Forced signals, by logical device.
    pub forced: IndexMap<String, ForcedSignal>,
    /// Privileges that the supervisor's thread requested from the operating system but was not granted.
    pub supervisor_rights_missing: Vec<String>,
}

/// Statistics of an interrupt source. Bin i of a histogram counts times from 2^i to 2^(i+1) ns; the first bin also counts shorter times,
/// and the last one longer times.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SourceStatistics {
    /// Number of steps in the source's firing table.
    pub steps: usize,
    /// Number of firings, excluding those of `execute`.
    pub firings: u64,
    /// Number of releases skipped because the previous firing had not finished.
    pub overruns: u64,
    /// Number of ratio values that were missing when their reader needed them.
    pub late: u64,
    /// Number of invocations that faulted.
    pub faults: u64,
    /// Number of conditions and other events that were lost because a queue was full.
    pub lost: u64,
    /// True if the source was stopped by a fault.
    pub stopped: bool,
    /// Privileges that the source's thread requested from the operating system but was not granted.
    pub rights_missing: Vec<String>,
    #[serde(flatten)]
    pub jitter: Jitter,
    #[serde(flatten)]
    pub durations: Durations,
    /// Placement of the source; absent if the source is being deleted.
    #[serde(flatten)]
    pub placed: Option<SourcePlace>,
    /// True if a probe is measuring the source's blocks.
    pub probed: bool,
    /// Durations of the blocks' invocations that a probe has measured since each block was installed.
    pub blocks: Vec<BlockTimes>,
}

/// Delays between the releases of firings and their starts.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Jitter {
    /// Delay between the release of the last firing and its start, ns.
    pub jitter_last_ns: u64,
    /// Maximum jitter, ns.
    pub jitter_max_ns: u64,
    /// Histogram of the jitter.
    pub jitter_bins: Vec<u64>,
    /// Upper bound of the bin that contains the median jitter, ns; 0 before the first firing.
    pub jitter_median_ns: u64,
}

/// Durations of firings.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Durations {
    /// Total duration of all firings, ns.
    pub duration_sum_ns: u64,
    /// Duration of the last firing, ns.
    pub duration_last_ns: u64,
    /// Maximum duration, ns.
    pub duration_max_ns: u64,
    /// Histogram of the durations.
    pub duration_bins: Vec<u64>,
    /// Upper bound of the bin that contains the median duration, ns; 0 before the first firing.
    pub duration_median_ns: u64,
}

/// Placement of an interrupt source, and the privileges that its thread requested from the operating system.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SourcePlace {
    pub processor: String,
    /// CPU core to which the source's processor is bound.
    pub core: Option<usize>,
    pub kind: KindOfSource,
    /// Period of a timer, ns.
    pub period_ns: Option<u64>,
    pub priority: u8,
    /// Privileges that the source's thread requested from the operating system; empty under the virtual clock.
    pub rights_asked: Vec<String>,
}

/// Kind of an interrupt source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum KindOfSource {
    Timer,
    /// Event of a device.
    Trigger,
    /// Request from another source.
    Software,
}

/// A one-line summary of a verb instance.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstanceStatistics {
    pub id: u64,
    pub name: String,
    pub verb: String,
    pub state: InstanceState,
    /// Command list that is running or was the last to run.
    pub list: String,
    /// Logical device whose own verb this instance runs, if any.
    pub owner: Option<String>,
    /// Running time since the start, excluding suspensions, s.
    pub running_s: f64,
}

/// Statistics of a physical device.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PhysicalDeviceStatistics {
    /// Cause of the loss; null if the device is not lost.
    pub lost: Option<String>,
    /// Number of commands to which a slew rate limit was applied.
    pub slew_limited: u64,
    /// Counters of the driver, by name.
    pub counters: IndexMap<String, u64>,
}

impl System {
    /// Returns firings, overruns and jitter of every source, the instances, the devices, the processes with their processors, and the
    /// state of the emergency stop.
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
            forced: forced(&core),
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

/// Returns the placement of a source, and the privileges that its thread requested.
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

/// Returns the upper bound of the bin that contains the median.
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

/// Converts a time to seconds for display.
#[allow(clippy::cast_precision_loss, reason = "a time in seconds")]
pub(crate) fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
