// SPDX-License-Identifier: Apache-2.0
//! Effects of a condition, wherever its source is: the kernel serves those of its own firings by this, the host those of processes
//! whose sources lie in several places.
use crate::block::BlockId;
use crate::event::{Event, Fault};
use crate::process::{Process, Reaction, Response, Watch};
use crate::process_word::Word;
use crate::source::SourceId;

/// Serves conditions: the kernel in whose firing one came, or the host, where no kernel has the word of the process.
pub trait Server {
    /// Returns the word of `process`, which others move too.
    fn word(&self, process: &Process) -> Word;

    /// Returns the conditions that came, unserved, in the present list of `process`: one bit a condition.
    fn remembered(&self, process: &Process) -> u64;

    /// Returns true if `process` could be moved.
    fn is_so(&self, moved: bool) -> bool;

    /// Carries out a prepared answer; none where somebody was faster.
    fn react(&mut self, process: &Process, word: Word, reaction: &dyn Reaction, next: Option<u16>) -> Option<ConditionEffect>;

    /// Freezes `process` for the supervisor; none where somebody was faster.
    fn freeze(&mut self, process: &Process, word: Word) -> Option<ConditionEffect> {
        self.is_so(process.freeze(word)).then_some(ConditionEffect::Frozen)
    }
}

/// Effect of a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConditionEffect {
    /// The supervisor carries on.
    Frozen,
    /// The process is in this stage now.
    To(u16),
    /// The process has ended.
    Ended,
}

/// Lets a condition act. `may_act`: nothing moved the process before it; else it is only remembered, where it is one for later.
pub fn act(server: &mut impl Server, process: &Process, word: Word, watch: &Watch, may_act: bool) -> Option<ConditionEffect> {
    if may_act {
        return respond(server, process, word, watch);
    }
    if word.remembers() && matches!(watch.response, Response::Remember) {
        process.remember(watch.condition);
    }
    None
}

/// Lets a condition act that came before the stage which waits for it was entered.
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

/// A condition that came.
#[derive(Clone, Copy)]
pub struct Occurrence {
    pub source: SourceId,
    pub process: u64,
    pub generation: u32,
    pub block: BlockId,
    pub item: u8,
    pub fault: Option<Fault>,
    /// Number of the invocation that reported it.
    pub number: u64,
    pub time_ns: i64,
}

impl Occurrence {
    /// Makes the occurrence of a condition that acts after it came, in a stage that waits for it.
    pub fn late(source: SourceId, process: &Process, word: Word, watch: &Watch, time_ns: i64) -> Occurrence {
        let block = watch.block.unwrap_or(BlockId(u32::MAX));
        Occurrence { source, process: process.id(), generation: word.generation, block, item: watch.item, fault: None, number: 0, time_ns }
    }

    /// Returns the event for the supervisor if no watch names the condition.
    pub fn unwatched(self, value: Vec<u8>) -> Event {
        let Occurrence { source, process, generation, block, item, fault, number, time_ns } = self;
        Event::Unwatched { source, process, generation, block, item, fault, number, time_ns, value }
    }

    /// Returns the event that tells the supervisor what the condition did. `alone`: no other condition came in the firing.
    pub fn watched(self, watch: &Watch, moved: Option<ConditionEffect>, alone: bool, value: Vec<u8>) -> Event {
        let Occurrence { source, process, generation, block, item, fault, number, time_ns } = self;
        let (condition, acted, ended) = (watch.condition, moved.is_some(), moved == Some(ConditionEffect::Ended));
        let stage = if let Some(ConditionEffect::To(next)) = moved { Some(next) } else { None };
        let captured = Vec::new();
        Event::Condition { source, process, generation, condition, block, item, fault, number, time_ns, alone, acted, ended, stage, value, captured }
    }
}
