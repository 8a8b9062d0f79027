// SPDX-License-Identifier: Apache-2.0
//! The step loop: a hot loop, and a careful one to which a firing switches when a step has faulted.
#![allow(clippy::needless_borrow, reason = "behind a raw pointer the compiler asks for the borrow to be seen")]
use crate::bank::{Entry, Stretch};
use crate::containment::{OUTSIDE, Over, budget_signal};
use crate::counters::add;
use crate::event::Fault;
use crate::floats;
use crate::phase::{CountedInvocations, stores};
use crate::preempt::Preempt;
use crate::schedule::Activation;
use crate::state::Kernel;
use crate::table::{Report, Table};
use opengpac::abi::{RUNNING, mark, outcome};
use opengpac::floats::Words;
use std::ffi::c_void;
use std::sync::atomic::Ordering;

/// Early end of a contained loop.
pub(crate) struct EarlyEnd {
    /// Faulting step.
    pub(crate) step: u32,
    /// Step that was aborted and stored nothing; `None` if all steps ran.
    pub(crate) at: Option<u32>,
    pub(crate) result: u64,
    /// True if the thread must not call a library again.
    pub is_lost: bool,
}

impl EarlyEnd {
    pub(crate) fn fault(&self) -> Fault {
        fault(self.result).expect("a signal is a fault")
    }
}

/// Result of a step that was aborted by a signal: an outcome that no entry returns, with the signal number in the bits above it (0 for an
/// exceeded budget).
pub(crate) const SIGNAL: u64 = outcome::SIGNAL;

/// Result if the floating-point control words had changed after the steps.
pub(crate) const FLOATS: u64 = SIGNAL | NO_SIGNAL << outcome::SHIFT;
const NO_SIGNAL: u64 = 0xffff;

/// Result if a block has called fork().
const FORKED: u64 = SIGNAL | CALLED_FORK << outcome::SHIFT;
const CALLED_FORK: u64 = 0xfffe;

/// Returns the result that describes the end of a loop.
pub fn ended_by(over: &Over) -> u64 {
    if over.has_forked() {
        return FORKED;
    }
    let signal = if over.signal == budget_signal() { 0 } else { over.signal as u64 };
    SIGNAL | (signal | if over.is_lost { outcome::LOST } else { 0 }) << outcome::SHIFT
}

/// Returns the fault that `result` represents, if it represents one.
pub(crate) fn fault(result: u64) -> Option<Fault> {
    let detail = result >> outcome::SHIFT;
    match result & outcome::MASK {
        outcome::DONE => None,
        outcome::PANIC => Some(Fault::Panic),
        outcome::NONFINITE => Some(Fault::NonFinite(detail as u8)),
        outcome::THREW => Some(Fault::Threw),
        outcome::FLOATS => Some(Fault::Floats),
        SIGNAL if detail == NO_SIGNAL => Some(Fault::Floats),
        SIGNAL if detail == CALLED_FORK => Some(Fault::Forked),
        SIGNAL if detail & outcome::LOST != 0 => Some(Fault::Lost((detail & !outcome::LOST) as i32)),
        SIGNAL if detail == 0 => Some(Fault::Budget),
        SIGNAL => Some(Fault::Signal(detail as i32)),
        _ => Some(Fault::Returned(detail as u32)),
    }
}

struct Frame<'a, P> {
    kernel: *mut Kernel,
    now_ns: i64,
    /// True if the probe measures the duration of blocks.
    probes: bool,
    preempt: &'a P,
}

/// Runs the steps that are due. The budget starts at `started_ns` of CLOCK_MONOTONIC.
#[inline]
pub(crate) fn contained<P: Preempt>(kernel: &mut Kernel, started_ns: i64, now_ns: i64, preempt: &P) -> Option<EarlyEnd> {
    let containment = &raw const kernel.source.containment;
    let probes = started_ns < kernel.source.probe_until_ns.load(Ordering::Relaxed);
    let mut frame = Frame { kernel, now_ns, probes, preempt };
    // SAFETY: the containment lives as long as the kernel's source; the body keeps nothing that must be dropped.
    let ended = unsafe { (*containment).run(body::<P>, (&raw mut frame).cast::<c_void>(), started_ns) };
    forks::end_if_child();
    let changed = changed(&kernel.table);
    ended.map(|over| EarlyEnd { step: over.step, at: over.at, result: ended_by(&over), is_lost: over.is_lost }).or(changed)
}

/// Called after the steps of a firing: returns the step to blame if the control words have changed.
#[inline]
fn changed(table: &Table) -> Option<EarlyEnd> {
    if Words::standardise() { answerable(table) } else { None }
}

/// Returns the last of the due blocks, preferring blocks of loaded modules over those built into this program.
#[cold]
fn answerable(table: &Table) -> Option<EarlyEnd> {
    floats::DISTRUST.store(true, Ordering::Relaxed);
    let blocks = table.steps.iter().enumerate().filter(|(_, step)| table.due[step.slot as usize]);
    let blocks = blocks.filter_map(|(index, step)| Some((step.block.as_ref()?.descriptor().reserved & mark::LOADED != 0, index)));
    blocks.max().map(|(_, index)| EarlyEnd { step: index as u32, at: None, result: FLOATS, is_lost: false })
}

