// SPDX-License-Identifier: Apache-2.0
//! One firing of a source, the same under both clocks: latch connections, read devices, run the steps that are due, write
//! devices, publish connections, serve conditions.
use crate::block::{Block, BlockId};
use crate::clock::monotonic_ns;
use crate::containment;
use crate::counters::add;
use crate::device::Device;
use crate::event::Event;
use crate::floats;
use crate::phase::CountedInvocations;
use crate::preempt::{Never, Preempt};
use crate::schedule::Due;
use crate::source::SourceId;
use crate::state::Kernel;
use crate::steps::{self, EarlyEnd};
use crate::tape::{Occasion, Tape};
use device::DeviceError;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Result of the first part of a firing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComputeResult {
    /// The source had already stopped.
    Nothing,
    /// A step stopped the source.
    Stopped,
    All,
}

impl Kernel {
    /// Runs firing `number`, which was released at `release_ns` on the host's clock and started at `started_ns` of CLOCK_MONOTONIC (for
    /// the budget).
    #[cfg_attr(rtsan, sanitize(realtime = "nonblocking"))]
    pub fn fire<P: Preempt>(&mut self, number: u64, release_ns: i64, started_ns: i64, preempt: &P) {
        let computed = self.compute(number, release_ns, started_ns, preempt);
        self.conclude(computed, release_ns, preempt);
    }

    /// Runs the first part of a firing, which has no visible effects yet.
    #[inline]
    pub fn compute<P: Preempt>(&mut self, number: u64, release_ns: i64, started_ns: i64, preempt: &P) -> ComputeResult {
        self.firing = number;
        self.begin();
        if self.stopped {
            return ComputeResult::Nothing;
        }
        self.careful = false;
        floats::begin();
        self.latch(release_ns, preempt);
        self.decide(number, release_ns);
        if self.work(release_ns, started_ns, preempt) { ComputeResult::All } else { ComputeResult::Stopped }
    }

    /// Runs the second part: writes devices, publishes results, serves conditions.
    #[inline]
    pub fn conclude<P: Preempt>(&mut self, computed: ComputeResult, release_ns: i64, preempt: &P) {
        if computed == ComputeResult::All {
            self.write_devices(release_ns);
            self.stamp(release_ns);
            self.publish(release_ns, preempt);
            self.advance();
        }
        if computed != ComputeResult::Nothing {
            self.serve(release_ns);
        }
        self.settle(release_ns);
        self.end(Occasion::Firing, release_ns);
        add(&self.source.counters.firings, 1);
    }

    /// Runs an extra firing at `now_ns` in which `blocks`, and the active blocks that they drive, are due.
    pub(crate) fn execute(&mut self, blocks: &[Arc<Block>], now_ns: i64) {
        if self.stopped {
            return;
        }
        floats::begin();
        self.latch(now_ns, &Never);
        self.table.due.fill(false);
        self.careful = true;
        for (step, chosen) in self.table.steps.iter().zip(&mut self.table.chosen) {
            *chosen = step.block.as_ref().is_some_and(|block| blocks.iter().any(|executed| Arc::ptr_eq(block, executed)));
        }
        let worked = self.work(now_ns, monotonic_ns(), &Never);
        self.table.chosen.fill(false);
        if worked {
            self.write_devices(now_ns);
            self.stamp_executed(now_ns);
            self.publish(now_ns, &Never);
            self.advance();
            for activation in &self.table.activations {
                // SAFETY: an activation of this source.
                unsafe { (*activation.state()).due = false };
            }
        }
    }

    /// Publishes the values stored by scripts, after a firing or a script.
    pub(crate) fn settle(&mut self, now_ns: i64) {
        if self.stored {
            self.stored = false;
            self.publish_groups(now_ns, &Never);
            self.write_row(now_ns);
        }
    }

    fn latch<P: Preempt>(&mut self, now_ns: i64, preempt: &P) {
        for inbound in &self.table.inbound {
            // SAFETY: this is the kernel of the reading source.
            unsafe {
                if P::POSSIBLE {
                    inbound.latch(now_ns, &mut || preempt.point());
                    preempt.point();
                } else {
                    inbound.latch_at_once(now_ns);
                }
            }
        }
        if self.table.queues {
            self.take_rows();
        }
    }

    fn take_rows(&mut self) {
        // SAFETY: connections and activations of this source.
        unsafe {
            self.table.inbound.iter().for_each(|inbound| inbound.release());
            for activation in &self.table.activations {
                let state = &*activation.state();
                if let (Due::Queued { members, .. }, true) = (activation.due(), state.on) {
                    members.iter().zip(&state.had).for_each(|((inbound, member), had)| inbound.hold(*member, *had));
                }
            }
            self.table.inbound.iter().filter(|inbound| inbound.queues()).for_each(|inbound| inbound.take());
        }
    }

