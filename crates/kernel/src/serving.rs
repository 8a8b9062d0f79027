// SPDX-License-Identifier: Apache-2.0
//! Effects of a condition, independent of the location of its source: used by the kernel for its own firings, and by the host for
//! processes whose sources are in several locations.
use crate::block::BlockId;
use crate::event::{Event, Fault};
use crate::process::{Process, Reaction, Response, Watch};
use crate::process_word::Word;
use crate::source::SourceId;

/// Server of conditions: the kernel in whose firing a condition was reported, or the host if no kernel has the word of the process.
pub trait Server {
    /// Returns the word of `process`, which other threads may change concurrently.
    fn word(&self, process: &Process) -> Word;

    /// Returns the conditions that were reported but not served in the current list of `process`, one bit per condition.
    fn remembered(&self, process: &Process) -> u64;

    /// Returns `moved` (true if a process was moved), or the recorded result if a record is played back.
    fn is_so(&self, moved: bool) -> bool;

    /// Carries out a prepared reaction; returns `None` if another party moved the process first.
    fn react(&mut self, process: &Process, word: Word, reaction: &dyn Reaction, next: Option<u16>) -> Option<ConditionEffect>;

    /// Freezes `process` for the supervisor; returns `None` if another party moved it first.
    fn freeze(&mut self, process: &Process, word: Word) -> Option<ConditionEffect> {
        self.is_so(process.freeze(word)).then_some(ConditionEffect::Frozen)
    }
}

/// Effect of a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConditionEffect {
    /// The process is frozen, and the supervisor takes over.
    Frozen,
    /// The process is now in this stage.
    To(u16),
    /// The process has ended.
    Ended,
}

/// Applies the effect of a condition. `may_act`: true if no condition has moved the process yet; if false, this condition is only
/// remembered, provided that a later stage awaits it.
pub fn act(server: &mut impl Server, process: &Process, word: Word, watch: &Watch, may_act: bool) -> Option<ConditionEffect> {
    if may_act {
        return respond(server, process, word, watch);
    }
    if word.remembers() && matches!(watch.response, Response::Remember) {
        process.remember(watch.condition);
    }
    None
}

/// Applies the effect of a condition that was reported before the stage that awaits it was entered.
pub fn act_late<'p>(server: &mut impl Server, process: &'p Process) -> Option<(Word, &'p Watch, ConditionEffect)> {
    let word = server.word(process);
    if !word.acts() {
        return None;
    }
    let watch = process.awaited_of(word.stage, server.remembered(process))?;
    process.forget(watch.condition);
    let moved = respond(server, process, word, watch)?;
    Some((word, watch, moved))
}

fn respond(server: &mut impl Server, process: &Process, word: Word, watch: &Watch) -> Option<ConditionEffect> {
    match &watch.response {
        Response::Remember => {
            process.remember(watch.condition);
            None
        }
        Response::Tell => server.freeze(process, word),
        Response::React { script, next } => server.react(process, word, &**script, *next),
    }
}

/// A reported condition.
#[derive(Clone, Copy)]
pub struct Occurrence {
    pub source: SourceId,
    pub process: u64,
    pub generation: u32,
    pub block: BlockId,
    pub item: u8,
    pub fault: Option<Fault>,
    /// Number of the invocation that reported the condition.
    pub number: u64,
    pub time_ns: i64,
}

impl Occurrence {
    /// Creates the occurrence of a condition that takes effect later than it was reported, in a stage that awaits it.
    pub fn late(source: SourceId, process: &Process, word: Word, watch: &Watch, time_ns: i64) -> Occurrence {
        let block = watch.block.unwrap_or(BlockId(u32::MAX));
        Occurrence { source, process: process.id(), generation: word.generation, block, item: watch.item, fault: None, number: 0, time_ns }
    }

    /// Returns the event for the supervisor if no watch names the condition.
    pub fn unwatched(self, value: Vec<u8>) -> Event {
        let Occurrence { source, process, generation, block, item, fault, number, time_ns } = self;
        Event::Unwatched { source, process, generation, block, item, fault, number, time_ns, value }
    }

    /// Returns the event that reports the effect of the condition to the supervisor. `alone`: no other condition was reported in the
    /// firing.
    pub fn watched(self, watch: &Watch, moved: Option<ConditionEffect>, alone: bool, value: Vec<u8>) -> Event {
        let Occurrence { source, process, generation, block, item, fault, number, time_ns } = self;
        let (condition, acted, ended) = (watch.condition, moved.is_some(), moved == Some(ConditionEffect::Ended));
        let stage = if let Some(ConditionEffect::To(next)) = moved { Some(next) } else { None };
        let captured = Vec::new();
        Event::Condition { source, process, generation, condition, block, item, fault, number, time_ns, alone, acted, ended, stage, value, captured }
    }
}