/// Body of the contained loop. Accesses everything through raw pointers: a signal may abort the loop inside any call of a block, and all
/// reports up to that point must be in memory.
unsafe extern "C" fn body<P: Preempt>(frame: *mut c_void) {
    // SAFETY: `contained` passes its own frame.
    unsafe {
        let frame = frame.cast::<Frame<P>>();
        let (kernel, now_ns, probes, preempt) = ((*frame).kernel, (*frame).now_ns, (*frame).probes, (*frame).preempt);
        (&(*kernel).source).containment.set_calls((&(*kernel).table).calls.as_ptr());
        if (*kernel).careful {
            careful(kernel, 0, now_ns, probes, preempt);
        } else if probes {
            let visited = (*kernel).table.visit();
            hot::<P, true>(kernel, now_ns, visited, preempt);
        } else {
            hot::<P, false>(kernel, now_ns, OUTSIDE, preempt);
        }
        (&(*kernel).source).containment.step().write_volatile(OUTSIDE);
    }
}

/// Runs the hot loop. With `PROBED`, measures the duration of step `visited`; without it, the loop contains no probe code.
///
/// # Safety
/// `kernel` must be that of the calling thread, and its table must have been placed; no other thread may access either.
unsafe fn hot<P: Preempt, const PROBED: bool>(kernel: *mut Kernel, now_ns: i64, visited: u32, preempt: &P) {
    // SAFETY: the lengths are those of the table's own vectors, which do not change during a firing.
    unsafe {
        let table = &raw mut *(*kernel).table;
        let step = (&(*kernel).source).containment.step();
        let (calls, due) = ((&(*table).calls).as_ptr(), (&(*table).due).as_ptr());
        let (stretches, count) = ((&(*table).stretches).as_ptr(), (&(*table).stretches).len());
        for stretch in 0..count {
            let stretch = *stretches.add(stretch);
            if !*due.add(stretch.slot as usize) {
                continue;
            }
            if !P::POSSIBLE && !matches!(stretch.entry, Entry::Single) {
                if let Some(faulted) = together::<PROBED>(kernel, stretch, now_ns, visited) {
                    return careful(kernel, faulted + 1, now_ns, false, preempt);
                }
                continue;
            }
            loop_in_one_line();
            for index in stretch.start..stretch.end {
                step.write_volatile(index);
                let result = if PROBED && index == visited {
                    Table::run_timed(table, index)
                } else {
                    let call = &*calls.add(index as usize);
                    (call.run)(call.instance, call.invocation)
                };
                if result != 0 {
                    step.write_volatile(OUTSIDE);
                    if report(kernel, index, result, now_ns) {
                        begin_careful(kernel, index);
                        return careful(kernel, index + 1, now_ns, false, preempt);
                    }
                }
                if P::POSSIBLE {
                    step.write_volatile(OUTSIDE);
                    preempt.point();
                }
            }
        }
    }
}

/// Aligns the following loop, about 35 bytes long, to an instruction cache line. An independent gain in C then takes 2.57 ns, compared
/// with 2.85 ns in a build whose loop crossed into the next line by one byte (decision 210).
#[inline(always)]
fn loop_in_one_line() {
    // SAFETY: pads with instructions that do nothing.
    unsafe { std::arch::asm!(".p2align 6", options(nomem, nostack, preserves_flags)) };
}

/// Runs a bank or fused blocks in the hot loop. The step visited by the probe is run on its own. Fused blocks are run one by one if one
/// of them is visited, or after one of them has reported. Returns the step that faulted, after beginning the careful mode. A separate
/// function because inlining it would take a register from the loop over single steps.
///
/// # Safety
/// Same as for `hot`; the entry must be that of these steps.
#[inline(never)]
unsafe fn together<const PROBED: bool>(kernel: *mut Kernel, stretch: Stretch, now_ns: i64, visited: u32) -> Option<u32> {
    // SAFETY: as for `hot`.
    unsafe {
        let table = &raw mut *(*kernel).table;
        let step = (&(*kernel).source).containment.step();
        let calls = (&(*table).calls).as_ptr();
        let Stretch { start: mut index, end, entry, .. } = stretch;
        while index < end {
            let is_visited = PROBED && (index..end).contains(&visited);
            let result = match entry {
                Entry::Bank(entry) if !(PROBED && index == visited) => entry(calls, step, index, if is_visited { visited } else { end }),
                Entry::Fused(entry) if !is_visited && index == stretch.start => entry(calls, step, index, end),
                _ => {
                    step.write_volatile(index);
                    if PROBED && index == visited {
                        Table::run_timed(table, index)
                    } else {
                        let call = &*calls.add(index as usize);
                        (call.run)(call.instance, call.invocation)
                    }
                }
            };
            let ran = step.read_volatile();
            index = ran + 1;
            if result != 0 {
                step.write_volatile(OUTSIDE);
                if report(kernel, ran, result, now_ns) {
                    begin_careful(kernel, ran);
                    return Some(ran);
                }
            }
        }
        None
    }
}