    fn decide(&mut self, number: u64, now_ns: i64) {
        let table = &mut *self.table;
        let mut missed = false;
        for (activation, due) in table.activations.iter().zip(&mut table.due) {
            // SAFETY: activations of this source, each after those that drive it.
            unsafe {
                *due = activation.decide(number);
                missed |= (*activation.state()).missed != 0;
            }
        }
        if missed {
            self.count_missed();
        }
        if self.table.queues {
            self.take_ratios(now_ns);
        }
    }

    /// Counts the invocations that were due at skipped releases, so that the numbering advances past them.
    #[cold]
    fn count_missed(&mut self) {
        for (slot, activation) in self.table.activations.iter().enumerate() {
            // SAFETY: an activation of this source.
            let missed = unsafe { (*activation.state()).missed };
            if missed > 0 {
                self.table.steps_of(slot).filter_map(|step| self.table.header(step)).for_each(|header| {
                    // SAFETY: the block is in the table, and no step runs.
                    unsafe { (*header).number += missed };
                });
            }
        }
    }

    fn take_ratios(&mut self, now_ns: i64) {
        let Kernel { table, teller, shared, source, told, .. } = self;
        for inbound in table.inbound.iter().filter(|inbound| inbound.queues()) {
            let late = &mut |member| {
                *told = true;
                add(&source.counters.late, 1);
                teller.tell(&shared.serials, Event::Late { source: source.id, member, time_ns: now_ns }, &[], &[]);
            };
            // SAFETY: this is the kernel of the reading source.
            unsafe { inbound.take_ratios(now_ns, late) };
        }
    }

    /// Reads devices and runs the steps. Returns false if a step stopped the source.
    fn work<P: Preempt>(&mut self, now_ns: i64, started_ns: i64, preempt: &P) -> bool {
        for (_, rows) in &self.table.rows {
            // SAFETY: this is the kernel of the source that the ring belongs to.
            unsafe { rows.writer.expect() };
        }
        for &time in &self.table.times {
            // SAFETY: running times in this source of processes that the table holds.
            unsafe { (*time).tell(now_ns) };
        }
        self.devices(now_ns, |device, tape| {
            // SAFETY: this is the kernel of the device's source.
            unsafe { device.read(now_ns, tape) }
        });
        self.look(now_ns, false);
        for (edge, source) in self.table.edges.iter().zip(&self.table.edge_sources) {
            // SAFETY: this is the kernel of the edge's device.
            if let (true, Some(source)) = (unsafe { edge.rises() }, source) {
                source.request(now_ns);
                self.raised = true;
            }
        }
        if let Some(ended) = steps::contained(self, started_ns, now_ns, preempt) {
            self.stop(ended, now_ns);
            return false;
        }
        true
    }

    fn write_devices(&mut self, now_ns: i64) {
        self.devices(now_ns, |device, tape| {
            // SAFETY: this is the kernel of the device's source.
            unsafe { device.write(now_ns, tape) }
        });
    }

    fn devices(&mut self, now_ns: i64, serve: impl Fn(&Device, Option<&dyn Tape>) -> Result<(), DeviceError>) {
        for index in 0..self.table.devices.len() {
            let served = serve(&self.table.devices[index], self.source.tape.as_deref());
            // For drivers that fork without fork(): their copy must touch no other device.
            forks::end_if_child();
            if let Err(error) = served {
                self.device_lost(index, error, now_ns);
            }
        }
    }

    /// Checks the channels with requests. An emergency stop takes effect here, before anything is written.
    fn look(&mut self, now_ns: i64, is_blind: bool) {
        let mut changed = false;
        for device in &self.table.devices {
            // SAFETY: this is the kernel of the device's source.
            changed |= unsafe { device.look(is_blind || device.is_lost()) };
        }
        if changed {
            self.tell_asked(now_ns);
        }
    }

    #[cold]
    pub(crate) fn device_lost(&mut self, index: usize, error: DeviceError, time_ns: i64) {
        let device = self.table.devices[index].name().to_owned();
        self.tell(Event::DeviceLost { source: self.source.id, device, message: error.message, time_ns }, &[], &[]);
        self.table.look_for_blind();
    }

    /// Stamps the activations that were due; those that read a lost device keep the number and age of the last reading.
    fn stamp(&mut self, now_ns: i64) {
        for slot in 0..self.table.due.len() {
            if self.table.due[slot] && !self.table.is_blind_at(slot) && (!self.careful || self.table.steps_of(slot).any(|step| self.table.ran[step as usize])) {
                let activation = &self.table.activations[slot];
                // SAFETY: an activation of this source; no step runs.
                unsafe {
                    activation.stamp((*activation.state()).number, now_ns);
                    self.table.marks.stamp(slot, now_ns, self.careful.then_some(&self.table.ran[..]));
                }
            }
        }
    }

    /// Advances each activation that was due to its next number.
    fn advance(&mut self) {
        for (activation, _) in self.table.activations.iter().zip(&self.table.due).filter(|(_, due)| **due) {
            // SAFETY: an activation of this source.
            unsafe { (*activation.state()).number += 1 };
        }
    }

