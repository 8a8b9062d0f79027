// SPDX-License-Identifier: Apache-2.0
//! Execution of scripts between two firings.
use crate::event::Event;
use crate::memory::Cell;
use crate::phase::CountedInvocations;
use crate::process::Process;
use crate::running_time::TimeState;
use crate::schedule::{Activation, Due, Inbound, Outbound};
use crate::script::{Op, Submission};
use crate::state::{Kernel, is_so, word_of};
use crate::table::Table;
use crate::tape::Occasion;
use std::mem;
use std::sync::Arc;
use std::sync::atomic::Ordering;

impl Kernel {
    /// Carries out all pending scripts in the order of submission.
    pub fn carry_out_all(&mut self, now_ns: i64) {
        if self.source.restarting.swap(false, Ordering::AcqRel) {
            self.begin();
            self.restart();
            self.end(Occasion::Restart, now_ns);
        }
        if self.source.mailbox.is_empty() {
            return;
        }
        let submissions = self.source.mailbox.take();
        submissions.for_each(|submission| self.carry_out(submission, now_ns));
        self.wake();
    }

    /// Restarts the source after the cause of the stop has been removed.
    pub fn restart(&mut self) {
        if self.source.is_lost.load(Ordering::Acquire) {
            return;
        }
        self.stopped = false;
        self.source.counters.stopped.store(false, Ordering::Release);
    }

    /// Ends the source: brings its devices to the safe state and closes them, even if other references to them exist. Leaves them open if
    /// an heir takes over.
    pub fn close(&mut self) {
        if self.source.leaving.load(Ordering::Acquire) {
            return;
        }
        for device in &self.table.devices {
            // SAFETY: this is the kernel of the device's source, and its last call.
            unsafe {
                device.safe_state();
                device.close();
            }
        }
    }

    /// Carries out one script atomically, then publishes the values it stored, serves the conditions of its `execute`s, and acknowledges
    /// it.
    #[cfg_attr(rtsan, sanitize(realtime = "nonblocking"))]
    pub fn carry_out(&mut self, mut submission: Box<Submission>, now_ns: i64) {
        self.begin();
        let mut captured = mem::take(&mut submission.captured);
        for op in &mut submission.script.ops {
            match op {
                Op::Table(table) => {
                    self.serve(now_ns);
                    self.swap(table, now_ns);
                }
                Op::While { process, generation } => {
                    let before = word_of(&self.source, process);
                    self.serve_entered(now_ns);
                    self.serve(now_ns);
                    if word_of(&self.source, process) != before || !before.acts() || before.generation != *generation {
                        break;
                    }
                }
                // SAFETY: an activation of this source.
                Op::Follow { activation, due, had } => unsafe { activation.swap(due, had) },
                Op::Inherit(inheritance) => {
                    // SAFETY: this is the kernel of the source; its submitter has seen the others end.
                    unsafe { inheritance.carry_out(self.source.id) };
                    self.stored = true;
                }
                op => self.apply(op, now_ns, &mut captured),
            }
        }
        self.serve_entered(now_ns);
        self.serve(now_ns);
        submission.captured = captured;
        submission.firing = self.firing;
        submission.time_ns = now_ns;
        submission.serial = self.shared.serials.fetch_add(1, Ordering::AcqRel);
        // Publication precedes acknowledgement, so that a client waiting for the script sees what it stored.
        self.settle(now_ns);
        self.end(Occasion::Script(submission.recorded), now_ns);
        self.source.done.put(submission);
        self.told = true;
    }

    /// While a firing under the virtual clock is in progress, answers read-only scripts with the state before the firing. Other scripts,
    /// and read-only ones queued behind them, wait until the firing ends; all scripts wait while the source is
    /// recorded or replayed.
    pub fn answer_readings(&mut self, now_ns: i64) {
        if self.source.tape.is_some() {
            return;
        }
        let mut waits = false;
        for mut submission in self.source.mailbox.take() {
            waits |= !submission.script.ops.iter().all(|op| matches!(op, Op::Capture(_)));
            if waits {
                self.source.mailbox.put(submission);
                continue;
            }
            let mut captured = mem::take(&mut submission.captured);
            for op in &mut submission.script.ops {
                self.apply(op, now_ns, &mut captured);
            }
            submission.captured = captured;
            (submission.firing, submission.time_ns) = (self.firing, now_ns);
            submission.serial = self.shared.serials.fetch_add(1, Ordering::AcqRel);
            self.source.done.put(submission);
            self.told = true;
        }
        self.wake();
    }