/// Records the result of a step until the end of the firing; returns true if it is a fault.
#[cold]
pub(crate) fn report(kernel: *mut Kernel, step: u32, result: u64, now_ns: i64) -> bool {
    // SAFETY: called by the kernel's own thread with its own kernel.
    let kernel = unsafe { &mut *kernel };
    let reports = &mut kernel.table.reports;
    if reports.len() < reports.capacity() {
        reports.push(Report { step, result, now_ns });
    } else {
        kernel.lose();
    }
    let fault = result & outcome::MASK != outcome::DONE;
    if !fault && let Some(block) = &kernel.table.steps[step as usize].block {
        block.note(result >> outcome::SHIFT);
    }
    if fault {
        add(&kernel.source.counters.faults, 1);
    }
    fault
}

/// Begins the careful mode: step `faulted` was the first to fault, and the steps before it ran if they were due.
#[cold]
fn begin_careful(kernel: *mut Kernel, faulted: u32) {
    // SAFETY: as for `report`.
    let kernel = unsafe { &mut *kernel };
    kernel.careful = true;
    let table = &mut *kernel.table;
    for (ran, step) in table.ran.iter_mut().zip(&table.steps).take(faulted as usize) {
        *ran = table.due[step.slot as usize];
    }
    table.ran[faulted as usize] = false;
}

/// Settles a loop that a signal aborted in step `at`, or that ran to completion: `Table::ran` then contains, for every step, true if it
/// stored its results.
#[cold]
pub(crate) fn settle_ended(kernel: &mut Kernel, at: Option<u32>) {
    let end = at.unwrap_or(kernel.table.steps.len() as u32);
    if !kernel.careful {
        kernel.careful = true;
        let table = &mut *kernel.table;
        table.ran.iter_mut().zip(&table.steps).for_each(|(ran, step)| *ran = table.due[step.slot as usize]);
    }
    kernel.table.ran[end as usize..].fill(false);
    if let Some(header) = at.and_then(|at| kernel.table.header(at)) {
        // SAFETY: the block is in the table, and no step runs.
        unsafe { (*header).number &= !RUNNING };
    }
}

/// Runs the rest of a firing in which a step has faulted, or a firing of `execute`; checks the drivers of each step. `probes`: measures
/// the durations of executed blocks, which the probe does not visit in any firing.
///
/// # Safety
/// Same as for `hot`.
#[cold]
unsafe fn careful<P: Preempt>(kernel: *mut Kernel, from: u32, now_ns: i64, probes: bool, preempt: &P) {
    // SAFETY: as for `hot`.
    unsafe {
        let table = &raw mut *(*kernel).table;
        let step = (&(*kernel).source).containment.step();
        // Only an `execute` firing is careful from its first step.
        let execute = from == 0;
        for index in from..(&(*table).steps).len() as u32 {
            let place = index as usize;
            let cold = &(&(*table).steps)[place];
            let scheduled = (&(*table).due)[cold.slot as usize];
            let driven = cold.drivers.iter().all(|&driver| (&(*table).ran)[driver as usize]);
            let chosen = (&(*table).chosen)[place];
            let executed = || execute && !cold.drivers.is_empty() && drives(&(&(*table).activations)[cold.slot as usize]);
            let copies = || execute && cold.block.is_none() && (*table).steps_of(cold.slot as usize).any(|other| (&(*table).chosen)[other as usize]);
            if !(chosen || driven && (scheduled || executed() || copies())) {
                (&mut (*table).ran)[place] = false;
                if let (true, Some(header)) = (scheduled, (*table).header(index)) {
                    // Its release is consumed, so that its numbers stay in step with the others.
                    (*header).number += 1;
                }
                continue;
            }
            step.write_volatile(index);
            let result = if probes && chosen {
                Table::run_timed(table, index)
            } else {
                let call = (&(*table).calls)[place];
                (call.run)(call.instance, call.invocation)
            };
            step.write_volatile(OUTSIDE);
            (&mut (*table).ran)[place] = result & outcome::MASK == outcome::DONE;
            if result != 0 {
                report(kernel, index, result, now_ns);
            }
            if P::POSSIBLE {
                preempt.point();
            }
        }
    }
}

/// Returns true if, in an `execute` firing, the blocks that ran drive the activation on this invocation.
fn drives(activation: &Activation) -> bool {
    // SAFETY: activations of this source.
    unsafe {
        (*activation.state()).on
            && activation.due().drivers().iter().all(|(driver, n)| {
                let state = &*driver.state();
                stores(state.number - state.activated.min(state.number), *n)
            })
    }
}
