// SPDX-License-Identifier: Apache-2.0
//! Order in which conditions take effect: at the end of the firing that reported them, by priority, then by order of declaration, then by
//! order of creation. Only the first condition that moves its process takes effect.
use crate::block::BlockId;
use crate::event::Event;
use crate::phase::CountedInvocations;
use crate::process::{Process, Reaction, Response, Watch};
use crate::process_word::Word;
use crate::running_time::TimeState;
use crate::script::{Op, Script};
use crate::serving::{self, ConditionEffect, Occurrence, Server};
use crate::state::{Kernel, is_so, word_of};
use crate::steps::{SIGNAL, fault};
use crate::table::{Candidate, ColdStep, Report};
use opengpac::What;
use opengpac::abi::outcome;
use std::cmp::Reverse;

/// Maximum number of rounds in which conditions reported by `execute`s in reactions are served immediately if the source may not fire
/// again.
const ROUNDS: usize = 16;

impl Kernel {
    /// Serves the conditions reported in this firing. Conditions reported by an `execute` in a reaction wait for the next firing, so that
    /// a cycle of transitions never runs without time passing. On a software source, whose next firing may never come, they are served
    /// immediately, in a limited number of rounds.
    pub(crate) fn serve(&mut self, now_ns: i64) {
        let rounds = if self.source.period_ns().is_some() { 1 } else { ROUNDS };
        for _ in 0..rounds {
            if self.table.reports.is_empty() {
                return;
            }
            self.serve_once(now_ns);
        }
    }

    fn serve_once(&mut self, now_ns: i64) {
        self.pass += 1;
        self.collect();
        let table = &mut *self.table;
        table.reports.clear();
        table.candidates.sort_unstable_by_key(|candidate| (Reverse(candidate.priority), candidate.order, candidate.created, candidate.step, candidate.item));
        let count = table.candidates.len();
        // Remembered conditions are recorded before anything moves, so that a wait reached in this firing finds them.
        for remembered in [true, false] {
            for index in 0..count {
                let candidate = self.table.candidates[index];
                if remembered == self.is_remembered(&candidate) {
                    self.answer(&candidate, now_ns);
                }
            }
        }
        self.table.candidates.clear();
    }

    fn collect(&mut self) {
        for index in 0..self.table.reports.len() {
            let report = self.table.reports[index];
            let process = self.table.steps[report.step as usize].process;
            if fault(report.result).is_none() {
                let mut conditions = report.result >> outcome::SHIFT;
                while conditions != 0 {
                    self.candidate(&report, process, conditions.trailing_zeros() as u8);
                    conditions &= conditions - 1;
                }
                continue;
            }
            self.candidate(&report, process, Watch::FAULT);
            if report.result & outcome::MASK == SIGNAL {
                for other in (0..self.table.processes.len() as u32).filter(|&other| other != process) {
                    if self.is_on(other) {
                        self.candidate(&report, other, Watch::FAULT);
                    }
                }
            }
        }
    }

    /// Returns true if the process has an active step in this source.
    fn is_on(&self, process: u32) -> bool {
        self.table.steps.iter().any(|step| {
            // SAFETY: an activation of this source.
            step.process == process && unsafe { (*self.table.activations[step.slot as usize].state()).on }
        })
    }

    fn candidate(&mut self, report: &Report, process: u32, item: u8) {
        let table = &mut *self.table;
        let found = &table.processes[process as usize];
        let block = block_of(&table.steps, report.step);
        let stage = word_of(&self.source, found).stage;
        let watch = found.watch_of(stage, block, item);
        let (priority, order) = watch.map_or((i32::MIN, u32::MAX), |(line, watch)| (watch.priority, line as u32));
        let candidate = Candidate {
            priority,
            order,
            created: found.created(),
            step: report.step,
            process,
            item,
            watch: watch.map(|(line, _)| (stage, line as u16)),
            result: report.result,
            now_ns: report.now_ns,
        };
        if table.candidates.len() < table.candidates.capacity() {
            table.candidates.push(candidate);
        } else {
            self.lose();
        }
    }

    fn is_remembered(&self, candidate: &Candidate) -> bool {
        let process = &self.table.processes[candidate.process as usize];
        candidate.watch.is_some_and(|(stage, line)| matches!(process.watches(stage)[usize::from(line)].response, Response::Remember))
    }

