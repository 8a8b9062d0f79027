// SPDX-License-Identifier: Apache-2.0
//! Everything that the supervisor keeps of a running system, under one lock. Every method that changes what runs is here or in
//! the files named after what they do; none of them waits.
use crate::alarms::Alarms;
use crate::claims::Request;
use crate::connect::Pair;
use crate::emergency::Emergency;
use crate::ends::Ends;
use crate::instance::Instance;
use crate::log::Log;
use crate::modes::Modes;
use crate::pause::Pause;
use crate::svvs::SvvRecord;
use crate::tables::SourceTable;
use crate::taps::Taps;
use guard::Restarts;
use indexmap::IndexMap;
use kernel::{Cell, Device, Host, Op, Script, SourceId, SourceSpec};
use model::plan::Claim;
use rtp::Processor;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A logical device, as it runs.
pub(crate) struct LogicalRecord {
    /// Instance of its own verb, if its type has one.
    pub instance: Option<u64>,
    pub state: DeviceState,
    /// (SVV that is set, SVV it is set from) when it is enabled.
    pub copies: Vec<(String, String)>,
}

/// State of a logical device's own verb; whether it moves is seen from the verbs that use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DeviceState {
    Disabled,
    Enabling,
    Enabled,
    Stopping,
    Fault,
}

/// A physical device and the source that serves it.
pub(crate) struct PhysicalRecord {
    pub device: Arc<Device>,
    pub source: SourceId,
    pub lost: Option<String>,
    /// Of one that lies elsewhere: how it was opened.
    pub opened: Option<(String, String)>,
    /// Kind and options of its driver.
    pub driver: (String, serde_json::Value),
    /// What its driver says of itself.
    pub about: serde_json::Value,
}

/// Whose script it was that a kernel acknowledges.
pub(crate) enum Purpose {
    /// Of this instance's sequence (the count tells a sequence that was given up).
    Sequence { instance: u64, epoch: u64 },
    /// A snapshot: the caller waits under this ticket.
    Read { ticket: u64 },
    /// Somebody waits for nothing but that.
    Carried { done: Arc<AtomicBool> },
    /// Nobody waits.
    Nothing,
}

pub(crate) struct Core {
    pub host: Arc<Host>,
    /// `rtp.name` → source.
    pub sources: IndexMap<String, SourceId>,
    /// What each source is, by number.
    pub specs: Vec<SourceSpec>,
    /// Processors that run elsewhere; those that share a process have one.
    pub elsewhere: IndexMap<String, Arc<Processor>>,
    /// Processes of this host but this one, as they were asked for, with the processors in each.
    pub processes: IndexMap<String, Vec<String>>,
    /// How often each of them may get a new process.
    pub restarts: HashMap<String, Restarts>,
    pub tables: BTreeMap<SourceId, SourceTable>,
    pub svvs: IndexMap<String, SvvRecord>,
    pub physical: IndexMap<String, PhysicalRecord>,
    pub logical: IndexMap<String, LogicalRecord>,
    pub instances: BTreeMap<u64, Instance>,
    pub claims: HashMap<Claim, u64>,
    /// Starts that wait for claims, in order.
    pub queue: Vec<Request>,
    pub log: Log,
    pub emergency: Emergency,
    pub pause: Pause,
    pub modes: Modes,
    pub alarms: Alarms,
    /// Sources that did not answer: nobody waits for them.
    pub lost: HashSet<SourceId>,
    /// Sources that a test has cut off.
    pub cut_off: HashSet<SourceId>,
    /// Modules in which a signal was caught: no new instance until a reset.
    pub poisoned: HashMap<String, String>,
    /// Snapshots that have arrived: ticket → (time, bytes of each script).
    pub reads: HashMap<u64, (i64, Vec<u8>)>,
    /// Ends not yet told to an event loop.
    pub ended: u64,
    /// The latest end reports, for who was not there.
    pub ends: Ends,
    pub taps: Taps,
    /// The latest connection of each pair.
    pub latest: HashMap<Pair, u64>,
    pub last_connection: u64,
    /// How many instances of each verb have been named.
    pub named: HashMap<String, u64>,
    /// Of a system that is recorded: the cells whose SVV the record knows.
    pub recorded: HashMap<(String, SourceId), Cell>,
    scripts: HashMap<u64, Purpose>,
    last_id: u64,
    /// How many SVVs were made so far: each has its number for the life of the system.
    pub svvs_made: u32,
}

impl Core {
    pub fn new(host: Arc<Host>) -> Core {
        Core {
            host,
            sources: IndexMap::new(),
            specs: Vec::new(),
            elsewhere: IndexMap::new(),
            processes: IndexMap::new(),
            restarts: HashMap::new(),
            tables: BTreeMap::new(),
            svvs: IndexMap::new(),
            physical: IndexMap::new(),
            logical: IndexMap::new(),
            instances: BTreeMap::new(),
            claims: HashMap::new(),
            queue: Vec::new(),
            log: Log::default(),
            emergency: Emergency::default(),
            pause: Pause::default(),
            modes: Modes::default(),
            alarms: Alarms::default(),
            lost: HashSet::new(),
            cut_off: HashSet::new(),
            poisoned: HashMap::new(),
            reads: HashMap::new(),
            ended: 0,
            ends: Ends::default(),
            taps: Taps::default(),
            latest: HashMap::new(),
            last_connection: 0,
            named: HashMap::new(),
            recorded: HashMap::new(),
            scripts: HashMap::new(),
            last_id: 0,
            svvs_made: 0,
        }
    }

    /// A number never given before: instances, tickets, scripts, blocks.
    pub fn fresh(&mut self) -> u64 {
        self.last_id += 1;
        self.last_id
    }

    /// Hands operations to a source as one script.
    pub fn submit(&mut self, source: SourceId, ops: Vec<Op>, purpose: Purpose) {
        let id = self.fresh();
        self.scripts.insert(id, purpose);
        if self.host.trace().is_some() && ops.iter().any(|op| matches!(op, Op::Table(_))) {
            self.name_cells(source);
        }
        if !self.cut_off.contains(&source) {
            self.host.submit(source, Box::new(Script { id, ops }));
        }
    }

    /// Whose the acknowledged script was.
    pub fn acknowledged(&mut self, script: u64) -> Purpose {
        self.scripts.remove(&script).unwrap_or(Purpose::Nothing)
    }

    /// What a script brings for this ticket is no longer waited for.
    pub fn nobody_reads(&mut self, asked: u64) {
        self.scripts.retain(|_, purpose| !matches!(purpose, Purpose::Read { ticket } if *ticket == asked));
    }

    /// `rtp.name` of a source.
    pub fn source_name(&self, source: SourceId) -> &str {
        self.sources.iter().find(|(_, id)| **id == source).map_or("?", |(name, _)| name)
    }

    /// Stores a value in every image that has the SVV, and keeps it for images that get it later.
    pub fn store_everywhere(&mut self, svv: &str, bytes: &[u8]) -> Vec<(SourceId, Op)> {
        let now_ns = self.host.now_ns();
        let Some(record) = self.svvs.get_mut(svv) else { return Vec::new() };
        record.keep(bytes, now_ns);
        if record.home.is_none() {
            self.taps.stored(svv, now_ns, bytes);
        }
        record.store_ops(bytes)
    }
}
