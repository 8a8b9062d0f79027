// SPDX-License-Identifier: Apache-2.0
//! Activations, which determine when sets of steps are due.
use crate::memory::Cell;
use crate::phase::{CountedInvocations, STAMP_LEN, State, stores};
use crate::{connection, inbound};
use std::cell::UnsafeCell;
use std::sync::{Arc, Mutex};

/// The reading end of a connection between sources.
pub type Inbound = inbound::Inbound<Activation>;
/// The writing end of a connection between sources.
pub type Outbound = connection::Outbound<Activation>;
/// A member of a connection's queue.
pub type QueueMember = connection::QueueMember<Activation>;

/// Rule that determines when the steps of an active activation are due.
#[derive(Clone)]
pub enum Due {
    /// Due at the firings of its source whose number is a multiple of `every` (set by `Op::On`). On a timer, this is an execution
    /// interval (firing k is released at epoch + k · period); on a trigger, `every` is 1.
    Interval,
    /// Due in the same firing as all of `by`, on every n-th of their invocations since they were activated (n > 1 only if driven by a
    /// ratio output). Used for blocks with synchronous inputs whose writers run in the same source.
    Driven { by: Vec<(Arc<Activation>, u32)> },
    /// Due when every one of these inbound queue members (connection, member) has a value that this activation has not taken yet, and all
    /// of `by` are due as in `Driven`.
    Queued { members: Vec<(Arc<Inbound>, usize)>, by: Vec<(Arc<Activation>, u32)> },
}

impl Due {
    /// Returns the activations that drive this one.
    pub(crate) fn drivers(&self) -> &[(Arc<Activation>, u32)] {
        match self {
            Due::Interval => &[],
            Due::Driven { by } | Due::Queued { by, .. } => by,
        }
    }

    /// Returns storage for the sequence number of the last value taken from each member.
    pub(crate) fn had(&self) -> Box<[u64]> {
        let members = if let Due::Queued { members, .. } = self { members.len() } else { 0 };
        vec![0; members].into()
    }
}

/// Schedule of steps that are always active together at one rate. Shared by successive tables, so that a new table does not disturb
/// running steps; changed only by the kernel of its source, between two firings.
pub struct Activation {
    /// Rule in force, for the kernel of its source.
    due: UnsafeCell<Due>,
    /// The same rule as seen by the table builder, including a pending `follow`.
    planned: Mutex<Due>,
    stamp: Option<Cell>,
    budget_ns: Option<u64>,
    state: UnsafeCell<State>,
}

// SAFETY: `state` and `due` are touched only by the kernel of the activation's source: its thread, or the one thread of the virtual clock.
unsafe impl Send for Activation {}
// SAFETY: as for `Send`.
unsafe impl Sync for Activation {}

impl CountedInvocations for Activation {
    #[inline]
    fn state(&self) -> *mut State {
        self.state.get()
    }
}

impl Activation {
    /// Creates an activation that is off. `stamp`: [`STAMP_LEN`] bytes of the image that contain, after each due firing, the number of
    /// the last invocation (u64), its release time (i64) and the number at activation (u64); SVVs written by its blocks carry this stamp.
    pub fn new(due: Due, stamp: Option<Cell>) -> Arc<Activation> {
        Self::with_budget(due, stamp, None)
    }

    /// Creates an activation with a declared time budget for a firing of its steps, in ns of real time: the containment aborts a firing
    /// that takes longer. The default is ten periods of the source, but at least 100 ms (1 s under the virtual clock).
    pub fn with_budget(due: Due, stamp: Option<Cell>, budget_ns: Option<u64>) -> Arc<Activation> {
        if let Some(stamp) = &stamp {
            assert!(stamp.len() >= STAMP_LEN, "a stamp has {STAMP_LEN} bytes: a number, a time, and the number at activation");
        }
        let state = State { had: due.had(), every: 1, ..State::default() };
        Arc::new(Activation { due: UnsafeCell::new(due.clone()), planned: Mutex::new(due), stamp, budget_ns, state: UnsafeCell::new(state) })
    }

    /// Sets `due` as the rule seen by the table builder.
    pub(crate) fn plan(&self, due: &Due) {
        *self.planned.lock().expect("nobody panics with the lock held") = due.clone();
    }