    fn answer(&mut self, candidate: &Candidate, now_ns: i64) {
        let process = &raw const *self.table.processes[candidate.process as usize];
        // SAFETY: the table holds the process, and no reaction swaps the table.
        let process = unsafe { &*process };
        let word = word_of(&self.source, process);
        let block = block_of(&self.table.steps, candidate.step);
        // SAFETY: the block is in the table, and no step runs.
        let number = self.table.header(candidate.step).map_or(0, |header| unsafe { (*header).number }.saturating_sub(1));
        let fault = fault(candidate.result);
        let (generation, time_ns, item) = (word.running_generation(), candidate.now_ns, candidate.item);
        let came = Occurrence { source: self.source.id, process: process.id(), generation, block, item, fault, number, time_ns };
        self.captured.clear();
        let Some((stage, line)) = candidate.watch else {
            return self.tell_condition(came.unwatched(Vec::new()), candidate.step, item, candidate.result);
        };
        let watch = &process.watches(stage)[usize::from(line)];
        let time: *mut TimeState = self.table.times[candidate.process as usize];
        // SAFETY: the process's time in this source.
        let may_act = word.acts() && word.stage == stage && unsafe { (*time).moved } != self.pass;
        let moved = serving::act(&mut InFiring { kernel: self, now_ns }, process, word, watch, may_act);
        if moved.is_some() {
            // SAFETY: as above.
            unsafe { (*time).moved = self.pass };
        }
        let alone = self.table.candidates.len() <= 1;
        self.tell_condition(came.watched(watch, moved, alone, Vec::new()), candidate.step, item, candidate.result);
        self.serve_entered(now_ns);
    }

    /// Schedules a check of the remembered conditions of `process` for later at this boundary.
    pub fn enter(&mut self, process: &Process) {
        if self.entered.len() < self.entered.capacity() {
            self.entered.push(process);
        } else {
            self.lose();
        }
    }

    /// Handles conditions that were reported before the stage that awaits them was entered: they take effect on entry.
    pub(crate) fn serve_entered(&mut self, now_ns: i64) {
        while let Some(process) = self.entered.pop() {
            // SAFETY: the script that entered the stage, or the table, holds the process.
            let process = unsafe { &*process };
            self.captured.clear();
            let Some((word, watch, moved)) = serving::act_late(&mut InFiring { kernel: self, now_ns }, process) else { continue };
            let came = Occurrence::late(self.source.id, process, word, watch, now_ns);
            let event = came.watched(watch, Some(moved), self.table.candidates.len() <= 1, Vec::new());
            let step = self.table.steps.iter().position(|step| step.block.as_ref().is_some_and(|block| Some(block.id()) == watch.block));
            match step {
                Some(step) => self.tell_condition(event, step as u32, watch.item, outcome::DONE),
                None => self.tell_captured(event, &[]),
            }
        }
    }

    /// Reports a condition with the value reported by its block or the message of its exception, and with the captures of its reaction.
    fn tell_condition(&mut self, event: Event, step: u32, item: u8, result: u64) {
        if fault(result).is_some() {
            // SAFETY: a step of this process returned it, or it is no exception.
            let what = unsafe { What::of(result) };
            return self.tell_captured(event, what.bytes());
        }
        let (start, len) = self.table.steps[step as usize].block.as_ref().map_or((std::ptr::null(), 0), |block| block.report_bytes(usize::from(item)));
        // SAFETY: the report lies in the instance, and no step runs.
        let value = if len == 0 { &[][..] } else { unsafe { std::slice::from_raw_parts(start, len) } };
        self.tell_captured(event, value);
    }

    fn tell_captured(&mut self, event: Event, value: &[u8]) {
        let captured = std::mem::take(&mut self.captured);
        self.tell(event, value, &captured);
        self.captured = captured;
        self.captured.clear();
    }
}

/// View of the kernel while it serves the conditions of its own firings.
struct InFiring<'a> {
    kernel: &'a mut Kernel,
    now_ns: i64,
}

impl Server for InFiring<'_> {
    fn word(&self, process: &Process) -> Word {
        word_of(&self.kernel.source, process)
    }

    fn remembered(&self, process: &Process) -> u64 {
        self.kernel.source.tape.as_ref().map_or_else(|| process.remembered(), |tape| tape.number(process.remembered()))
    }

    fn is_so(&self, moved: bool) -> bool {
        is_so(&self.kernel.source, moved)
    }

    fn react(&mut self, process: &Process, word: Word, reaction: &dyn Reaction, next: Option<u16>) -> Option<ConditionEffect> {
        if self.kernel.stopped {
            // The source has stopped, so the next stage would not run here.
            return self.freeze(process, word);
        }
        if !self.is_so(process.react(word, next)) {
            return None;
        }
        let mut captured = std::mem::take(&mut self.kernel.captured);
        for op in &Script::of(reaction).ops {
            if let Op::While { process, generation } = op {
                let word = self.word(process);
                if word.generation != *generation || !word.acts() {
                    break;
                }
            }
            if matches!(op, Op::Forget) {
                process.forget_all();
            }
            self.kernel.apply(op, self.now_ns, &mut captured);
        }
        self.kernel.captured = captured;
        let Some(next) = next else { return Some(ConditionEffect::Ended) };
        self.kernel.enter(process);
        Some(ConditionEffect::To(next))
    }
}

fn block_of(steps: &[ColdStep], step: u32) -> BlockId {
    steps[step as usize].block.as_ref().map_or(BlockId(u32::MAX), |block| block.id())
}