    /// Makes `table` the active table, and leaves the previous one in its place.
    fn swap(&mut self, table: &mut Box<Table>, now_ns: i64) {
        mem::swap(&mut self.table, table);
        for (slot, activation) in self.table.activations.iter().enumerate() {
            // SAFETY: an activation of this source.
            unsafe { (*activation.state()).slot = slot as u32 };
        }
        // SAFETY: this is the kernel of the connections' source.
        unsafe {
            let sent = |outbound: &Arc<Outbound>| table.outbound.iter().any(|old| Arc::ptr_eq(old, outbound));
            self.table.outbound.iter().filter(|outbound| !sent(outbound)).for_each(|outbound| outbound.publish_at_once(self.firing, now_ns));
            let known = |inbound: &Arc<Inbound>| table.inbound.iter().any(|old| Arc::ptr_eq(old, inbound));
            self.table.inbound.iter().filter(|inbound| !known(inbound)).for_each(|inbound| inbound.latch_at_once(now_ns));
        }
        self.table.look_for_blind();
        self.write_row(now_ns);
        let (declared, some_without) = self.table.budget_ns;
        let default = if some_without { self.budget_ns } else { 0 };
        self.source.containment.set_budget(default.max(declared as i64));
    }

    /// Applies one operation of a script or reaction.
    pub(crate) fn apply(&mut self, op: &Op, now_ns: i64, captured: &mut Vec<u8>) {
        match op {
            Op::Table(_) | Op::Follow { .. } | Op::Inherit(_) => {
                unreachable!("`carry_out` swaps what a script brings, and a process refuses reactions that swap")
            }
            Op::Store(cell, bytes) => {
                cell.store(bytes);
                self.stored = true;
            }
            Op::Append { value, window } => {
                debug_assert!(window.takes(value));
                window.append(value);
                self.stored = true;
            }
            Op::Fill { value, window } => {
                debug_assert!(window.takes(value));
                window.fill_from(value);
                self.stored = true;
            }
            Op::Copy(from, to) => {
                // SAFETY: both cells are held by the script; this source's own image.
                unsafe { std::ptr::copy(from.start(), to.start(), from.len().min(to.len())) };
                self.stored = true;
            }
            Op::Look(device) => {
                // SAFETY: this is the kernel of the device's source.
                if unsafe { device.look(device.is_lost()) } {
                    self.tell_asked(now_ns);
                }
            }
            Op::Renew(renewal) => {
                // SAFETY: this is the kernel of the device's source.
                unsafe { renewal.carry_out() };
                self.table.look_for_blind();
            }
            Op::Reset(block) => block.reset(),
            Op::Keep(to, from) => to.keep(from),
            Op::On(activation, every) => self.switch_on(activation, (*every).max(1)),
            Op::Tune(activation, every) => self.tune(activation, *every),
            Op::Off(activation) => {
                // SAFETY: an activation of this source.
                let state = unsafe { &mut *activation.state() };
                (state.on, state.due) = (false, false);
            }
            Op::Execute(blocks) => self.execute(blocks, now_ns),
            Op::Stage { process, stage, generation } => {
                if is_so(&self.source, process.enter(*stage, *generation)) {
                    self.enter(process);
                }
            }
            Op::Advance { process, generation, from, to } => {
                if is_so(&self.source, process.advance(*generation, *from, *to)) {
                    self.enter(process);
                }
            }
            // Handled by the loop of the reaction.
            Op::While { .. } | Op::Forget => {}
            Op::StartClock(process) => self.with_time(process, |time| time.start(now_ns)),
            Op::StopClock(process) => self.with_time(process, |time| time.stop(now_ns)),
            Op::ResumeClock(process) => self.with_time(process, |time| time.resume(now_ns)),
            Op::KeepClock(to, from) => {
                if let (Some(to), Some(from)) = (to.time(self.source.id), from.time(self.source.id)) {
                    // SAFETY: both are times in this source, of two processes.
                    unsafe { (*to.state()).keep(&*from.state(), 0) };
                }
            }
            Op::Capture(cells) => cells.iter().for_each(|cell| capture(cell, captured)),
            Op::Engage { device, channels } => channels.iter().for_each(|channel| device.engage(usize::from(*channel), true)),
            Op::Safe { device, channels } => {
                // SAFETY: a device of this source.
                if let Err(error) = unsafe { device.make_safe(now_ns, channels, self.source.tape.as_deref()) } {
                    let (name, message) = (device.name().to_owned(), error.message);
                    self.tell(Event::DeviceLost { source: self.source.id, device: name, message, time_ns: now_ns }, &[], &[]);
                }
            }
        }
    }

