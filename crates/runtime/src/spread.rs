// SPDX-License-Identifier: Apache-2.0
//! Processes spread over several locations. Serves conditions that no kernel can serve, and keeps the local word of a process
//! synchronised with the remote one.
use crate::remote_sources::RemoteSources;
use kernel::process_word::Word;
use kernel::serving::{self, ConditionEffect, Occurrence, Server};
use kernel::{Event, Home, Op, Process, Reaction, Script, SourceId};
use std::sync::Arc;

impl RemoteSources {
    /// Notifies the other hosts of a spread process of the effects of a script on it.
    pub(crate) fn announce(&self, source: SourceId, script: &Script) {
        if !self.is_any() {
            return;
        }
        let to = self.of(source);
        for (process, step) in steps(script) {
            if !process.is_spread() {
                continue;
            }
            let places = self.places(process.id());
            match step {
                Step::Enter(stage, generation) => process.enter(stage, Some(generation)),
                Step::Advance(generation, from, stage) => process.advance(generation, from, stage),
            };
            let (generation, stage) = process.now();
            let others = places.iter().filter(|place| to.as_ref().is_none_or(|to| !Arc::ptr_eq(to, place)));
            others.for_each(|place| place.enter(process.id(), stage, generation));
        }
    }

    /// Serves conditions that no kernel can serve because their processes are spread over several locations; tracks processes whose word
    /// is remote.
    pub(crate) fn serve(&self, event: Event) -> Event {
        match event {
            Event::Unwatched { source, process: id, generation, block, item, fault, number, time_ns, value } => {
                let came = Occurrence { source, process: id, generation, block, item, fault, number, time_ns };
                let Some(process) = self.process(id).filter(|process| process.is_spread()) else { return came.unwatched(value) };
                let word = process.word();
                let Some((_, watch)) = process.watch_of(word.stage, block, item) else { return came.unwatched(value) };
                // Conditions reported before a wait of the same list was reached still count for it.
                let moved = if process.is_of_list(generation) { serving::act(&mut Here, &process, word, watch, word.acts()) } else { None };
                let generation = if moved.is_some() { word.generation } else { generation };
                Occurrence { generation, ..came }.watched(watch, moved, false, value)
            }
            Event::Done { source, script, firing, time_ns, captured } => {
                let found: Vec<Event> = steps(&script).filter_map(|(process, step)| served(process, &step, source, time_ns)).collect();
                let done = Event::Done { source, script, firing, time_ns, captured };
                let mut found = found.into_iter();
                let Some(first) = found.next() else { return done };
                self.tell_first(found.chain([done]));
                first
            }
            Event::Condition { process: id, generation, stage, ended, acted: true, .. } => {
                if let Some(process) = self.process(id).filter(|process| matches!(process.home(), Home::There(_))) {
                    process.follow(generation, stage, ended);
                }
                event
            }
            event => event,
        }
    }
}

/// Completes a script that has been carried out and that moved a process: serves the remembered conditions, or updates the local word.
fn served(process: &Process, step: &Step, source: SourceId, time_ns: i64) -> Option<Event> {
    match (process.home(), step) {
        (Home::Spread, _) => return serve_remembered(process, source, time_ns),
        (Home::There(_), Step::Enter(stage, generation)) => process.enter(*stage, Some(*generation)),
        (Home::There(_), Step::Advance(generation, from, stage)) => process.advance(*generation, *from, *stage),
        (Home::Here, _) => return None,
    };
    None
}

/// Serves a condition that was reported before the stage that awaits it was entered.
fn serve_remembered(process: &Process, source: SourceId, time_ns: i64) -> Option<Event> {
    let (word, watch, moved) = serving::act_late(&mut Here, process)?;
    Some(Occurrence::late(source, process, word, watch, time_ns).watched(watch, Some(moved), false, Vec::new()))
}

/// Condition server of the host, for processes whose word is local but whose kernels are remote, so that only the supervisor answers
/// their conditions.
struct Here;

impl Server for Here {
    fn word(&self, process: &Process) -> Word {
        process.word()
    }

    fn remembered(&self, process: &Process) -> u64 {
        process.remembered()
    }

    fn is_so(&self, moved: bool) -> bool {
        moved
    }

    fn react(&mut self, process: &Process, word: Word, _: &dyn Reaction, _: Option<u16>) -> Option<ConditionEffect> {
        self.freeze(process, word)
    }
}

/// Effect of a script on the word of a process.
enum Step {
    Enter(u16, u32),
    Advance(u32, u16, u16),
}

fn steps(script: &Script) -> impl Iterator<Item = (&Arc<Process>, Step)> {
    script.ops.iter().filter_map(|op| match op {
        Op::Stage { process, stage, generation: Some(generation) } => Some((process, Step::Enter(*stage, *generation))),
        Op::Advance { process, generation, from, to } => Some((process, Step::Advance(*generation, *from, *to))),
        _ => None,
    })
}
