// SPDX-License-Identifier: Apache-2.0
//! Takeover of processes left by a previous supervisor, whose processors continue to run without a supervisor.
use crate::core::Core;
use crate::movements::sequence::by_source;
use crate::processors::remote::processor_of;
use crate::refuse::refuse;
use crate::scripts::{Purpose, Ticket};
use crate::system::System;

use kernel::{Cell, Op, SourceId};
use model::refusal::{Class, Refusals};
use rtp::Processor;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// Time limit for earlier starts to complete, and for kernels to answer after that.
const SETTLED: Duration = Duration::from_secs(5);

/// Results of a takeover, one per process that contains processors.
#[derive(Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TakenOver {
    /// Results, sorted by process name.
    pub processors: Vec<OfProcessor>,
}

/// Result for a processor in its own process, or for several processors that share a process.
#[derive(Debug, Default, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "ProcessTakenOver"))]
pub struct OfProcessor {
    /// Name of the processor, or of the process if it can be shared.
    pub name: String,
    /// Processors in the process.
    pub processors: Vec<String>,
    /// True if the running blocks of the process were taken over; false if the process was started for this system.
    pub is_adopted: bool,
    /// Labels of blocks that continue from their previous state.
    pub carried: Vec<String>,
    /// Blocks that restart, each with the reason.
    pub anew: Vec<Anew>,
    /// Labels of blocks that were running but have not been started by this system; they have ended.
    pub ended: Vec<String>,
    /// Longest time for which a device was not written, ns; null if there are no devices.
    pub gap_ns: Option<i64>,
}

/// A block that restarts.
#[derive(Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "BlockAnew"))]
pub struct Anew {
    /// Label of the block.
    pub block: String,
    /// Reason for the restart.
    pub why: String,
}

impl System {
    /// Makes processes that lost their system continue as part of this system, from their current state. Does nothing under the virtual
    /// clock or when called again. Refuses a takeover if a running block must not continue; that processor is then left unchanged, but
    /// processors whose names sort before it have been taken over.
    pub fn take_over(&self) -> Result<TakenOver, Refusals> {
        let mut remote: Vec<Arc<Processor>> = self.shared.command(|core| {
            // Processes on another host do not wait for a supervisor.
            Ok(core.remote.places().into_iter().filter(|processor| runtime::Remote::host(&**processor).is_none()).collect())
        })?;
        if remote.iter().any(|processor| processor.is_adopted()) {
            // Anything that is still starting would restart after the takeover.
            self.shared.wait_for(None, SETTLED, |core| Ok(core.instances.values().all(|instance| !instance.is_under_way()).then_some(())))?;
        }
        remote.sort_by(|one, other| one.name().cmp(other.name()));
        let mut taken_over = Vec::new();
        for processor in remote {
            let taken = processor.take_over().map_err(|why| {
                let message = format!("cannot take over what runs on {}: {why}", self.shared.locked().remote.called(&processor));
                refuse(Class::InvalidState, message, "close this system instead: what runs there ends in an orderly way when its patience= has elapsed")
            })?;
            let of =
                OfProcessor { name: processor.name().to_owned(), processors: self.shared.locked().remote.processors_in(&processor), ..OfProcessor::default() };
            taken_over.push(match taken {
                None => of,
                Some(taken) => {
                    let anew = taken.anew.into_iter().map(|(block, why)| Anew { block, why }).collect();
                    OfProcessor { is_adopted: true, carried: taken.carried, anew, ended: taken.ended, gap_ns: taken.gap_ns, ..of }
                }
            });
        }
        for processor in taken_over.iter().filter(|of| of.is_adopted).flat_map(|of| &of.processors) {
            self.carry_values(processor)?;
        }
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        for of in taken_over.iter().filter(|of| of.is_adopted) {
            let what = format!("taken over: {} blocks continue, {} start again, {} have ended", of.carried.len(), of.anew.len(), of.ended.len());
            core.observation.log.add(now_ns, "processor", &of.name, what);
        }
        drop(core);
        Ok(TakenOver { processors: taken_over })
    }

    /// Copies the values that SVVs have in a taken-over processor to all sources, for SVVs that have not been written in this system yet.
    fn carry_values(&self, processor: &str) -> Result<(), Refusals> {
        let asked = self.shared.command(|core| Ok(ask_unwritten(core, processor)))?;
        let all_there = |core: &mut Core| Ok(asked.iter().all(|(ticket, _)| core.observation.reads.contains_key(ticket)).then_some(()));
        self.shared.wait_for(None, SETTLED, all_there)?;
        self.shared.command(|core| {
            know_again(core, &asked);
            Ok(())
        })
    }
}

/// SVVs in the order in which a source was queried for them, with the ticket of the query.
type AskedSvvs = (Ticket, Vec<(String, usize)>);

/// Queries the sources of a processor for the values of SVVs that no block has written yet.
fn ask_unwritten(core: &mut Core, processor: &str) -> Vec<AskedSvvs> {
    let mut by_source: BTreeMap<SourceId, Vec<(String, Cell)>> = BTreeMap::new();
    for (name, svv) in core.registry.svvs.iter().filter(|(_, svv)| svv.home.is_none()) {
        for (source, cell) in svv.cells.iter().filter(|(source, _)| processor_of(core.registry.source_name(**source)) == processor) {
            by_source.entry(*source).or_default().push((name.clone(), cell.clone()));
        }
    }
    let mut asked = Vec::new();
    for (source, cells) in by_source {
        let ticket = Ticket(core.numbers.fresh());
        asked.push((ticket, cells.iter().map(|(name, cell)| (name.clone(), cell.len())).collect()));
        core.submit(source, vec![Op::Capture(cells.into_iter().map(|(_, cell)| cell).collect())], Purpose::Read { ticket });
    }
    asked
}

/// Adopts as current those values that differ from the values stored here.
fn know_again(core: &mut Core, asked: &[AskedSvvs]) {
    let mut known: BTreeMap<&str, Vec<u8>> = BTreeMap::new();
    for (ticket, names) in asked {
        let Some((_, captured)) = core.observation.reads.remove(ticket) else { continue };
        let mut rest = captured.as_slice();
        for (name, len) in names {
            let Some((bytes, after)) = rest.split_at_checked(*len) else { break };
            rest = after;
            // Other images contain the stored value.
            if core.registry.svvs.get(name).is_some_and(|svv| svv.home.is_none() && svv.past.stored != bytes) {
                known.insert(name, bytes.to_vec());
            }
        }
    }
    let stores: Vec<(SourceId, Op)> = known.into_iter().flat_map(|(name, bytes)| core.carrier().store_everywhere(name, &bytes)).collect();
    for (source, ops) in by_source(stores) {
        core.submit(source, ops, Purpose::Nothing);
    }
}