    /// Swaps the rule in force with `due`, and the sequence numbers of the values last taken from its members with `had`.
    ///
    /// # Safety
    /// Must be called only by the kernel of the activation's source.
    pub(crate) unsafe fn swap(&self, due: &mut Due, had: &mut Box<[u64]>) {
        // SAFETY: the caller is the one that touches both.
        unsafe {
            std::ptr::swap(self.due.get(), due);
            std::mem::swap(&mut (*self.state.get()).had, had);
        }
    }

    /// Returns the rule in force.
    ///
    /// # Safety
    /// Must be called only by the kernel of the activation's source.
    pub(crate) unsafe fn due(&self) -> &Due {
        // SAFETY: the caller is the one that changes it.
        unsafe { &*self.due.get() }
    }

    pub fn budget_ns(&self) -> Option<u64> {
        self.budget_ns
    }

    /// Returns the rule by which the activation is due, as seen by the table builder.
    pub fn planned(&self) -> Due {
        self.planned.lock().expect("nobody panics with the lock held").clone()
    }

    pub fn stamp_cell(&self) -> Option<&Cell> {
        self.stamp.as_ref()
    }

    /// Returns the activations that drive this one, for the table builder.
    pub(crate) fn planned_drivers(&self) -> Vec<(Arc<Activation>, u32)> {
        self.planned.lock().expect("nobody panics with the lock held").drivers().to_vec()
    }

    /// Decides whether the activation is due in firing `firing`. Called after its drivers have been decided and its queued values have
    /// been taken.
    ///
    /// # Safety
    /// Must be called only by the kernel of the activation's source.
    #[inline]
    pub(crate) unsafe fn decide(&self, firing: u64) -> bool {
        // SAFETY: the caller is the one that touches it.
        let state = unsafe { &mut *self.state.get() };
        state.missed = 0;
        state.due = state.on
            // SAFETY: as for this one.
            && match unsafe { self.due() } {
                Due::Interval => firing >= state.next && interval_due(state, firing),
                // SAFETY: as for this one.
                Due::Driven { by } => unsafe { all_due(state, by) },
                Due::Queued { members, by } => {
                    // SAFETY: as for this one.
                    let due = members.iter().zip(&state.had).all(|((inbound, member), had)| unsafe { inbound.sequence(*member) } != *had)
                        && unsafe { all_due(state, by) };
                    if due {
                        for ((inbound, member), had) in members.iter().zip(state.had.iter_mut()) {
                            // SAFETY: as for this one.
                            *had = unsafe { inbound.sequence(*member) };
                        }
                    }
                    due
                }
            };
        state.due
    }

    /// Writes the stamp.
    pub(crate) fn stamp(&self, number: u64, now_ns: i64) {
        if let Some(stamp) = &self.stamp {
            // SAFETY: the stamp has its length (checked when it was made), and the state is this kernel's.
            unsafe {
                stamp.start().cast::<u64>().write_unaligned(number);
                stamp.start().add(8).cast::<i64>().write_unaligned(now_ns);
                stamp.start().add(16).cast::<u64>().write_unaligned((*self.state.get()).activated);
            }
        }
    }
}

/// Returns true if firing `firing` is at or after the next due one.
#[inline]
fn interval_due(state: &mut State, firing: u64) -> bool {
    if firing == state.next {
        state.next += u64::from(state.every);
        return true;
    }
    skipped(state, firing)
}

#[cold]
fn skipped(state: &mut State, firing: u64) -> bool {
    let every = u64::from(state.every);
    let past = firing - state.next;
    let due = past.is_multiple_of(every);
    state.missed = past / every + u64::from(!due);
    state.number += state.missed;
    state.next = firing - past % every + every;
    due
}

/// Returns true if all of `by` are due.
///
/// # Safety
/// Must be called by the kernel of the source of all of `by`.
#[inline]
unsafe fn all_due(state: &mut State, by: &[(Arc<Activation>, u32)]) -> bool {
    let mut due = true;
    for (index, (driver, n)) in by.iter().enumerate() {
        // SAFETY: as for the caller.
        let driver = unsafe { &*driver.state() };
        due &= driver.due && stores(driver.number - driver.activated, *n);
        if index == 0 && driver.missed > 0 {
            missed_with(state, driver, *n);
        }
    }
    due
}

/// Counts the releases that the driving activation missed as missed by the driven one too.
#[cold]
fn missed_with(state: &mut State, driver: &State, n: u32) {
    let phase = driver.number.saturating_sub(driver.activated);
    state.missed = (phase.saturating_sub(driver.missed)..phase).filter(|&missed| stores(missed, n)).count() as u64;
    state.number += state.missed;
}
