// SPDX-License-Identifier: Apache-2.0
//! Taking over what a supervisor before has left: processes of processors that go on without one.
use crate::refuse::refuse;
use crate::system::System;
use model::refusal::{Class, Refusals};
use rtp::Processor;
use serde::Serialize;
use std::sync::Arc;

/// What became of each processor in a process of its own.
#[derive(Debug, Serialize)]
pub struct TakenOver {
    /// In the order of their names.
    pub processors: Vec<OfProcessor>,
}

/// What became of one processor.
#[derive(Debug, Default, Serialize)]
pub struct OfProcessor {
    /// Its name.
    pub name: String,
    /// Something of it ran, and has been taken over now; else its process was started for this system.
    pub is_adopted: bool,
    /// Blocks that go on where they were, by label.
    pub carried: Vec<String>,
    /// Blocks that begin anew, and why.
    pub anew: Vec<Anew>,
    /// Blocks that ran, and that this system has not started: they have ended.
    pub ended: Vec<String>,
    /// The longest time for which a device was not written, ns; none where there is none.
    pub gap_ns: Option<i64>,
}

/// A block that begins anew.
#[derive(Debug, Serialize)]
pub struct Anew {
    /// Its label.
    pub block: String,
    /// Why.
    pub why: String,
}

impl System {
    /// What runs in processes that lost their system goes on as this one has it, from where it is. Nothing under the virtual clock, and nothing the
    /// second time. Refused where what ran must not go on: then that processor is as before, and those before it in the order of names are
    /// taken over.
    pub fn take_over(&self) -> Result<TakenOver, Refusals> {
        let mut elsewhere: Vec<(String, Arc<Processor>)> = self.shared.command(|core| {
            // On another host there is nothing that waits.
            let own = core.elsewhere.iter().filter(|(_, far)| kernel::Far::host(&***far).is_none());
            Ok(own.map(|(name, far)| (name.clone(), far.clone())).collect())
        })?;
        elsewhere.sort_by(|(one, _), (other, _)| one.cmp(other));
        let mut processors = Vec::new();
        for (name, far) in elsewhere {
            let taken = far.take_over().map_err(|why| {
                let message = format!("cannot take over what runs on processor '{name}': {why}");
                refuse(Class::InvalidState, message, "or close this system: what runs there ends in order when its patience is over")
            })?;
            processors.push(match taken {
                None => OfProcessor { name, ..OfProcessor::default() },
                Some(taken) => {
                    let anew = taken.anew.into_iter().map(|(block, why)| Anew { block, why }).collect();
                    OfProcessor { name, is_adopted: true, carried: taken.carried, anew, ended: taken.ended, gap_ns: taken.gap_ns }
                }
            });
        }
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        for of in processors.iter().filter(|of| of.is_adopted) {
            let what = format!("taken over: {} blocks go on, {} begin anew, {} have ended", of.carried.len(), of.anew.len(), of.ended.len());
            core.log.add(now_ns, "processor", &of.name, what);
        }
        drop(core);
        Ok(TakenOver { processors })
    }
}
