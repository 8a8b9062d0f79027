// SPDX-License-Identifier: Apache-2.0
//! Banks: steps of one kind side by side, run by one entry, so that the compiler sees the body in the loop around it.
//!
//! A bank entry does for each of its steps exactly what the entry of the block does, in their order. It stands beside the ABI: a module without one
//! has its blocks run one by one.

use crate::abi::{Invocation, Run};
use core::ffi::c_void;
use std::collections::HashMap;
use std::sync::RwLock;

/// One call of the step loop: 24 bytes, read by the kernel's `containment.c` too. The first word of each instance says whether it may be ended:
/// `abi::RUNNING`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Call {
    pub run: Run,
    pub instance: *mut c_void,
    pub invocation: *const Invocation,
}

/// The bank entry of a block: runs the calls `from..to`, writes to `step` the index of each before it begins, and returns at the first result that
/// is not 0, with `step` at the call that gave it. 0: all ran, and `step` is at the last.
///
/// # Safety
/// `calls` has `to` calls; each of `from..to` is of this block, in order as [`Run`] asks. `from` is less than `to`.
pub type Bank = unsafe extern "C" fn(calls: *const Call, step: *mut u32, from: u32, to: u32) -> u64;

/// Name of the function by which a code module may give bank entries, [`of`] of the module's own; the number is the version of [`Call`] and [`Bank`].
pub const BANK_SYMBOL: &str = "opengpac_bank_1";

static BANKS: RwLock<Option<HashMap<usize, Bank>>> = RwLock::new(None);

/// Gives the blocks whose entry is `run` this bank entry; a table that was built before goes on without it. Not for the real-time path.
pub fn add(run: Run, bank: Bank) {
    BANKS.write().expect("nobody panics with the lock held").get_or_insert_default().insert(run as usize, bank);
}

/// Returns the bank entry of the blocks whose entry is `run`, if they have one. Not for the real-time path.
pub fn of(run: Run) -> Option<Bank> {
    BANKS.read().expect("nobody panics with the lock held").as_ref()?.get(&(run as usize)).copied()
}

/// Runs a bank as its entry has to; `once` is what `run` of the block does. For generated code.
///
/// # Safety
/// As [`Bank`] says.
#[doc(hidden)]
#[inline(always)]
pub unsafe fn run(calls: *const Call, step: *mut u32, from: u32, to: u32, once: impl Fn(*mut c_void, *const Invocation) -> u64) -> u64 {
    use core::sync::atomic::{Ordering, compiler_fence};
    for index in from..to {
        // What the step before has stored is in memory, and nothing of this one has begun: a signal may end it from here on.
        compiler_fence(Ordering::SeqCst);
        // SAFETY: the caller's promise.
        let result = unsafe {
            step.write_volatile(index);
            compiler_fence(Ordering::SeqCst);
            let call = &*calls.add(index as usize);
            once(call.instance, call.invocation)
        };
        if result != 0 {
            return result;
        }
    }
    0
}