    /// Stamps the activations that had completed when a step stopped the source.
    #[cold]
    fn stamp_through(&mut self, now_ns: i64) {
        if self.table.chosen.contains(&true) { self.stamp_executed(now_ns) } else { self.stamp(now_ns) }
    }

    /// Stamps the activations that an `execute` ran, with the numbers of the blocks themselves.
    fn stamp_executed(&mut self, now_ns: i64) {
        for (slot, activation) in self.table.activations.iter().enumerate() {
            let ran = self.table.steps_of(slot).find(|&step| self.table.ran[step as usize] && self.table.header(step).is_some());
            let Some(header) = ran.and_then(|step| self.table.header(step)) else { continue };
            // SAFETY: the block is in the table and no step runs; an activation of this source.
            unsafe {
                let state = &mut *activation.state();
                // A reset has set both in the block; the state here may still hold values of its previous life.
                (state.number, state.activated) = ((*header).number - 1, (*header).activated);
                if !self.table.is_blind_at(slot) {
                    activation.stamp(state.number, now_ns);
                    self.table.marks.stamp(slot, now_ns, Some(&self.table.ran));
                }
                state.due = true;
                self.table.due[slot] = true;
            }
        }
    }

    /// Publishes groups, sends rows, raises sources, and writes the rows for the programming system.
    fn publish<P: Preempt>(&mut self, now_ns: i64, preempt: &P) {
        self.publish_groups(now_ns, preempt);
        for index in 0..self.table.outbound.len() {
            self.send_row(index, now_ns);
            if P::POSSIBLE {
                preempt.point();
            }
        }
        self.write_row(now_ns);
    }

    fn publish_groups<P: Preempt>(&mut self, now_ns: i64, preempt: &P) {
        for outbound in &self.table.outbound {
            // SAFETY: this is the kernel of the writing source.
            unsafe {
                if P::POSSIBLE {
                    outbound.publish(self.firing, now_ns, &mut || preempt.point());
                } else {
                    outbound.publish_at_once(self.firing, now_ns);
                }
            }
        }
    }

    fn send_row(&mut self, index: usize, now_ns: i64) {
        let table = &*self.table;
        let outbound = &table.outbound[index];
        let stored = |member: usize| !self.careful || table.writers[index][member].is_none_or(|step| table.ran[step as usize]);
        // SAFETY: this is the kernel of the writing source.
        match unsafe { outbound.push(self.firing, now_ns, &stored) } {
            Ok(true) => {
                if let Some(source) = &table.wakes[index] {
                    source.request(now_ns);
                    self.raised = true;
                }
            }
            Ok(false) => {}
            Err(member) => {
                let reader = outbound.wake.unwrap_or(SourceId(u32::MAX));
                self.tell(Event::Overrun { source: self.source.id, reader, member, time_ns: now_ns }, &[], &[]);
            }
        }
    }

    pub(crate) fn write_row(&mut self, now_ns: i64) {
        for (spans, rows) in &self.table.rows {
            // SAFETY: this is the kernel of the source that the ring belongs to.
            unsafe { rows.writer.write(self.firing, now_ns, spans) };
        }
    }

    /// Stops the source after a signal or an exceeded budget in a block: aborts the firing and brings devices to their safe state.
    /// Invocations that completed have stored values that others may read, so these are stamped with their numbers.
    #[cold]
    fn stop(&mut self, ended: EarlyEnd, time_ns: i64) {
        self.stopped = true;
        containment::look_soon();
        if ended.is_lost {
            self.lose_source(ended.step);
        }
        steps::settle_ended(self, ended.at);
        self.stamp_through(time_ns);
        self.source.counters.stopped.store(true, Ordering::Release);
        for device in &self.table.devices {
            // SAFETY: this is the kernel of the device's source.
            unsafe { device.safe_state() };
        }
        self.stored = false;
        let step = &self.table.steps[ended.step as usize];
        let (block, process) = (step.block.as_ref().map_or(BlockId(u32::MAX), |block| block.id()), self.table.processes[step.process as usize].id());
        self.tell(Event::Stopped { source: self.source.id, block, process, fault: ended.fault(), time_ns }, &[], &[]);
        // The fault is reported first: it is the cause that ends the verbs here, whatever else an input that is no longer read may stop.
        self.look(time_ns, true);
        steps::report(self, ended.step, ended.result, time_ns);
    }

    /// Abandons the source, whose thread must not call any library again. A process that was started only to run processors exits here,
    /// with its devices safe.
    #[cold]
    fn lose_source(&mut self, step: u32) {
        self.source.is_lost.store(true, Ordering::Release);
        if containment::is_retiring() {
            self.source.containment.retire(step);
            for device in &self.table.devices {
                // SAFETY: this is the kernel of the device's source.
                unsafe { device.safe_state() };
            }
            containment::end_process();
        }
    }
}
