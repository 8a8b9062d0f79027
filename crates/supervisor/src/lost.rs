// SPDX-License-Identifier: Apache-2.0
//! Lost processors: a source that does not acknowledge a script within its bound. For verbs with blocks there `processor_lost` comes: τ
//! leads on to a list that runs on what is left, else they end; nobody waits for the source any more, until a reset.
use crate::core::Core;
use crate::instance::Cause;
use crate::refuse::{refuse, unknown};
use crate::system::System;
use kernel::SourceId;
use model::plan::Plan;
use model::refusal::{Class, Refusals};

/// How long a source may take to acknowledge a script, ns. An idle one answers at once, a busy one after its firing.
const ANSWER_NS: i64 = 5_000_000_000;

/// A look that comes so much too late was held up itself, ns.
const STOOD_STILL_NS: i64 = 1_000_000_000;

impl Core {
    /// When a source that is asked has to have answered.
    pub fn next_answer(&self) -> Option<i64> {
        self.instances.values().filter(|i| i.outstanding > 0).map(|i| i.sent_ns.saturating_add(ANSWER_NS)).min()
    }

    /// Gives up the sources that have not answered in time.
    pub fn look_for_lost(&mut self) {
        let now_ns = self.host.now_ns();
        let Some(at) = self.next_answer().filter(|at| *at <= now_ns) else { return };
        if now_ns - at > STOOD_STILL_NS {
            // Nobody looked when it was time: this side stood still, and answers that came meanwhile are still on their way through it.
            self.instances.values_mut().filter(|i| i.outstanding > 0).for_each(|i| i.sent_ns = now_ns);
            return;
        }
        let late = self.instances.values().filter(|i| i.outstanding > 0 && i.sent_ns.saturating_add(ANSWER_NS) <= now_ns);
        let mut silent: Vec<SourceId> = late.flat_map(|i| i.awaited.iter().copied()).collect();
        silent.sort_unstable();
        silent.dedup();
        silent.into_iter().for_each(|source| self.silent(source));
    }

    fn silent(&mut self, source: SourceId) {
        let message = format!("source '{}' has not answered for {} s", self.source_name(source), ANSWER_NS / 1_000_000_000);
        self.processor_lost(source, &message);
    }

    /// Nobody runs the source any more, or nobody hears of it.
    pub fn processor_lost(&mut self, source: SourceId, message: &str) {
        if !self.lost.insert(source) {
            return;
        }
        let time_ns = self.host.now_ns();
        let name = self.source_name(source).to_owned();
        let message = message.to_owned();
        self.log.add(time_ns, "processor_lost", &name, message.clone());
        self.alarm_processor(&self.lost_place(source), &message);
        let there: Vec<u64> = self.instances.values().filter(|i| i.is_busy() && i.installed.sources.contains(&source)).map(|i| i.id).collect();
        for id in there {
            if !self.take_process(id, true) {
                continue;
            }
            // Only now is it certain in which list the process is.
            if let Some(condition) = self.instances.get(&id).and_then(|i| i.condition("processor_lost")) {
                self.lose(id, Cause { condition, block: None, value: None, message: message.clone(), time_ns, asked_for: false });
            }
        }
        let waiting: Vec<u64> = self.instances.values().filter(|i| i.awaited.contains(&source)).map(|i| i.id).collect();
        for id in waiting {
            if let Some(instance) = self.instances.get_mut(&id) {
                instance.awaited.retain(|awaited| *awaited != source);
                instance.outstanding = instance.awaited.len();
            }
            self.proceed(id);
        }
        let gone: Vec<String> = self.physical.iter().filter(|(_, physical)| physical.source == source).map(|(name, _)| name.clone()).collect();
        gone.iter().for_each(|device| self.mark_lost(device, &message, time_ns));
    }

    /// Refuses a plan that would run where nobody is.
    pub fn refuse_lost_plan(&self, plan: &Plan) -> Result<(), Refusals> {
        match plan.blocks.iter().filter_map(|block| self.sources.get(&block.source)).find(|source| self.lost.contains(source)) {
            None => Ok(()),
            Some(source) => Err(refuse(
                Class::InvalidState,
                format!("cannot create '{}': source '{}' is lost", plan.verb, self.source_name(*source)),
                "see the log for why, then call reset()",
            )),
        }
    }
}

impl System {
    /// For tests: from now on the source gets no script and acknowledges none, as if its processor were gone.
    ///
    /// # Errors
    /// `UnknownName`.
    pub fn cut_off(&self, source: &str) -> Result<(), Refusals> {
        self.shared.command(|core| {
            let Some(id) = core.sources.get(source).copied() else {
                return Err(unknown("source", source, core.sources.keys().map(String::as_str)));
            };
            core.cut_off.insert(id);
            Ok(())
        })
    }
}