    fn with_time(&self, process: &Process, change: impl FnOnce(&mut TimeState)) {
        if let Some(time) = process.time(self.source.id) {
            // SAFETY: the process's time in this source.
            change(unsafe { &mut *time.state() });
        }
    }

    fn tune(&mut self, activation: &Arc<Activation>, every: u32) {
        // SAFETY: an activation of this source.
        let state = unsafe { &mut *activation.state() };
        state.tuned = every;
        if state.on && every != 0 && state.every != every {
            state.every = every;
            state.next = next_multiple(self.firing, every);
        }
    }

    fn switch_on(&mut self, activation: &Arc<Activation>, every: u32) {
        let slot = self.table.slot(activation);
        // SAFETY: an activation of this source.
        let state = unsafe { &mut *activation.state() };
        let every = if state.tuned == 0 { every } else { state.tuned };
        if state.on && state.every == every {
            return;
        }
        state.on = true;
        state.every = every;
        state.next = next_multiple(self.firing, every);
        let mut headers = slot.into_iter().flat_map(|slot| self.table.steps_of(slot)).filter_map(|step| self.table.header(step)).peekable();
        if let Some(&header) = headers.peek() {
            // SAFETY: the block is in the table, and no step runs.
            state.number = unsafe { (*header).number };
        }
        state.activated = state.number;
        for header in headers {
            // SAFETY: as above.
            unsafe { (*header).activated = (*header).number };
        }
        // SAFETY: an activation of this source.
        if let Due::Queued { members, .. } = unsafe { activation.due() } {
            for (index, (inbound, _)) in members.iter().enumerate() {
                if !members[..index].iter().any(|(before, _)| Arc::ptr_eq(before, inbound)) {
                    // SAFETY: a connection to this source.
                    unsafe { inbound.skip(&|member| members.iter().any(|(of, read)| *read == member && Arc::ptr_eq(of, inbound))) };
                }
            }
            for ((inbound, member), had) in members.iter().zip(state.had.iter_mut()) {
                // SAFETY: a connection to this source.
                *had = unsafe { inbound.sequence(*member) };
            }
        }
    }
}

/// Returns the first multiple of `every` after firing `firing`; skips the division if `every` is 1.
fn next_multiple(firing: u64, every: u32) -> u64 {
    if every == 1 { firing + 1 } else { (firing / u64::from(every) + 1) * u64::from(every) }
}

/// Captures a value. The space was reserved when the script was submitted or, for a reaction, when the stages of its process were set.
fn capture(cell: &Cell, captured: &mut Vec<u8>) {
    debug_assert!(captured.len() + cell.len() <= captured.capacity());
    let at = captured.len();
    captured.resize(at + cell.len(), 0);
    // SAFETY: the cell is held by the script; `captured` has room.
    unsafe { captured.as_mut_ptr().add(at).copy_from_nonoverlapping(cell.start(), cell.len()) };
}
